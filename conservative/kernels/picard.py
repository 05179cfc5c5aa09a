"""Picard's iteration on Chebyshev points, of many initial states at once, and its solutions at any times.

The equations are J w' = (S w + h) x w + T - h' and q' = q w / 2 in body axes, whose axes need not be principal. Each term has a
factor for each initial state, because the verification solves equations that are wrong on purpose (`Terms`). A state is a
quaternion, scalar first, body to world, and u = w + `wheel`, where `wheel` is J^-1 h for a rotor with a motor.
Source: C. W. Clenshaw and H. J. Norton, Comput. J. 6 (1963) 88; X. Bai and J. L. Junkins, J. Astronaut. Sci. 58 (2011) 583.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel
from .fields import body_torque

USUAL, FIXED, HALF_TURNED = range(3)
"""The inertia turns with the body; its components stay the same in world axes; or it is R J instead of R J R' in world axes."""


class Terms(NamedTuple):
    """The body, and the terms of the equations.

    `spinning` is S, `mode` a constant of this file, `tensor` the inertia that `FIXED` keeps in world axes, and `inverse`
    is the inverse of J or of this tensor. `side` is 1, or -1 for q' = w q / 2. `factors` (B, 4) are of the gyroscopic
    term, the torque of the field, an additional damping, 1/s, and of q'.
    """

    J: Any
    inverse: Any
    spinning: Any
    tensor: Any
    mode: int
    side: float
    factors: Any


class AtTimes(NamedTuple):
    """Loads at n times; arrays of length 0 stand for nothing.

    They are the momentum h of the rotor (n, 3), `wheel` (n, 3), quaternions of W in the axes of the field (n, 4), torques in
    body and in world axes (n, 3), damping (n, 3, 3), N m s, and torques in body axes that depend on the state (B, n, 3).
    """

    rotor: Any
    wheel: Any
    back: Any
    body: Any
    world: Any
    damping: Any
    own: Any


@kernel
def slope(field, terms, loads, y, b, k, out):  # noqa: PLR0912, PLR0915  # one formula: each part of a scene once
    """Write the derivative of state b at time k to out (7,)."""
    q0, q1, q2, q3 = y[0, b, k], y[1, b, k], y[2, b, k], y[3, b, k]
    w0, w1, w2 = y[4, b, k], y[5, b, k], y[6, b, k]
    if len(loads.wheel):
        w0, w1, w2 = w0 - loads.wheel[k, 0], w1 - loads.wheel[k, 1], w2 - loads.wheel[k, 2]
    gyroscopic, strength, damping, turn = terms.factors[b, 0], terms.factors[b, 1], terms.factors[b, 2], terms.factors[b, 3]
    a0, a1, a2 = 0.5 * turn * w0, 0.5 * turn * w1, 0.5 * turn * w2
    out[0] = -(q1 * a0 + q2 * a1 + q3 * a2)
    out[1] = q0 * a0 + terms.side * (q2 * a2 - q3 * a1)
    out[2] = q0 * a1 + terms.side * (q3 * a0 - q1 * a2)
    out[3] = q0 * a2 + terms.side * (q1 * a1 - q2 * a0)
    # The attitude, for what is not constant in body axes.
    size = 1.0 / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    q0, q1, q2, q3 = size * q0, size * q1, size * q2, size * q3
    r00, r01, r02 = 1.0 - 2.0 * (q2 * q2 + q3 * q3), 2.0 * (q1 * q2 - q0 * q3), 2.0 * (q1 * q3 + q0 * q2)
    r10, r11, r12 = 2.0 * (q1 * q2 + q0 * q3), 1.0 - 2.0 * (q1 * q1 + q3 * q3), 2.0 * (q2 * q3 - q0 * q1)
    r20, r21, r22 = 2.0 * (q1 * q3 - q0 * q2), 2.0 * (q2 * q3 + q0 * q1), 1.0 - 2.0 * (q1 * q1 + q2 * q2)
    T0, T1, T2 = 0.0, 0.0, 0.0
    if field is not None:
        p0, p1, p2, p3 = q0, q1, q2, q3
        if len(loads.back):
            c = loads.back[k]
            p0 = c[0] * q0 - c[1] * q1 - c[2] * q2 - c[3] * q3
            p1 = c[0] * q1 + c[1] * q0 + c[2] * q3 - c[3] * q2
            p2 = c[0] * q2 - c[1] * q3 + c[2] * q0 + c[3] * q1
            p3 = c[0] * q3 + c[1] * q2 - c[2] * q1 + c[3] * q0
        torque = body_torque(field, (p0, p1, p2, p3))
        T0, T1, T2 = strength * torque[0], strength * torque[1], strength * torque[2]
    if len(loads.body):
        T0, T1, T2 = T0 + loads.body[k, 0], T1 + loads.body[k, 1], T2 + loads.body[k, 2]
    if len(loads.world):
        m0, m1, m2 = loads.world[k, 0], loads.world[k, 1], loads.world[k, 2]
        T0 += r00 * m0 + r10 * m1 + r20 * m2
        T1 += r01 * m0 + r11 * m1 + r21 * m2
        T2 += r02 * m0 + r12 * m1 + r22 * m2
    if len(loads.damping):
        D = loads.damping[k]
        T0 -= D[0, 0] * w0 + D[0, 1] * w1 + D[0, 2] * w2
        T1 -= D[1, 0] * w0 + D[1, 1] * w1 + D[1, 2] * w2
        T2 -= D[2, 0] * w0 + D[2, 1] * w1 + D[2, 2] * w2
    if len(loads.own):
        T0, T1, T2 = T0 + loads.own[b, k, 0], T1 + loads.own[b, k, 1], T2 + loads.own[b, k, 2]
    h0, h1, h2 = 0.0, 0.0, 0.0
    if len(loads.rotor):
        h0, h1, h2 = loads.rotor[k, 0], loads.rotor[k, 1], loads.rotor[k, 2]
    if terms.mode == USUAL:
        S = terms.spinning
        L0 = S[0, 0] * w0 + S[0, 1] * w1 + S[0, 2] * w2 + h0
        L1 = S[1, 0] * w0 + S[1, 1] * w1 + S[1, 2] * w2 + h1
        L2 = S[2, 0] * w0 + S[2, 1] * w1 + S[2, 2] * w2 + h2
    else:  # the vector in world axes
        v0, v1, v2 = r00 * w0 + r01 * w1 + r02 * w2, r10 * w0 + r11 * w1 + r12 * w2, r20 * w0 + r21 * w1 + r22 * w2
        if terms.mode == HALF_TURNED:
            S = terms.J  # R' (R J) R w = J R w
            L0 = S[0, 0] * v0 + S[0, 1] * v1 + S[0, 2] * v2 + h0
            L1 = S[1, 0] * v0 + S[1, 1] * v1 + S[1, 2] * v2 + h1
            L2 = S[2, 0] * v0 + S[2, 1] * v1 + S[2, 2] * v2 + h2
        else:
            S = terms.tensor
            l0 = S[0, 0] * v0 + S[0, 1] * v1 + S[0, 2] * v2
            l1 = S[1, 0] * v0 + S[1, 1] * v1 + S[1, 2] * v2
            l2 = S[2, 0] * v0 + S[2, 1] * v1 + S[2, 2] * v2
            L0 = r00 * l0 + r10 * l1 + r20 * l2 + h0
            L1 = r01 * l0 + r11 * l1 + r21 * l2 + h1
            L2 = r02 * l0 + r12 * l1 + r22 * l2 + h2
    T0 += gyroscopic * (L1 * w2 - L2 * w1)
    T1 += gyroscopic * (L2 * w0 - L0 * w2)
    T2 += gyroscopic * (L0 * w1 - L1 * w0)
    if terms.mode == FIXED:
        T0, T1, T2 = r00 * T0 + r01 * T1 + r02 * T2, r10 * T0 + r11 * T1 + r12 * T2, r20 * T0 + r21 * T1 + r22 * T2
    K = terms.inverse
    a0 = K[0, 0] * T0 + K[0, 1] * T1 + K[0, 2] * T2
    a1 = K[1, 0] * T0 + K[1, 1] * T1 + K[1, 2] * T2
    a2 = K[2, 0] * T0 + K[2, 1] * T1 + K[2, 2] * T2
    if terms.mode != USUAL:  # (J R)^-1, or back into body axes
        a0, a1, a2 = r00 * a0 + r10 * a1 + r20 * a2, r01 * a0 + r11 * a1 + r21 * a2, r02 * a0 + r12 * a1 + r22 * a2
    out[4], out[5], out[6] = a0 - damping * w0, a1 - damping * w1, a2 - damping * w2


@entry
def slopes(field, terms, loads, y, out):
    """Write the derivatives of states y (7, B, n) at n times to out (7, B, n)."""
    one = np.empty(7)
    for b in range(y.shape[1]):
        for k in range(y.shape[2]):
            slope(field, terms, loads, y, b, k, one)
            for i in range(7):
                out[i, b, k] = one[i]


@kernel
def _matrix(q, R):
    size = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    a, x, y, z = size * q[0], size * q[1], size * q[2], size * q[3]
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - a * z), 2.0 * (x * z + a * y)
    R[1, 0], R[1, 1], R[1, 2] = 2.0 * (x * y + a * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - a * x)
    R[2, 0], R[2, 1], R[2, 2] = 2.0 * (x * z - a * y), 2.0 * (y * z + a * x), 1.0 - 2.0 * (x * x + y * y)


@entry
def sweep(field, terms, loads, y, Y, half, tolerance, integral, most):  # noqa: PLR0912  # loops over arrays
    """Iterate the states Y (7, B, n) of a stretch of half length `half`, s, from the states y (7, B) at its start.

    `integral` (n, n), transposed, turns values at the points, times `half`, into their integrals to each point. Returns the
    number of iterations, `most` if they have not converged before, and the last change, relative to the largest number of the
    start. They have converged if it is below `tolerance`, or no longer falls near round-off.
    """
    bodies, n = Y.shape[1], Y.shape[2]
    F, new, one = np.empty((7, bodies, n)), np.empty(n), np.empty(7)
    size, last = 0.0, math.inf
    for i in range(7):
        for b in range(bodies):
            size = max(size, abs(y[i, b]))
    size = size if size > 0.0 else 1.0
    for number in range(1, most):
        for b in range(bodies):
            for k in range(n):
                slope(field, terms, loads, Y, b, k, one)
                for i in range(7):
                    F[i, b, k] = one[i]
        change = 0.0
        for i in range(7):
            for b in range(bodies):
                new[:] = 0.0
                for j in range(n):
                    factor = half * F[i, b, j]
                    for k in range(n):
                        new[k] += factor * integral[j, k]
                for k in range(n):
                    value = y[i, b] + new[k]
                    difference = abs(value - Y[i, b, k])
                    if not difference <= change:  # also nan
                        change = difference
                    Y[i, b, k] = value
        change = change / size
        if change < tolerance or (change < 1e-13 and change > 0.5 * last) or not change < 1e30:
            return number, change
        last = change
    return most, last


@entry
def sample(ends, series, first, t, wheel, R, w):
    """Write attitudes (B, n, 3, 3) and rates (B, n, 3) of Chebyshev series (stretches, B, terms, 7) between `ends`.

    Times t (B or 1, n) may be in any order. States are nan outside of the series, and `first` (7, B) at the start. `wheel`
    (B or 1, n, 3) is subtracted from the rates; it may have length 0.
    """
    stretches, bodies, terms = series.shape[0], first.shape[1], series.shape[2]
    y, two = np.empty(7), np.empty(7)
    for b in range(R.shape[0]):
        own, of = b if bodies > 1 else 0, b if t.shape[0] > 1 else 0
        place = 0
        for k in range(t.shape[1]):
            time = t[of, k]
            if time == ends[0]:
                for i in range(7):
                    y[i] = first[i, own]
            elif not (ends[0] < time <= ends[stretches]):
                y[:] = np.nan
            else:
                while place > 0 and time <= ends[place]:
                    place -= 1
                while time > ends[place + 1]:
                    place += 1
                a, c = ends[place], ends[place + 1]
                x = 2.0 * ((time - a) / (c - a)) - 1.0
                y[:], two[:] = 0.0, 0.0
                for j in range(terms - 1, 0, -1):  # Clenshaw's recurrence
                    for i in range(7):
                        y[i], two[i] = series[place, own, j, i] + 2.0 * x * y[i] - two[i], y[i]
                for i in range(7):
                    y[i] = series[place, own, 0, i] + x * y[i] - two[i]
            _matrix(y, R[b, k])
            for i in range(3):
                w[b, k, i] = y[4 + i] - (wheel[of, k, i] if len(wheel) else 0.0)
