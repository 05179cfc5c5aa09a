"""Drift over time: runs longer than the scene's own, kept as the largest drift so far at evenly spaced times."""

from __future__ import annotations

import numpy as np
import pandas as pd

from conservative.attitude import Array, orthonormality
from conservative.invariants import sizes
from conservative.method import Method, grid_for
from conservative.reports.labels import shown
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.errors import drifts
from ..measures.measurement import Measurement
from .case import Case, Failed, attempt

STUDY = "drift"
DURATIONS = 10.0
"""Length of a run in durations of its scene."""
KEPT = 120
"""Samples of a picture."""

COLUMNS = ("scene", "series", "t", "invariant", "drift")


def case_for(scene: Scene, method: Method) -> Case:
    """Return the run of a method at the scene's step over `DURATIONS` durations, every step a sample."""
    return Case(STUDY, scene, method, grid_for(scene, scene.dt, scene.t_end * DURATIONS))


def measured(case: Case, skip_missing: bool) -> tuple[list[Measurement], pd.DataFrame]:
    """Return the rows of one run, and its picture: columns scene, series, t (s), invariant, drift (relative, largest so far).

    Raises
    ------
    MissingEngine
        The engine is not installed, and `skip_missing` is False.
    """
    outcome = attempt(case, skip_missing)
    if isinstance(outcome, Failed):
        names = [(f"{invariant.name} drift max", "1") for invariant in case.scene.invariants]
        return case.blanks(names, outcome.status, outcome.detail), pd.DataFrame(columns=list(COLUMNS))
    detail = f"over {case.grid.t[-1]:g} s"
    rows = [case.row(*value, detail=detail) for value in drifts(outcome.trajectory)]
    return rows, samples(outcome.trajectory, shown(case.method.name, case.method.label))


def samples(trajectory: Trajectory, series: str) -> pd.DataFrame:
    """Return the picture of a run, a series by this name."""
    kinds = {invariant.name: trajectory.drift(invariant) for invariant in trajectory.scene.invariants}
    kinds["orthonormality"] = orthonormality(trajectory.R_WB)
    return pd.concat([_largest_so_far(trajectory, kind, values, series) for kind, values in kinds.items()], ignore_index=True)


def _largest_so_far(trajectory: Trajectory, kind: str, drift: Array, series: str) -> pd.DataFrame:
    t = trajectory.t
    size = np.maximum.accumulate(sizes(drift))
    kept = np.unique(np.linspace(0, len(t) - 1, KEPT).round().astype(int))[1:]
    return pd.DataFrame(
        {
            "scene": trajectory.scene.name,
            "series": series,
            "t": t[kept],
            "invariant": kind,
            "drift": size[kept],
        },
        columns=list(COLUMNS),
    )
