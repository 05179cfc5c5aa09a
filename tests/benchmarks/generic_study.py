"""A generic scene, its reference solution, and a method that fails as requested."""

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np

import conservative as cv
from conservative.attitude import rotation_about
from conservative.method import Role
from conservative.references.exact.method import Exact
from conservative.references.truth import Truth

TURN = rotation_about((0.3, -0.8, 0.5), 1.1)
START = rotation_about((-0.2, 0.4, 0.9), 2.2)
BODY = cv.RigidBody(TURN @ np.diag([1.7, 0.9, 2.3]) @ TURN.T)
SCENE = cv.Scene("generic", BODY, START, (0.7, -1.3, 2.1), 2.0, dt=0.02)


@dataclass(frozen=True)
class Broken(cv.Method):
    """An engine whose runs end as `how` says."""

    how: str
    family: ClassVar[str] = "broken"
    role: ClassVar[Role] = Role.ENGINE

    @property
    def order(self):
        return 2

    def unsupported(self, scene):
        return "it cannot do anything" if self.how == "unsupported" else None

    def samples(self, scene, grid, off):
        """Return the initial state at all times, changed by `off` in the last sample."""
        R, w = (np.repeat(start[None], grid.n_samples, axis=0) for start in (scene.R_WB0, scene.w_WB_B0))
        R[-1] += off
        return cv.Trajectory(scene, grid.t, R, w, self.label)

    def prepare(self, scene, grid):
        if self.how == "refuses":
            raise cv.BadInput("dt", grid.dt, "a shorter step")
        if self.how == "raises":
            raise RuntimeError("planted")
        if self.how == "gives nan":
            return lambda: self.samples(scene, grid, np.nan)
        if self.how == "is skewed":
            return lambda: self.samples(scene, grid, 1.0)
        if self.how == "gives nothing":
            return lambda: None
        start = np.zeros(1), scene.R_WB0[None], scene.w_WB_B0[None]
        return lambda: cv.Trajectory(scene, *start, self.label, failure=cv.Diverged(0.0, "planted"))


@cache
def truth(scene, grid):
    return Truth(Exact().prepare(scene, grid)(), 2e-15, ("exact", "other"), scene.t_end)
