"""Fields as the kernels see them: a named tuple of parameters in principal axes, and its torque, compiled per type.

A kernel is compiled once for each type of field; `None` is the free body, for which the torque code is not compiled at all.
A new field is a named tuple in a module of its own that implements the four functions below. Newton's method relies on the
derivatives that they return: it expects quadratic convergence. A field with an axis can have a recurrence as well (`axial`).
"""

from __future__ import annotations

import inspect
from functools import singledispatch
from typing import NamedTuple

import numpy as np
from numba.extending import overload

from . import SMALL, small
from .axial import axial_constants, axial_energy, start_series
from .traced import join
from .vector import cross, dot, scale, vertical


class Uniform(NamedTuple):
    """Uniform gravity: weight times centre of mass, N m, principal axes."""

    x: float
    y: float
    z: float


@singledispatch
def finite_torque(field, q, a):
    """Return T = Q0' tau* in N m and its derivative by a (three columns).

    tau* = sum_j qbar_j x (-V*_j) is the torque of the finite derivative over the step from the attitude Q0 of the quaternion q
    to Q0 Cay(2 a) (method of the paper, 23 and 27b, in three unknowns).
    """
    raise TypeError(f"not a field: {field!r}")


@singledispatch
def energy(field, q):
    """Return V in J at the attitude of the quaternion q, whose length does not matter."""
    raise TypeError(f"not a field: {field!r}")


@singledispatch
def body_torque(field, q):
    """Return the torque in N m, principal axes, at the attitude of the quaternion q, whose length does not matter."""
    raise TypeError(f"not a field: {field!r}")


@singledispatch
def at_time(field, t):
    """Return the field as it is at a time t, s: itself, unless it is one of those of `field_in_time`."""
    return field


def _stay(field, t):
    return field


@overload(at_time, jit_options=SMALL)
def _choose_to_stay(field, t):
    return None if getattr(field, "instance_class", None) in at_time.registry else _stay


@singledispatch
def finite_derivative(field, q0, q1):
    """Return V* (9,) in J between base vectors q0 and q1 (9,), and its derivative by q1 (9, 9)."""
    raise TypeError(f"not a field: {field!r}")


def implements(function, *fields, **options):
    """Register what is decorated as `function` of the named tuples `fields`, compiled with numba's `options` and in Python."""

    def register(implementation):
        def choose(field, *_):
            return implementation if getattr(field, "instance_class", None) in fields else None

        choose.__signature__ = inspect.signature(implementation)
        overload(function, jit_options=options)(choose)
        for field in fields:
            function.register(field)(implementation)
        return implementation

    return register


@implements(finite_torque, Uniform, **SMALL)
def _finite_torque_uniform(field, q, a):
    # T = (M c) x (-gamma), c = weight com
    g = vertical(q)
    m, dm = halfway(a, (field.x, field.y, field.z))
    return cross(g, m), (cross(g, dm[0]), cross(g, dm[1]), cross(g, dm[2]))


@small
def halfway(a, c):
    """Return M c, M = (1 + Cay(2a))/2, and its derivative by a (three columns): c on average over a step, in axes of its start.

    M = 1 + (hat(a) + hat(a)^2) / (1 + a.a), and M' is M at -a.
    """
    s = 1.0 / (1.0 + dot(a, a))
    ac = cross(a, c)
    aac = cross(a, ac)
    m = (c[0] + s * (ac[0] + aac[0]), c[1] + s * (ac[1] + aac[1]), c[2] + s * (ac[2] + aac[2]))
    # d(M c)/da_k = s (e_k x c + (a.c) e_k + c_k a - 2 a_k M c)
    f = dot(a, c)
    t = scale(2.0, m)
    d0 = (s * (f + c[0] * a[0] - a[0] * t[0]), s * (c[0] * a[1] - c[2] - a[0] * t[1]), s * (c[0] * a[2] + c[1] - a[0] * t[2]))
    d1 = (s * (c[1] * a[0] + c[2] - a[1] * t[0]), s * (f + c[1] * a[1] - a[1] * t[1]), s * (c[1] * a[2] - c[0] - a[1] * t[2]))
    d2 = (s * (c[2] * a[0] - c[1] - a[2] * t[0]), s * (c[2] * a[1] + c[0] - a[2] * t[1]), s * (f + c[2] * a[2] - a[2] * t[2]))
    return m, (d0, d1, d2)


@small
def in_body(q, v):
    """A world vector v in the axes that the quaternion q, of any length, turns into world axes."""
    n = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    u = (-q[1], -q[2], -q[3])
    t = cross(u, v)
    ut = cross(u, t)
    f = 2.0 * n
    return (v[0] + f * (q[0] * t[0] + ut[0]), v[1] + f * (q[0] * t[1] + ut[1]), v[2] + f * (q[0] * t[2] + ut[2]))


@implements(energy, Uniform, **SMALL)
def _energy_uniform(field, q):
    return dot(vertical(q), (field.x, field.y, field.z))


@implements(body_torque, Uniform, **SMALL)
def _body_torque_uniform(field, q):
    return cross(vertical(q), (field.x, field.y, field.z))


@implements(finite_derivative, Uniform)
def _finite_derivative_uniform(field, q0, q1):
    V_star = np.zeros(9)
    V_star[2], V_star[5], V_star[8] = field.x, field.y, field.z
    return V_star, np.zeros((9, 9))


class UniformSeries:
    """J^-1 (g x m), with M1 and M2 of `turned_moment`."""

    def __init__(self, emit, M1, M2):
        self._emit, self._M1, self._M2 = emit, M1, M2

    def accelerate(self, c, n):
        """Coefficient n of J^-1 T."""
        return self._emit.subtract(self._emit.add(None, self._M2, c[n, 0]), self._M1, c[n, 1])


def turned_moment(J_inverse, m):
    """J^-1 (m2, m3, m1) and J^-1 (m3, m1, m2), with which J^-1 (g x m) is a difference of two products."""
    i = J_inverse
    return join(i[0] * m[1], i[1] * m[2], i[2] * m[0], 0.0), join(i[0] * m[2], i[1] * m[0], i[2] * m[1], 0.0)


@axial_constants.register(Uniform)
def _axial_constants_uniform(field, J_inverse):
    return turned_moment(J_inverse, field)


@axial_energy.register(Uniform)
def _axial_energy_uniform(field, constants, g):
    return field.x * g[0] + field.y * g[1] + field.z * g[2], field


@start_series.register(Uniform)
def _start_series_uniform(field, constants, g):
    return UniformSeries, constants
