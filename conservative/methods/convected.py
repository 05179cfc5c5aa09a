"""The paper's integrator, unchanged: convected base vectors and their momenta, implicit constraints, 18 unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..attitude import Array
from ..check import positive_number
from ..deferred_imports import kernels
from ..errors import NotConverged
from ..features import ROTATION
from ..grid import Grid
from ..invariants import MOMENTA
from ..method import Method, Role, Run
from ..method_info import MethodInfo, Structure
from ..scene import Scene
from ..trajectory import Bounds, Counters, Trajectory
from .bounds import within_round_off
from .units import in_own_units

MAX_ITERATIONS = 20
"""Largest number of Newton's corrections of a step."""
Linearisation = Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Convected(Method):
    """Krenk & Nielsen's algorithm, Table 1, on base vectors and their momenta, with its analytic tangent (29).

    Parameters
    ----------
    tol
        The paper's eps: Newton's method stops when the norm of the residual (27) is at most this. It is absolute. The
        residual contains changes of base vectors and of momenta; momenta are in SI units, or for very large or small bodies in
        units in which the motion is of order one (`conservative.methods.units`).

    Raises
    ------
    BadInput
        tol is not a positive number.
    """

    tol: float = 1e-8

    family: ClassVar[str] = "convected"
    role: ClassVar[Role] = Role.OURS
    order = 2
    conserves = frozenset({"energy", *MOMENTA})
    method_info: ClassVar[MethodInfo] = MethodInfo(
        pictures=("",),
        colour="sky",
        structure=lambda method: Structure(symmetric=True, symplectic=False),
        supports=ROTATION,
    )

    def __post_init__(self) -> None:
        positive_number("tol", self.tol)

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        return within_round_off(self, scene, grid, self.tol, None)

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        q0 = scene.R_WB0.T.flatten()  # a copy, because kernels are compiled separately for read-only arrays
        kernel, J_inverse = kernels("convected"), np.ascontiguousarray(scene.body.inverse)
        u0 = np.concatenate([q0, kernel.conjugate_momentum(q0, scene.body.momentum(scene.w_WB_B0))])  # 1)
        dt, residual_and_tangent, finite_gradient = grid.dt, kernel.residual_and_tangent, kernel.finite_gradient
        field = None if scene.potential is None else scene.potential.kernel_field(np.eye(3))

        def linearise(u0: Array, u1: Array) -> tuple[Array, Array]:
            """Return the residual (27) and tangent (29) of the state at both ends of a step."""
            V_star, dV_star = (None, None) if field is None else finite_gradient(field, u0[:9], u1[:9])
            return residual_and_tangent(dt, J_inverse, V_star, dV_star, u0[:9], u0[9:], u1[:9], u1[9:])

        def run() -> Trajectory:
            with np.errstate(all="ignore"):  # a step that overflows fails
                u, corrections, failure = _march(linearise, u0, grid, self.tol)
            q, p = u[:, :9].reshape(-1, 3, 3), u[:, 9:].reshape(-1, 3, 3)
            R_WB = np.swapaxes(q, 1, 2)
            M = p @ R_WB  # p_i . q_j
            L = np.stack([M[:, 1, 2] - M[:, 2, 1], M[:, 2, 0] - M[:, 0, 2], M[:, 0, 1] - M[:, 1, 0]], axis=1)  # (8)
            done = grid.n_steps if failure is None else failure.step - 1
            work = Counters(steps=done, stages=done, iterations=corrections)
            return Trajectory(scene, grid.t[: len(u)], R_WB, L @ J_inverse, self.label, work, failure)

        return run


def _march(linearise: Linearisation, u: Array, grid: Grid, tol: float) -> tuple[Array, int, NotConverged | None]:
    """Follow Table 1. Return the samples (n, 18), the total number of corrections, and the failure or None.

    Steps are taken in Python, which can distinguish a singular tangent from other errors. Only the equations are compiled.
    """
    samples, total = [u], 0
    for step in range(1, grid.n_steps + 1):
        u0, norm = u, math.inf  # 2) prediction: the state itself
        for corrections in range(MAX_ITERATIONS + 1):
            try:
                r, K = linearise(u0, u)  # 3)
                norm = math.sqrt(r @ r)
                if norm <= tol or not math.isfinite(norm) or corrections == MAX_ITERATIONS:
                    break
                u = u - np.linalg.solve(K, r)  # 4), (28)
            except np.linalg.LinAlgError:  # C C' or the tangent can become singular at steps of a radian and more
                break
        total += corrections
        if not norm <= tol:
            return np.array(samples), total, NotConverged(step, (step - 1) * grid.dt, norm)
        if step % grid.every == 0 or step == grid.n_steps:
            samples.append(u)
    return np.array(samples), total, None
