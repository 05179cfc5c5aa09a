"""Engines over decreasing step sizes or tolerances: errors, observed order, and wall times.

Impulse-based engines in single precision become less accurate with smaller steps. They have no order.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator

from conservative.method import Method
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.worker.client import time_limit
from conservative.scene import Scene

from ..measures.convergence_order import grows_with_shorter_steps, observed_order
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from . import step_ladder
from .case import Case, Success, drop_step
from .convergence import find_no_order, order_rows
from .declaration import Declaration, Named
from .line import LinePoint, measure_line
from .speed import time_runs
from .study import Progress, Study
from .work_precision import list_cases

WORSE = "worse with smaller steps"
"""Reason of an outcome without an order: the error increases as steps get shorter."""
SLOW_PREPARATION = 1.0
"""Time of a preparation, s, above which a method gets only every second step size: some engines compile for each."""
PREPARATIONS = 30.0
"""Time, s, for all preparations of a method on a scene. Step sizes beyond it are skipped."""
SKIPPED = Outcome(OutcomeKind.SKIPPED, "its engine takes long to prepare a run, so that it has fewer steps")
TIMED = 1.0
"""Largest attitude error, rad, of a timed run. A run with a larger error is another motion."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the errors of every engine at all step sizes, the observed order, and the times of the same runs."""
    tell = study.count(progress, len(study.lines) + 1)
    for scene in study.scenes:
        good: dict[Case, Success] = {}
        for method in study.lines:
            tell(f"{scene.name}: errors of {method.name}")
            points = yield from converge(study, scene, method)
            yield from fit_order(study, scene, method, points)
            for point in points:
                if isinstance(point.done, Success) and point.errors[Measure.ATTITUDE_MAX] <= TIMED:
                    good[point.case] = point.done
        tell(f"{scene.name}: timing {len(good)} runs")
        yield from time_rows(study, good)


def converge(study: Study, scene: Scene, method: Method) -> Generator[Measurement, None, list[LinePoint]]:
    """Yield the errors of one method; return its points."""
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    cases, points = list_cases(study, scene, method), list[LinePoint]()
    for point in measure_line(study, limit_preparation(cases, points), truth, [Measure.ATTITUDE_MAX]):
        points.append(point)
        yield from point.rows()
    tried = [point.case for point in points]
    yield from (case.row(Value(Measure.ATTITUDE_MAX, math.nan), SKIPPED) for case in cases if case not in tried)
    return points


def limit_preparation(cases: list[Case], points: list[LinePoint]) -> Iterator[Case]:
    """Yield the first case, then the others within the time limit; every second one if preparing the first was slow.

    `points` are those of the cases so far; the caller adds each.
    """
    yield cases[0]

    def spent() -> float:
        return sum(point.done.cost.prepare for point in points if isinstance(point.done, Success))

    for case in cases[2::2] if spent() > SLOW_PREPARATION else cases[1:]:
        if spent() > PREPARATIONS:
            return
        yield case


def fit_order(study: Study, scene: Scene, method: Method, points: list[LinePoint]) -> list[Measurement]:
    """Return the observed order and its standard error, or the reason why there is no order."""
    case, names = Case(study.name, scene, method, step_ladder.samples(scene, method)), (Measure.ORDER, Measure.ORDER_STDERR)
    if failed := find_no_order(study, case):
        return list(map(drop_step, case.rows(blanks(*names), failed)))
    steps, values = [point.case.grid.dt for point in points], [point.errors[Measure.ATTITUDE_MAX] for point in points]
    order = observed_order(steps, values)
    return order_rows(case, names, order, WORSE if order.reason and grows_with_shorter_steps(steps, values) else order.reason)


def time_rows(study: Study, runs: dict[Case, Success]) -> Iterator[Measurement]:
    """Yield the times of all runs of a scene, in interleaved rounds; for a run beyond the budget, its only time."""
    quick = {case: done.run for case, done in runs.items() if done.cost.first_call <= study.longest_run}
    with time_limit(study.hang_limit):
        yield from time_runs(study, {(case, Measure.TIME): (case, run) for case, run in quick.items()}, Processes())
    for case, done in runs.items():
        if case not in quick:
            value = Value(Measure.TIME, done.cost.first_call / (case.grid.dt * case.grid.n_steps))
            yield case.row(value, detail="a single run")


STUDY = Declaration(findings, named=Named.ONLY, apart=True, timed=True, options=("scenes",))
