"""The symmetric top without truncation error: each step is an addition theorem of elliptic functions.

A symmetric body whose centre of mass lies on its axis, seen from the frame that does not spin, has the angular velocity
w = L/J1. With k = m g l / J1, u the vertical component of its axis, and E, z, w3 the energy, vertical and axial momentum, all
divided by J1,

    x(t) = k u/2 - E/6    satisfies    x'^2 = 4 x^3 - g2 x - g3,    so    x(t) = p(t + const), Weierstrass' p;
    g2 = E^2/3 - k z w3 + k^2,    g3 = 4 a^3 - g2 a + (k (z - w3)/2)^2  at  a = k/2 - E/6.

Let q = alpha + beta be the attitude quaternion (alpha: its parts along 1 and k, beta: along i and j). From q' = w q / 2 and
w' = k e_z x n follows that alpha, beta and M = exp(i w3 t/2) (w1 + i w2) satisfy Lame's equation y'' = (2 x + B) y, with
B = -E/6 - k/2, -E/6 + k/2 and E/3 - w3^2/4. Its propagator over a step h, y1 = A y + b y', is algebraic in the state: with f
the solution that starts like t^2 at the pole of p, and S = (x' - p'(h)) / (2 (x - p(h))), the slope of the addition theorem
p(t + h) = S^2 - p(t) - p(h),

    A = [f(h) (p(h) + x + B) - f'(h) S] / 3,    b = [f'(h) - f(h) S] / 3.

Proof: b is an elliptic function of t with simple poles at 0 and -h only, so it is linear in S, and both coefficients follow
from t -> 0; A = -db/dt with the end of the step held fixed. So no step has a truncation error, however long. The constants
p(h), p'(h), f(h), f'(h) are found once per run in twofold precision, from Laurent series and these theorems at doubled
arguments. Nothing is singular: an axis through a pole, a sleeping top, steady precession, zero spin, rest and no gravity are
ordinary states.

The constants belong to one energy and one momentum, so round-off alone would let both wander, linearly, and near a steady
precession exponentially. Each step therefore ends with the smallest change of the state that restores them.

Why not something else on tops: `Gauss` needs some thirty times the work and stays for bodies without symmetry; a Taylor
series of (axis, momentum) evaluates six products to order 20, where this takes one division and no series; compositions of free
rotations and kicks have a truncation error and bound the energy only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np

from .attitude import Array, from_quaternion, to_quaternion
from .errors import Diverged
from .frames import SpinFreeScene, frame_unsupported, without_spin
from .method import Grid, Method, Run
from .potential import UniformGravity
from .principal import Quadruple, Triple
from .scene import Scene
from .trajectory import Counters, Trajectory, finite_prefix


@dataclass(frozen=True)
class Lame(Method):
    """The exact step of a symmetric body in uniform gravity, its centre of mass on its axis; see the module for the equations.

    Accuracy does not depend on dt: one step is about 1e-15 off in attitude, and such errors add up. Energy, momenta and
    orthonormality are kept to round-off. A step longer than about half a period of nutation is taken in equal parts, which
    `Counters.stages` counts.

    References: F. Klein and A. Sommerfeld, Theorie des Kreisels, for alpha and beta as elliptic functions of the second kind;
    E. T. Whittaker and G. N. Watson, Modern Analysis, chapters 20 and 23, for p and Lame's equation.
    """

    family: ClassVar[str] = "lame"
    room: ClassVar[Literal["ours", "engine", "truth"]] = "ours"

    @property
    def order(self) -> None:
        return None

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "vertical momentum", "axial momentum"})

    def unsupported(self, scene: Scene) -> str | None:
        if not isinstance(scene.potential, UniformGravity | None):
            return "needs uniform gravity"
        return frame_unsupported("non_spinning", scene) and "body and field symmetric about one axis"

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        from .kernels.lame import march

        top = upright(scene)

        def run() -> Trajectory:
            q, L = np.empty((grid.n_samples, 4)), np.empty((grid.n_samples, 3))
            parts = march(grid.dt, top.slow.J1, top.moment, grid.n_steps, grid.every, top.q, top.L, q, L)
            work = Counters(steps=grid.n_steps, stages=grid.n_steps * parts, iterations=0)
            return top.trajectory(self.label, grid, q, L, work)

        return run


@dataclass(frozen=True, eq=False)
class Upright:
    """A symmetric scene as the kernel takes it: the slow frame turned so that its third axis is the axis of symmetry.

    Attributes
    ----------
    slow
        The scene without its spin.
    R_SA
        Rotation (3, 3) that takes components in the turned frame to those in the slow frame.
    moment
        Weight times lever arm, N m, along the axis.
    q, L
        Attitude of the turned frame at the start, scalar first, and momentum in it, kg m^2/s.
    """

    slow: SpinFreeScene
    R_SA: Array
    moment: float
    q: Quadruple
    L: Triple

    def trajectory(self, label: str, grid: Grid, q: Array, L: Array, work: Counters) -> Trajectory:
        """Return the body's trajectory from samples of the turned frame: quaternions (n, 4), momenta (n, 3)."""
        R_WS = from_quaternion(q / np.sqrt(np.einsum("ij,ij->i", q, q))[:, None]) @ self.R_SA.T
        R_WB, w_WB_B = self.slow.state(grid.t, R_WS, L @ self.R_SA.T / self.slow.J1)
        done = Trajectory(self.slow.spinning, grid.t, R_WB, w_WB_B, label, work)
        finite = finite_prefix(R_WB, w_WB_B)
        if finite == len(done):
            return done
        failure = Diverged(float(grid.t[max(finite - 1, 0)]))
        return replace(done, t=done.t[:finite], R_WB=R_WB[:finite], w_WB_B=w_WB_B[:finite], failure=failure)


@lru_cache(maxsize=256)
def upright(scene: Scene) -> Upright:
    """Return a symmetric scene as the kernel takes it."""
    slow = without_spin(scene)
    R_SA = frame_with_axis(slow.axis_B)
    potential = scene.potential
    moment = float(potential.moment_B @ slow.axis_B) if isinstance(potential, UniformGravity) else 0.0
    L = (R_SA.T @ scene.body.momentum(scene.w_WB_B0)).tolist()
    return Upright(slow, R_SA, moment, tuple(to_quaternion(scene.R_WB0 @ R_SA).tolist()), tuple(L))


def frame_with_axis(axis: Array) -> Array:
    """Return a rotation (3, 3) whose third column is the unit vector `axis` (3,)."""
    first = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis], axis=1)
