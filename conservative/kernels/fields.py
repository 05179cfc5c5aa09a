"""Fields as the kernels see them: a named tuple of parameters in principal axes, and its torque, compiled per type.

A kernel is compiled once for each type of field; `None` is the free body, for which the torque code is not compiled at all.
A new field is a named tuple here (or in a module of its own) with overloads of `finite_torque` and `body_torque`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import overload

from . import kernel
from .vector import cross, dot, vertical


class Uniform(NamedTuple):
    """Uniform gravity: weight times centre of mass, N m, principal axes."""

    x: float
    y: float
    z: float


def finite_torque(field, q, a):
    """Return T = Q0' tau* in N m and its derivative by a (three columns).

    tau* = sum_j qbar_j x (-V*_j) is the torque of the finite derivative over the step from the attitude Q0 of the quaternion q
    to Q0 Cay(2 a) (method of the paper, 23 and 27b, in three unknowns).
    """
    raise TypeError("compiled only")  # pragma: no cover


def body_torque(field, q):
    """Return the torque in N m, principal axes, at the attitude of the quaternion q, whose length does not matter."""
    raise TypeError("compiled only")  # pragma: no cover


def finite_derivative(field, q0, q1):
    """Return V* (9,) in J between base vectors q0 and q1 (9,), and its derivative by q1 (9, 9)."""
    raise TypeError("compiled only")  # pragma: no cover


def is_field(type_, field) -> bool:
    """Whether a numba type is the named tuple `field`."""
    return getattr(type_, "instance_class", None) is field


@overload(finite_torque)
def _finite_torque_uniform(field, q, a):
    if not is_field(field, Uniform):
        return None

    def torque(field, q, a):
        # T = (M c) x (-gamma), M = (1 + Cay(2a)) / 2 = 1 + (hat(a) + hat(a)^2) / (1 + a.a), c = weight com
        c = (field.x, field.y, field.z)
        g = vertical(q)
        s = 1.0 / (1.0 + dot(a, a))
        ac = cross(a, c)
        aac = cross(a, ac)
        m = (c[0] + s * (ac[0] + aac[0]), c[1] + s * (ac[1] + aac[1]), c[2] + s * (ac[2] + aac[2]))
        # d(Mc)/da v = s [v x c + v x (a x c) + a x (v x c)] - 2 s (a.v) (Mc - c)
        ax = dot(a, c)
        columns = (
            _derivative(0, a, c, ac, ax, m, s, g),
            _derivative(1, a, c, ac, ax, m, s, g),
            _derivative(2, a, c, ac, ax, m, s, g),
        )
        return cross(g, m), columns

    return torque


@kernel
def _derivative(k, a, c, ac, ax, m, s, g):
    """Derivative of gamma x (M c) by a_k."""
    v = (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
    vc = cross(v, c)
    vac = cross(v, ac)
    avc = cross(a, vc)
    f = 2.0 * s * a[k]
    d = (
        s * (vc[0] + vac[0] + avc[0]) - f * (m[0] - c[0]),
        s * (vc[1] + vac[1] + avc[1]) - f * (m[1] - c[1]),
        s * (vc[2] + vac[2] + avc[2]) - f * (m[2] - c[2]),
    )
    return cross(g, d)


@overload(body_torque)
def _body_torque_uniform(field, q):
    if not is_field(field, Uniform):
        return None

    def torque(field, q):
        return cross(vertical(q), (field.x, field.y, field.z))

    return torque


@overload(finite_derivative)
def _finite_derivative_uniform(field, q0, q1):
    if not is_field(field, Uniform):
        return None

    def derivative(field, q0, q1):
        V_star = np.zeros(9)
        V_star[2], V_star[5], V_star[8] = field.x, field.y, field.z
        return V_star, np.zeros((9, 9))

    return derivative
