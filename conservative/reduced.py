"""The paper's map in three unknowns: the default method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from .check import positive_number
from .errors import NotConverged
from .method import Grid, Method, Run
from .principal import principal_start
from .scene import Scene
from .trajectory import Counters, Trajectory


@dataclass(frozen=True)
class Reduced(Method):
    """The scheme of Krenk & Nielsen, eliminated to three unknowns and compiled; equal to `Convected` to round-off.

    With w* = J^-1 (L_n + L_n+1)/2, the mean of the two body momenta each in its own frame,

        Q_n+1 = Q_n Cay(dt w*)
        Q_n+1 L_n+1 = Q_n L_n + dt tau*        tau* = sum_j qbar_j x (-V*_j)

    follows from the paper's (22) to (26) without approximation. Energy, world momentum (or its vertical component) and
    orthonormality are conserved to round-off; the axial momentum of a top is not.

    Parameters
    ----------
    tol
        Relative error that the solver may leave in a step. Newton converges quadratically, so the default is round-off.

    Raises
    ------
    BadInput
        tol is not a number above 0.
    """

    tol: float = 1e-20

    family: ClassVar[str] = "reduced"
    room: ClassVar[Literal["ours", "engine", "truth"]] = "ours"

    def __post_init__(self) -> None:
        positive_number("tol", self.tol)

    @property
    def order(self) -> int:
        return 2

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "momentum", "vertical momentum"})

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        from .kernels.march import march, stage_steps

        start = principal_start(scene)
        stages = stage_steps(grid.dt, (1.0,))

        def run() -> Trajectory:
            q, L = np.empty((grid.n_samples, 4)), np.empty((grid.n_samples, 3))
            done, corrections, size = march(
                stages, grid.n_steps, grid.every, start.J, start.J_inverse, start.field, self.tol, start.q, start.L, q, L
            )
            failure = None if done == grid.n_steps else NotConverged(done + 1, done * grid.dt, size)
            work = Counters(steps=done, stages=done * len(stages), iterations=corrections)
            return start.trajectory(self.label, grid, done, q, L, work, failure)

        return run
