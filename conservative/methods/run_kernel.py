"""Run a kernel that makes steps, and return its samples as a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from threading import get_ident, main_thread
from typing import Any

import numpy as np

from ..deferred_imports import kernels
from ..errors import Diverged, IntegrationFailed, NotConverged, WrongBranch
from ..grid import Grid
from ..scene import Scene
from ..trajectory import Counters, Trajectory
from .pieces import list_pieces, march_pieces
from .principal_axes import PrincipalStart

_NO_COUNTERS = Counters(0)


class KernelRun(partial[Trajectory]):
    """A run, and its function `own_loop` that integrates and does not convert the samples (`Method.prepare`).

    A `partial`, because a call takes 0.04 us more than a call of a function; a method `__call__` takes 0.06 us more.
    """

    __slots__ = ("own_loop",)
    own_loop: Callable[[], Any]


def prepare_run(
    scene: Scene,
    grid: Grid,
    label: str,
    start: PrincipalStart,
    kernel: Any,
    model: Any,
    coefficients: Any,
    find_coefficients: Callable[[float], Any] | None = None,
) -> KernelRun:
    """Return the run of a kernel with its model and coefficients (`conservative.kernels.protocol`).

    Where a load is not smooth, steps are divided: `find_coefficients` returns the coefficients of a part of a step, s.

    `start` turns the samples from principal to body axes. Everything that all calls share is made here, including the arrays q
    and L, because calls of one run do not overlap. With loads, L has four more columns, for `Trajectory.supplied`.
    """
    n, n_steps, t = grid.n_samples, grid.n_steps, grid.t
    loaded, of_R, of_w = scene.loaded, (n, 3, 3), (n, 3)
    q, L = np.empty((n, 4)), np.empty((n, 7 if loaded else 3))
    bound = kernel.bind(model, coefficients) if hasattr(kernel, "bind") else partial(kernel.enter, *model, *coefficients)
    enter, to_body_axes = partial(bound, n_steps, grid.every), kernels("samples").to_body_axes
    if find_coefficients and len(breaks := scene.smoothness(grid.last).breaks):
        enter = partial(march_pieces, list_pieces(grid, breaks), kernel, model, find_coefficients, grid)
    turn = start.J_inverse, start.spin, start.R_BP
    counts: tuple[int, int, int, int | None] | None = None
    counters = _NO_COUNTERS

    def run() -> Trajectory:
        nonlocal counts, counters
        pause = kernel.PAUSE if get_ident() == main_thread().ident else 0  # signal handlers run in the main thread only
        done, stages, corrections, evaluations, size, elsewhere = enter(pause, q, L)
        # Runs share their counters, which are frozen and rarely change: 0.3 us.
        if (done, stages, corrections, evaluations) != counts:
            counts = done, stages, corrections, evaluations
            counters = Counters(*counts)
        R_WB, w_WB_B = np.empty(of_R), np.empty(of_w)
        if done == n_steps and to_body_axes(t, q, L, *turn, R_WB, w_WB_B) == n:
            # The constructor takes three times as long.
            trajectory = object.__new__(Trajectory)
            trajectory.__dict__.update(
                scene=scene, t=t.copy(), R_WB=R_WB, w_WB_B=w_WB_B, label=label, counters=counters, failure=None, choice=None,
                supplied=L[:, 3:].copy() if loaded else None, frame=None, control=None,
            )  # fmt: skip
            return trajectory
        n_good = n if done == n_steps else grid.count_samples(done)
        R_WB, w_WB_B = np.empty((n_good, 3, 3)), np.empty((n_good, 3))
        finite = to_body_axes(t, q, L, *turn, R_WB, w_WB_B)
        if finite < n_good:
            failure: IntegrationFailed = Diverged(float(t[max(finite - 1, 0)]))
        else:
            failure = (WrongBranch if elsewhere else NotConverged)(done + 1, done * grid.dt, size, kernel.FAILURE)
        supplied = L[:finite, 3:].copy() if loaded else None
        return Trajectory(scene, t[:finite].copy(), R_WB[:finite], w_WB_B[:finite], label, counters, failure, None, supplied)

    whole = KernelRun(run)
    whole.own_loop = partial(enter, 0, q, L)
    return whole
