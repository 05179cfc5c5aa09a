"""The one runner of all kernels that take steps: it calls the kernel and makes a trajectory of the samples. Source: our own."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from threading import get_ident, main_thread
from typing import Any

import numpy as np

from ..attitude import Array
from ..deferred_imports import kernels
from ..errors import Diverged, IntegrationFailed, NotConverged, WrongBranch
from ..method import Grid, Run
from ..scene import Scene
from ..trajectory import Counters, Trajectory
from .principal_axes import PrincipalStart


def prepare_run(scene: Scene, grid: Grid, label: str, start: PrincipalStart, kernel: Any, model: Any, coefficients: Any) -> Run:
    """Return the run of a kernel with its model and coefficients (`conservative.kernels.protocol`).

    `start` is what its samples, in principal axes, are turned back with.
    """
    n, n_steps, Result = grid.n_samples, grid.n_steps, kernels("protocol").Result
    # Of the workspace, the last three are of each run. Its count is checked by `enter`, that of the result by its class.
    enter = partial(kernel.enter, *model, *coefficients, n_steps, grid.every)

    def run() -> Trajectory:
        q, L = np.empty((n, 4)), np.empty((n, 3))
        try:
            result = Result(*enter(kernel.PAUSE if in_main_thread() else 0, q, L))
        except np.linalg.LinAlgError:  # what compiled code cannot catch: equations that are singular, or not finite
            result = Result(count_steps(enter, q, L, grid), 0, 0, None, np.inf, False)
        done = result.done
        t, R_WB, w_WB_B, failure = turn_back(start, grid, n if done == n_steps else grid.count_samples(done), q, L)
        if failure is None and done < n_steps:
            kind = WrongBranch if result.elsewhere else NotConverged
            failure = kind(done + 1, done * grid.dt, result.size, kernel.FAILURE)
        work = Counters(done, result.stages, result.corrections, result.evaluations)
        return Trajectory(scene, t, R_WB, w_WB_B, label, work, failure)

    return run


def count_steps(enter: Any, q: Array, L: Array, grid: Grid) -> int:
    """Return how many steps a run that raises takes at least, by the samples it fills: q (n, 4), L (n, 3), kg m^2/s."""
    q.fill(np.nan)
    with suppress(np.linalg.LinAlgError):
        enter(0, q, L)
    return (max(1, int(np.isfinite(q).all(axis=1).sum())) - 1) * grid.every


def in_main_thread() -> bool:
    """Whether this is the thread that Python calls handlers of signals in."""
    return get_ident() == main_thread().ident


def turn_back(
    start: PrincipalStart, grid: Grid, n: int, q: Array, L: Array
) -> tuple[Array, Array, Array, IntegrationFailed | None]:
    """Return times (n,), s, attitudes (n, 3, 3) and rates (n, 3), rad/s, body axes; and the failure, if some are not finite.

    They are made of the first n of q (., 4) and L (., 3), kg m^2/s, principal axes, up to the first that is not finite.
    The quaternion is normalised here: its length carries no information, as the kernels' products are homogeneous in it.
    """
    t, R_WB, w_WB_B = grid.t, np.empty((n, 3, 3)), np.empty((n, 3))
    finite = kernels("samples").to_body_axes(t, q, L, start.J_inverse, start.spin, start.R_BP, R_WB, w_WB_B)
    if finite == len(t):
        return t, R_WB, w_WB_B, None
    failure = None if finite == n else Diverged(float(t[max(finite - 1, 0)]))
    return t[:finite], R_WB[:finite], w_WB_B[:finite], failure
