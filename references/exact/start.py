"""The initial state in 500 bits, the evaluation of a motion, and the simplest motion: a turn about a fixed axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from conservative.attitude import Array, to_quaternion
from conservative.body import RigidBody

from .digits import Matrix, Vector, as_array, cross, from_cayley_klein, mp, rotation_phase

_PARALLEL = mp.mpf(10) ** -130
"""Sine of an angle that is round-off: principal axes have 150 digits."""

SYMMETRIC = 1e-12
"""Relative difference of two moments that are equal up to the round-off of the tensor."""


@dataclass(frozen=True, eq=False)
class InitialState:
    """Attitude and rates of a body at t = 0. The doubles of the user are taken as exact numbers."""

    body: RigidBody
    R_WB0: Array
    w_WB_B0: Array

    @cached_property
    def principal(self) -> tuple[Vector, Matrix]:
        """Principal moments, and axes as columns. A diagonal tensor keeps its order."""
        J = self.body.inertia
        if np.count_nonzero(J - np.diag(np.diag(J))) == 0:
            return [mp.mpf(value) for value in np.diag(J)], mp.eye(3)
        moments, axes = mp.eigsy(mp.matrix(J.tolist()))
        if mp.det(axes) < 0:
            axes[:, 2] = -axes[:, 2]
        return list(moments), axes

    @cached_property
    def attitude(self) -> Matrix:
        """Body-to-world rotation of the normalised quaternion of `R_WB0`."""
        q = [mp.mpf(float(x)) for x in to_quaternion(self.R_WB0)]
        w, x, y, z = (part / mp.sqrt(sum(part**2 for part in q)) for part in q)
        return mp.matrix(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def rates(self, R_BP: Matrix) -> Vector:
        """Return the rates in axes P, rad/s."""
        return list(R_BP.T * mp.matrix([mp.mpf(float(w)) for w in self.w_WB_B0]))

    @property
    def steady(self) -> bool:
        """True if a free body turns about a fixed axis or rests: its momentum is parallel to its rates."""
        moments, axes = self.principal
        w = self.rates(axes)
        L = [a * b for a, b in zip(moments, w, strict=True)]
        return bool(mp.norm(cross(w, L)) <= _PARALLEL * mp.norm(w) * mp.norm(L))


Solution = Callable[[Array], tuple[Array, Array]]
"""A motion in closed form: maps any times (n,), s, to `R_WB` (n, 3, 3) and `w_WB_B` (n, 3)."""

_BLOCK = 16384
"""Samples evaluated together, so that they fit into a cache."""


def in_blocks(motion: Solution, t: Array) -> tuple[Array, Array]:
    """Return `R_WB` (n, 3, 3) and `w_WB_B` (n, 3) at t (n,), block after block."""
    R_WB, w_WB_B = np.empty((len(t), 3, 3)), np.empty((len(t), 3))
    for begin in range(0, len(t), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        R_WB[block], w_WB_B[block] = motion(t[block])
    return R_WB, w_WB_B


def steady_turn(start: InitialState) -> Solution:
    """Return the motion with the constant rates of a start: a turn about an axis fixed in body and world, or rest."""
    w = start.rates(mp.eye(3))
    speed = mp.norm(w)
    x, y, z = np.array([float(x / speed) for x in w]) if speed > 0 else np.array([0.0, 0.0, 1.0])
    half_turn, R_WB0 = rotation_phase(mp.mpf(0), speed / 2), as_array(start.attitude)

    def at(t: Array) -> tuple[Array, Array]:
        half = half_turn.phasor(t)
        turn = from_cayley_klein(half.real + 1j * z * half.imag, (x + 1j * y) * half.imag)
        return R_WB0 @ turn, np.broadcast_to(start.w_WB_B0, (*t.shape, 3)).copy()

    return at
