"""Samples in body axes from the states of engines: one compiled loop for all engines, as for our own methods.

The form of a state is one of the integers below. Symbols: F are the axes of the engine's body, D the axes of its attitude,
q a quaternion with the scalar first, w rates in F, l the momentum, u = l/J1 in D, n the third axis of F in D. Engines return
attitudes without orthonormalisation, so the norm error of a quaternion is visible in the samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from conservative.attitude import Array
from conservative.kernels import brief, entry, small

QUATERNION = 0
"""(q, w). For this form and the next two the constants are a rate and an axis (3,), about which D turns in the world, rad/s."""
MATRIX = 1
"""(R_DF by rows, w)."""
ROWS = 2
"""(third and first row of R_DF, w); the second row is their cross product."""
NON_SPINNING = 3
"""(q of the non-spinning frame, u1, u2); constants: spin, rad/s, u3, J1/J2, J1/J3."""
AXIS_AND_ANGLE = 4
"""(n, u1, u2, angle about n) of the non-spinning frame; constants as before."""
RATES_AND_ANGLE = 5
"""(w, angle about l less l t/J3) of a free body, D with its third axis along l; constants: l/J3, rad/s, J1, J2, J3."""
ROW_AND_ANGLE = 6
"""(third row of R_DF, angle of a rotation about it after the smallest rotation with this row, w)."""


@dataclass(frozen=True, eq=False)
class States:
    """States of n bodies at s samples.

    Attributes
    ----------
    kind
        Form of the states.
    values
        The states (n, s, m).
    R_WD, constants
        Rotations (n, 3, 3), D to world axes, and constants (n, 4) of the form; None for identities and zeros.
    rates_in_world
        True if the rates of a quaternion or a matrix are in D instead of F.
    """

    kind: int
    values: Array
    R_WD: Array | None = None
    constants: Array | None = None
    rates_in_world: bool = False


def to_body_axes(t: Array, states: States, R_BF: Array) -> tuple[Array, Array, Any]:
    """Return attitudes R_WB (n, s, 3, 3), rates w_WB_B (n, s, 3), rad/s, and how many first samples of each body are finite.

    `t` are the times (s,) or more, s; `R_BF` the rotations (n, 3, 3) from F to body axes.
    """
    n, s, _ = states.values.shape
    R_WB, w_WB_B, finite = np.empty((n, s, 3, 3)), np.empty((n, s, 3)), np.empty(n, np.int64)
    _convert(states.kind, states.rates_in_world, _owned(t), _owned(states.values), *_axes(states, R_BF), R_WB, w_WB_B, finite)
    return R_WB, w_WB_B, finite


def _owned(array: Any) -> Array:
    """Return a copy: numba compiles a function again for arrays that are read-only."""
    return np.array(array, float, order="C")


def _axes(states: States, R_BF: Array) -> tuple[Array, Array, Array]:
    n = len(R_BF)
    R_WD = np.broadcast_to(np.eye(3), (n, 3, 3)) if states.R_WD is None else states.R_WD
    constants = np.zeros((n, 4)) if states.constants is None else states.constants
    return _owned(R_BF), _owned(constants), _owned(R_WD)


Delivered = tuple[Array, Array]
"""Final attitude R_WB (3, 3), and rates w_WB_B (3,), rad/s, in new arrays."""


def bind_conversion(t_end: float, states: States, R_BF: Array) -> Callable[[Array], Delivered]:
    """Return the conversion of a state (m,) of one body at one time, s, with everything bound that does not change.

    `states` has the form and the constants of the body; its values are not used. `R_BF` is (3, 3). The result has the digits of
    `to_body_axes`. It takes 1.3 us; a script in NumPy that multiplies the rotations takes 6 us, and one with a product of a
    prepared matrix 1.8 us.
    """
    kind, in_world, axes = states.kind, states.rates_in_world, [array[0] for array in _axes(states, R_BF[None])]
    empty = np.empty

    def convert(state: Array) -> Delivered:
        R_WB, w_WB_B = empty((3, 3)), empty(3)
        _convert_one(kind, in_world, t_end, state, *axes, R_WB, w_WB_B)
        return R_WB, w_WB_B

    return convert


@small
def _of_quaternion(w, x, y, z):
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    return (
        (ww + xx - yy - zz, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), ww - xx + yy - zz, 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), ww - xx - yy + zz),
    )


@small
def _least(x, y, z):
    """Return the smallest rotation from the third axis to a vector of any length, not opposite to it."""
    size = 1.0 / math.sqrt(x * x + y * y + z * z)
    x, y, z = x * size, y * size, z * size
    a, b = x / (1.0 + z), y / (1.0 + z)
    return (1.0 - x * a, -x * b, x), (-x * b, 1.0 - y * b, y), (-x, -y, z)


@small
def _product(A, B):
    return _row(A[0], B), _row(A[1], B), _row(A[2], B)


@small
def _row(a, B):
    return (
        a[0] * B[0][0] + a[1] * B[1][0] + a[2] * B[2][0],
        a[0] * B[0][1] + a[1] * B[1][1] + a[2] * B[2][1],
        a[0] * B[0][2] + a[1] * B[1][2] + a[2] * B[2][2],
    )


@small
def _transpose(A):
    return (A[0][0], A[1][0], A[2][0]), (A[0][1], A[1][1], A[2][1]), (A[0][2], A[1][2], A[2][2])


@small
def _about_third(angle):
    c, s = math.cos(angle), math.sin(angle)
    return (c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


@small
def _turn(k, t):
    """Return the rotation by k[0] t about the unit vector k[1:]."""
    s, c, x, y, z = math.sin(k[0] * t), math.cos(k[0] * t), k[1], k[2], k[3]
    v = 2.0 * math.sin(0.5 * k[0] * t) ** 2
    return (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z),
    )


@small
def _slow_rates(R, u1, u2, k):
    w = _row((u1, u2, k[1]), R)
    return w[0], w[1] * k[2], w[2] * k[3]


@small
def _matrix(A):
    return (A[0, 0], A[0, 1], A[0, 2]), (A[1, 0], A[1, 1], A[1, 2]), (A[2, 0], A[2, 1], A[2, 2])


@small
def _sample(kind, rates_in_world, t, y, R_FB, k, A):
    if kind == QUATERNION:
        R, w = _of_quaternion(y[0], y[1], y[2], y[3]), (y[4], y[5], y[6])
    elif kind == MATRIX:
        R, w = ((y[0], y[1], y[2]), (y[3], y[4], y[5]), (y[6], y[7], y[8])), (y[9], y[10], y[11])
    elif kind == ROWS:
        g, a = (y[0], y[1], y[2]), (y[3], y[4], y[5])
        second = (g[1] * a[2] - g[2] * a[1], g[2] * a[0] - g[0] * a[2], g[0] * a[1] - g[1] * a[0])
        R, w = (a, second, g), (y[6], y[7], y[8])
    elif kind == NON_SPINNING:
        R = _product(_of_quaternion(y[0], y[1], y[2], y[3]), _about_third(k[0] * t))
        w = _slow_rates(R, y[4], y[5], k)
    elif kind == AXIS_AND_ANGLE:
        R = _product(_least(y[0], y[1], y[2]), _about_third(y[5] + k[0] * t))
        w = _slow_rates(R, y[3], y[4], k)
    elif kind == ROW_AND_ANGLE:
        R, w = _product(_about_third(y[3]), _transpose(_least(y[0], y[1], y[2]))), (y[4], y[5], y[6])
    else:
        w = (y[0], y[1], y[2])
        R = _product(_about_third(k[0] * t + y[3]), _transpose(_least(k[1] * w[0], k[2] * w[1], k[3] * w[2])))
    if rates_in_world:
        w = _row(w, R)
    R = _product(A, R)
    if kind <= ROWS and k[0] != 0.0:
        R = _product(_turn(k, t), R)
    return _product(R, R_FB), _row(w, R_FB)


@brief
def _convert_one(kind, rates_in_world, t, state, R_BF, c, R_WD, R_WB, w_WB_B):
    k = (c[0], c[1], c[2], c[3])
    R, w = _sample(kind, rates_in_world, t, state, _transpose(_matrix(R_BF)), k, _matrix(R_WD))
    for j in range(3):
        R_WB[j, 0], R_WB[j, 1], R_WB[j, 2] = R[j]
        w_WB_B[j] = w[j]


@entry
def _convert(kind, rates_in_world, t, states, R_BF, constants, R_WD, R_WB, w_WB_B, finite):
    for body in range(len(states)):
        A, R_FB = _matrix(R_WD[body]), _transpose(_matrix(R_BF[body]))
        c = constants[body]
        k = (c[0], c[1], c[2], c[3])
        finite[body] = 0
        for i in range(states.shape[1]):
            R, w = _sample(kind, rates_in_world, t[i], states[body, i], R_FB, k, A)
            size = 0.0
            for j in range(3):
                R_WB[body, i, j, 0], R_WB[body, i, j, 1], R_WB[body, i, j, 2] = R[j]
                w_WB_B[body, i, j] = w[j]
                size += abs(R[j][0]) + abs(R[j][1]) + abs(R[j][2]) + abs(w[j])
            if finite[body] == i and math.isfinite(size):
                finite[body] = i + 1
