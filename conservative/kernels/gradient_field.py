"""The gradient of a far centre's gravity: V = 3/2 rate^2 u' I u with u = R' e, quadratic in the base vectors.

V* is therefore the gradient at their mean, with the columns 3 rate^2 (I ubar)_j e, and the torque 3 rate^2 e x (Rbar I ubar).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import kernel, traced
from .axial import axial_constants, axial_energy, start_series
from .fields import body_torque, energy, finite_derivative, finite_torque, halfway, implements, in_body
from .series import History, outwards
from .traced import join
from .vector import add, cross, dot, scale

Triple = tuple[float, float, float]


class Gradient(NamedTuple):
    """Rows of 3 rate^2 I, J, in the axes of the kernel; e, the direction of the centre, in world axes."""

    first: Triple
    second: Triple
    third: Triple
    e: Triple


@kernel
def _times(field, u):
    return (dot(field.first, u), dot(field.second, u), dot(field.third, u))


@implements(finite_torque, Gradient)
def _finite_torque_gradient(field, q, a):
    e = in_body(q, field.e)
    u, du = halfway(scale(-1.0, a), e)
    m, dm = halfway(a, _times(field, u))
    return cross(e, m), (
        _column(field, a, e, dm[0], du[0]),
        _column(field, a, e, dm[1], du[1]),
        _column(field, a, e, dm[2], du[2]),
    )


@kernel
def _column(field, a, e, dm, du):
    """Derivative of e x (M I u): M changes the product by dm, u changes by -du since it is taken at -a."""
    return cross(e, add(dm, halfway(a, _times(field, scale(-1.0, du)))[0]))


@implements(energy, Gradient)
def _energy_gradient(field, q):
    e = in_body(q, field.e)
    return 0.5 * dot(e, _times(field, e))


@implements(body_torque, Gradient)
def _body_torque_gradient(field, q):
    e = in_body(q, field.e)
    return cross(e, _times(field, e))


@implements(finite_derivative, Gradient)
def _finite_derivative_gradient(field, q0, q1):
    e = np.array(field.e)
    mean = 0.5 * (q0 + q1)
    u = (np.sum(mean[0:3] * e), np.sum(mean[3:6] * e), np.sum(mean[6:9] * e))
    Iu = _times(field, u)
    rows = (field.first, field.second, field.third)
    V_star, dV_star = np.empty(9), np.empty((9, 9))
    ee = 0.5 * np.outer(e, e)
    for j in range(3):
        V_star[3 * j : 3 * j + 3] = Iu[j] * e
        for k in range(3):
            dV_star[3 * j : 3 * j + 3, 3 * k : 3 * k + 3] = rows[j][k] * ee
    return V_star, dV_star


class GradientSeries:
    """J^-1 (g x u), u = rate^2 I g: (r, s) of u over J are rows of a matrix each, by which r, s and g itself are multiplied."""

    def __init__(self, emit, *rows):
        self._emit, self._rows = emit, (rows[:3], rows[3:])
        self._u = (History(emit), History(emit))

    def accelerate(self, c, n):
        """Coefficient n of J^-1 T."""
        emit, (r, s) = self._emit, self._u
        for u, (by_r, by_s, by_g) in zip(self._u, self._rows, strict=True):
            u.push(emit.add(emit.add(emit.times(by_g, c.newest[0]), by_r, c[n, 0]), by_s, c[n, 1]))
        plus = minus = None
        for i in outwards(n):
            plus, minus = emit.add(plus, c[n - i, 0], s[i]), emit.add(minus, c[n - i, 1], r[i])
        return emit.minus(plus, minus)


@axial_constants.register(Gradient)
def _axial_constants_gradient(field, J_inverse):
    x, y, z = field.first, field.second, field.third
    i, j, k = J_inverse
    return (
        join(i * y[1], j * z[2], k * x[0], 0.0),
        join(i * y[2], j * z[0], k * x[1], 0.0),
        join(i * y[0], j * z[1], k * x[2], 0.0),
        join(i * z[1], j * x[2], k * y[0], 0.0),
        join(i * z[2], j * x[0], k * y[1], 0.0),
        join(i * z[0], j * x[1], k * y[2], 0.0),
    )


@axial_energy.register(Gradient)
def _axial_energy_gradient(field, constants, g):
    u = (traced.dot(field.first, g), traced.dot(field.second, g), traced.dot(field.third, g))
    return 0.5 * traced.dot(g, u), u


@start_series.register(Gradient)
def _start_series_gradient(field, constants, g):
    return GradientSeries, constants
