"""The paper's integrator as it stands: convected base vectors and their momenta, implicit constraints, 18 unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from .check import positive_number
from .errors import NotConverged
from .method import Grid, Method, Run
from .scene import Scene
from .trajectory import Counters, Trajectory


@dataclass(frozen=True)
class Convected(Method):
    """Krenk & Nielsen's algorithm, Table 1, with its analytic tangent (29); read `kernels/convected.py` beside the paper.

    Parameters
    ----------
    tol
        The paper's eps: Newton stops where the norm of the residual (27) is at most this.

    Raises
    ------
    BadInput
        tol is not a number above 0.
    """

    tol: float = 1e-8

    family: ClassVar[str] = "convected"
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
        from .kernels.convected import G, conjugate_momentum, march

        q0 = scene.R_WB0.T.flatten()  # a copy: read-only and writeable arrays would be compiled for one by one
        p0 = conjugate_momentum(q0, scene.body.momentum(scene.w_WB_B0))
        J_inverse = np.ascontiguousarray(scene.body.inverse)
        field = None if scene.potential is None else scene.potential.kernel_field(np.eye(3))

        def run() -> Trajectory:
            q, p = np.empty((grid.n_samples, 9)), np.empty((grid.n_samples, 9))
            done, corrections, norm = march(grid.dt, grid.n_steps, grid.every, J_inverse, field, self.tol, q0, p0, q, p)
            kept = grid.kept(done)
            L = np.array([-G(q[i]) @ p[i] for i in range(kept)])
            R_WB = np.swapaxes(q[:kept].reshape(-1, 3, 3), 1, 2)
            failure = None if done == grid.n_steps else NotConverged(done + 1, done * grid.dt, norm)
            work = Counters(steps=done, stages=done, iterations=corrections)
            return Trajectory(scene, grid.t[:kept], R_WB, L @ J_inverse, self.label, work, failure)

        return run
