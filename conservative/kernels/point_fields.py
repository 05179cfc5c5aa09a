"""Fields between a point b of the body and a point A of the world: V = F(s) with s = |R b - A|^2.

s is quadratic in the base vectors, so its finite derivative is its gradient at their mean, and that of V is

    V* = slope(s0, s1) ds/dR at the mean        slope = (F(s1) - F(s0)) / (s1 - s0)

with the divided difference written out so that nothing cancels where s1 -> s0. The torque is 2 slope (R b at the mean) x A:
like that of gravity, with A for the vertical.
"""

from __future__ import annotations

import math
from functools import singledispatch
from typing import NamedTuple

import numpy as np

from . import kernel
from .fields import body_torque, energy, finite_derivative, finite_torque, halfway, implements, in_body
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
