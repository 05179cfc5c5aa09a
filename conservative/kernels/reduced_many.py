"""The steps of `reduced` for many bodies at once, each a lane with a field and moments of its own: same arithmetic, one loop.

All lanes take the same steps. A lane whose solution is not trusted is solved for alone, as one body is; one that has none on
the continuous branch is stopped, and left to whoever runs it again. Neither changes a bit of its neighbours' results.
"""

from __future__ import annotations

from ..potentials.uniform_gravity import UniformField
from . import entry, kernel, small
from .lanes import WIDTH, lane_of, load_rows, save_columns, save_rows, with_lane
from .reduced import NEAR, SMOOTH, add_momentum, continue_branch, explicit_guess, guess_ahead, newton_solve, turn_attitude
from .vector import choose, dot, every, fill_like, subtract

ROWS = 33
"""Numbers of a body's state: q (4), L (3), what their sums lost (4, 3), how many solutions fit on each other, and the last six
of them (18), newest first."""
PAST, ROOM = 5, 30
"""Solutions that are kept in a ring, from the second newest on, and its rows: all of them are there twice."""


@small
def load_past(ring, place, newest):
    """The last six solutions, newest first: one and, from a place of the ring on, five."""
    past = load_rows(ring, 3 * place * WIDTH, WIDTH, 15, WIDTH)
    return newest, past[:3], past[3:6], past[6:9], past[9:12], past[12:]


@small
def push(ring, place, a):
    """Store a as the newest of the ring, twice, so that five in a row are there from any place; return its place."""
    place = place - 1 if place > 0 else PAST - 1
    save_rows(ring, 3 * place * WIDTH, WIDTH, a)
    save_rows(ring, 3 * (place + PAST) * WIDTH, WIDTH, a)
    return place


@small
def pick(v, i):
    """One body's vector."""
    return lane_of(v[0], i), lane_of(v[1], i), lane_of(v[2], i)


@small
def put(v, i, x):
    """The vectors, one body's replaced."""
    return with_lane(v[0], i, x[0]), with_lane(v[1], i, x[1]), with_lane(v[2], i, x[2])


@kernel
def solve_alone(h, J, J_inverse, field, q, L, carry, tolerance, a, gain, trusted, finished, first):
    """Solve for the lanes that are not trusted, one by one; return solutions, gains, and momenta of all with what they lost.

    A body without a solution is brought to rest, where it needs no further work, and noted in `finished`.
    """
    alone = choose(trusted, fill_like(0.0, a[0]), fill_like(1.0, a[0]))
    rest = (0.0, 0.0, 0.0)
    for i in range(WIDTH):
        if lane_of(alone, i) == 1.0:
            own_field = None if field is None else UniformField(lane_of(field.x, i), lane_of(field.y, i), lane_of(field.z, i))
            own_q = (lane_of(q[0], i), lane_of(q[1], i), lane_of(q[2], i), lane_of(q[3], i))
            own = pick(J, i), pick(J_inverse, i), own_field, own_q, pick(L, i), pick(carry, i)
            found, own_gain, _, _, exists = continue_branch(h, own[0], own[1], own[2], own[3], own[4], own[5], tolerance)
            if not exists:
                finished[first + i] = False
                found, own_gain, L, carry = rest, rest, put(L, i, rest), put(carry, i, rest)
            a, gain = put(a, i, found), put(gain, i, own_gain)
    return a, gain, L, carry


@entry
def march(lengths, tolerance, moments, moment, states, room, done, last, n_steps, every_step, q_out, L_out, finished):
    """Take the steps after `done` up to `last` of n_steps: of all bodies, WIDTH at a time.

    lengths (stages,) are those of a step, s; moments (6, n) the principal moments, kg m^2, and their inverses, moment (3, n)
    that of uniform gravity, N m, or None; states (ROWS, n); `room` (ROOM, WIDTH) is worked in. Samples go to q_out (n, samples,
    4) and L_out (n, samples, 3), and `finished` (n,) is made False where a body has no solution.
    """
    n, stages = moments.shape[1], len(lengths)
    tolerance = tolerance ** (2.0 / 3.0)
    all_moments, all_states = moments.reshape(-1), states.reshape(-1)
    ring, q_flat, L_flat, samples = room.reshape(-1), q_out.reshape(-1), L_out.reshape(-1), q_out.shape[1]
    for i in range(0, n, WIDTH):
        J_and_inverse = load_rows(all_moments, i, n, 6, WIDTH)
        J, J_inverse = J_and_inverse[:3], J_and_inverse[3:]
        if moment is None:
            field = None
        else:
            x, y, z = load_rows(moment.reshape(-1), i, n, 3, WIDTH)
            field = UniformField(x, y, z)
        state = load_rows(all_states, i, n, 18, WIDTH)
        q, L, q_carry, L_carry, known, newest = state[:4], state[4:7], state[7:11], state[11:14], state[14], state[15:]
        older = load_rows(all_states, i + 18 * n, n, 15, WIDTH)
        save_rows(ring, 0, WIDTH, older)
        save_rows(ring, 15 * WIDTH, WIDTH, older)
        zero = fill_like(0.0, known)
        place, row, until_sample = 0, done // every_step, every_step - done % every_step
        for step in range(done + 1, last + 1):
            for stage in range(stages):
                h = lengths[stage]
                enough = known >= 6.0
                a = guess_ahead(load_past(ring, place, newest))
                if not every(enough):
                    a = choose(enough, a, explicit_guess(h, J_inverse, field, q, L))
                a, gain, _, _, trusted = newton_solve(h, J, field, q, L, L_carry, a, NEAR, tolerance)
                if not every(trusted):
                    a, gain, L, L_carry = solve_alone(
                        h, J, J_inverse, field, q, L, L_carry, tolerance, a, gain, trusted, finished, i
                    )
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
                to = i * samples + row
                save_columns(q_flat, 4 * to, 4 * samples, q)
                save_columns(L_flat, 3 * to, 3 * samples, L)
        save_rows(all_states, i, n, q + L + q_carry + L_carry + (known,) + newest)
        save_rows(all_states, i + 18 * n, n, load_rows(ring, 3 * place * WIDTH, WIDTH, 15, WIDTH))
