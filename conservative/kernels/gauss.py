"""Gauss collocation for a body with a fixed point in uniform gravity or without a field.

Unknowns are the momentum L and the vertical gamma = R' e_z, both in principal axes (for a free body gamma is the direction of
the world momentum): a closed system of six with quadratic invariants only,

    L' = L x w + gamma x c,    gamma' = gamma x w,    w = J^-1 L,

energy L.w/2 + c.gamma, L.gamma and gamma.gamma, which collocation at Gauss points keeps whatever the step. What is left of the
attitude is one angle about the vertical, a quadrature. With the minimal rotation M that takes gamma to a principal axis a and a
constant rotation C that takes a to e_z,

    R = Rz(phi) C M(gamma),    phi' = w.(gamma + a) / (1 + gamma.a),

and six choices of a, the charts, keep the divisor above 1.5. The kernel works in units that make L of size one.
"""

from __future__ import annotations

import math

import numpy as np

from . import kernel
from .vector import accumulate, cross, dot, product

MAX_SWEEPS = 60
MAX_NEWTON = 25
ROUND_OFF = 2e-17

# Chart k + 3 (s < 0) has a = s e_k; the quaternion is that of the constant rotation C.
_R = math.sqrt(0.5)
CHART_AXES = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]])
CHART_TURNS = np.array([[_R, 0, -_R, 0], [_R, _R, 0, 0], [1, 0, 0, 0], [_R, 0, _R, 0], [_R, -_R, 0, 0], [0, 1, 0, 0]])
KEPT_CHART = 0.5
"""A chart is kept while gamma.a is above this at the middle of the step; the best of six has 0.577 at least."""


@kernel
def rates(J_inverse, c, Z, F):
    """F = (L', gamma') at the states Z, both (6, stages)."""
    for i in range(Z.shape[1]):
        l0, l1, l2 = Z[0, i], Z[1, i], Z[2, i]
        g0, g1, g2 = Z[3, i], Z[4, i], Z[5, i]
        w0, w1, w2 = J_inverse[0] * l0, J_inverse[1] * l1, J_inverse[2] * l2
        F[0, i] = l1 * w2 - l2 * w1 + (g1 * c[2] - g2 * c[1])
        F[1, i] = l2 * w0 - l0 * w2 + (g2 * c[0] - g0 * c[2])
        F[2, i] = l0 * w1 - l1 * w0 + (g0 * c[1] - g1 * c[0])
        F[3, i] = g1 * w2 - g2 * w1
        F[4, i] = g2 * w0 - g0 * w2
        F[5, i] = g0 * w1 - g1 * w0


@kernel
def stages_from(A, h, F, U, D, Z):
    """D = h F A' and Z = U + D; return the largest change of D."""
    change = 0.0
    for k in range(6):
        for i in range(A.shape[0]):
            total = 0.0
            for j in range(A.shape[1]):
                total += A[i, j] * F[k, j]
            total *= h
            change = max(change, abs(total - D[k, i]))
            D[k, i] = total
            Z[k, i] = U[k] + total
    return change


@kernel
def swept(A, h, J_inverse, c, U, F, D, Z):
    """Iterate D = h A f(U + D) to stagnation; return (sweeps, last change, success)."""
    before = math.inf
    for sweep in range(1, MAX_SWEEPS + 1):
        rates(J_inverse, c, Z, F)
        change = stages_from(A, h, F, U, D, Z)
        ratio = change / before if sweep > 1 else 1.0
        if change * min(ratio, 1.0) <= ROUND_OFF or (ratio >= 0.5 and change < 1e-14):
            return sweep, change, True
        if sweep > 2 and not ratio < 0.5:
            return sweep, change, False
        before = change
    return MAX_SWEEPS, before, False


@kernel
def newton(A, h, J_inverse, c, U, F, D, Z):
    """Solve the same equations by Newton from an explicit Euler guess; return (iterations, last change, success)."""
    s = A.shape[0]
    tangent = np.empty((6 * s, 6 * s))
    residual = np.empty(6 * s)
    block = np.empty((6, 6))
    before = math.inf
    for iteration in range(1, MAX_NEWTON + 1):
        rates(J_inverse, c, Z, F)
        for j in range(s):
            tangent_block(J_inverse, c, Z[:, j], block)
            for k in range(6):
                total = 0.0
                for m in range(s):
                    total += A[j, m] * F[k, m]
                residual[6 * j + k] = h * total - D[k, j]
                for i in range(s):
                    for n in range(6):
                        tangent[6 * i + k, 6 * j + n] = (1.0 if i == j and k == n else 0.0) - h * A[i, j] * block[k, n]
        correction = np.linalg.solve(tangent, residual)
        change = 0.0
        for j in range(s):
            for k in range(6):
                D[k, j] += correction[6 * j + k]
                Z[k, j] = U[k] + D[k, j]
                change = max(change, abs(correction[6 * j + k]))
        if change * change <= ROUND_OFF or (change >= before and change < 1e-12):
            return iteration, change, True
        before = change
    return MAX_NEWTON, before, False


@kernel
def tangent_block(J_inverse, c, U, block):
    """Derivative (6, 6) of the rates at one state."""
    block[:, :] = 0.0
    w = (J_inverse[0] * U[0], J_inverse[1] * U[1], J_inverse[2] * U[2])
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        block[k, i] = w[j] - U[j] * J_inverse[i]
        block[k, j] = U[i] * J_inverse[j] - w[i]
        block[k, 3 + i] = c[j]
        block[k, 3 + j] = -c[i]
        block[3 + k, 3 + i] = w[j]
        block[3 + k, 3 + j] = -w[i]
        block[3 + k, i] = -U[3 + j] * J_inverse[i]
        block[3 + k, j] = U[3 + i] * J_inverse[j]


@kernel
def chart_rotation(chart, gamma):
    """Quaternion, not normalised, of C M(gamma)."""
    a = (CHART_AXES[chart, 0], CHART_AXES[chart, 1], CHART_AXES[chart, 2])
    turn = (CHART_TURNS[chart, 0], CHART_TURNS[chart, 1], CHART_TURNS[chart, 2], CHART_TURNS[chart, 3])
    n = cross(gamma, a)
    return product(turn, (1.0 + dot(gamma, a), n[0], n[1], n[2]))


@kernel
def attitude(chart, phi, gamma):
    """Unit quaternion of Rz(phi) C M(gamma)."""
    m = chart_rotation(chart, gamma)
    size = 1.0 / math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2] + m[3] * m[3])
    return product((size * math.cos(0.5 * phi), 0.0, 0.0, size * math.sin(0.5 * phi)), m)


@kernel
def angle_in(chart, q, gamma):
    """The phi for which `attitude(chart, phi, gamma)` is q or -q."""
    m = chart_rotation(chart, gamma)
    z = product(q, (m[0], -m[1], -m[2], -m[3]))
    return 2.0 * math.atan2(z[3], z[0])


@kernel
def best_chart(gamma):
    """The chart whose axis is nearest to gamma."""
    k = 0
    for i in range(1, 3):
        if abs(gamma[i]) > abs(gamma[k]):
            k = i
    return k if gamma[k] >= 0.0 else k + 3


@kernel
def turn_rate(h, b, chart, J_inverse, Z):
    """Integral of phi' over the step."""
    a0, a1, a2 = CHART_AXES[chart, 0], CHART_AXES[chart, 1], CHART_AXES[chart, 2]
    total = 0.0
    for i in range(Z.shape[1]):
        g0, g1, g2 = Z[3, i], Z[4, i], Z[5, i]
        top = J_inverse[0] * Z[0, i] * (g0 + a0) + J_inverse[1] * Z[1, i] * (g1 + a1) + J_inverse[2] * Z[2, i] * (g2 + a2)
        total += b[i] * top / (1.0 + g0 * a0 + g1 * a1 + g2 * a2)
    return h * total


@kernel
def march(A, A_low, E, b, b_low, h, n_steps, every, J_inverse, c, L0, gamma0, q_out, L_out):
    """Take n_steps steps of h s and store attitude and momentum of every `every`-th and the last.

    Returns (steps done, sweeps and Newton corrections, size of the last change); steps done < n_steps means that the next one
    did not converge.
    """
    s = b.shape[0]
    U, carry = np.empty(6), np.zeros(6)
    for k in range(3):
        U[k], U[3 + k] = L0[k], gamma0[k]
    F, D, Z = np.empty((6, s)), np.zeros((6, s)), np.empty((6, s))
    chart = best_chart(gamma0)
    phi, phi_carry = 0.0, 0.0
    q_out[0, :] = attitude(chart, phi, gamma0)
    L_out[0, :] = L0
    row, work, change = 0, 0, 0.0
    for step in range(1, n_steps + 1):
        if step == 1:
            start(A, h, J_inverse, c, U, F, D, Z)
        else:
            stages_from(E, h, F, U, D, Z)
        sweeps, change, good = swept(A, h, J_inverse, c, U, F, D, Z)
        work += sweeps
        if not good:
            start(A, h, J_inverse, c, U, F, D, Z)
            corrections, change, good = newton(A, h, J_inverse, c, U, F, D, Z)
            work += corrections
            if not good:
                return step - 1, work, change
        add_low(A_low, h, F, U, D, Z)
        rates(J_inverse, c, Z, F)
        middle = (Z[3, s // 2], Z[4, s // 2], Z[5, s // 2])
        if dot(middle, (CHART_AXES[chart, 0], CHART_AXES[chart, 1], CHART_AXES[chart, 2])) < KEPT_CHART:
            gamma = (U[3], U[4], U[5])
            q = attitude(chart, phi - phi_carry, gamma)
            chart = best_chart(middle)
            phi, phi_carry = angle_in(chart, q, gamma), 0.0
        phi, phi_carry = accumulate(phi, phi_carry, turn_rate(h, b, chart, J_inverse, Z))
        for k in range(6):
            low, high = 0.0, 0.0
            for i in range(s):
                low += b_low[i] * F[k, i]
                high += b[i] * F[k, i]
            U[k], carry[k] = accumulate(U[k], carry[k], h * (high + low))
        if step % every == 0 or step == n_steps:
            row += 1
            q_out[row, :] = attitude(chart, phi - phi_carry, (U[3], U[4], U[5]))
            L_out[row, :] = U[:3]
    return n_steps, work, change


@kernel
def add_low(A_low, h, F, U, D, Z):
    """Add what the rounding of A took from the stages: without it each step changes the energy by 1e-18 always the same way."""
    for k in range(6):
        for i in range(A_low.shape[0]):
            total = 0.0
            for j in range(A_low.shape[1]):
                total += A_low[i, j] * F[k, j]
            D[k, i] += h * total
            Z[k, i] = U[k] + D[k, i]


@kernel
def start(A, h, J_inverse, c, U, F, D, Z):
    """First guess of the stages: the rates at the start of the step held constant."""
    for k in range(6):
        Z[k, :] = U[k]
    rates(J_inverse, c, Z, F)
    stages_from(A, h, F, U, D, Z)
