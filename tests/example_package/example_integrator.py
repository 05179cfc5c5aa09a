"""An explicit midpoint step for the momentum and a Cayley turn by its middle rate: order 2, conserves nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import conservative as cv
from conservative.attitude import cayley, hat
from conservative.grid import Grid
from conservative.method import Run
from conservative.trajectory import Counters


@dataclass(frozen=True)
class Example(cv.Method):
    """The step, for free bodies only."""

    family: ClassVar[str] = "example"
    role: ClassVar[cv.Role] = cv.Role.OURS

    @property
    def order(self) -> int:
        return 2

    def unsupported(self, scene: cv.Scene) -> str | None:
        return None if scene.free else "it is for free bodies"

    def prepare(self, scene: cv.Scene, grid: Grid) -> Run:
        J, inverse, h = scene.body.inertia, np.linalg.inv(scene.body.inertia), grid.dt

        def run() -> cv.Trajectory:
            R, w = scene.R_WB0, scene.w_WB_B0
            states = [(R, w)]
            for step in range(1, grid.n_steps + 1):
                middle = w + h / 2 * inverse @ (hat(J @ w) @ w)
                R, w = R @ cayley(h * middle), w + h * inverse @ (hat(J @ middle) @ middle)
                if step % grid.every == 0 or step == grid.n_steps:
                    states.append((R, w))
            attitudes, rates = (np.array(part) for part in zip(*states, strict=True))
            return cv.Trajectory(scene, grid.t, attitudes, rates, self.label, Counters(steps=grid.n_steps))

        return run
