"""Long runs: drift over ten times the scene's duration."""

from __future__ import annotations

import math
from collections.abc import Iterator

from conservative.grid import grid_for
from conservative.outcome import Outcome
from conservative.scene import Scene

from ..measures.errors import measure_drifts
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from .case import Case
from .declaration import Declaration
from .study import Progress, Study

DURATIONS = 10.0
"""Length of a run in durations of its scene, if the tables of its loads are as long."""


def end_of(scene: Scene) -> float:
    """Return the length of a long run of a scene, s: `DURATIONS`, or up to the end of the first table that ends before."""
    ends = (max(scene.t_end, load.end) for load in scene.loads)
    return min(scene.t_end * DURATIONS, *ends, math.inf)  # inf: min needs two arguments if there are no loads


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the drifts of every method at the scene's step size."""
    tell = study.count(progress, len(study.competitors))
    for scene in study.scenes:
        cases = [
            Case(study.name, scene, competitor, grid_for(scene, scene.dt, end_of(scene))) for competitor in study.competitors
        ]
        skipped = study.skip_slow(cases)
        for case in cases:
            tell(f"{scene.name}: {case.method.name}")
            done = skipped.get(case) or study.attempt(case)
            if isinstance(done, Outcome):
                yield from case.rows(
                    (Value(Measure.DRIFT_MAX, math.nan, invariant.name) for invariant in scene.invariants), done
                )
            else:
                yield from case.rows(measure_drifts(done.trajectory), detail=f"over {case.grid.t[-1]:g} s")


STUDY = Declaration(findings)
