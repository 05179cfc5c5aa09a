"""The steps of `reduced` for many bodies at once, each a lane with a field and moments of its own: same arithmetic, one loop.

All lanes take the same steps. A lane whose solution is not trusted is solved for alone, as one body is; one that has none on
the continuous branch is stopped, and left to whoever runs it again. Neither changes a bit of its neighbours' results.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .fields import Uniform
from .lanes_llvm import choose, every, fill_like, lane_of, load, save, with_lane
from .reduced import NEAR, SMOOTH, add_momentum, continue_branch, explicit_guess, guess_ahead, newton_solve, turn_attitude
from .vector import choose_vector, dot, subtract

WIDTH = 8
"""Bodies at a time: two registers of four, so that a processor works on one while the other waits."""
PAST = 5
"""Older solutions that are kept beside the newest, for the guess of the next."""
ROWS = 33
"""Numbers of a body's state."""


class State(NamedTuple):
    """Where bodies are: attitude and momentum with what their sums lost, the newest solution, and how many before it fit on."""

    q: Any
    q_carry: Any
    L: Any
    L_carry: Any
    newest: Any
    known: Any


@entry
def start(q, L, states, q_out, L_out):
    """Fill the states (ROWS, m) of n bodies that start at attitudes q (n, 4) with momenta L (n, 3), and their first samples."""
    states[:] = 0.0
    q_out[:, 0] = q
    L_out[:, 0] = L
    for i in range(states.shape[1]):
        body = min(i, len(q) - 1)
        for k in range(4):
            states[k, i] = q[body, k]
        for k in range(3):
            states[8 + k, i] = L[body, k]


@small
def load3(array, first, n):
    """Lanes of three rows, n apart."""
    return load(array, first, WIDTH), load(array, first + n, WIDTH), load(array, first + 2 * n, WIDTH)


@small
def load4(array, first, n):
    """Lanes of four rows, n apart."""
    a, b, c = load3(array, first, n)
    return a, b, c, load(array, first + 3 * n, WIDTH)


@small
def load_state(states, first, n):
    """The state of the bodies from number `first` on, without their older solutions."""
    return State(
        load4(states, first, n),
        load4(states, first + 4 * n, n),
        load3(states, first + 8 * n, n),
        load3(states, first + 11 * n, n),
        load3(states, first + 14 * n, n),
        load(states, first + 17 * n, WIDTH),
    )


@small
def save_rows(array, first, n, vector):
    """Store lanes in rows, n apart."""
    for k in range(len(vector)):
        save(array, first + k * n, vector[k])


@small
def save_state(states, first, n, state):
    """What `load_state` loads."""
    save_rows(states, first, n, state.q)
    save_rows(states, first + 4 * n, n, state.q_carry)
    save_rows(states, first + 8 * n, n, state.L)
    save_rows(states, first + 11 * n, n, state.L_carry)
    save_rows(states, first + 14 * n, n, state.newest)
    save(states, first + 17 * n, state.known)


@small
def load_past(ring, place, newest):
    """The last six solutions, newest first: one and, from a place of the ring on, five."""
    at, one = 3 * place * WIDTH, 3 * WIDTH
    return (
        newest,
        load3(ring, at, WIDTH),
        load3(ring, at + one, WIDTH),
        load3(ring, at + 2 * one, WIDTH),
        load3(ring, at + 3 * one, WIDTH),
        load3(ring, at + 4 * one, WIDTH),
    )


@small
def push(ring, place, a):
    """Store a as the newest of the ring, twice, so that five in a row are there from any place; return its place."""
    place = place - 1 if place > 0 else PAST - 1
    save_rows(ring, 3 * place * WIDTH, WIDTH, a)
    save_rows(ring, 3 * (place + PAST) * WIDTH, WIDTH, a)
    return place


@small
def pick3(v, i):
    """One body's vector."""
    return lane_of(v[0], i), lane_of(v[1], i), lane_of(v[2], i)


@small
def put3(v, i, x):
    """The vectors, one body's replaced."""
    return with_lane(v[0], i, x[0]), with_lane(v[1], i, x[1]), with_lane(v[2], i, x[2])


@kernel
def solve_alone(h, J, J_inverse, field, state, tolerance, a, gain, trusted, finished, first):
    """Solve for the lanes that are not trusted, one by one; return their solutions, gains, and momenta.

    A body without a solution is brought to rest, where it needs no further work, and noted in `finished`.
    """
    q, L, L_carry = state.q, state.L, state.L_carry
    flags = choose(trusted, fill_like(1.0, h * a[0]), fill_like(0.0, h * a[0]))
    for i in range(WIDTH):
        if lane_of(flags, i) == 0.0:
            of_one = None if field is None else Uniform(lane_of(field.x, i), lane_of(field.y, i), lane_of(field.z, i))
            q_one, L_one, carry = (*pick3(q, i), lane_of(q[3], i)), pick3(L, i), pick3(L_carry, i)
            found = continue_branch(h, pick3(J, i), pick3(J_inverse, i), of_one, q_one, L_one, carry, tolerance)
            if found[4]:
                a, gain = put3(a, i, found[0]), put3(gain, i, found[1])
            else:
                rest = (0.0, 0.0, 0.0)
                finished[first + i] = False
                a, gain, L, L_carry = put3(a, i, rest), put3(gain, i, rest), put3(L, i, rest), put3(L_carry, i, rest)
    return a, gain, L, L_carry


@small
def aligned(size):
    """Room for numbers that begins where a line of the cache does: a load across two lines costs two."""
    room = np.empty(size + 8)
    first = (-room.ctypes.data // 8) % 8
    return room[first : first + size]


@kernel
def march(lengths, tolerance, moments, moment, states, done, last, n_steps, every_step, q_out, L_out, finished):
    """Take the steps after `done` up to `last` of n_steps: of all bodies, WIDTH at a time.

    lengths (stages,) are those of a step, s; moments (6, n) the principal moments, kg m^2, and their inverses, moment (3, n)
    that of uniform gravity, N m, or None; states (ROWS, n). Samples of the first bodies go to q_out (., samples, 4) and L_out
    (., samples, 3), and `finished` (n,) is made False where a body has no solution.
    """
    n, stages = moments.shape[1], len(lengths)
    tolerance = tolerance ** (2.0 / 3.0)
    all_moments, all_states = moments.reshape(-1), states.reshape(-1)
    ring, room = aligned(3 * 2 * PAST * WIDTH), aligned(7 * WIDTH)
    for i in range(0, n, WIDTH):
        J, J_inverse = load3(all_moments, i, n), load3(all_moments, i + 3 * n, n)
        if moment is None:
            field = None
        else:
            f = load3(moment.reshape(-1), i, n)
            field = Uniform(f[0], f[1], f[2])
        state = load_state(all_states, i, n)
        for k in range(3 * PAST):
            older = load(all_states, i + (18 + k) * n, WIDTH)
            save(ring, k * WIDTH, older)
            save(ring, (k + 3 * PAST) * WIDTH, older)
        place, row = 0, done // every_step
        until_sample = every_step - done % every_step
        zero = fill_like(0.0, state.known)
        q, q_carry, L, L_carry, newest, known = state
        for step in range(done + 1, last + 1):
            for stage in range(stages):
                h = lengths[stage]
                enough = known >= 6.0
                if every(enough):
                    a = guess_ahead(load_past(ring, place, newest))
                else:
                    a = choose_vector(
                        enough, guess_ahead(load_past(ring, place, newest)), explicit_guess(h, J_inverse, field, q, L)
                    )
                a, gain, _, _, trusted = newton_solve(h, J, field, q, L, L_carry, a, NEAR, tolerance)
                if not every(trusted):
                    state = State(q, q_carry, L, L_carry, newest, known)
                    a, gain, L, L_carry = solve_alone(h, J, J_inverse, field, state, tolerance, a, gain, trusted, finished, i)
                    known = choose(trusted, known, zero)
                if stages == 1:
                    change = subtract(a, newest)
                    place = push(ring, place, newest)
                    newest = a
                    known = choose(dot(change, change) <= SMOOTH * dot(a, a), known + 1.0, zero)
                L, L_carry = add_momentum(L, L_carry, gain)
                q, q_carry = turn_attitude(a, q, q_carry)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every_step
                row += 1
                save_rows(room, 0, WIDTH, q)
                save_rows(room, 4 * WIDTH, WIDTH, L)
                for lane in range(min(WIDTH, len(q_out) - i)):
                    for k in range(4):
                        q_out[i + lane, row, k] = room[k * WIDTH + lane]
                    for k in range(3):
                        L_out[i + lane, row, k] = room[(4 + k) * WIDTH + lane]
        save_state(all_states, i, n, State(q, q_carry, L, L_carry, newest, known))
        for k in range(3 * PAST):
            save(all_states, i + (18 + k) * n, load(ring, (3 * place + k) * WIDTH, WIDTH))


@entry
def enter(lengths, tolerance, moments, moment, states, done, last, n_steps, every_step, q_out, L_out, finished):
    """`march` as Python calls it."""
    march(lengths, tolerance, moments, moment, states, done, last, n_steps, every_step, q_out, L_out, finished)
