"""Errors over decreasing step sizes, and the observed order."""

from __future__ import annotations

from collections.abc import Iterator

from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene

from ..measures.convergence_order import Order, observed_order
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from . import step_ladder
from .case import Case, drop_step, outcome_of_error
from .declaration import Declaration
from .line import LinePoint, measure_line
from .selection import Missing
from .study import Progress, Study

ORDERS = {
    Measure.ATTITUDE_MAX: (Measure.ORDER, Measure.ORDER_STDERR),
    Measure.RATES_MAX: (Measure.ORDER_RATES, Measure.ORDER_RATES_STDERR),
}
"""Error measures to which orders are fitted, with the measures of the order and of its standard error."""
ERRORS = (Measure.ATTITUDE_MAX, Measure.ATTITUDE_FINAL, Measure.RATES_MAX)
"""Measures at every step size."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield errors over decreasing step sizes, and the observed order, of every method with a step size."""
    tell = study.count(progress, len(study.competitors))
    for scene in study.scenes:
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            case = Case(study.name, scene, method, step_ladder.samples(scene, method))
            if failed := find_no_order(study, case):
                yield from map(drop_step, case.rows(blanks(*(order for order, _ in ORDERS.values())), failed))
            else:
                yield from converge(study, scene, method)


def find_no_order(study: Study, case: Case) -> Outcome | None:
    """Return the outcome of a method that has no order on a scene, otherwise None."""
    if isinstance(case.method, Missing):
        return outcome_of_error(case.method, case.method.error, study.skip_missing)
    reason = case.method.unsupported(case.scene) or ("its accuracy does not depend on dt" if case.method.order is None else "")
    return Outcome(OutcomeKind.UNSUPPORTED, reason) if reason else None


def converge(study: Study, scene: Scene, method: Method) -> Iterator[Measurement]:
    """Yield the errors of one method at all step sizes, then the observed orders."""
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    cases = [Case(study.name, scene, method, grid) for grid in step_ladder.steps(scene, method)]
    points: list[LinePoint] = []
    for point in measure_line(study, cases, truth, ERRORS):
        points.append(point)
        yield from point.rows()
    for measure, names in ORDERS.items():
        order = observed_order([point.case.grid.dt for point in points], [point.errors[measure] for point in points])
        yield from order_rows(cases[0], names, order, order.reason)


def order_rows(case: Case, names: tuple[Measure, Measure], order: Order, reason: str) -> list[Measurement]:
    """Return the rows of an observed order and its standard error. `reason` explains a missing order; "" if there is one."""
    outcome = Outcome(OutcomeKind.NO_ORDER, reason) if reason else OK
    rows = case.rows(map(Value, names, (order.slope, order.stderr)), outcome, "" if reason else str(order))
    return list(map(drop_step, rows))


STUDY = Declaration(findings, named=True)
