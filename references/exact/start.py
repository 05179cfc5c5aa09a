"""A scene's start in many digits: the doubles that a user hands in are taken as exact numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from conservative.attitude import Array, to_quaternion
from conservative.body import RigidBody

from .digits import Number, mp

Vector = list[Number]
Matrix = Any
"""A matrix of `mp`."""

_PARALLEL = mp.mpf(10) ** -130
"""Sine of an angle that is rounding: principal axes come out with 150 digits."""

SYMMETRIC = 1e-12
"""Moments that differ by less, relative to the largest, are those of a symmetric body whose tensor was rounded."""


@dataclass(frozen=True, eq=False)
class Start:
    """Attitude and rates of a body at t = 0 in many digits."""

    body: RigidBody
    R_WB0: Array
    w_WB_B0: Array

    @cached_property
    def principal(self) -> tuple[Vector, Matrix]:
        """Principal moments and the axes as columns, of the whole tensor; a diagonal one keeps its order."""
        J = self.body.inertia
        if np.count_nonzero(J - np.diag(np.diag(J))) == 0:
            return [mp.mpf(value) for value in np.diag(J)], mp.eye(3)
        moments, axes = mp.eigsy(matrix(J))
        if mp.det(axes) < 0:
            axes[:, 2] = -axes[:, 2]
        return list(moments), axes

    @cached_property
    def attitude(self) -> Matrix:
        """Body-to-world rotation: that of the quaternion which `conservative.attitude` reads off `R_WB0`, normalised."""
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
        """Whether a free body would turn about a fixed axis: its momentum is parallel to its rates, or it is at rest."""
        moments, axes = self.principal
        w = self.rates(axes)
        L = [a * b for a, b in zip(moments, w, strict=True)]
        return bool(norm(cross(w, L)) <= _PARALLEL * norm(w) * norm(L))


def matrix(values: ArrayLike) -> Matrix:
    """Return a matrix of exact numbers."""
    return mp.matrix(np.asarray(values, dtype=float).tolist())


def as_array(values: Matrix) -> Array:
    """Return a matrix of `mp` in double precision."""
    return np.array([[float(value) for value in row] for row in values.tolist()])


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a: Vector) -> Number:
    """Return |a|."""
    return mp.sqrt(sum(x * x for x in a))


def halves_in_double(R: Matrix) -> tuple[complex, complex]:
    """Return `halves` in double precision."""
    alpha, beta = halves(R)
    return complex(alpha), complex(beta)


def halves(R: Matrix) -> tuple[Number, Number]:
    """Return alpha = q0 + i q3 and beta = q1 + i q2 of a rotation (Shepperd's choice of the largest component)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    squares = [1 + trace, *(1 + 2 * R[i, i] - trace for i in range(3))]
    largest = max(range(4), key=lambda i: squares[i])
    odd = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    if largest == 0:
        q = [squares[0], *odd]
    else:
        k = largest - 1
        q = [odd[k], *(squares[largest] if i == k else R[i, k] + R[k, i] for i in range(3))]
    q = [x / (2 * mp.sqrt(squares[largest])) for x in q]
    return mp.mpc(q[0], q[3]), mp.mpc(q[1], q[2])


def multiply(left: Any, right: Any) -> Any:
    """Return the product of two quaternions, each a pair (alpha, beta): of numbers or of arrays (n,)."""
    (a, b), (c, d) = left, right
    return a * c - b * np.conj(d), a * d + b * np.conj(c)


def root(square: Number) -> Number:
    """Return the square root of what is not negative but for rounding."""
    return mp.sqrt(max(square, mp.mpf(0)))


def unit(value: Number) -> Number:
    """Return `value` within [0, 1], which it leaves by rounding only."""
    return min(max(value, mp.mpf(0)), mp.mpf(1))


def from_halves(alpha: Any, beta: Any) -> Array:
    """Return rotations (n, 3, 3) of quaternions of any length, given as alpha = q0 + i q3 and beta = q1 + i q2, each (n,).

    These Cayley-Klein parameters (Klein & Sommerfeld, Theorie des Kreisels, I.2) are what theta functions give.
    """
    aa, bb = alpha * alpha, beta * beta
    a_size, b_size = np.abs(alpha) ** 2, np.abs(beta) ** 2
    inverse = 1 / (a_size + b_size)
    mixed, product = alpha * np.conj(beta), alpha * beta
    out = np.empty((*alpha.shape, 3, 3))
    out[..., 0, 0], out[..., 1, 1] = (aa + bb).real * inverse, (aa - bb).real * inverse
    out[..., 1, 0], out[..., 0, 1] = (aa + bb).imag * inverse, (bb - aa).imag * inverse
    out[..., 2, 2] = (a_size - b_size) * inverse
    out[..., 0, 2], out[..., 1, 2] = 2 * product.imag * inverse, -2 * product.real * inverse
    out[..., 2, 0], out[..., 2, 1] = 2 * mixed.imag * inverse, 2 * mixed.real * inverse
    return out
