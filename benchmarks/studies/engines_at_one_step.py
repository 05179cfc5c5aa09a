"""The study of engines at the scene's step size: errors, drifts, flips and the time per step.

Times are measured in the process of each engine, in rounds interleaved across all engines, one engine at a time. A crash or a
hang affects the rows of one method only.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np

from conservative.attitude import Array
from conservative.grid import Grid, grid_for
from conservative.invariants import find_energy
from conservative.outcome import OK, Outcome
from conservative.references.worker.client import time_limit
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.timing import time_interleaved
from .case import Case, Failure, Success
from .engine_selection import is_as_installed
from .selection import Missing
from .speed import MEASURES, TimedRun, times
from .step_ladder import SAMPLES
from .study import Progress, Study
from .time_limit import attempt_here

AS_INSTALLED = "as installed"
"""Detail of the rows of an engine as installed."""
FIRST_LIMIT = 180.0
"""Time, s, that the first run of a setting may take: importing and compiling an engine can take a minute."""
TURNS = (Measure.TURNS_OVER, Measure.TURNS_OVER_TRUE)
FAR_SIDE = 0.5
"""Fraction of the initial momentum along the spin axis that the reversed momentum has to reach for a flip."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the properties of each engine, its errors and drifts with every step stored, and its times with a few samples."""
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        grid = grid_for(scene, scene.dt)
        truth = study.truth(scene, grid).trajectory
        ready: list[TimedRun] = []
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            ready += yield from measure(study, Case(study.name, scene, method, grid), truth)
        tell(f"{scene.name}: timing {len(ready)} engines")
        with time_limit(study.hang_limit):
            timings = time_interleaved({timed: timed.done.run for timed in ready}, study.rounds, budget=study.timing_budget)
        for timed, timing in timings.items():
            yield from times(timed, timing)


def facts(case: Case, outcome: Outcome) -> list[Measurement]:
    """Return the properties of an engine: bits of its numbers, and the expected order or nan."""
    method = case.method
    if isinstance(method, Missing):
        return []
    bits = float(getattr(method, "precision", "f64").removeprefix("f"))
    order = math.nan if method.order is None else float(method.order)
    detail = AS_INSTALLED if is_as_installed(method) else ""
    known = (Value(Measure.PRECISION, bits), Value(Measure.ORDER_EXPECTED, order))
    return [case.row(value, outcome, detail) for value in known]


def measure(study: Study, case: Case, truth: Trajectory) -> Generator[Measurement, None, list[TimedRun]]:
    """Yield the rows of one engine except its times; return the run to be timed in a list, which may be empty."""
    outcome = attempt_here(max(FIRST_LIMIT, study.hang_limit), case, study.skip_missing)
    yield from facts(case, outcome.outcome if isinstance(outcome, Failure) else OK)
    yield from accuracy(case, outcome, truth)
    few, again = case, outcome
    if isinstance(outcome, Success):
        few = replace(case, grid=keep_few(case.grid, study.longest_run / outcome.cost.first_call))
        again = attempt_here(study.hang_limit, few, study.skip_missing)
    if isinstance(again, Failure):
        yield from few.blanks(blanks(*MEASURES), again.outcome)
        return []
    return [TimedRun(few, again, again)]


def keep_few(grid: Grid, share: float) -> Grid:
    """Return the same steps (the first `share` of a slow run) with few samples."""
    n_steps = math.ceil(grid.n_steps * min(1.0, share))
    return Grid(grid.dt, n_steps, math.ceil(n_steps / SAMPLES))


def accuracy(case: Case, outcome: Success | Failure, truth: Trajectory) -> list[Measurement]:
    """Return errors, drifts and, for a free body, the number of flips; without values if the run failed."""
    counted = TURNS if case.scene.free else ()
    if isinstance(outcome, Failure):
        return case.blanks([*errors.blanks(case.scene), *blanks(*counted)], outcome.outcome)
    with np.errstate(over="ignore", invalid="ignore"):  # a diverging motion can be finite for some time
        values = errors.measure_errors(outcome.trajectory, truth)
        rows = [case.row(value, OK, direction(value, outcome.trajectory)) for value in values]
    turns = (count_turns_over(outcome.trajectory), count_turns_over(truth)) if counted else ()
    return rows + [case.row(Value(measure, float(n))) for measure, n in zip(counted, turns, strict=True)]


def direction(value: Value, trajectory: Trajectory) -> str:
    """Return whether the energy drift is a gain or a loss; empty for other quantities."""
    energy = find_energy(trajectory.scene.invariants)
    if energy is None or (value.measure, value.quantity) != (Measure.DRIFT_MAX, energy.name):
        return ""
    return "gained" if trajectory.drift(energy)[-1] > 0 else "lost"


def count_turns_over(trajectory: Trajectory) -> int:
    """Return how often a body turned over.

    That is how often the component of its momentum along one principal axis changed sides: the axis that has most of it at the
    start, about which a body of three different moments turns over where that is the middle one. A side counts from `FAR_SIDE`
    of the component at the start on, so that a wobble across zero does not.
    """
    along = momentum_along_spin(trajectory.scene, trajectory.w_WB_B)
    sides = np.sign(along[np.abs(along) >= FAR_SIDE * abs(along[0])])
    return int(np.count_nonzero(np.diff(sides)))


def momentum_along_spin(scene: Scene, w_WB_B: Array) -> Array:
    """Return the momentum (n,), kg m^2/s, along the principal axis that has most at the start, for rates (n, 3), rad/s."""
    along = scene.body.momentum(w_WB_B) @ scene.body.R_BP
    start = scene.body.momentum(scene.w_WB_B0) @ scene.body.R_BP
    component: Array = along[:, int(np.argmax(np.abs(start)))]
    return component
