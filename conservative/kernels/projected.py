"""Explicit Runge-Kutta steps, each projected back onto the invariants.

The state is the attitude as a quaternion q and the momentum L, principal axes: with w = J^-1 L and the body's torque T(q),

    q' = q (0, w) / 2        L' = (L + r) x w + T

with the momentum r of a rotor, which L does not contain.

Coefficients that are zero are left out. A, but not b, is multiplied by h beforehand. After the step |q| = 1 is
restored, and then energy and momentum about the field's axis are brought back to their values at the start (Hairer, Lubich &
Wanner, IV.4): by Newton's method along their gradients with respect to L and to a turn of the body, so that the state moves
least. With loads these values change by work and impulse, which the step sums as it does q and L. An invariant that is met to
round-off is left alone, and nothing can accumulate.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .compiler.lanes import FOUR, join, lane_of, load, load_rows, save, save_rows, splat
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import add, cross, dot, fuse, in_body, product, scale, subtract, times
from .fields import (
    add_supply,
    at_time,
    body_momentum,
    body_torque,
    energy,
    no_supply,
    rotor_at,
    shift_invariants,
    supply_rate,
    torque,
    whole,
    with_motor,
)
from .protocol import Output, Result, Workspace, deliver, find_ends, record, record_supply

FAILURE = "the step ends too far from the invariants to be projected onto them"
"""Reason that a step fails."""
PAUSE = 2**14
"""Steps between two calls of handlers of signals."""
MOST_CORRECTIONS = 8
"""Largest number of corrections of a projection."""
ROUND_OFF = 2.0**-51
"""Largest relative defect that counts as none."""
FAR, LEFT = 0.1, 1e-6
"""Largest relative defect a step may have before projection, and after it."""
FLAT, NOISE = 0.01, 2.0**-49
"""Where the gradient of the energy is shorter than FLAT of its scale, up to NOISE of the scale is not corrected."""
DEPENDENT, TINY = 1e-8, 1e-300
"""Regularisation: added to the length 1 of the gradients, which are parallel in a steady precession, and to squares that can
be 0."""


class Model(NamedTuple):
    """1/J, the field, its axis of symmetry and the scales of energy and momentum; q and L at the start, principal axes.

    `axis` is a world vector of length one, or None; `turn` the angular velocity, rad/s, world axes, of the axes in which the
    field is fixed, or None where it does not turn; `scales` is what errors of energy, J, and momentum, kg m^2/s, are relative
    to, the first of them inf where no energy is conserved.
    """

    J_inverse: Any
    field: Any
    axis: Any
    turn: Any
    scales: Any
    q: Any
    L: Any
    rotor: Any


class Coefficients(NamedTuple):
    """Non-zero coefficients of all stages and of the step: factors (n,), their columns, where each row starts; step h, s.

    `nodes` are the times of the stages, in steps.
    """

    weights: Any
    columns: Any
    starts: Any
    nodes: Any
    h: float


@small
def rates(J_inverse, rotor, field, t, q, L, slopes, at, supply_at):
    """Write (q', L', 0) to slopes[at : at + 8], and with loads their power and torque to slopes[supply_at : supply_at + 4].

    With a motor L is the whole momentum, of which the rotor has its part at a time t, s; there is no other rotor then.
    """
    w = times(J_inverse, body_momentum(field, L, t))
    x, y, z = 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]
    n = cross(whole(rotor, L), w)
    T = torque(field, q, w)
    save_rows(slopes, supply_at, 1, supply_rate(field, q, w))
    save(slopes, at + FOUR, join(n[0] + T[0], n[1] + T[1], n[2] + T[2], 0.0))
    save(
        slopes,
        at,
        join(
            -(q[1] * x + q[2] * y + q[3] * z),
            q[0] * x + q[2] * z - q[3] * y,
            q[0] * y + q[3] * x - q[1] * z,
            q[0] * z + q[1] * y - q[2] * x,
        ),
    )


@small
def combine(q, L, weights, columns, first, last, slopes):
    """(q, L) + sum of weights[i] times the slopes of stage columns[i], first <= i < last; the newest slopes come last."""
    for i in range(first, last):
        weight, at = load(weights, i, 1), 2 * FOUR * columns[i]
        q = fuse(weight, load(slopes, at, FOUR), q)
        L = fuse(weight, load(slopes, at + FOUR, FOUR), L)
    return q, L


@small
def take_step(h, t, J_inverse, rotor, field, weights, columns, starts, nodes, q, L, slopes):
    """Return the state after a step from t, s. Stage i begins at starts[i] in weights and columns; the step is last."""
    L = with_motor(field, L, t)
    q0, L0 = join(q[0], q[1], q[2], q[3]), join(L[0], L[1], L[2], 0.0)
    stages = len(starts) - 2
    for stage in range(stages):
        qs, Ls = combine(q0, L0, weights, columns, starts[stage], starts[stage + 1], slopes)
        q, L = (
            (lane_of(qs, 0), lane_of(qs, 1), lane_of(qs, 2), lane_of(qs, 3)),
            (lane_of(Ls, 0), lane_of(Ls, 1), lane_of(Ls, 2)),
        )
        ts = t + nodes[stage] * h
        rates(J_inverse, rotor, at_time(field, ts), ts, q, L, slopes, 2 * FOUR * stage, FOUR * (2 * stages + stage))
    # Weights rounded after multiplication by h would not sum to h, and the clock would be wrong.
    dq, dL = combine(splat(0.0), splat(0.0), weights, columns, starts[stages], starts[stages + 1], slopes)
    q1, L1 = fuse(splat(h), dq, q0), fuse(splat(h), dL, L0)
    L = lane_of(L1, 0), lane_of(L1, 1), lane_of(L1, 2)
    return (lane_of(q1, 0), lane_of(q1, 1), lane_of(q1, 2), lane_of(q1, 3)), body_momentum(field, L, t + h)


@small
def sum_supply(h, weights, columns, starts, slopes, supplied):
    """Return the sums of work and impulse plus the last step's: its quadrature of power and torque."""
    stages = len(starts) - 2
    for i in range(starts[stages], starts[stages + 1]):
        rate = load_rows(slopes, FOUR * (2 * stages + columns[i]), 1, 4, 1)
        supplied = add_supply(supplied, h * weights[i], rate)
    return supplied


@small
def near_unit(q):
    """Return q (3 - |q|^2)/2, nearly q/|q| if |q| is near 1. The length has no meaning, but must not drift."""
    n = 1.5 - 0.5 * ((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]))
    return (n * q[0], n * q[1], n * q[2], n * q[3])


@small
def values(J_inverse, rotor, field, axis, turn, q, L):
    """Energy, J, and momentum about the world vector `axis`, kg m^2/s; without an axis, `None`, the latter is 0.

    Of a field that turns, the Jacobi integral E - turn.l in place of the energy.
    """
    momentum = 0.0 if axis is None else dot(whole(rotor, L), in_body(q, axis))
    lacking = 0.0 if turn is None else dot(whole(rotor, L), in_body(q, turn))
    return (0.5 * dot(L, times(J_inverse, L)) + energy(field, q)) - lacking, momentum


@small
def gradient(J_inverse, rotor, field, turn, q, L):
    """(w, T): the gradients of what `values` has in the energy's place are w by L, and -T by a turn of the body.

    Of the Jacobi integral these are the rates relative to the axes that turn, and the torque plus L x turn.
    """
    w, T = times(J_inverse, L), body_torque(field, q)
    if turn is None:
        return w, T
    o = in_body(q, turn)
    return subtract(w, o), add(T, cross(whole(rotor, L), o))


@small
def significant(e, scale, size, w, T):
    """Return the part of an energy defect e that is corrected, given the `gradient` (w, T) there.

    Near rest in an equilibrium the gradient vanishes, and the smallest correction of round-off moves the body far: by 4e-11 rad
    at 1e-5 rad from the equilibrium of a spring, in each step. Round-off is therefore left there, and taken off e so that the
    correction is a continuous function of e and of the state.
    """
    short = 1.0 - (size * size * dot(w, w) + dot(T, T)) / (FLAT * FLAT * scale * scale)
    least = max(0.0, short) * NOISE * scale
    return max(0.0, e - least) if e > 0.0 else min(0.0, e + least)


@small
def shortest_move(w, T, rotor, axis, size, e, m, q, L):
    """Return (dL, turn of the body) that changes energy by e and momentum about the axis by m, to first order.

    (w, T) is the `gradient`. Gradients are with respect to (L / size, turn): (size w, -T) and (size axis, L x axis). Both are
    scaled to length one here, and regularised by DEPENDENT, so that parallel gradients share the correction.
    """
    by_energy = 1.0 / math.sqrt(size * size * dot(w, w) + dot(T, T) + TINY)
    if axis is None:
        a = e * by_energy * by_energy
        return scale(a * size * size, w), scale(-a, T)
    v = in_body(q, axis)
    across = cross(whole(rotor, L), v)
    by_momentum = 1.0 / math.sqrt(size * size + dot(across, across))
    cosine = (size * size * dot(w, v) - dot(T, across)) * by_energy * by_momentum
    one = 1.0 + DEPENDENT
    over = 1.0 / (one * one - cosine * cosine)
    a = over * by_energy * (one * (e * by_energy) - cosine * (m * by_momentum))
    b = over * by_momentum * (one * (m * by_momentum) - cosine * (e * by_energy))
    return scale(size * size, add(scale(a, w), scale(b, v))), add(scale(-a, T), scale(b, across))


@small
def project(J_inverse, rotor, field, axis, turn, kept, scales, q, L):
    """Return (q, L, corrections, relative defect left) of a state brought back to the energy and momentum `kept`."""
    q = near_unit(q)
    corrections = 0
    while True:
        now = values(J_inverse, rotor, field, axis, turn, q, L)
        e, m = kept[0] - now[0] if scales[0] < math.inf else 0.0, kept[1] - now[1]
        defect = max(abs(e) / scales[0], abs(m) / scales[1])
        # Also if the defect is nan, which no comparison accepts; `march` then ends.
        if corrections == MOST_CORRECTIONS or not ROUND_OFF < defect < FAR:
            return q, L, corrections, defect
        w, T = gradient(J_inverse, rotor, field, turn, q, L)
        e = significant(e, scales[0], scales[1], w, T)
        if max(abs(e) / scales[0], abs(m) / scales[1]) <= ROUND_OFF:
            return q, L, corrections, defect
        corrections += 1
        dL, rotation = shortest_move(w, T, rotor, axis, scales[1], e, m, q, L)
        L = add(L, dL)
        q = near_unit(product(q, (1.0, 0.5 * rotation[0], 0.5 * rotation[1], 0.5 * rotation[2])))


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`). A step fails where it cannot be projected; the size is the relative defect that is left."""
    J_inverse, field, axis, turn, scales, q, L, rotor = model
    weights, columns, starts, nodes, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    # The caller uses the same array for all runs.
    weights = weights.copy()
    for i in range(starts[-2]):  # not one product of a slice: numba compiles the text of its error for that
        weights[i] *= h
    stages = len(starts) - 2
    slopes = np.empty(3 * FOUR * stages)
    supplied = no_supply(field)
    record(0, q, L, q_out, L_out)
    record_supply(0, supplied, L_out)
    kept = values(J_inverse, rotor_at(field, rotor, 0.0), at_time(field, 0.0), axis, turn, q, L)
    row, corrections, until_sample, defect = 0, 0, every, 0.0
    done = 0
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        for step in range(done + 1, last + 1):
            q, L = take_step(h, (step - 1) * h, J_inverse, rotor, field, weights, columns, starts, nodes, q, L, slopes)
            supplied = sum_supply(h, weights, columns, starts, slopes, supplied)
            now, aim = at_time(field, step * h), shift_invariants(kept, axis, turn, supplied)
            wheel = rotor_at(field, rotor, step * h)
            q, L, more, defect = project(J_inverse, wheel, now, axis, turn, aim, scales, q, L)
            corrections += more
            if not defect < LEFT:
                work = (step - 1) * stages
                return Result(step - 1, work, corrections, work, defect, False)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                record(row, q, L, q_out, L_out)
                record_supply(row, supplied, L_out)
        done = last
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps * stages, corrections, n_steps * stages, defect, False)


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))
