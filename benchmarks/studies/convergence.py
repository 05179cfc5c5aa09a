"""The study of convergence: errors over decreasing step sizes, and the observed order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene

from ..measures import errors
from ..measures.convergence_order import Order, observed_order
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from . import step_ladder
from .case import Case, Failure, Success, attempt, drop_step, fail_unsupported
from .selection import Missing
from .study import Progress, Study
from .time_limit import attempt_within

ORDERS = {
    Measure.ATTITUDE_MAX: (Measure.ORDER, Measure.ORDER_STDERR),
    Measure.RATES_MAX: (Measure.ORDER_RATES, Measure.ORDER_RATES_STDERR),
}
"""The measure to which an order is fitted, and the measures of the order and of its standard error."""
ERRORS = (Measure.ATTITUDE_MAX, Measure.ATTITUDE_FINAL, Measure.RATES_MAX)
"""Measures at every step size."""
FEWEST_POINTS = 4
"""Smallest number of points, as far as `LINE_LIMIT` allows."""
LINE_LIMIT = 8
"""Time for all points of a slow method, in units of the time budget of a run."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield errors over decreasing step sizes, and the observed order, of every method with a step size."""
    tell = study.count(progress, len(study.competitors))
    for scene in study.scenes:
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            case = Case(study.name, scene, method, step_ladder.samples(scene, method))
            failed = no_order(case, study.skip_missing)
            if failed:
                measures = blanks(*(order for order, _ in ORDERS.values()))
                yield from map(drop_step, case.blanks(measures, failed.outcome))
            else:
                yield from converge(study, scene, method)


def no_order(case: Case, skip_missing: bool) -> Failure | None:
    """Return the failure of a method that has no order on a scene, otherwise None."""
    if isinstance(case.method, Missing):
        missing = attempt(case, skip_missing)
        return missing if isinstance(missing, Failure) else None
    reason = case.method.unsupported(case.scene) or ("its accuracy does not depend on dt" if case.method.order is None else "")
    return fail_unsupported(reason) if reason else None


def converge(study: Study, scene: Scene, method: Method) -> Iterator[Measurement]:
    """Yield the errors of one method at all step sizes, then the observed orders."""
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    errors_by_step: dict[Measure, dict[float, float]] = {measure: {} for measure in ERRORS}
    cases = [Case(study.name, scene, method, grid) for grid in step_ladder.steps(scene, method)]
    for case, outcome in attempt_each(study, cases):
        if isinstance(outcome, Failure):
            yield from case.blanks(blanks(*ERRORS), outcome.outcome)
            continue
        for value in errors.measure_errors(outcome.trajectory, truth):
            if value.measure in errors_by_step:
                errors_by_step[value.measure][case.grid.dt] = value.value
                yield case.row(value)
    for measure, names in ORDERS.items():
        order = observed_order(list(errors_by_step[measure]), list(errors_by_step[measure].values()))
        yield from order_rows(cases[0], names, order, order.reason)


def order_rows(case: Case, names: tuple[Measure, Measure], order: Order, reason: str) -> list[Measurement]:
    """Return the rows of an observed order and its standard error, or of the reason why there is none."""
    outcome = Outcome(OutcomeKind.NO_ORDER, reason) if reason else OK
    values = map(Value, names, (order.slope, order.stderr))
    return [drop_step(case.row(value, outcome, "" if reason else str(order))) for value in values]


def attempt_each(study: Study, cases: Iterable[Case]) -> Iterator[tuple[Case, Success | Failure]]:
    """Yield the outcome of each case, coarse to fine. Cases beyond the time budget are skipped.

    A slow method gets fewer points: the coarsest `FEWEST_POINTS` if their total time allows it, and finer ones within the time
    budget of a run. After a run that was stopped, no finer one is made.
    """
    times: list[float] = []
    per_step = 0.0
    for case in cases:
        expected = per_step * case.grid.n_steps
        if not fits(study, times, expected):
            longest = f"would take about {expected:.2g} s, more than {study.longest_run:g} s"
            reason = longest if expected < math.inf else "a coarser run was ended"
            yield case, Failure(Outcome(OutcomeKind.SKIPPED, reason))
            continue
        outcome = attempt_within(study.hang_limit, case, study.skip_missing)
        yield case, outcome
        if isinstance(outcome, Success):
            times.append(cost_of_run(study, case, outcome, first=not times))
            per_step = times[-1] / case.grid.n_steps
        elif outcome.outcome.kind is OutcomeKind.TIMEOUT:
            per_step = math.inf


def fits(study: Study, times: list[float], expected: float) -> bool:
    """Whether a run with an expected time, s, is within the budget after runs that took `times`, s."""
    needed = len(times) < FEWEST_POINTS and sum(times) + expected <= LINE_LIMIT * study.longest_run
    return needed or expected <= study.longest_run


def cost_of_run(study: Study, case: Case, done: Success, first: bool) -> float:
    """Return the wall time, s, of a run: of a second call if the first may have included compilation."""
    if not first or done.cost.first_call < study.longest_run / 4:
        return done.cost.first_call
    again = attempt_within(study.hang_limit, case, study.skip_missing)
    return min(each.cost.first_call for each in (done, again) if isinstance(each, Success))
