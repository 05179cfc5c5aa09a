"""Runs of the kernel `dense`: steps of a tolerance, with samples from their polynomials."""

from __future__ import annotations

from functools import partial
from threading import get_ident, main_thread
from typing import Any

import numpy as np

from ..attitude import from_quaternion, to_quaternion, triple
from ..check import build_unchecked
from ..deferred_imports import kernels
from ..errors import NotConverged
from ..grid import Grid
from ..scene import Scene
from ..trajectory import Counters, Trajectory
from .principal_axes import PrincipalStart
from .run_kernel import KernelRun
from .taylor_model import axes_of


def prepare_dense(scene: Scene, grid: Grid, label: str, start: PrincipalStart, model: Any, order: int, tol: float) -> KernelRun:
    """Return the run of series of an order with a tolerance: the kernel fills attitudes and rates itself."""
    kernel, n, t = kernels("dense"), grid.n_samples, grid.t
    R_BP = () if start.R_BP is None else tuple(map(triple, start.R_BP))
    units = (1.0, 1.0, start.spin[1] / start.J_inverse[2] if start.spin else 1.0)
    frame = kernel.Frame(tuple(map(triple, axes_of(scene))), R_BP, units, start.spin[:1] if start.spin else ())
    enter = partial(kernel.bind(model, frame, order, grid.dt, tol), grid.n_steps, grid.every)
    R_WB0 = from_quaternion(to_quaternion(scene.R_WB0))

    def run() -> Trajectory:
        R_WB, w_WB_B = np.empty((n + kernel.REGISTER, 3, 3)), np.empty((n + kernel.REGISTER, 3))
        R_WB[0], w_WB_B[0] = R_WB0, scene.w_WB_B0
        pause = kernel.PAUSE if get_ident() == main_thread().ident else 0
        done, *counts, size, _ = enter(pause, R_WB.reshape(-1), w_WB_B.reshape(-1))
        failure = None if done == grid.n_steps else NotConverged(done + 1, done * grid.dt, size, kernel.FAILURE)
        good, counters = grid.count_samples(done), Counters(done, *counts)
        samples = {"t": t[:good].copy(), "R_WB": R_WB[:good], "w_WB_B": w_WB_B[:good]}
        return build_unchecked(Trajectory, scene=scene, **samples, label=label, counters=counters, failure=failure, choice=None)

    room = np.empty(9 * (n + kernel.REGISTER)), np.empty(3 * (n + kernel.REGISTER))
    whole = KernelRun(run)
    whole.own_loop = partial(enter, 0, *room)
    return whole
