"""Engines at the scene's step size: errors, drifts, flips and the time per step.

Times are measured in the process of each engine, in rounds interleaved across all engines, one engine at a time. A crash or a
hang affects the rows of one method only.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np

from conservative.grid import Grid, grid_for
from conservative.invariants import find_energy
from conservative.outcome import OK, Outcome
from conservative.references.worker.client import time_limit
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from .case import Case, Success
from .declaration import Declaration, Named
from .selection import Missing, bits_of
from .speed import MEASURES, time_steps
from .study import Progress, Study
from .time_limit import attempt_here

AS_INSTALLED = "as installed"
"""Detail of the rows of an engine as installed."""
FIRST_LIMIT = 180.0
"""Time limit, s, of the first run of a setting: importing and compiling an engine can take a minute."""
TURNS = (Measure.TURNS_OVER, Measure.TURNS_OVER_TRUE)
FAR_SIDE = 0.5
"""Fraction of the initial momentum along the spin axis that the reversed momentum has to reach for a flip."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the properties of each engine, its errors and drifts with every step stored, and its times, final state only."""
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        grid = grid_for(scene, scene.dt)
        truth = study.truth(scene, grid).trajectory
        ready: dict[Case, Success] = {}
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            ready |= yield from measure(study, Case(study.name, scene, method, grid), truth)
        tell(f"{scene.name}: timing {len(ready)} engines")
        with time_limit(study.hang_limit):
            yield from time_steps(study, ready)


def measure(study: Study, case: Case, truth: Trajectory) -> Generator[Measurement, None, dict[Case, Success]]:
    """Yield the rows of one engine except its times; return the run to be timed by its case, or nothing."""
    done = attempt_here(max(FIRST_LIMIT, study.hang_limit), case, study.skip_missing)
    method = case.method
    if not isinstance(method, Missing):
        order = math.nan if method.order is None else float(method.order)
        properties = (Value(Measure.PRECISION, float(bits_of(method))), Value(Measure.ORDER_EXPECTED, order))
        outcome = OK if isinstance(done, Success) else done
        yield from case.rows(properties, outcome, AS_INSTALLED if method in method.settings_for("as_installed") else "")
    yield from measure_accuracy(case, done, truth)
    if isinstance(done, Success):
        # The same steps, and the first ones if the run is slow.
        n_steps = math.ceil(case.grid.n_steps * min(1.0, study.longest_run / done.cost.first_call))
        case = replace(case, grid=Grid(case.grid.dt, n_steps, n_steps))
        done = study.attempt_here(case)
    if isinstance(done, Outcome):
        yield from case.rows(blanks(*MEASURES), done)
        return {}
    return {case: done}


def measure_accuracy(case: Case, done: Success | Outcome, truth: Trajectory) -> list[Measurement]:
    """Return errors, drifts and, for a free body, the number of flips; without values if the run failed."""
    counted = TURNS if case.scene.free else ()
    if isinstance(done, Outcome):
        return case.rows([*errors.blanks(case.scene), *blanks(*counted)], done)
    with np.errstate(over="ignore", invalid="ignore"):  # a diverging motion can be finite for some time
        rows = case.rows(errors.measure_errors(done.trajectory, truth))
        if energy := find_energy(case.scene.invariants):
            direction = "gained" if done.trajectory.drift(energy)[-1] > 0 else "lost"
            place = next(i for i, row in enumerate(rows) if (row.measure, row.quantity) == (Measure.DRIFT_MAX, energy.name))
            rows[place] = replace(rows[place], detail=direction)
    turns = (count_turns_over(done.trajectory), count_turns_over(truth)) if counted else ()
    return rows + [case.row(Value(measure, float(n))) for measure, n in zip(counted, turns, strict=True)]


def count_turns_over(trajectory: Trajectory) -> int:
    """Return how often a body turned over.

    The momentum component along one principal axis changes its sign when the body turns over. The axis is the one with the
    largest component at the start. A sign counts only if the component reaches `FAR_SIDE` of its initial size, so that small
    oscillations about zero are ignored.
    """
    body, start = trajectory.scene.body, trajectory.scene.w_WB_B0
    along = (body.momentum(trajectory.w_WB_B) @ body.R_BP)[:, int(np.argmax(np.abs(body.momentum(start) @ body.R_BP)))]
    signs = np.sign(along[np.abs(along) >= FAR_SIDE * abs(along[0])])
    return int(np.count_nonzero(np.diff(signs)))


STUDY = Declaration(findings, named=Named.ONLY, apart=True, timed=True, options=("scenes",))
