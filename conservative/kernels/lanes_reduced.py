"""The steps of `reduced` for many bodies at once: every lane is a body of its own, all with one stage a step.

The functions of `reduced` are used as they are; what branches there, the end of Newton's iterations and what to do about an
untrusted answer, is a mask here. All lanes iterate until the last one is done. A lane that is not trusted is finished alone, by
`continue_branch`, and put back; its neighbours do not notice. A lane without a continuous solution becomes nan from there on.
"""

from __future__ import annotations

import math

import numpy as np

from . import kernel, small
from .lanes import choose, every, fill_like, lane_of, load, save, with_lane
from .reduced import (
    FEW,
    NEAR,
    NEAR_ZERO,
    REST,
    SMOOTH,
    add_momentum,
    continue_branch,
    explicit_guess,
    final_correction,
    residual,
)
from .vector import accumulate, apply, cross, dot, scale, subtract, times


@small
def choose_vector(mask, a, b):
    """a or b for each body."""
    return (choose(mask, a[0], b[0]), choose(mask, a[1], b[1]), choose(mask, a[2], b[2]))


@small
def tangent_and_determinant(J, a):
    """As `inverse_tangent` of a free body, with one over the determinant."""
    Ja = times(J, a)
    k0 = (J[0], a[2] * J[0] - Ja[2], Ja[1] - a[1] * J[0])
    k1 = (Ja[2] - a[2] * J[1], J[1], a[0] * J[1] - Ja[0])
    k2 = (a[1] * J[2] - Ja[1], Ja[0] - a[0] * J[2], J[2])
    k12 = cross(k1, k2)
    over = 1.0 / dot(k0, k12)
    return (scale(over, k12), scale(over, cross(k2, k0)), scale(over, cross(k0, k1))), over


@small
def solve(h, J, q, L, carry, guess, near, tolerance):
    """As `reduced.newton_solve`, with a mask of the lanes to trust.

    Almost always one correction is enough for all, and there is no other branch. A lane that is done is left as it is while
    others go on: its result does not depend on its neighbours. After one correction the answer is as near to the guess as the
    correction is small.
    """
    rows, over = tangent_and_determinant(J, guess)
    correction = apply(rows, residual(h, J, None, q, L, guess))
    a = subtract(guess, correction)
    enough = dot(correction, correction) <= tolerance * (dot(a, a) + REST)
    iterations, close = 1, enough
    while iterations < FEW and not every(enough):
        new_rows, new_over = tangent_and_determinant(J, a)
        correction = apply(new_rows, residual(h, J, None, q, L, a))
        a = choose_vector(enough, a, subtract(a, correction))
        rows = (
            choose_vector(enough, rows[0], new_rows[0]),
            choose_vector(enough, rows[1], new_rows[1]),
            choose_vector(enough, rows[2], new_rows[2]),
        )
        over = choose(enough, over, new_over)
        aa, away = dot(a, a) + REST, subtract(a, guess)
        enough = enough | (dot(correction, correction) <= tolerance * aa)
        close = dot(away, away) <= near * aa + NEAR_ZERO
        iterations += 1
    a, gain = final_correction(h, J, None, q, L, carry, rows, a)
    return a, gain, iterations + 1, enough & close & (over > 0.0)


@small
def turn(a, q, carry):
    """As `turn_attitude`, without products by zero."""
    square = dot(a, a)
    root = math.sqrt(1.0 + square)
    c = -square / (root * (1.0 + root))
    p0 = -(q[1] * a[0] + q[2] * a[1] + q[3] * a[2])
    p1 = q[0] * a[0] + (q[2] * a[2] - q[3] * a[1])
    p2 = q[0] * a[1] + (q[3] * a[0] - q[1] * a[2])
    p3 = q[0] * a[2] + (q[1] * a[1] - q[2] * a[0])
    w, cw = accumulate(q[0], carry[0], p0 + c * (q[0] + p0))
    x, cx = accumulate(q[1], carry[1], p1 + c * (q[1] + p1))
    y, cy = accumulate(q[2], carry[2], p2 + c * (q[2] + p2))
    z, cz = accumulate(q[3], carry[3], p3 + c * (q[3] + p3))
    return (w, x, y, z), (cw, cx, cy, cz)


@small
def pick(v, index):
    """One body's vector."""
    return (lane_of(v[0], index), lane_of(v[1], index), lane_of(v[2], index))


@small
def replace(v, index, x):
    """The vectors with one body's replaced."""
    return (with_lane(v[0], index, x[0]), with_lane(v[1], index, x[1]), with_lane(v[2], index, x[2]))


@small
def extrapolate_ring(ring, first, width, newest):
    """As `extrapolate` for all components: the second newest (3 vectors) is at `first`, older ones follow."""
    step = 3 * width
    b, c, d = (
        load3(ring, width, first, width),
        load3(ring, width, first + step, width),
        load3(ring, width, first + 2 * step, width),
    )
    e, f = load3(ring, width, first + 3 * step, width), load3(ring, width, first + 4 * step, width)
    return (
        ((20.0 * c[0] - 15.0 * (b[0] + d[0])) + (6.0 * e[0] - f[0])) + 6.0 * newest[0],
        ((20.0 * c[1] - 15.0 * (b[1] + d[1])) + (6.0 * e[1] - f[1])) + 6.0 * newest[1],
        ((20.0 * c[2] - 15.0 * (b[2] + d[2])) + (6.0 * e[2] - f[2])) + 6.0 * newest[2],
    )


@small
def load3(array, n, first, width):
    """Three rows of an array (., n)."""
    return (load(array, first, width), load(array, first + n, width), load(array, first + 2 * n, width))


def _make_march(width):
    @kernel
    def finish_alone(h, J, J_inverse, q, L, carry, tolerance, a, gain, trusted):
        """Solve for the lanes that are not trusted, one by one."""
        flags = choose(trusted, fill_like(1.0, a[0]), fill_like(0.0, a[0]))
        for i in range(width):
            if lane_of(flags, i) == 0.0:
                q1 = (lane_of(q[0], i), lane_of(q[1], i), lane_of(q[2], i), lane_of(q[3], i))
                found = continue_branch(h, pick(J, i), pick(J_inverse, i), None, q1, pick(L, i), pick(carry, i), tolerance)
                if found[4]:
                    a, gain = replace(a, i, found[0]), replace(gain, i, found[1])
                else:
                    a = replace(a, i, (math.nan, math.nan, math.nan))
                    gain = a
        return a, gain

    @kernel
    def march_lanes(h, tolerance, moments, states, n_steps, every_step, out):
        """moments (6, n): J and 1/J; states (7, n): q and L; out (blocks, samples, 7, width). Returns what was done alone."""
        n = moments.shape[1]
        tolerance = tolerance ** (2.0 / 3.0)
        flat, state_flat, out_flat = moments.reshape(-1), states.reshape(-1), out.reshape(-1)
        samples, alone, corrections = out.shape[1], 0, 0
        ring = np.zeros(30 * width)
        for block in range(n // width):
            i = block * width
            J, J_inverse = load3(flat, n, i, width), load3(flat, n, i + 3 * n, width)
            q123 = load3(state_flat, n, i, width)
            q = (q123[0], q123[1], q123[2], load(state_flat, i + 3 * n, width))
            L = load3(state_flat, n, i + 4 * n, width)
            zero = fill_like(0.0, L[0])
            q_carry, L_carry = (zero, zero, zero, zero), (zero, zero, zero)
            to = block * samples * 7 * width
            for j in range(4):
                save(out_flat, to + j * width, q[j])
            for j in range(3):
                save(out_flat, to + (4 + j) * width, L[j])
            known = zero
            newest, place = L_carry, 0
            until_sample = every_step
            for step in range(1, n_steps + 1):
                enough = known >= 6.0
                if every(enough):
                    a = extrapolate_ring(ring, place * 3 * width, width, newest)
                else:
                    a = choose_vector(
                        enough,
                        extrapolate_ring(ring, place * 3 * width, width, newest),
                        explicit_guess(h, J_inverse, None, q, L),
                    )
                a, gain, iterations, trusted = solve(h, J, q, L, L_carry, a, NEAR, tolerance)
                corrections += iterations
                if not every(trusted):
                    alone += 1
                    a, gain = finish_alone(h, J, J_inverse, q, L, L_carry, tolerance, a, gain, trusted)
                change = subtract(a, newest)
                place = place - 1 if place > 0 else 4
                for j in range(3):
                    save(ring, (3 * place + j) * width, newest[j])
                    save(ring, (3 * place + 15 + j) * width, newest[j])
                newest = a
                known = choose(dot(change, change) <= SMOOTH * dot(a, a), known + 1.0, zero)
                L, L_carry = add_momentum(L, L_carry, gain)
                q, q_carry = turn(a, q, q_carry)
                until_sample -= 1
                if until_sample == 0 or step == n_steps:
                    until_sample = every_step
                    to += 7 * width
                    for j in range(4):
                        save(out_flat, to + j * width, q[j])
                    for j in range(3):
                        save(out_flat, to + (4 + j) * width, L[j])
        return alone, corrections

    return march_lanes


march_four, march_eight = _make_march(4), _make_march(8)
