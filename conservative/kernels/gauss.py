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
from .simd import LANES, four, fused, larger_size, place, put, splat, spread
from .vector import accumulate, cross, dot, product

MAX_SWEEPS = 120
MAX_NEWTON = 25
ROUND_OFF = 2e-17
STAGNATION = 2e-15
SLOWEST = 0.8
"""Pairs of sweeps that gain less than this are left for Newton, whose step costs as much as a hundred sweeps."""

# Chart k + 3 (s < 0) has a = s e_k; the quaternion is that of the constant rotation C.
_R = math.sqrt(0.5)
CHART_AXES = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]])
CHART_TURNS = np.array([[_R, 0, -_R, 0], [_R, _R, 0, 0], [1, 0, 0, 0], [_R, 0, _R, 0], [_R, -_R, 0, 0], [0, 1, 0, 0]])
KEPT_CHART = 0.5
"""A chart is kept while gamma.a is above this at the middle of the step; the best of six has 0.577 at least."""


@kernel
def rates(J_inverse, c, Z, F):
    """F = (L', gamma') at the states Z: both (6, width) in one dimension, width a multiple of four."""
    width = Z.shape[0] // 6
    for i in range(0, width, LANES):
        L = (four(Z, i), four(Z, width + i), four(Z, 2 * width + i))
        g = (four(Z, 3 * width + i), four(Z, 4 * width + i), four(Z, 5 * width + i))
        w = (J_inverse[0] * L[0], J_inverse[1] * L[1], J_inverse[2] * L[2])
        L_rate = cross(L, w)
        g_rate = cross(g, w)
        put(F, i, L_rate[0] + (c[2] * g[1] - c[1] * g[2]))
        put(F, width + i, L_rate[1] + (c[0] * g[2] - c[2] * g[0]))
        put(F, 2 * width + i, L_rate[2] + (c[1] * g[0] - c[0] * g[1]))
        put(F, 3 * width + i, g_rate[0])
        put(F, 4 * width + i, g_rate[1])
        put(F, 5 * width + i, g_rate[2])


@kernel
def stages_from(A, s, h, F, U, D, Z):
    """D = h F A' and Z = U + D; return the largest change of D. A is (stages, width), column j of the matrix in row j."""
    width = Z.shape[0] // 6
    change = splat(0.0)
    for i in range(0, width, LANES):
        d0 = d1 = d2 = d3 = d4 = d5 = splat(0.0)
        for j in range(s):
            a = four(A, j * width + i)
            d0 = fused(a, spread(F, j), d0)
            d1 = fused(a, spread(F, width + j), d1)
            d2 = fused(a, spread(F, 2 * width + j), d2)
            d3 = fused(a, spread(F, 3 * width + j), d3)
            d4 = fused(a, spread(F, 4 * width + j), d4)
            d5 = fused(a, spread(F, 5 * width + j), d5)
        change = placed(h * d0, U[0], D, Z, i, change)
        change = placed(h * d1, U[1], D, Z, width + i, change)
        change = placed(h * d2, U[2], D, Z, 2 * width + i, change)
        change = placed(h * d3, U[3], D, Z, 3 * width + i, change)
        change = placed(h * d4, U[4], D, Z, 4 * width + i, change)
        change = placed(h * d5, U[5], D, Z, 5 * width + i, change)
    return max(max(place(change, 0), place(change, 1)), max(place(change, 2), place(change, 3)))


@kernel
def placed(d, u, D, Z, i, change):
    """Store four increments d and the states u + d; return the largest change so far."""
    change = larger_size(d - four(D, i), change)
    put(D, i, d)
    put(Z, i, splat(u) + d)
    return change


@kernel
def swept(A, s, h, J_inverse, c, U, F, D, Z):
    """Iterate D = h A f(U + D) to stagnation; return (sweeps, last change, success)."""
    before = earlier = math.inf
    for sweep in range(1, MAX_SWEEPS + 1):
        rates(J_inverse, c, Z, F)
        change = stages_from(A, s, h, F, U, D, Z)
        ratio = change / before if sweep > 1 else 1.0
        if (ratio < 0.9 and change * ratio <= ROUND_OFF * (1.0 - ratio)) or (ratio >= 0.5 and change < STAGNATION):
            return sweep, change, True
        # Eigenvalues of the iteration come in pairs that beat, so one sweep alone says little.
        if sweep > 4 and not change < SLOWEST * earlier:
            return sweep, change, False
        earlier, before = before, change
    return MAX_SWEEPS, before, False


@kernel
def newton(A, s, h, J_inverse, c, U, F, D, Z):
    """Solve the same equations by Newton from an explicit Euler guess; return (iterations, last change, success)."""
    width = Z.shape[0] // 6
    states, slopes, increments, matrix = (
        Z.reshape((6, width)),
        F.reshape((6, width)),
        D.reshape((6, width)),
        A.reshape((s, width)),
    )
    tangent = np.empty((6 * s, 6 * s))
    residual = np.empty(6 * s)
    block = np.empty((6, 6))
    before = math.inf
    for iteration in range(1, MAX_NEWTON + 1):
        rates(J_inverse, c, Z, F)
        for j in range(s):
            tangent_block(J_inverse, c, states[:, j], block)
            for k in range(6):
                total = 0.0
                for m in range(s):
                    total += matrix[m, j] * slopes[k, m]
                residual[6 * j + k] = h * total - increments[k, j]
                for i in range(s):
                    for n in range(6):
                        tangent[6 * i + k, 6 * j + n] = (1.0 if i == j and k == n else 0.0) - h * matrix[j, i] * block[k, n]
        correction = np.linalg.solve(tangent, residual)
        change = 0.0
        for j in range(s):
            for k in range(6):
                increments[k, j] += correction[6 * j + k]
                states[k, j] = U[k] + increments[k, j]
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
def turned(h, b, chart, J_inverse, Z):
    """Integral of phi' over the step."""
    width = Z.shape[0] // 6
    a = (CHART_AXES[chart, 0], CHART_AXES[chart, 1], CHART_AXES[chart, 2])
    total = splat(0.0)
    for i in range(0, width, LANES):
        w = (J_inverse[0] * four(Z, i), J_inverse[1] * four(Z, width + i), J_inverse[2] * four(Z, 2 * width + i))
        g = (four(Z, 3 * width + i), four(Z, 4 * width + i), four(Z, 5 * width + i))
        top = w[0] * (g[0] + splat(a[0])) + w[1] * (g[1] + splat(a[1])) + w[2] * (g[2] + splat(a[2]))
        total = total + four(b, i) * top / (splat(1.0) + (a[0] * g[0] + a[1] * g[1] + a[2] * g[2]))
    return h * summed(total)


@kernel
def summed(v):
    """Sum of four floats."""
    return (place(v, 0) + place(v, 2)) + (place(v, 1) + place(v, 3))


@kernel
def advance(h, b, b_low, F, U, carry):
    """U += h sum_j b_j F_j, compensated."""
    width = F.shape[0] // 6
    for k in range(6):
        total = splat(0.0)
        for i in range(0, width, LANES):
            total = fused(four(b_low, i), four(F, k * width + i), total)
        for i in range(0, width, LANES):
            total = fused(four(b, i), four(F, k * width + i), total)
        U[k], carry[k] = accumulate(U[k], carry[k], h * summed(total))


@kernel
def start(A, s, h, J_inverse, c, U, F, D, Z):
    """First guess of the stages: the rates at the start of the step held constant."""
    width = Z.shape[0] // 6
    for k in range(6):
        Z[k * width : (k + 1) * width] = U[k]
    rates(J_inverse, c, Z, F)
    stages_from(A, s, h, F, U, D, Z)


@kernel
def march(s, A, E, b, b_low, h, n_steps, every, J_inverse, c, L0, gamma0, q_out, L_out):
    """Take n_steps steps of h s and store attitude and momentum of every `every`-th and the last.

    Returns (steps done, sweeps and Newton corrections, size of the last change); steps done < n_steps means that the next one
    did not converge. Coefficients come with their stages filled up with zeros to a multiple of four.
    """
    width = b.shape[0]
    U, carry = np.empty(6), np.zeros(6)
    for k in range(3):
        U[k], U[3 + k] = L0[k], gamma0[k]
    F, D, Z = np.empty(6 * width), np.zeros(6 * width), np.empty(6 * width)
    chart = best_chart(gamma0)
    phi, phi_carry = 0.0, 0.0
    q_out[0, :] = attitude(chart, phi, gamma0)
    L_out[0, :] = L0
    row, work, change = 0, 0, 0.0
    for step in range(1, n_steps + 1):
        if step == 1:
            start(A, s, h, J_inverse, c, U, F, D, Z)
        else:
            stages_from(E, s, h, F, U, D, Z)
        sweeps, change, good = swept(A, s, h, J_inverse, c, U, F, D, Z)
        work += sweeps
        if not good:
            start(A, s, h, J_inverse, c, U, F, D, Z)
            corrections, change, good = newton(A, s, h, J_inverse, c, U, F, D, Z)
            work += corrections
            if not good:
                return step - 1, work, change
        rates(J_inverse, c, Z, F)
        m = 3 * width + s // 2
        middle = (Z[m], Z[m + width], Z[m + 2 * width])
        if dot(middle, (CHART_AXES[chart, 0], CHART_AXES[chart, 1], CHART_AXES[chart, 2])) < KEPT_CHART:
            gamma = (U[3], U[4], U[5])
            q = attitude(chart, phi - phi_carry, gamma)
            chart = best_chart(middle)
            phi, phi_carry = angle_in(chart, q, gamma), 0.0
        phi, phi_carry = accumulate(phi, phi_carry, turned(h, b, chart, J_inverse, Z))
        advance(h, b, b_low, F, U, carry)
        if step % every == 0 or step == n_steps:
            row += 1
            q_out[row, :] = attitude(chart, phi - phi_carry, (U[3], U[4], U[5]))
            L_out[row, :] = U[:3]
    return n_steps, work, change
