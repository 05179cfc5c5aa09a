"""Engines of another package, written for the tests: one fast, one in plain Python and slow, and some that hang or crash."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import conservative as cv
from conservative.attitude import hat
from conservative.grid import Grid
from conservative.method import Run
from conservative.references.exact.method import Exact
from conservative.trajectory import Counters


@dataclass(frozen=True)
class Foreign(cv.Method):
    """Base class of the engines here: for free bodies, of order 4."""

    role: ClassVar[cv.Role] = cv.Role.ENGINE

    @property
    def order(self) -> int:
        return 4

    def unsupported(self, scene: cv.Scene) -> str | None:
        return None if scene.free else "it is for free bodies"


@dataclass(frozen=True)
class Fast(Foreign):
    """The closed form under another name, because a foreign engine may be the best."""

    family: ClassVar[str] = "foreign_fast"

    def prepare(self, scene: cv.Scene, grid: Grid) -> Run:
        run = Exact().prepare(scene, grid)

        def relabel() -> cv.Trajectory:
            trajectory = run()
            return cv.Trajectory(
                scene, trajectory.t, trajectory.R_WB, trajectory.w_WB_B, self.label, trajectory.counters, trajectory.failure
            )

        return relabel


@dataclass(frozen=True)
class Slow(Foreign):
    """The classical method of Runge and Kutta in plain Python, which also sleeps `pause` s in each step."""

    pause: float = 0.0
    family: ClassVar[str] = "foreign_slow"

    def prepare(self, scene: cv.Scene, grid: Grid) -> Run:
        J, inverse, h = scene.body.inertia, np.linalg.inv(scene.body.inertia), grid.dt

        def rate(state: np.ndarray) -> np.ndarray:
            R, w = state[:3], state[3]
            return np.vstack([R @ hat(w), inverse @ np.cross(J @ w, w)])

        def run() -> cv.Trajectory:
            state = np.vstack([scene.R_WB0, scene.w_WB_B0])
            kept = [state]
            for step in range(1, grid.n_steps + 1):
                a = rate(state)
                b = rate(state + h / 2 * a)
                c = rate(state + h / 2 * b)
                state = state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))
                time.sleep(self.pause)
                if step % grid.every == 0 or step == grid.n_steps:
                    kept.append(state)
            states = np.array(kept)
            return cv.Trajectory(scene, grid.t, states[:, :3], states[:, 3], self.label, Counters(steps=grid.n_steps))

        return run


@dataclass(frozen=True)
class Harmful(Foreign):
    """An engine that hangs or ends its process, as `how` requires."""

    how: str = "hang"
    family: ClassVar[str] = "foreign_harm"

    def prepare(self, scene: cv.Scene, grid: Grid) -> Run:
        return lambda: getattr(self, self.how)(scene, grid)

    def hang(self, scene: cv.Scene, grid: Grid) -> cv.Trajectory:
        while True:
            pass

    def exit(self, scene: cv.Scene, grid: Grid) -> cv.Trajectory:
        os._exit(3)

    def abort(self, scene: cv.Scene, grid: Grid) -> cv.Trajectory:
        os.abort()
