"""The study of engines over decreasing step sizes or tolerances: errors, observed order, and wall times.

Impulse-based engines in single precision become less accurate with smaller steps. They have no order.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np

from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.worker.client import time_limit
from conservative.scene import Scene

from ..measures import errors
from ..measures.convergence_order import grows_with_shorter_steps, observed_order
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.timing import time_interleaved
from . import step_ladder
from .case import Case, Failure, Success, drop_step
from .convergence import attempt_each, no_order, order_rows
from .study import Progress, Study
from .work_precision import ROUNDS, one_of_each_series, points

WORSE = "worse with smaller steps"
"""Reason of an outcome without an order: the error increases as steps get shorter."""
SLOW_PREPARATION = 1.0
"""Time of a preparation, s, above which a method gets only every second step size: some engines compile for each."""
PREPARATIONS = 30.0
"""Time, s, for all preparations of a method on a scene. Step sizes beyond it are skipped."""
SKIPPED = Outcome(OutcomeKind.SKIPPED, "its engine takes long to prepare a run, so that it has fewer steps")
"""Outcome of skipped step sizes."""
TIMED = 1.0
"""Largest attitude error, rad, of a timed run. A run with a larger error is another motion."""
CALL = 0.002
"""Shortest sample of timed calls, s."""


@dataclass(frozen=True, eq=False)
class EnginePoint:
    """A run that reached its end, and its largest attitude error, rad."""

    case: Case
    done: Success
    error: float


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the errors of every engine at all step sizes, the observed order, and the times of the same runs."""
    methods = one_of_each_series(study)
    tell = study.count(progress, len(methods) + 1)
    for scene in study.scenes:
        points: list[EnginePoint] = []
        for method in methods:
            tell(f"{scene.name}: errors of {method.name}")
            mine = yield from converge(study, scene, method)
            yield from order_of(study, scene, method, mine)
            points += mine
        good = [point for point in points if point.error <= TIMED]
        tell(f"{scene.name}: timing {len(good)} runs")
        yield from time_rows(study, good)


def cases_of(study: Study, scene: Scene, method: Method) -> list[Case]:
    """Return the cases of a method, coarse to fine: all step sizes, or the cases of `work_precision` if it has none."""
    if method.order is None or method.unsupported(scene):
        return points(study, scene, method)
    grids = step_ladder.steps(scene, method)[:: 2 if study.quick else 1]
    return [Case(study.name, scene, method, grid) for grid in grids]


def converge(study: Study, scene: Scene, method: Method) -> Generator[Measurement, None, list[EnginePoint]]:
    """Yield the errors of one method; return its points."""
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    points_so_far: list[EnginePoint] = []
    cases = cases_of(study, scene, method)
    tried: list[Case] = []
    for case, outcome in attempt_each(study, limit_preparation(cases, points_so_far)):
        tried.append(case)
        if isinstance(outcome, Failure):
            yield case.row(Value(Measure.ATTITUDE_MAX, float("nan")), outcome.outcome)
            continue
        with np.errstate(over="ignore", invalid="ignore"):  # a diverging motion can be finite for some time
            values = errors.measure_errors(outcome.trajectory, truth)
        error = next(value for value in values if value.measure is Measure.ATTITUDE_MAX)
        points_so_far.append(EnginePoint(case, outcome, error.value))
        yield case.row(error)
    yield from (case.row(Value(Measure.ATTITUDE_MAX, float("nan")), SKIPPED) for case in cases if case not in tried)
    return points_so_far


def limit_preparation(cases: list[Case], points_so_far: list[EnginePoint]) -> Iterator[Case]:
    """Yield the first case, then the others within the time limit; every second one if preparing the first was slow."""
    yield cases[0]
    is_slow = bool(points_so_far) and points_so_far[0].done.cost.prepare > SLOW_PREPARATION
    for case in cases[2::2] if is_slow else cases[1:]:
        if sum(point.done.cost.prepare for point in points_so_far) > PREPARATIONS:
            return
        yield case


def order_of(study: Study, scene: Scene, method: Method, points: list[EnginePoint]) -> list[Measurement]:
    """Return the observed order and its standard error, or the reason why there is no order."""
    case, names = Case(study.name, scene, method, step_ladder.samples(scene, method)), (Measure.ORDER, Measure.ORDER_STDERR)
    if failed := no_order(case, study.skip_missing):
        return [drop_step(row) for row in case.blanks(blanks(*names), failed.outcome)]
    steps, values = [point.case.grid.dt for point in points], [point.error for point in points]
    order = observed_order(steps, values)
    return order_rows(case, names, order, WORSE if order.reason and grows_with_shorter_steps(steps, values) else order.reason)


def time_rows(study: Study, points: list[EnginePoint]) -> Iterator[Measurement]:
    """Yield the times of all points of a scene, in interleaved rounds; for a run beyond the budget, its only time."""
    quick = {point: point.done.run for point in points if point.done.cost.first_call <= study.longest_run}
    with time_limit(study.hang_limit):
        timings = time_interleaved(quick, min(study.rounds, ROUNDS), min_time=CALL, budget=study.timing_budget / 2)
    for point, timing in timings.items():
        yield time_row(point, timing.minimum, timing.outcome, str(timing))
    for point in points:
        if point not in quick:
            yield time_row(point, point.done.cost.first_call, OK, "a single run")


def time_row(point: EnginePoint, spent: float, outcome: Outcome, detail: str) -> Measurement:
    """Return the row of a run that took `spent` s."""
    grid = point.case.grid
    value = Value(Measure.TIME, spent / (grid.dt * grid.n_steps))
    return point.case.row(value, outcome, detail if outcome.ok else "")
