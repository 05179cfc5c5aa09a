"""The paper's step in three unknowns, and the loop of steps, stages and samples around it.

The unknown is a = h w*/2, the Cayley vector of half the turn of a step of length h. w* is the mean rate in body axes, and tau*
the torque of the step in world axes. J and L are in principal axes, the attitude q is a quaternion, scalar first, Q is its
matrix, and ' the transpose:

    J a + a x (J a) = (h/2) (L0 + (h/2) (T - a x T))          T = Q0' tau*
    q1 = q0 (1, a) / sqrt(1 + a.a)
    L1 = Cay(2a)' (L0 + h T) = 2 J w* - L0

L is J w, without the momentum r of a rotor, which adds a x (h/2) r on the left of the first equation. L1 = 2 J w* - L0 remains.
With a motor, r is the mean of r0 and r1, and L0 + r0 - r and L1 + r1 - r are in the places of L0 and L1, so that
Q1 (L1 + r1) = Q0 (L0 + r0) without a torque, and w* is unchanged.

Round-off of L1 with a mean other than 0 becomes a drift after 10^6 steps. If L1 - L0 is computed from a rounded a and rounded
constants such as 4/h, the mean is 10^-20 of the energy per step. `final_correction` therefore solves the equation for w*, whose
residual has the size of L1 - L0 instead of L. L1 follows from its other side. The round-off that remains in an
asymmetric body has no mean, with or without a field, so errors grow with the square root of the number of steps. In symmetric
bodies it can repeat from step to step.

The arithmetic is a chain of dependent operations, so its length counts, not their number. The first guess and its
tangent do not need L: the processor works on them while it waits for the L of the last step.

The equation has several solutions at large steps. The step is the solution on the continuous branch a(h) from a(0) = 0.
Newton's result is trusted if its few corrections stay near the first guess. Otherwise `continue_branch` follows the branch.

Many bodies take the same steps in the same arithmetic: each is a lane with a field and moments of its own (`march_lanes`). A
lane whose solution is not trusted is solved separately. A lane without a solution on the continuous branch stops, and its body
is run again alone. Neither changes a bit of its neighbours' results.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..potentials.uniform_gravity import UniformField
from . import entry, kernel, small
from .compiler.lanes import WIDTH, lane_of, load_rows, save_rows, with_lane
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import (
    accumulate,
    add,
    apply,
    choose,
    cross,
    dot,
    fill_like,
    fuse,
    inverse,
    invert,
    scale,
    subtract,
    times,
    turn,
)
from .compiler.vector import every as all_lanes
from .fields import at_step, finite_torque, no_supply, react, step_rotor, supply, torque, whole
from .protocol import Output, Result, Workspace, deliver, find_ends, record, record_lanes, record_supply

FAILURE = "no continuous solution"
"""Reason that a step fails."""
PAUSE = 2**17
"""Stages between two calls of handlers of signals."""
EXPENSIVE = 64
"""Stages that a stage solved by `continue_branch` counts as."""
MAX_ITERATIONS = 30
FEW = 4
"""Largest number of corrections after which Newton's result is trusted."""
NEAR, NEAR_TANGENT, NEAR_ZERO = 0.25, 0.01, 1e-4
"""Newton is trusted when |a - guess|^2 <= NEAR |a|^2 + NEAR_ZERO; NEAR_TANGENT replaces NEAR for a guess on the tangent of the
branch."""
REST = 1e-20
"""Added to |a|^2 in relative tolerances: for a body at rest, a is round-off alone."""
FIRST_PART, SHORTEST_PART = 0.25, 2.0**-14
"""`continue_branch` takes h in parts: the first one, relative to h, and the length below which the branch counts as ended."""
SMOOTH = 0.04
"""Guesses are extrapolated while |change of a|^2 <= SMOOTH |a|^2 from step to step."""
ROWS = 33
"""Numbers of a body's state: q (4), L (3), what their sums lost (4, 3), how many solutions fit on each other, and the last six
of them (18), newest first."""
HEAD = 18
"""Numbers of the state before the older solutions: all of it, up to the newest solution."""
PAST, ROOM = 5, 30
"""Solutions that are kept in a ring, from the second newest on, and its rows: all of them are there twice."""
OLDER = 3 * PAST
"""Numbers of the solutions in the ring."""


class Model(NamedTuple):
    """Moments, kg m^2, and their inverses, field or None, attitude and momentum, kg m^2/s, at the start: principal axes.

    `rotor` is the momentum of the rotor, kg m^2/s, or None. `L` does not contain it.
    """

    J: Any
    J_inverse: Any
    field: Any
    q: Any
    L: Any
    rotor: Any = None


class Coefficients(NamedTuple):
    """Lengths (stages,), s, of the stages of a step, and the relative error that the solver may leave in a stage."""

    lengths: Any
    tolerance: float


@small
def explicit_guess(h, J_inverse, field, rotor, q, L):
    """Return a of an explicit half step of Euler's equations: third order in h."""
    w = times(J_inverse, L)
    rate = cross(whole(rotor, L), w)
    if field is not None:
        rate = add(rate, torque(field, q, w))
    return scale(0.5 * h, times(J_inverse, add(L, scale(0.5 * h, rate))))


@small
def guess_ahead(past):
    """Return the next a from the polynomial of degree 5 through the last six, newest first."""
    return extrapolate(0, past), extrapolate(1, past), extrapolate(2, past)


@small
def extrapolate(k, past):
    """Component k of `guess_ahead`."""
    a, b, c, d, e, f = past
    # Binomial coefficients: the sixth difference of seven successive values is 0.
    # The newest comes last: a processor sums the rest while it still computes the newest.
    return ((20.0 * c[k] - 15.0 * (b[k] + d[k])) + (6.0 * e[k] - f[k])) + 6.0 * a[k]


@small
def gaps(J):
    """Return the factors of a x (J a) = ((J3 - J2) a2 a3, ...)."""
    return (J[2] - J[1], J[0] - J[2], J[1] - J[0])


@small
def residual(h, J, field, rotor, q, L, a):
    """Left minus right side of the equation for a."""
    half = 0.5 * h
    lhs = add(times(J, a), times(gaps(J), (a[1] * a[2], a[2] * a[0], a[0] * a[1])))
    if rotor is not None:
        lhs = add(lhs, cross(a, scale(half, rotor)))
    if field is None:
        return subtract(lhs, scale(half, L))
    T = finite_torque(field, q, a)[0]
    return subtract(lhs, scale(half, add(L, scale(half, subtract(T, cross(a, T))))))


@small
def tangent(h, J, field, rotor, q, a):
    """Return the residual's derivative by a (three columns)."""
    Ja = times(J, a)
    k0 = (J[0], a[2] * J[0] - Ja[2], Ja[1] - a[1] * J[0])
    k1 = (Ja[2] - a[2] * J[1], J[1], a[0] * J[1] - Ja[0])
    k2 = (a[1] * J[2] - Ja[1], Ja[0] - a[0] * J[2], J[2])
    if rotor is not None:
        x, y, z = scale(0.5 * h, rotor)
        k0, k1, k2 = add(k0, (0.0, -z, y)), add(k1, (z, 0.0, -x)), add(k2, (-y, x, 0.0))
    if field is None:
        return k0, k1, k2
    T, dT = finite_torque(field, q, a)
    f = 0.25 * h * h
    k0 = subtract(k0, scale(f, subtract(subtract(dT[0], (0.0, -T[2], T[1])), cross(a, dT[0]))))
    k1 = subtract(k1, scale(f, subtract(subtract(dT[1], (T[2], 0.0, -T[0])), cross(a, dT[1]))))
    k2 = subtract(k2, scale(f, subtract(subtract(dT[2], (-T[1], T[0], 0.0)), cross(a, dT[2]))))
    return k0, k1, k2


@small
def inverse_tangent(h, J, field, rotor, q, a):
    """Rows of the inverse of the residual's derivative by a."""
    return inverse(tangent(h, J, field, rotor, q, a))


@small
def final_correction(h, J, field, rotor, q, L, carry, rows, a):
    """Return a after one more correction with the last tangent, whose inverse is `rows`, and L1 with its carry.

    Of J w + a x (J w) = L0 + (h/2) (T - a x T), a = (h/2) w, the difference u = J w - L0 is rounded once. The correction c of w
    and what the sum L0 = L - carry lost to rounding are added to L + 2 u, and remain in the carry of L1 with all their digits:
    their part of order h c would have a mean if it was rounded as u is.

    Without field and rotor each component of a x (J w) is one constant times two rates: rounding that constant changes the
    conserved energy and momentum in the last place, but they are conserved all the same. With a field or a rotor they would
    not be, because the mean of w1 w2 w3 is not 0.
    """
    half = 0.5 * h
    w = scale(2.0 / h, a)
    u = (fuse(J[0], w[0], -L[0]), fuse(J[1], w[1], -L[1]), fuse(J[2], w[2], -L[2]))
    if rotor is None and field is None:
        turning = times(scale(half, gaps(J)), (w[1] * w[2], w[2] * w[0], w[0] * w[1]))
    else:
        turning = cross(a, whole(rotor, times(J, w)))
    if field is not None:
        half_T = scale(half, finite_torque(field, q, a)[0])
        turning = subtract(add(turning, cross(a, half_T)), half_T)
    correction = apply(rows, add(add(u, turning), carry))
    x, cx = add_twice(L[0], u[0], fuse(-2.0 * J[0], correction[0], carry[0]))
    y, cy = add_twice(L[1], u[1], fuse(-2.0 * J[1], correction[1], carry[1]))
    z, cz = add_twice(L[2], u[2], fuse(-2.0 * J[2], correction[2], carry[2]))
    return subtract(a, scale(half, correction)), (x, y, z), (cx, cy, cz)


@small
def add_twice(total, u, rest):
    """Return total + 2 u + rest and its rounding error, as `accumulate` does, for a small rest."""
    new = total + fuse(2.0, u, rest)
    return new, fuse(-2.0, u, new - total) - rest


@small
def newton_solve(h, J, field, rotor, q, L, carry, guess, near, largest_square):
    """Return (a, L1, its carry, corrections made, size of the last, whether to trust it), from a first guess of a.

    Newton's answer is trusted where it takes at most `FEW` corrections, stays near the guess (`near`), and the determinant of
    the equation's derivative is positive: it is at a = 0, and zero where the continuous branch ends.
    A correction of relative size s leaves an error of s^2, and one more with the same tangent s^3. The loop ends AFTER that
    one, if s^3 <= the relative error asked for: if s^2 <= `largest_square`, which is that error to the power 2/3. Stopping
    where a residual is small enough instead would leave an error of one sign, and the energy would drift.

    With lanes, the loop runs until the last body is done; a lane that is done does not change, so that its result
    does not depend on its neighbours. After one correction the answer is as near to the guess as that correction is small.
    """
    rows, determinant_inverse = invert(tangent(h, J, field, rotor, q, guess))
    correction = apply(rows, residual(h, J, field, rotor, q, L, guess))
    a = subtract(guess, correction)
    square = dot(correction, correction)
    enough = square <= largest_square * (dot(a, a) + REST)
    iterations, close = 1, enough
    while iterations < FEW and not all_lanes(enough):
        new_rows, new_inverse = invert(tangent(h, J, field, rotor, q, a))
        correction = apply(new_rows, residual(h, J, field, rotor, q, L, a))
        a = choose(enough, a, subtract(a, correction))
        rows = choose(enough, rows, new_rows)
        determinant_inverse = choose(enough, determinant_inverse, new_inverse)
        square = dot(correction, correction)
        aa, away = dot(a, a) + REST, subtract(a, guess)
        enough = enough | (square <= largest_square * aa)
        close = dot(away, away) <= near * aa + NEAR_ZERO
        iterations += 1
    a, L, carry = final_correction(h, J, field, rotor, q, L, carry, rows, a)
    # The determinant of the tangent is positive at a = 0. On the continuous branch it cannot change its sign.
    return a, L, carry, iterations + 1, math.sqrt(square), enough & close & (determinant_inverse > 0.0)


@kernel
def continue_branch(h, J, J_inverse, field, rotor, q, L, carry, largest_square):
    """Return the results of `newton_solve`, by continuation: a(h) along the branch from a(0) = 0, in parts as long as possible.

    Each guess is on the tangent of the branch. Where the branch ends before h, the size is the residual's at that end,
    relative to the right side.
    """
    a, slope = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    reached, part, corrections = 0.0, FIRST_PART, 0
    while part >= SHORTEST_PART:
        aim = min(reached + part, 1.0)
        hs = aim * h
        guess = (
            add(a, scale((aim - reached) * h, slope)) if reached > 0.0 else explicit_guess(hs, J_inverse, field, rotor, q, L)
        )
        solution, L1, carry1, iterations, size, trusted = newton_solve(
            hs, J, field, rotor, q, L, carry, guess, NEAR_TANGENT, largest_square
        )
        corrections += iterations
        if not trusted:
            part *= 0.5
            continue
        if aim == 1.0:
            return solution, L1, carry1, corrections, size, True
        # Parts that were halved before a bend of the branch grow again behind it.
        a, reached, part = solution, aim, 2.0 * part
        rows = inverse_tangent(hs, J, field, rotor, q, a)
        # a'(h): forcing(h)/2 is the derivative of the right side by h, and (h/2) forcing(h/2) the right side itself.
        slope = scale(0.5, apply(rows, forcing(hs, field, rotor, q, L, a)))
    r = residual(h, J, field, rotor, q, L, a)
    f = forcing(0.5 * h, field, rotor, q, L, a)
    return a, L, carry, corrections, math.sqrt(dot(r, r) / dot(f, f)) / abs(0.5 * h), False


@small
def forcing(h, field, rotor, q, L, a):
    """Twice the derivative by h of the right side of the equation for a, with the rotor there: L0 - a x r + h (T - a x T)."""
    if rotor is not None:
        L = subtract(L, cross(a, rotor))
    if field is None:
        return L
    T = finite_torque(field, q, a)[0]
    return add(L, scale(h, subtract(T, cross(a, T))))


@kernel
def find_solution(h, J, J_inverse, field, rotor, q, L):
    """Return whether Newton's method from the explicit guess, trusted or not, ends at a solution of the equation."""
    a = explicit_guess(h, J_inverse, field, rotor, q, L)
    for _ in range(MAX_ITERATIONS):
        correction = apply(inverse_tangent(h, J, field, rotor, q, a), residual(h, J, field, rotor, q, L, a))
        a = subtract(a, correction)
        if dot(correction, correction) <= 1e-24 * (dot(a, a) + REST):  # relative 1e-12: it converges quadratically
            return True
    return False


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`).

    Attitude and momentum are summed with compensation, which costs 15 % of a free body's step in one stage, 13 % in five, and
    5 % in a field; without it round-off errors grow thirty times as large. A step fails where it has no solution on the
    continuous branch; the size then is the residual where the branch ends.
    """
    J, J_inverse, field, rotor = model.J, model.J_inverse, model.field, model.rotor
    n_steps, every, pause, q_out, L_out = workspace
    lengths = coefficients.lengths
    # After a Newton correction of size d, one more with the same tangent (`final_correction`) leaves an error of about d^3.
    # Squares of d are compared.
    largest_square = coefficients.tolerance ** (2.0 / 3.0)
    record(0, model.q, model.L, q_out, L_out)
    state = (model.q, (0.0, 0.0, 0.0, 0.0), model.L, (0.0, 0.0, 0.0), no_supply(field))
    record_supply(0, state[4], L_out)
    at, row, corrections, history = (1, 0), 0, 0, no_history()
    # `pause` counts stages, and a block steps: rounded up, so that a block has at least one.
    block = -(-pause // len(lengths))
    left = block
    while True:
        first = at[0]
        last = end_of_block(first - 1, n_steps, left)
        at, row, more, size, state, history = take_steps(
            lengths, n_steps, last, every, J, J_inverse, field, rotor, largest_square, at, row, state, history, q_out, L_out
        )
        corrections += more
        step, stage = at
        if step > n_steps:
            return Result(n_steps, n_steps * len(lengths), corrections, None, size, False)
        if step <= last:
            q, q_carry, L, L_carry, supplied = state
            h, t = lengths[stage], find_start(lengths, step, stage)
            now = at_step(field, t, h)
            mean, half = step_rotor(field, rotor, t, h)
            L, L_carry = react(L, L_carry, half)
            a, L1, L1_carry, more, size, solved = continue_branch(h, J, J_inverse, now, mean, q, L, L_carry, largest_square)
            corrections += more
            if not solved:
                elsewhere = find_solution(h, J, J_inverse, now, mean, q, L)
                return Result(step - 1, (step - 1) * len(lengths), corrections, None, size, elsewhere)
            L, L_carry = react(L1, L1_carry, half)
            supplied = supply(now, h, q, a, supplied)
            q, q_carry = turn_attitude(a, q, q_carry)
            # The history lacks this stage, so its solutions are no longer the last ones at equal distances.
            at, state, history = (step, stage + 1), (q, q_carry, L, L_carry, supplied), no_history()
            left -= EXPENSIVE
        left -= step - first
        if left <= 0 < pause:
            left = block
            call_handlers()


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))


@kernel
def take_steps(
    lengths, n_steps, last, every, J, J_inverse, field, rotor, largest_square, at, row, state, history, q_out, L_out
):
    """Take steps from a step and stage on, up to step `last` or a stage whose solution is not trusted; return where that is.

    What is rare is left to `march`, so that this loop has the registers for itself: a call in it costs a quarter more.
    """
    first_step, first = at
    q, q_carry, L, L_carry, supplied = state
    corrections, size = 0, 0.0
    until_sample = every - (first_step - 1) % every
    smooth, past = history
    for step in range(first_step, last + 1):
        for stage in range(first, len(lengths)):
            h, t = lengths[stage], find_start(lengths, step, stage)
            now = at_step(field, t, h)
            mean, half = step_rotor(field, rotor, t, h)
            # L stays as it is before the stage: if the solution is not trusted, `march` solves the stage from there.
            M, M_carry = react(L, L_carry, half)
            a = guess_ahead(past) if smooth >= 6 else explicit_guess(h, J_inverse, now, mean, q, M)
            a, M, M_carry, iterations, size, trusted = newton_solve(h, J, now, mean, q, M, M_carry, a, NEAR, largest_square)
            corrections += iterations
            if not trusted:
                return (step, stage), row, corrections, size, (q, q_carry, L, L_carry, supplied), (smooth, past)
            if len(lengths) == 1:
                change = subtract(a, past[0])
                smooth = smooth + 1 if dot(change, change) <= SMOOTH * dot(a, a) else 0
                past = (a, past[0], past[1], past[2], past[3], past[4])
            L, L_carry = react(M, M_carry, half)
            supplied = supply(now, h, q, a, supplied)
            q, q_carry = turn_attitude(a, q, q_carry)
        first = 0
        until_sample -= 1
        if until_sample == 0 or step == n_steps:
            until_sample = every
            row += 1
            record(row, q, L, q_out, L_out)
            record_supply(row, supplied, L_out)
    return (last + 1, 0), row, corrections, size, (q, q_carry, L, L_carry, supplied), (smooth, past)


@small
def find_start(lengths, step, stage):
    """Return the time, s, at which a stage of a step starts. Without loads its callers do not use it, and it is left out."""
    t = 0.0
    for i in range(len(lengths)):
        # Products, whose rounding does not add up as in a sum over all steps.
        t += (step - 1) * lengths[i] if i >= stage else step * lengths[i]
    return t


@small
def no_history():
    """Return the number of known last solutions, 0, and places for the last six, newest first.

    With one stage a step they are equally spaced in time, and their extrapolation beats the explicit guess.
    """
    unknown = (math.nan, math.nan, math.nan)
    return 0, (unknown, unknown, unknown, unknown, unknown, unknown)


@small
def add_momentum(L, carry, gain):
    """Return L + gain as a compensated sum."""
    x, cx = accumulate(L[0], carry[0], gain[0])
    y, cy = accumulate(L[1], carry[1], gain[1])
    z, cz = accumulate(L[2], carry[2], gain[2])
    return (x, y, z), (cx, cy, cz)


@small
def turn_attitude(a, q, carry):
    """Return q1 = q0 (1, a) / sqrt(1 + a.a) as a compensated sum.

    With 1 / sqrt(1 + a.a) = 1 + c the increment is p + c (q0 + p), p = q0 (0, a). Rounding
    of c has a.a times the effect of rounding of p.
    """
    square = fuse(a[2], a[2], fuse(a[1], a[1], a[0] * a[0]))  # explicit, for the same bits in lanes
    root = math.sqrt(1.0 + square)
    # 1/root - 1 without cancellation
    c = -square / (root * (1.0 + root))
    p = turn(q, a)
    w, cw = accumulate(q[0], carry[0], p[0] + c * (q[0] + p[0]))
    x, cx = accumulate(q[1], carry[1], p[1] + c * (q[1] + p[1]))
    y, cy = accumulate(q[2], carry[2], p[2] + c * (q[2] + p[2]))
    z, cz = accumulate(q[3], carry[3], p[3] + c * (q[3] + p[3]))
    return (w, x, y, z), (cw, cx, cy, cz)


@small
def push(ring, place, a):
    """Store a as the newest solution and return its place. Two copies keep five successive solutions contiguous."""
    place = place - 1 if place > 0 else PAST - 1
    save_rows(ring, 3 * place * WIDTH, WIDTH, a)
    save_rows(ring, 3 * (place + PAST) * WIDTH, WIDTH, a)
    return place


@small
def pick(v, i):
    """Return the vector of one body."""
    return lane_of(v[0], i), lane_of(v[1], i), lane_of(v[2], i)


@small
def put(v, i, x):
    """Return the vectors with the vector of one body replaced."""
    return with_lane(v[0], i, x[0]), with_lane(v[1], i, x[1]), with_lane(v[2], i, x[2])


@kernel
def solve_alone(h, J, J_inverse, field, q, L, carry, largest_square, a, L1, carry1, trusted, finished, first):
    """Solve for the lanes that are not trusted, one by one; return solutions and momenta of all, with their carries.

    A body without a solution is brought to rest, where it needs no further work, and noted in `finished`.
    """
    # Floats, because `lane_of` cannot read a truth value.
    alone = choose(trusted, fill_like(0.0, a[0]), fill_like(1.0, a[0]))
    rest = (0.0, 0.0, 0.0)
    for i in range(WIDTH):
        if lane_of(alone, i) == 1.0:
            own_field = None if field is None else UniformField(lane_of(field.x, i), lane_of(field.y, i), lane_of(field.z, i))
            own_q = (lane_of(q[0], i), lane_of(q[1], i), lane_of(q[2], i), lane_of(q[3], i))
            own = pick(J, i), pick(J_inverse, i), own_field, own_q, pick(L, i), pick(carry, i)
            own_a, own_L1, own_carry1, _, _, exists = continue_branch(
                h, own[0], own[1], own[2], None, own[3], own[4], own[5], largest_square
            )
            if not exists:
                finished[first + i] = False
                own_a, own_L1, own_carry1 = rest, rest, rest
            a, L1, carry1 = put(a, i, own_a), put(L1, i, own_L1), put(carry1, i, own_carry1)
    return a, L1, carry1


@entry
def march_lanes(
    lengths, tolerance, moments, gravity_moment, states, room, done, last, n_steps, every_step, q_out, L_out, finished
):
    """Take the steps after `done` up to `last` of n_steps: of all bodies, WIDTH at a time.

    lengths (stages,) are the parts of a step, s; moments (6, n) the principal moments, kg m^2, and their inverses;
    gravity_moment (3, n) the moment of uniform gravity, N m, or None; states (ROWS, n); `room` (ROOM, WIDTH) is memory for the
    work. Samples go to q_out (n, samples, 4) and L_out (n, samples, 3), and `finished` (n,) becomes False if a body has no
    solution.
    """
    n, stages = moments.shape[1], len(lengths)
    largest_square = tolerance ** (2.0 / 3.0)
    all_moments, all_states = moments.reshape(-1), states.reshape(-1)
    ring, q_flat, L_flat, samples = room.reshape(-1), q_out.reshape(-1), L_out.reshape(-1), q_out.shape[1]
    for i in range(0, n, WIDTH):
        J_and_inverse = load_rows(all_moments, i, n, 6, WIDTH)
        J, J_inverse = J_and_inverse[:3], J_and_inverse[3:]
        if gravity_moment is None:
            field = None
        else:
            x, y, z = load_rows(gravity_moment.reshape(-1), i, n, 3, WIDTH)
            field = UniformField(x, y, z)
        state = load_rows(all_states, i, n, HEAD, WIDTH)
        q, L, q_carry, L_carry, smooth, newest = state[:4], state[4:7], state[7:11], state[11:14], state[14], state[15:]
        older = load_rows(all_states, i + HEAD * n, n, OLDER, WIDTH)
        save_rows(ring, 0, WIDTH, older)
        save_rows(ring, OLDER * WIDTH, WIDTH, older)
        zero = fill_like(0.0, smooth)
        place, row, until_sample = 0, done // every_step, every_step - done % every_step
        for step in range(done + 1, last + 1):
            for stage in range(stages):
                h = lengths[stage]
                enough = smooth >= 6.0
                past = load_rows(ring, 3 * place * WIDTH, WIDTH, OLDER, WIDTH)
                a = guess_ahead((newest, past[:3], past[3:6], past[6:9], past[9:12], past[12:]))
                if not all_lanes(enough):
                    a = choose(enough, a, explicit_guess(h, J_inverse, field, None, q, L))
                a, L1, L1_carry, _, _, trusted = newton_solve(h, J, field, None, q, L, L_carry, a, NEAR, largest_square)
                if not all_lanes(trusted):
                    a, L1, L1_carry = solve_alone(
                        h, J, J_inverse, field, q, L, L_carry, largest_square, a, L1, L1_carry, trusted, finished, i
                    )
                    smooth = choose(trusted, smooth, zero)
                if stages == 1:
                    change = subtract(a, newest)
                    place = push(ring, place, newest)
                    newest = a
                    smooth = choose(dot(change, change) <= SMOOTH * dot(a, a), smooth + 1.0, zero)
                L, L_carry = L1, L1_carry
                q, q_carry = turn_attitude(a, q, q_carry)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every_step
                row += 1
                record_lanes(i, row, samples, q, q_flat)
                record_lanes(i, row, samples, L, L_flat)
        save_rows(all_states, i, n, q + L + q_carry + L_carry + (smooth,) + newest)
        save_rows(all_states, i + HEAD * n, n, load_rows(ring, 3 * place * WIDTH, WIDTH, OLDER, WIDTH))
