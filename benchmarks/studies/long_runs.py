"""The study of long runs: drift over ten times the scene's duration."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from conservative.grid import grid_for
from conservative.outcome import Outcome

from ..measures.errors import measure_drifts
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from .case import Case, Success
from .study import Progress, Study

DURATIONS = 10.0
"""Length of a run in durations of its scene."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the drifts of every method at the scene's step size."""
    tell = study.count(progress, len(study.competitors))
    for scene in study.scenes:
        for method in study.competitors:
            tell(f"{scene.name}: {method.name}")
            case = Case(study.name, scene, method, grid_for(scene, scene.dt, scene.t_end * DURATIONS))
            yield from measure_run(case, study.attempt(case))


def measure_run(case: Case, done: Success | Outcome) -> list[Measurement]:
    """Return the rows of one run."""
    if isinstance(done, Outcome):
        return case.rows((Value(Measure.DRIFT_MAX, np.nan, invariant.name) for invariant in case.scene.invariants), done)
    return case.rows(measure_drifts(done.trajectory), detail=f"over {case.grid.t[-1]:g} s")
