"""The studies of accuracy: drifts and errors at the paper's steps, and convergence over a ladder of steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from conservative.benchmarks.studies.case import OK
from conservative.method import Method, Role, grid_for
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..measures import errors
from ..measures.convergence_order import observed_order
from ..measures.measurement import Measurement
from ..measures.timing import elapsed
from . import step_ladder
from .case import NO_ORDER, SKIPPED, UNSUPPORTED, Case, Done, Failed, at_no_step, attempt
from .selection import Missing

if TYPE_CHECKING:
    from conservative.references.truth import Truth

    from .studies import Progress, Study

PAPER_FRACTIONS = (1.0, 0.5, 0.25)
"""Steps of the paper's figures, relative to the scene's own."""
CONVERGENCE = (("attitude error max", "observed order"), ("rate error max", "observed order rates"))
"""What an order is fitted to, and what the order is then called."""


def paper(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield drifts, errors and work of every method at the paper's steps; every step is a sample."""
    total = len(study.scenes) * len(study.methods)
    for i, scene in enumerate(study.scenes):
        grids = [grid_for(scene, scene.dt * fraction) for fraction in PAPER_FRACTIONS]
        progress(i * len(study.methods), total, f"{scene.name}: truth")
        truths = [study.truth(scene, grid) for grid in grids]
        yield from (truth_row(study, scene, grid.dt, truth) for grid, truth in zip(grids, truths, strict=True))
        for j, method in enumerate(study.methods):
            progress(i * len(study.methods) + j, total, f"{scene.name}: {method.name}")
            for grid, truth in zip(grids, truths, strict=True):
                case = Case(study.name, scene, method, grid)
                yield from measured(case, attempt(case, study.skip_missing), truth.trajectory)
                if method.order is None:
                    break  # accuracy does not depend on dt, nor does what the samples show


def truth_row(study: Study, scene: Scene, dt: float, truth: Truth) -> Measurement:
    """Return how well the two truths agree."""
    names = " and ".join(truth.names)
    return Measurement(
        study.name, scene.name, "truth", names, "truth", dt, "truth agreement", truth.agreement_rad, "rad", "ok", names
    )


def measured(case: Case, outcome: Done | Failed, truth: Trajectory) -> list[Measurement]:
    """Return a row for every measure, and for the work done; without values where the run did not reach its end."""
    if isinstance(outcome, Failed):
        return case.blanks(errors.names(case.scene), outcome.status, outcome.detail)
    found = errors.measure(outcome.trajectory, truth) + work(outcome.trajectory.counters)
    return [case.row(*value) for value in found]


def work(counters: Counters) -> list[errors.Value]:
    """Return the counters that the method has."""
    counts = (("steps", counters.steps), ("newton iterations", counters.iterations), ("evaluations", counters.evaluations))
    return [(name, float(count), "1") for name, count in counts if count is not None]


def convergence(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield errors over a ladder of steps, and the observed order, of every method that has a step."""
    methods = [method for method in study.methods if method.role != Role.TRUTH]
    total = len(study.scenes) * len(methods)
    for i, scene in enumerate(study.scenes):
        for j, method in enumerate(methods):
            progress(i * len(methods) + j, total, f"{scene.name}: {method.name}")
            nothing = no_order(Case(study.name, scene, method, step_ladder.samples(scene, method)), study.skip_missing)
            yield from nothing or converging(study, scene, method)


def no_order(case: Case, skip_missing: bool) -> list[Measurement]:
    """Return the rows of a method that has no order on a scene and says why; none of one that may have."""
    reason = case.method.unsupported(case.scene) or ("its accuracy does not depend on dt" if case.method.order is None else "")
    missing = attempt(case, skip_missing) if isinstance(case.method, Missing) else None
    failed = missing if isinstance(missing, Failed) else Failed(UNSUPPORTED, reason)
    measures = [(name, "1") for _, name in CONVERGENCE] if failed.detail else []
    return [at_no_step(row) for row in case.blanks(measures, failed.status, failed.detail)]


def converging(study: Study, scene: Scene, method: Method) -> Iterator[Measurement]:
    """Yield the errors of one method at all its steps, then the orders they show."""
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    wanted = {name for name, _ in CONVERGENCE} | {"attitude error final"}
    units = [(name, unit) for name, unit in errors.names(scene) if name in wanted]
    found: dict[str, dict[float, float]] = {name: {} for name in wanted}
    cases = [Case(study.name, scene, method, grid) for grid in step_ladder.steps(scene, method)]
    for case, outcome in climb(cases, study.longest_run, study.skip_missing):
        if isinstance(outcome, Failed):
            yield from case.blanks(units, outcome.status, outcome.detail)
            continue
        for name, value, unit in errors.measure(outcome.trajectory, truth):
            if name in wanted:
                found[name][case.grid.dt] = value
                yield case.row(name, value, unit)
    for name, order_name in CONVERGENCE:
        yield from fitted(cases[0], order_name, found[name])


def climb(cases: list[Case], longest: float, skip_missing: bool) -> Iterator[tuple[Case, Done | Failed]]:
    """Yield the outcome of each case, coarse to fine; what would take more than `longest` s is skipped and says so."""
    per_step = 0.0
    for case in cases:
        expected = per_step * case.grid.n_steps
        if expected > longest:
            yield case, Failed(SKIPPED, f"would take about {expected:.2g} s, more than {longest:g} s")
            continue
        outcome = attempt(case, skip_missing)
        if isinstance(outcome, Done):
            # The very first call may include compilation, so that only a short one is taken for the cost of a run.
            first = outcome.cost.first_call
            per_step = (first if per_step or first < longest / 4 else elapsed(outcome.run)) / case.grid.n_steps
        yield case, outcome


def fitted(case: Case, name: str, errors_of_steps: dict[float, float]) -> list[Measurement]:
    """Return the observed order and its standard error."""
    order = observed_order(list(errors_of_steps), list(errors_of_steps.values()))
    status = NO_ORDER if order.reason else OK
    values = ((name, order.slope), (f"{name} stderr", order.stderr))
    return [at_no_step(case.row(measure, value, "1", status, str(order))) for measure, value in values]
