"""Runs from other starts of a body: `run(R_WB0, w_WB_B0)` of every prepared run, for loops over initial states.

A run of compiled code may have `find_restart`, which returns a function that writes a start into its numbers, in a microsecond,
and returns False if the run does not suit the start. Its `again` then returns the trajectory from there. Any other run is
prepared again for each start.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .attitude import Array
from .check import finite_array, rotation
from .grid import Grid
from .scene import Scene
from .trajectory import Trajectory

Prepare = Callable[[Scene, Grid], Any]
FromStart = Callable[[Any, Any], Trajectory]
_FLOAT = np.dtype(np.float64)
MOST_KEPT = 4
"""Largest number of prepared runs: starts of one body can need different models, such as a top near the vertical."""


def bind_starts(prepare: Prepare, scene: Scene, grid: Grid) -> FromStart:
    """Return the function for other starts of the body of a scene, with everything else as it is (`Method.prepare`).

    `prepare` makes the run of a scene on a grid.
    """
    kept: list[tuple[Callable[[Array, Array], bool], Callable[[Any], Trajectory]]] = []
    R, w, of_R, of_w = np.empty((3, 3)), np.empty(3), (3, 3), (3,)

    def from_start(R_WB0: Any, w_WB_B0: Any) -> Trajectory:
        try:
            fits = R_WB0.shape == of_R and w_WB_B0.shape == of_w and R_WB0.dtype is _FLOAT and w_WB_B0.dtype is _FLOAT
        except AttributeError:  # a list, a Rotation
            fits = False
        if not fits:
            R_WB0, w_WB_B0 = read_start(R_WB0, w_WB_B0)
        R[...] = R_WB0
        w[...] = w_WB_B0
        for restart, again in kept:
            if restart(R, w):
                return again(scene_there)
        return begin(*read_start(R_WB0, w_WB_B0))

    def scene_there() -> Scene:
        """Return the scene with the start of the last call."""
        return scene.rename(scene.name, R_WB0=R, w_WB_B0=w)

    def begin(R_WB0: Array, w_WB_B0: Array) -> Trajectory:
        """Return the trajectory of a run that is prepared for this start, and keep the run if it can be used again."""
        run = prepare(scene.rename(scene.name, R_WB0=R_WB0, w_WB_B0=w_WB_B0), grid)
        if (find_restart := getattr(run, "find_restart", None)) is not None and (restart := find_restart())(R, w):
            del kept[MOST_KEPT - 1 :]
            kept.insert(0, (restart, run.again))
            return run.again(scene_there)  # as in later calls, bit for bit
        trajectory: Trajectory = run()
        return trajectory

    return from_start


def read_start(R_WB0: Any, w_WB_B0: Any) -> tuple[Array, Array]:
    """Return an attitude (3, 3) and rates (3,), rad/s, as `Scene` accepts them. Raise `BadInput` if it does not."""
    return rotation("R_WB0", R_WB0), finite_array("w_WB_B0", w_WB_B0, ((3,),), "three finite rates (3,), rad/s")


class AnyRun:
    """A run of a method without compiled starts, which is prepared again for each start. It has the attributes of the run."""

    def __init__(self, run: Any, from_start: FromStart) -> None:
        self._run, self.from_start = run, from_start

    def __call__(self, R_WB0: Any = None, w_WB_B0: Any = None) -> Trajectory:
        if R_WB0 is None and w_WB_B0 is None:
            return self._run()
        return self.from_start(R_WB0, w_WB_B0)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._run, name)


def with_starts(run: Any, prepare: Prepare, scene: Scene, grid: Grid) -> Any:
    """Return the run, which can then be called with another start."""
    first: FromStart | None = None

    def from_start(R_WB0: Any, w_WB_B0: Any) -> Trajectory:
        nonlocal first
        first = first or bind_starts(prepare, scene, grid)
        if hasattr(run, "from_start"):
            run.from_start = first
        return first(R_WB0, w_WB_B0)

    if hasattr(run, "from_start"):
        run.from_start = from_start
        return run
    return AnyRun(run, from_start)
