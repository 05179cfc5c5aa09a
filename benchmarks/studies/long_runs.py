"""The study of long runs: drift over ten times the scene's duration."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conservative.attitude import Array, orthonormality
from conservative.grid import grid_for
from conservative.invariants import sizes
from conservative.method import Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.errors import measure_drifts
from ..measures.measure import Measure, Value
from .case import Case, Failure, Success
from .study import Finding, Progress, Study
from .time_limit import attempt_within

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
            yield from long_run(case, attempt_within(study.hang_limit, case, study.skip_missing))


def case_for(study: str, scene: Scene, method: Method) -> Case:
    """Return the run of a method at the scene's step over `DURATIONS` durations, every step a sample."""
    return Case(study, scene, method, grid_for(scene, scene.dt, scene.t_end * DURATIONS))


def long_run(case: Case, outcome: Success | Failure) -> Iterator[Finding]:
    """Yield the rows of one run, then its lines."""
    if isinstance(outcome, Failure):
        values = [Value(Measure.DRIFT_MAX, np.nan, invariant.name) for invariant in case.scene.invariants]
        yield from case.blanks(values, outcome.outcome)
        return
    detail = f"over {case.grid.t[-1]:g} s"
    yield from (case.row(value, detail=detail) for value in measure_drifts(outcome.trajectory))
    for quantity, drift in every_drift(outcome.trajectory).items():
        largest = np.maximum.accumulate(sizes(drift))
        some = np.unique(np.linspace(0, len(largest) - 1, SAMPLES).round().astype(int))[1:]
        yield case.samples(quantity, outcome.trajectory.t[some], largest[some])


def every_drift(trajectory: Trajectory) -> dict[str, Array]:
    """Return the sampled quantities (n,) or (n, 3) by name, dimensionless."""
    invariants = {invariant.name: trajectory.drift(invariant) for invariant in trajectory.scene.invariants}
    return invariants | {ORTHONORMALITY: orthonormality(trajectory.R_WB)}
