"""Fields between a point b of the body and a point A of the world: V = F(s) with s = |R b - A|^2.

s is quadratic in the base vectors, so its finite derivative is its gradient at their mean, and that of V is

    V* = slope(s0, s1) ds/dR at the mean        slope = (F(s1) - F(s0)) / (s1 - s0)

with the divided difference written out so that nothing cancels where s1 -> s0. The torque is 2 slope (R b at the mean) x A:
like that of gravity, with A for the vertical.
"""

from __future__ import annotations

import math
from functools import partial, singledispatch
from typing import NamedTuple

import numpy as np

from . import kernel, traced
from .axial import axial_constants, axial_energy, start_series
from .fields import body_torque, energy, finite_derivative, finite_torque, halfway, implements, in_body, turned_moment
from .series import TURNED, TWICE, History, outwards
from .traced import join, over_root, root, where_above
from .vector import cross, dot, scale, subtract

Triple = tuple[float, float, float]


class Spring(NamedTuple):
    """F = stiffness/2 (sqrt(s) - rest)^2; b in principal axes, A in world axes, m."""

    b: Triple
    A: Triple
    stiffness: float
    rest: float


class Attraction(NamedTuple):
    """F = -strength / sqrt(s); b in principal axes, A in world axes, m."""

    b: Triple
    A: Triple
    strength: float


@singledispatch
def slope(field, s0, s1):
    """Return (F(s1) - F(s0)) / (s1 - s0), N/m, and its derivative by s1, N/m^3."""
    raise TypeError(f"not a field: {field!r}")


@implements(slope, Spring)
def _slope_spring(field, s0, s1):
    half = 0.5 * field.stiffness
    if field.rest == 0.0:
        return half, 0.0
    r1 = math.sqrt(s1)
    both = math.sqrt(s0) + r1
    return half * (1.0 - 2.0 * field.rest / both), half * field.rest / (r1 * both * both)


@implements(slope, Attraction)
def _slope_attraction(field, s0, s1):
    r0, r1 = math.sqrt(s0), math.sqrt(s1)
    value = field.strength / ((r0 + r1) * r0 * r1)
    return value, -0.5 * value * (r0 + 2.0 * r1) / (s1 * (r0 + r1))


@kernel
def _square(v):
    return dot(v, v)


@implements(finite_torque, Spring, Attraction)
def _finite_torque_point(field, q, a):
    A = in_body(q, field.A)
    m, dm = halfway(a, field.b)
    end = subtract(subtract(scale(2.0, m), field.b), A)
    value, change = slope(field, _square(subtract(field.b, A)), _square(end))
    f, g = -2.0 * value, -8.0 * change
    Am = cross(A, m)
    return scale(f, Am), (
        _column(f, g, A, Am, end, dm[0]),
        _column(f, g, A, Am, end, dm[1]),
        _column(f, g, A, Am, end, dm[2]),
    )


@kernel
def _column(f, g, A, Am, end, dm):
    """Derivative of f A x m along dm, where f changes by -2 change ds1 and ds1 = 4 end.dm."""
    d = cross(A, dm)
    e = g * dot(end, dm)
    return (f * d[0] + e * Am[0], f * d[1] + e * Am[1], f * d[2] + e * Am[2])


@implements(energy, Spring)
def _energy_spring(field, q):
    stretch = math.sqrt(_square(subtract(field.b, in_body(q, field.A)))) - field.rest
    return 0.5 * field.stiffness * stretch * stretch


@implements(energy, Attraction)
def _energy_attraction(field, q):
    return -field.strength / math.sqrt(_square(subtract(field.b, in_body(q, field.A))))


@implements(body_torque, Spring, Attraction)
def _body_torque_point(field, q):
    A = in_body(q, field.A)
    s = _square(subtract(field.b, A))
    return scale(2.0 * slope(field, s, s)[0], cross(field.b, A))


@implements(finite_derivative, Spring, Attraction)
def _finite_derivative_point(field, q0, q1):
    b, A = np.array(field.b), np.array(field.A)
    x0 = b[0] * q0[0:3] + b[1] * q0[3:6] + b[2] * q0[6:9] - A
    x1 = b[0] * q1[0:3] + b[1] * q1[3:6] + b[2] * q1[6:9] - A
    value, change = slope(field, np.sum(x0 * x0), np.sum(x1 * x1))
    mean = 0.5 * (x0 + x1)
    V_star, dV_star = np.empty(9), np.empty((9, 9))
    by_point = value * np.eye(3) + 4.0 * change * np.outer(mean, x1)
    for j in range(3):
        V_star[3 * j : 3 * j + 3] = 2.0 * value * b[j] * mean
        for k in range(3):
            dV_star[3 * j : 3 * j + 3, 3 * k : 3 * k + 3] = b[j] * b[k] * by_point
    return V_star, dV_star


class PointSeries:
    """J^-1 T of T = (base + y) g x m, where y is a multiple of s^alpha and s, the squared distance, is linear in g.

    S holds S2, S3, S1, S2 of s/s[0] = 1 + S.(g - g[0]). From s y' = alpha s' y follows, with s[k] in units of s[0],

        y[n] = (alpha + 1)/n sum of k s[k] y[n-k] - sum of s[k] y[n-k]        k = 1 ... n
    """

    def __init__(self, emit, M1, M2, S, y0, alpha, base):
        self._emit, self._M1, self._M2, self._S, self._y0, self._alpha, self._base = emit, M1, M2, S, y0, alpha, base
        self._s, self._ks, self._y, self._Q = (History(emit) for _ in range(4))

    def accelerate(self, c, n):
        """Coefficient n of J^-1 T."""
        emit, y, Q = self._emit, self._y, self._Q
        Q.push(emit.subtract(emit.add(None, self._M2, c[n, 0]), self._M1, c[n, 1]))
        self._push_distance(c, n)
        y.push(self._next_power(n) if n else self._y0)
        total = Q[n] if self._base else None
        for i in outwards(n):
            total = emit.add(total, y[i], Q[n - i])
        return total

    def _push_distance(self, c, n):
        emit = self._emit
        t = emit.times(self._S, c[n, 0])
        s = emit.plus(emit.plus(t, emit.shuffle(t, TURNED)), emit.shuffle(t, TWICE))
        self._s.push(s)
        self._ks.push(emit.times(emit.constant(float(n)), s))

    def _next_power(self, n):
        emit, plain, weighted = self._emit, None, None
        for k in outwards(n):
            if k:
                plain = emit.add(plain, self._s[k], self._y[n - k])
                weighted = emit.add(weighted, self._ks[k], self._y[n - k])
        return emit.minus(emit.times(emit.constant((self._alpha + 1) / n), weighted), plain)


_SpringSeries = partial(PointSeries, alpha=-0.5, base=1)
_AttractionSeries = partial(PointSeries, alpha=-1.5, base=0)


def _axial_constants(field, factor, J_inverse):
    """Distance A of the anchor, and its product with b and a factor of the torque as `turned_moment`."""
    A = root(traced.dot(field.A, field.A))
    return A, *turned_moment(J_inverse, traced.scale(-factor * A, field.b))


@axial_constants.register(Spring)
def _axial_constants_spring(field, J_inverse):
    return _axial_constants(field, field.stiffness, J_inverse)


@axial_constants.register(Attraction)
def _axial_constants_attraction(field, J_inverse):
    return _axial_constants(field, field.strength, J_inverse)


def _from_point(field, constants, g):
    """A g - b, m, and its square."""
    x = traced.subtract(traced.scale(constants[0], g), field.b)
    return x, traced.dot(x, x)


def _over_spring(field, square):
    """One over the distance, but 0 where nothing depends on it: without a length at rest the distance may be 0."""
    return where_above(over_root(square), 0.0, field.rest)


@axial_energy.register(Spring)
def _axial_energy_spring(field, constants, g):
    x, square = _from_point(field, constants, g)
    slack = 1.0 - field.rest * _over_spring(field, square)
    stiffness = field.stiffness * slack
    return 0.5 * stiffness * slack * square, traced.scale(stiffness * constants[0], x)


@axial_energy.register(Attraction)
def _axial_energy_attraction(field, constants, g):
    x, square = _from_point(field, constants, g)
    over = over_root(square)
    V = -field.strength * over
    return V, traced.scale(-V * over * over * constants[0], x)


def _slopes(field, A, over):
    """S of `PointSeries`."""
    s, b = -2.0 * A * over * over, field.b
    return join(s * b[1], s * b[2], s * b[0], s * b[1])


@start_series.register(Spring)
def _start_series_spring(field, constants, g):
    over = _over_spring(field, _from_point(field, constants, g)[1])
    return _SpringSeries, (*constants[1:], _slopes(field, constants[0], over), -field.rest * over)


@start_series.register(Attraction)
def _start_series_attraction(field, constants, g):
    over = over_root(_from_point(field, constants, g)[1])
    return _AttractionSeries, (*constants[1:], _slopes(field, constants[0], over), over * over * over)
