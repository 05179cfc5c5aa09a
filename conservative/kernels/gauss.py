"""Gauss collocation for a body with a fixed point in uniform gravity or without a field.

Unknowns are the momentum L and the vertical gamma = R' e_z, both in principal axes (for a free body gamma is the direction of
the world momentum): a closed system of six with quadratic invariants only,

    L' = L x w + gamma x c,    gamma' = gamma x w,    w = J^-1 L,

energy L.w/2 + c.gamma, L.gamma and gamma.gamma, which collocation at Gauss points keeps whatever the step. What is left of the
attitude is one angle about the vertical, a quadrature. With the minimal rotation M that takes gamma to a unit vector a fixed in
the body, and a constant rotation C that takes a to e_z,

    R = Rz(phi) C M(gamma),    phi' = w.(gamma + a) / (1 + gamma.a),    R1 = Rz(phi1 - phi0) R0 M(gamma0)' M(gamma1).

Each step has its own a, the gamma at its middle: the divisor stays near 2, and nothing depends on the axes of the body or the
direction of time. The kernel works in units that make L of size one.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .protocol import Result, Workspace, find_ends, loosen
from .signals import call_handlers
from .simd import LANES, four, fuse, lane, larger_size, put, splat, spread
from .vector import accumulate, add, cross, dot, product, scale, subtract, vertical

FAILURE = "no continuous solution"
"""Why a step fails."""
PAUSE = 2**13
"""Sweeps between two calls of handlers of signals; a correction by Newton's method counts as NEWTON of them."""
NEWTON = 100
MAX_SWEEPS = 120
MAX_NEWTON = 25
ROUND_OFF = 2e-17
STAGNATION = 2e-15
SLOWEST = 0.8
"""Newton takes over when two sweeps shrink the change by less than this factor; its step costs as much as a hundred sweeps."""
FEW, NEAR = 6, 0.25
"""Newton is trusted with at most FEW corrections that lead no further than NEAR from the guess; L is of size one."""
SHORTEST_PART = 2.0**-14
"""Part of a step below which the continuous branch of its solution counts as ended."""
LONGEST = 2.0**64
"""Length at which a quaternion is divided by this power of two, which rounds nothing."""


class Model(NamedTuple):
    """The closed system, principal axes, with momenta in units of `unit` kg m^2/s.

    1/J and the moment c of the field in these units, L and gamma at the start, the attitude q there against axes whose third
    is along gamma, and `left`, which takes those axes to the world's.
    """

    unit: float
    J_inverse: Any
    moment: Any
    L: Any
    gamma: Any
    q: Any
    left: Any


class Coefficients(NamedTuple):
    """Number of stages s; A, E by columns, b and its low part, padded with zeros to a multiple of four stages; step h, s."""

    s: int
    A: Any
    E: Any
    b: Any
    b_low: Any
    h: float


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
            d0 = fuse(a, spread(F, j), d0)
            d1 = fuse(a, spread(F, width + j), d1)
            d2 = fuse(a, spread(F, 2 * width + j), d2)
            d3 = fuse(a, spread(F, 3 * width + j), d3)
            d4 = fuse(a, spread(F, 4 * width + j), d4)
            d5 = fuse(a, spread(F, 5 * width + j), d5)
        change = store_increments(h * d0, U[0], D, Z, i, change)
        change = store_increments(h * d1, U[1], D, Z, width + i, change)
        change = store_increments(h * d2, U[2], D, Z, 2 * width + i, change)
        change = store_increments(h * d3, U[3], D, Z, 3 * width + i, change)
        change = store_increments(h * d4, U[4], D, Z, 4 * width + i, change)
        change = store_increments(h * d5, U[5], D, Z, 5 * width + i, change)
    return max(max(lane(change, 0), lane(change, 1)), max(lane(change, 2), lane(change, 3)))


@kernel
def store_increments(d, u, D, Z, i, change):
    """Store four increments d and the states u + d; return the largest change so far."""
    change = larger_size(d - four(D, i), change)
    put(D, i, d)
    put(Z, i, splat(u) + d)
    return change


@kernel
def sweep_stages(A, s, h, J_inverse, c, U, F, D, Z):
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
def newton_solve(A, s, h, J_inverse, c, U, F, D, Z):
    """Solve the same equations by Newton from the D and Z given; return (iterations, last change, success, branch).

    The last is whether the determinant of the tangent is positive: it is for h = 0, and zero where the continuous branch ends.
    """
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
            return iteration, change, True, np.linalg.slogdet(tangent)[0] > 0.0
        before = change
    return MAX_NEWTON, before, False, False


@kernel
def continue_branch(A, s, h, J_inverse, c, U, F, D, Z):
    """Solve by Newton along the branch D(h) from D(0) = 0, in parts of h as long as can be; return (iterations, size, success).

    A part is trusted where its few corrections lead not far away from a guess in line with the last two. Where the branch ends
    before h, the size is not of a correction but the residual of the whole step there.
    """
    found, before = np.zeros_like(D), np.zeros_like(D)
    reached, earlier, part, work = 0.0, 0.0, 1.0, 0
    while part >= SHORTEST_PART:
        aim = min(reached + part, 1.0)
        if reached > 0.0:
            D[:] = found + (aim - reached) / (reached - earlier) * (found - before)
            place_stages(U, D, Z)
        else:
            guess_stages(A, s, aim * h, J_inverse, c, U, F, D, Z)
        guess = D.copy()
        corrections, change, good, positive = newton_solve(A, s, aim * h, J_inverse, c, U, F, D, Z)
        work += corrections
        if not (good and positive and corrections <= FEW and np.abs(D - guess).max() <= NEAR):
            part *= 0.5
        elif aim == 1.0:
            return work, change, True
        else:
            before, found, earlier, reached, part = found, D.copy(), reached, aim, 2.0 * part
    D[:] = found
    place_stages(U, D, Z)
    rates(J_inverse, c, Z, F)
    return work, stages_from(A, s, h, F, U, D, Z), False


@kernel
def place_stages(U, D, Z):
    """Z = U + D"""
    width = Z.shape[0] // 6
    for k in range(6):
        Z[k * width : (k + 1) * width] = U[k] + D[k * width : (k + 1) * width]


@kernel
def find_solution(A, s, h, J_inverse, c, U, F, D, Z):
    """Whether Newton's method from an explicit Euler guess ends at a solution of the equations, whichever."""
    guess_stages(A, s, h, J_inverse, c, U, F, D, Z)
    return newton_solve(A, s, h, J_inverse, c, U, F, D, Z)[2]


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


@small
def middle(s, Z):
    """A vector along gamma at the middle of the step: that of the stage there, or the mean of the two next to it."""
    width = Z.shape[0] // 6
    i, j = 3 * width + (s - 1) // 2, 3 * width + s // 2
    return (0.5 * (Z[i] + Z[j]), 0.5 * (Z[width + i] + Z[width + j]), 0.5 * (Z[2 * width + i] + Z[2 * width + j]))


@small
def carry_attitude(q, carry, a, size, g0, g1):
    """A quaternion, longer than q, of R M(g0)' M(g1), as a compensated sum; a is of length `size`.

    With a of unit length the quaternion of M(g0)' M(g1) is along (1 + g0.a + g1.a + g0.g1, (g1 - g0) x (g0 + a)).
    """
    v = cross(subtract(g1, g0), add(scale(size, g0), a))
    v = scale(1.0 / (size + dot(add(g0, g1), a) + size * dot(g0, g1)), v)
    d = product(q, (0.0, v[0], v[1], v[2]))
    w, cw = accumulate(q[0], carry[0], d[0])
    x, cx = accumulate(q[1], carry[1], d[1])
    y, cy = accumulate(q[2], carry[2], d[2])
    z, cz = accumulate(q[3], carry[3], d[3])
    if max(max(abs(w), abs(x)), max(abs(y), abs(z))) > LONGEST:
        s = 1.0 / LONGEST
        return (s * w, s * x, s * y, s * z), (s * cw, s * cx, s * cy, s * cz)
    return (w, x, y, z), (cw, cx, cy, cz)


@small
def minimal_rotation(g, a):
    """Quaternion, not normalised, of the minimal rotation that takes the unit vector g to a."""
    n = cross(g, a)
    return (1.0 + dot(g, a), n[0], n[1], n[2])


@kernel
def attitude(left, phi, q, gamma):
    """Quaternion, not normalised, of Rz(phi) R turned by `left`, R of q but for round-off: that which takes gamma to e_z."""
    z = product(left, (math.cos(0.5 * phi), 0.0, 0.0, math.sin(0.5 * phi)))
    return product(z, product(q, minimal_rotation(gamma, vertical(q))))


@kernel
def integrate_turn(h, b, a, size, J_inverse, Z):
    """Integral of phi' over the step; a is of length `size`."""
    width = Z.shape[0] // 6
    total = splat(0.0)
    for i in range(0, width, LANES):
        w = (J_inverse[0] * four(Z, i), J_inverse[1] * four(Z, width + i), J_inverse[2] * four(Z, 2 * width + i))
        g = (four(Z, 3 * width + i), four(Z, 4 * width + i), four(Z, 5 * width + i))
        above = w[0] * (size * g[0] + splat(a[0])) + w[1] * (size * g[1] + splat(a[1])) + w[2] * (size * g[2] + splat(a[2]))
        total = total + four(b, i) * above / (splat(size) + (a[0] * g[0] + a[1] * g[1] + a[2] * g[2]))
    return h * sum_lanes(total)


@kernel
def sum_lanes(v):
    """Sum of four floats."""
    return (lane(v, 0) + lane(v, 2)) + (lane(v, 1) + lane(v, 3))


@kernel
def advance(h, b, b_low, F, U, carry):
    """U += h sum_j b_j F_j, compensated."""
    width = F.shape[0] // 6
    for k in range(6):
        total = splat(0.0)
        for i in range(0, width, LANES):
            total = fuse(four(b_low, i), four(F, k * width + i), total)
        for i in range(0, width, LANES):
            total = fuse(four(b, i), four(F, k * width + i), total)
        U[k], carry[k] = accumulate(U[k], carry[k], h * sum_lanes(total))


@kernel
def guess_stages(A, s, h, J_inverse, c, U, F, D, Z):
    """First guess of the stages: the rates at the start of the step held constant."""
    width = Z.shape[0] // 6
    for k in range(6):
        Z[k * width : (k + 1) * width] = U[k]
    rates(J_inverse, c, Z, F)
    stages_from(A, s, h, F, U, D, Z)


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`).

    A step fails where it has no solution on the continuous branch; the size then is the residual where the branch ends.
    """
    unit, J_inverse, c, L0, gamma0, q0, left = model
    s, A, E, b, b_low, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    width = b.shape[0]
    U, carry = np.empty(6), np.zeros(6)
    for k in range(3):
        U[k], U[3 + k] = L0[k], gamma0[k]
    F, D, Z = np.empty(6 * width), np.zeros(6 * width), np.empty(6 * width)
    q, q_carry, gamma, phi, phi_carry = q0, (0.0, 0.0, 0.0, 0.0), gamma0, 0.0, 0.0
    store(0, left, phi, q, gamma, unit, U, q_out, L_out)
    row, work, change, until_pause = 0, 0, 0.0, pause
    for step in range(1, n_steps + 1):
        if step == 1:
            guess_stages(A, s, h, J_inverse, c, U, F, D, Z)
        else:
            stages_from(E, s, h, F, U, D, Z)
        sweeps, change, good = sweep_stages(A, s, h, J_inverse, c, U, F, D, Z)
        work += sweeps
        if not good:
            corrections, change, good = continue_branch(A, s, h, J_inverse, c, U, F, D, Z)
            work += corrections
            until_pause -= NEWTON * corrections
            if not good:
                elsewhere = find_solution(A, s, h, J_inverse, c, U, F, D, Z)
                return Result(step - 1, (step - 1) * s, work, None, change, elsewhere)
        rates(J_inverse, c, Z, F)
        a = middle(s, Z)
        size = math.sqrt(dot(a, a))
        phi, phi_carry = accumulate(phi, phi_carry, integrate_turn(h, b, a, size, J_inverse, Z))
        advance(h, b, b_low, F, U, carry)
        before, gamma = gamma, (U[3], U[4], U[5])
        q, q_carry = carry_attitude(q, q_carry, a, size, before, gamma)
        if step % every == 0 or step == n_steps:
            row += 1
            store(row, left, phi - phi_carry, q, gamma, unit, U, q_out, L_out)
        until_pause -= sweeps
        if until_pause <= 0 < pause:
            until_pause = pause
            call_handlers()
    return Result(n_steps, n_steps * s, work, None, change, False)


MODEL_END, COEFFICIENTS_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    return loosen(march(model, coefficients, Workspace(*loose[COEFFICIENTS_END:])))


@kernel
def store(row, left, phi, q, gamma, unit, U, q_out, L_out):
    """Write a state."""
    q_out[row, :] = attitude(left, phi, q, gamma)
    for k in range(3):
        L_out[row, k] = unit * U[k]
