"""The one runner of all kernels that take steps: it calls the kernel and makes a trajectory of the samples. Source: our own."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..attitude import Array
from ..errors import Diverged, IntegrationFailed, NotConverged, WrongBranch
from ..lazy_kernels import kernels
from ..method import Grid, Run
from ..scene import Scene
from ..trajectory import Counters, Trajectory
from .principal_axes import PrincipalStart


def prepare_run(scene: Scene, grid: Grid, label: str, start: PrincipalStart, kernel: Any, model: Any, coefficients: Any) -> Run:
    """Return the run of a kernel with its model and coefficients (`conservative.kernels.protocol`).

    `start` is what its samples, in principal axes, are turned back with.
    """
    protocol, enter, n = kernels("protocol"), kernel.enter, grid.n_samples

    def run() -> Trajectory:
        q, L = np.empty((n, 4)), np.empty((n, 3))
        result = protocol.Result(*enter(*model, *coefficients, grid.n_steps, grid.every, q, L))
        work = Counters(result.done, result.stages, result.corrections, result.evaluations)
        t, R_WB, w_WB_B, failure = _turn_back(start, grid, result.done, q, L)
        if failure is None and result.done < grid.n_steps:
            failure = _failure_of(kernel, grid, result)
        return Trajectory(scene, t, R_WB, w_WB_B, label, work, failure)

    return run


def _turn_back(
    start: PrincipalStart, grid: Grid, done: int, q: Array, L: Array
) -> tuple[Array, Array, Array, IntegrationFailed | None]:
    """Return times, attitudes and rates, body axes, of the samples of `done` steps, and the failure if they end in no numbers.

    The quaternion is normalised here: its length carries no information, as the kernels' products are homogeneous in it.
    """
    n, t = grid.kept(done), grid.t
    R_WB, w_WB_B = np.empty((n, 3, 3)), np.empty((n, 3))
    finite = kernels("samples").to_body_axes(t, q, L, start.J_inverse, start.spin, start.R_BP, R_WB, w_WB_B)
    failure = None if finite == n else Diverged(float(t[max(finite - 1, 0)]))
    return t[:finite], R_WB[:finite], w_WB_B[:finite], failure


def _failure_of(kernel: Any, grid: Grid, result: Any) -> NotConverged:
    """Return why the step after the last one done failed."""
    kind = WrongBranch if result.elsewhere else NotConverged
    return kind(result.done + 1, result.done * grid.dt, result.size, kernel.FAILURE)
