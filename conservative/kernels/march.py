"""The paper's step in three unknowns, and the loop of steps, stages and samples around it (method: section 4 of README).

Unknown is a = dt w*/2, the Cayley vector of half the step; J, L in principal axes, attitude as a quaternion q (scalar first):

    J a + a x (J a) = (h/2) (L0 + (h/2) (T - a x T))          T = Q0' tau*
    q1 = q0 (1, a) / sqrt(1 + a.a)
    L1 = Cay(2a)' (L0 + h T)
"""

from __future__ import annotations

import math

import numpy as np

from . import kernel
from .fields import body_torque, finite_torque
from .vector import accumulate, add, cross, dot, product, scaled, solve, subtract, times

MAX_ITERATIONS = 30


@kernel
def initial_guess(h, J_inverse, field, q, L):
    """a of an explicit half step of Euler's equations: third order in h, so that Newton mostly needs two corrections."""
    rate = cross(L, times(J_inverse, L))
    if field is not None:
        rate = add(rate, body_torque(field, q))
    return scaled(0.5 * h, times(J_inverse, add(L, scaled(0.5 * h, rate))))


@kernel
def residual_and_tangent(h, J, field, q, L, a):
    """Return (residual, columns of its derivative by a, T)."""
    Ja = times(J, a)
    lhs = add(Ja, cross(a, Ja))
    k0 = (J[0], a[2] * J[0] - Ja[2], Ja[1] - a[1] * J[0])
    k1 = (Ja[2] - a[2] * J[1], J[1], a[0] * J[1] - Ja[0])
    k2 = (a[1] * J[2] - Ja[1], Ja[0] - a[0] * J[2], J[2])
    half = 0.5 * h
    if field is None:
        return subtract(lhs, scaled(half, L)), (k0, k1, k2), (0.0, 0.0, 0.0)
    T, dT = finite_torque(field, q, a)
    rhs = add(L, scaled(half, subtract(T, cross(a, T))))
    f = half * half
    k0 = subtract(k0, scaled(f, subtract(subtract(dT[0], (0.0, -T[2], T[1])), cross(a, dT[0]))))
    k1 = subtract(k1, scaled(f, subtract(subtract(dT[1], (T[2], 0.0, -T[0])), cross(a, dT[1]))))
    k2 = subtract(k2, scaled(f, subtract(subtract(dT[2], (-T[1], T[0], 0.0)), cross(a, dT[2]))))
    return subtract(lhs, scaled(half, rhs)), (k0, k1, k2), T


@kernel
def solved(h, J, J_inverse, field, q, L, tolerance):
    """Return (a, T, corrections made, size of the last relative to a, or -1 times it where Newton gave up).

    Newton converges quadratically, so a correction of relative size s leaves an error of s^2: the loop ends AFTER the
    correction with s^2 <= tolerance. Testing before it would bias the energy (method, section 9).
    """
    a = initial_guess(h, J_inverse, field, q, L)
    size = math.inf
    for iteration in range(1, MAX_ITERATIONS + 1):
        residual, tangent, T = residual_and_tangent(h, J, field, q, L, a)
        correction = solve(tangent, residual)
        a = subtract(a, correction)
        square = dot(correction, correction)
        scale = dot(a, a)
        if square <= tolerance * scale:
            if field is not None:
                T = finite_torque(field, q, a)[0]
            return a, T, iteration, math.sqrt(square)
        size = math.sqrt(square / scale)
    return a, (0.0, 0.0, 0.0), MAX_ITERATIONS, -size


@kernel
def march(h_stages, n_steps, every, J, J_inverse, field, tolerance, q0, L0, q_out, L_out):
    """Take n_steps steps, each of the stages h_stages (s), and store every `every`-th state and the last.

    Attitude and momentum are summed with compensation. Returns (steps done, Newton corrections, relative size of the last
    correction); steps done < n_steps means that the next one did not converge.
    """
    q, q_carry = q0, (0.0, 0.0, 0.0, 0.0)
    L, L_carry = L0, (0.0, 0.0, 0.0)
    q_out[0, :] = q
    L_out[0, :] = L
    row, corrections, size = 0, 0, 0.0
    for step in range(1, n_steps + 1):
        for h in h_stages:
            a, T, iterations, size = solved(h, J, J_inverse, field, q, L, tolerance)
            corrections += iterations
            if not size >= 0.0:
                return step - 1, corrections, -size
            L, L_carry = turned_momentum(h, field, a, T, L, L_carry)
            q, q_carry = turned_attitude(a, q, q_carry)
        if step % every == 0 or step == n_steps:
            row += 1
            q_out[row, :] = q
            L_out[row, :] = L
    return n_steps, corrections, size


@kernel
def turned_momentum(h, field, a, T, L, carry):
    """L1 = Cay(2a)' (L0 + h T) as a compensated increment."""
    v = L if field is None else add(L, scaled(h, T))
    av = cross(a, v)
    s = 2.0 / (1.0 + dot(a, a))
    d = scaled(s, subtract(cross(a, av), av))
    if field is not None:
        d = add(d, scaled(h, T))
    x, cx = accumulate(L[0], carry[0], d[0])
    y, cy = accumulate(L[1], carry[1], d[1])
    z, cz = accumulate(L[2], carry[2], d[2])
    return (x, y, z), (cx, cy, cz)


@kernel
def turned_attitude(a, q, carry):
    """q1 = q0 (1, a) / sqrt(1 + a.a) as a compensated increment."""
    square = dot(a, a)
    root = math.sqrt(1.0 + square)
    s = 1.0 / root
    less = -square / (root * (1.0 + root))
    d = product(q, (less, s * a[0], s * a[1], s * a[2]))
    w, cw = accumulate(q[0], carry[0], d[0])
    x, cx = accumulate(q[1], carry[1], d[1])
    y, cy = accumulate(q[2], carry[2], d[2])
    z, cz = accumulate(q[3], carry[3], d[3])
    return (w, x, y, z), (cw, cx, cy, cz)


def stage_steps(dt: float, weights: tuple[float, ...]) -> np.ndarray:
    """Return the lengths of the stages, s, of one step dt."""
    return dt * np.asarray(weights, dtype=float)
