"""The study of long runs: drift over ten times the scene's duration."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conservative.attitude import orthonormality
from conservative.grid import grid_for
from conservative.invariants import sizes
from conservative.method import Method
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..measures.errors import measure_drifts
from ..measures.measure import Measure, Value
from .case import Case, Success
from .study import Finding, Progress, Study

DURATIONS = 10.0
"""Length of a run in durations of its scene."""
SAMPLES = 120
"""Largest number of samples of a line."""
ORTHONORMALITY = "orthonormality"
"""A sampled quantity in addition to the invariants of the scene."""


def findings(study: Study, progress: Progress) -> Iterator[Finding]:
    """Yield drifts of every method at the scene's step size, and the running maximum over time of each relative drift."""
    tell = study.count(progress, len(study.competitors))
    for scene in study.scenes:
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            case = case_for(study.name, scene, method)
            yield from measure_run(case, study.attempt(case))


def case_for(study: str, scene: Scene, method: Method) -> Case:
    """Return the run of a method at the scene's step over `DURATIONS` durations, every step a sample."""
    return Case(study, scene, method, grid_for(scene, scene.dt, scene.t_end * DURATIONS))


def measure_run(case: Case, done: Success | Outcome) -> Iterator[Finding]:
    """Yield the rows of one run, then its lines."""
    if isinstance(done, Outcome):
        yield from case.rows((Value(Measure.DRIFT_MAX, np.nan, invariant.name) for invariant in case.scene.invariants), done)
        return
    trajectory = done.trajectory
    yield from case.rows(measure_drifts(trajectory), detail=f"over {case.grid.t[-1]:g} s")
    drifts = {invariant.name: trajectory.drift(invariant) for invariant in case.scene.invariants}
    for quantity, drift in (drifts | {ORTHONORMALITY: orthonormality(trajectory.R_WB)}).items():
        largest = np.maximum.accumulate(sizes(drift))
        some = np.unique(np.linspace(0, len(largest) - 1, SAMPLES).round().astype(int))[1:]
        yield case.samples(quantity, trajectory.t[some], largest[some])
