"""The mistake that explains the motions of a method: by the test of `engines check`, or else by the search of `judge`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from conservative.attitude import angle_between, to_quaternion
from conservative.benchmarks.verification.protocol import FREE, GRIDS, HEAVY, examine
from conservative.grid import Grid
from conservative.references.samples import QUATERNION, States
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..verification.compare import SIGMAS, Compared
from ..verification.explain import diagnose

ALLOWED = 3.0
"""Error that an explanation may leave, in units of the difference between the runs with the two shortest steps."""
SMALLEST = 1e-4
"""Smallest error that it may leave: more than round-off in single precision."""
UNKNOWN = "No known mistake explains its motion: its error does not fall with dt"


def find_causes(solve: Callable[[Scene, Grid], Trajectory]) -> tuple[str, str]:
    """Return the mistakes on the free and on the heavy body, "" for none; those of the free one hold for both.

    `solve` raises `NotImplementedError` for a body that is not supported. Its trajectories are not checked.
    """
    free = _find(FREE, solve)
    return free, free or _find(HEAVY, solve)


def _find(scene: Scene, solve: Callable[[Scene, Grid], Trajectory]) -> str:
    try:
        runs = [solve(scene, grid) for grid in GRIDS]
    except NotImplementedError:
        return ""
    if any(len(run.t) < grid.n_samples or not np.isfinite(run.w_WB_B).all() for run, grid in zip(runs, GRIDS, strict=True)):
        return "Its motion ends early or is not finite"
    states = [np.concatenate([to_quaternion(run.R_WB), run.w_WB_B], axis=1)[None] for run in runs]
    _, mistakes, falls = examine(scene, {grid: States(QUATERNION, each) for grid, each in zip(GRIDS, states, strict=True)})
    if mistakes or falls:
        return "; ".join(mistakes)
    last, before = runs[-1], runs[-2]
    apart = float(np.max([angle_between(last.R_WB, before.R_WB), np.linalg.norm(last.w_WB_B - before.w_WB_B, axis=1)]))
    allowed = np.full(2, max(SMALLEST, ALLOWED * apart))
    scale = float(np.linalg.norm(last.w_WB_B, axis=1).max())
    case = Compared(scene, last.t, (last.R_WB, last.w_WB_B), 0.0, scale, allowed, allowed / SIGMAS, rounded=tuple(allowed))
    for kinds in ({"scenes", "equations"}, {"bodies"}):  # readings and times are those of the test
        for each in diagnose(case, False, kinds=frozenset(kinds)).named:
            if each.explains and each.keys != ("first row",):  # which is given
                return each.sentence.removesuffix(". Correct --body")
    return UNKNOWN
