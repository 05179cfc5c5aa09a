"""The steps of `reduced` for many bodies at once: every lane is a body of its own, all with one stage a step.

The functions of `reduced` are used as they are; what branches there, the end of Newton's iterations and what to do about an
untrusted answer, is a mask here. All lanes iterate until the last one is done. A lane that is not trusted is finished alone, by
`continue_branch`, and put back; its neighbours do not notice. A lane without a continuous solution becomes nan from there on.
"""

from __future__ import annotations

import math

from . import kernel, small
from .lanes_llvm import choose, every, fill_like, lane_of, load, save, true_in, with_lane
from .reduced import (
    FEW, NEAR, NEAR_ZERO, REST, SMOOTH, add_momentum, continue_branch, explicit_guess, extrapolate, final_correction,
    inverse_tangent, residual, turn_attitude,
)
from .vector import apply, cross, dot, subtract


@small
def solve(h, J, field, q, L, carry, guess, near, tolerance):
    """As `reduced.newton_solve`, with a mask of the lanes to trust; not to trust are those of which it is false."""
    a, iteration = guess, 0
    while True:
        rows = inverse_tangent(h, J, field, q, a)
        correction = apply(rows, residual(h, J, field, q, L, a))
        a = subtract(a, correction)
        square = dot(correction, correction)
        aa = dot(a, a) + REST
        near_enough = square <= tolerance * aa
        iteration += 1
        if iteration == FEW or every(near_enough):
            break
    away = subtract(a, guess)
    trusted = near_enough & (dot(away, away) <= near * aa + NEAR_ZERO) & (dot(rows[0], cross(rows[1], rows[2])) > 0.0)
    a, gain = final_correction(h, J, field, q, L, carry, rows, a)
    return a, gain, iteration + 1, trusted


@small
def pick(v, index):
    """One body's vector."""
    return (lane_of(v[0], index), lane_of(v[1], index), lane_of(v[2], index))


@small
def replace(v, index, x):
    """The vectors with one body's replaced."""
    return (with_lane(v[0], index, x[0]), with_lane(v[1], index, x[1]), with_lane(v[2], index, x[2]))


@small
def choose_vector(mask, a, b):
    """a or b for each body."""
    return (choose(mask, a[0], b[0]), choose(mask, a[1], b[1]), choose(mask, a[2], b[2]))


@small
def load3(array, n, first, width):
    """Three rows of an array (., n)."""
    return (load(array, first, width), load(array, first + n, width), load(array, first + 2 * n, width))


def _make_march(width):
    @kernel
    def finish_alone(h, J, J_inverse, q, L, carry, tolerance, a, gain, trusted):
        """Solve for the lanes that are not trusted, one by one."""
        for i in range(width):
            if not true_in(trusted, i):
                q1 = (lane_of(q[0], i), lane_of(q[1], i), lane_of(q[2], i), lane_of(q[3], i))
                found = continue_branch(
                    h, pick(J, i), pick(J_inverse, i), None, q1, pick(L, i), pick(carry, i), tolerance
                )
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
            past = (L_carry, L_carry, L_carry, L_carry, L_carry, L_carry)
            until_sample = every_step
            for step in range(1, n_steps + 1):
                enough = known >= 6.0
                if every(enough):
                    a = (extrapolate(0, past), extrapolate(1, past), extrapolate(2, past))
                else:
                    a = choose_vector(
                        enough,
                        (extrapolate(0, past), extrapolate(1, past), extrapolate(2, past)),
                        explicit_guess(h, J_inverse, None, q, L),
                    )
                a, gain, iterations, trusted = solve(h, J, None, q, L, L_carry, a, NEAR, tolerance)
                corrections += iterations
                if not every(trusted):
                    alone += 1
                    a, gain = finish_alone(h, J, J_inverse, q, L, L_carry, tolerance, a, gain, trusted)
                change = subtract(a, past[0])
                known = choose(dot(change, change) <= SMOOTH * dot(a, a), known + 1.0, zero)
                past = (a, past[0], past[1], past[2], past[3], past[4])
                L, L_carry = add_momentum(L, L_carry, gain)
                q, q_carry = turn_attitude(a, q, q_carry)
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
