"""Runs of the kernel `dense`: steps of a tolerance, with samples from their polynomials."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..attitude import from_quaternion, to_quaternion, triple
from ..deferred_imports import kernels
from ..grid import Grid
from ..scene import Scene
from .principal_axes import PrincipalStart
from .run_kernel import KernelRun, build_run
from .taylor_model import axes_of
from .taylor_starts import bind_restart


def prepare_dense(scene: Scene, grid: Grid, label: str, start: PrincipalStart, model: Any, order: int, tol: float) -> KernelRun:
    """Return the run of series of an order with a tolerance: the kernel fills attitudes and rates itself."""
    kernel = kernels("dense")
    R_BP = () if start.R_BP is None else tuple(map(triple, start.R_BP))
    units = (1.0, 1.0, start.spin[1] / start.J_inverse[2] if start.spin else 1.0)
    frame = kernel.Frame(tuple(map(triple, axes_of(scene))), R_BP, units, start.spin[:1] if start.spin else ())
    first = np.append(from_quaternion(to_quaternion(scene.R_WB0)), scene.w_WB_B0)
    bound = kernel.bind(model, frame, order, grid.dt, tol, first, start.axes(grid.dt))
    enter, restart = partial(bound, grid.n_steps, grid.every), partial(bind_restart, scene, start, model, frame, bound.args[0])
    return build_run(scene, grid, label, kernel, lambda pause: partial(enter, pause), find_restart=restart)
