"""Steps of a Taylor series, each projected back onto the invariants. Uniform gravity.

The state is g and a, third and first row of the attitude's matrix, and the rates w, all in principal axes:

    g' = g x w        a' = a x w        J w' = J w x w + g x m

where m is the weight times the centre of mass. The coefficients of a step come from `series_llvm`. After the step g and a are
made orthonormal, and energy and vertical momentum are brought back to their values at the start as in `projected`: by Newton's
method along their gradients with respect to L and to a turn of the body.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from . import entry, kernel, small
from .fields import in_body
from .protocol import Result, Workspace, find_ends, loosen
from .series_llvm import orders
from .signals import call_handlers, end_of_block
from .simd import join, lane
from .vector import add, cross, dot, scale, subtract, times

FAILURE = "the step ends too far from the invariants to be projected onto them"
"""Why a step fails."""
PAUSE = 2**16
"""Steps between two calls of handlers of signals."""
MOST_CORRECTIONS = 8
ENOUGH = 2.0**-26
"""Relative defect whose square, which a correction leaves, is round-off."""
FAR, LEFT = 0.1, 1e-6
"""Largest relative defect a step may have before projection, and after it."""
DEPENDENT, TINY = 1e-8, 1e-300
"""Regularisation: relative, of the gradients' Gram determinant, and added to squares that can be 0."""


class Model(NamedTuple):
    """J, 1/J, moment of the weight, scales of energy and momentum; q and L at the start, all in principal axes.

    `scales` is what errors of energy, J, and momentum, kg m^2/s, are relative to.
    """

    J: Any
    J_inverse: Any
    moment: Any
    scales: Any
    q: Any
    L: Any


class Coefficients(NamedTuple):
    """Order of the series and length of the step, s."""

    order: int
    h: float


@small
def constants(J, J_inverse, moment):
    """K, M1 and M2 of `orders`."""
    i, m = J_inverse, moment
    K = join((J[1] - J[2]) * i[0], (J[2] - J[0]) * i[1], (J[0] - J[1]) * i[2], 0.0)
    return K, join(i[0] * m[1], i[1] * m[2], i[2] * m[0], 0.0), join(i[0] * m[2], i[1] * m[0], i[2] * m[1], 0.0)


@small
def split(v):
    """The first three lanes."""
    return (lane(v, 0), lane(v, 1), lane(v, 2))


@small
def shortest_move(w, L, moment, size, e, m, g):
    """Return (dL, turn of the body) that changes energy by e and vertical momentum by m, to first order, and moves least.

    Gradients are with respect to (L / size, turn): (size w, -T) and (size g, L x g), with the torque T.
    """
    T, turn, square = cross(g, moment), cross(L, g), size * size
    ee = square * dot(w, w) + dot(T, T) + TINY
    mm = square + dot(turn, turn)
    em = square * dot(w, g) - dot(T, turn)
    over = 1.0 / ((1.0 + DEPENDENT) * (ee * mm) - em * em)
    x, y = over * (mm * e - em * m), over * (ee * m - em * e)
    return scale(square, add(scale(x, w), scale(y, g))), add(scale(-x, T), scale(y, turn))


@small
def values(J, moment, g, w):
    """Energy, J, and vertical momentum, kg m^2/s."""
    L = times(J, w)
    return 0.5 * dot(L, w) + dot(moment, g), dot(L, g)


@small
def correct(J, J_inverse, moment, kept, scales, g, a, w):
    """Return (g, a, w, relative defect before) of a state brought closer to orthonormality and to what is `kept`.

    The inverse length of g is two terms of its series (`projected.near_unit`), and energy and momentum are taken with g that
    long, so that no product waits for another. What is left is of the size of the defect's square.
    """
    L, n = times(J, w), 1.5 - 0.5 * dot(g, g)
    e = kept[0] - (0.5 * dot(L, w) + n * dot(moment, g))
    m = kept[1] - n * dot(L, g)
    dL, turn = shortest_move(w, L, moment, scales[1], e, m, g)
    upright = subtract(scale(1.5 - 0.5 * dot(a, a), a), scale(dot(a, g), g))
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, add(w, times(J_inverse, dL)), max(abs(e) * scales[2], abs(m) * scales[3])


@small
def project(J, J_inverse, moment, kept, scales, g, a, w):
    """Return (g, a, w, corrections, relative defect left) of a state brought back to what is `kept`."""
    corrections = 0
    while True:
        g, a, w, defect = correct(J, J_inverse, moment, kept, scales, g, a, w)
        corrections += 1
        if corrections == MOST_CORRECTIONS or not ENOUGH < defect < FAR:
            return g, a, w, corrections, defect * defect


@small
def quaternion(g, a):
    """The quaternion, of any length, of the matrix with third row g and first row a."""
    b = cross(g, a)
    trace = a[0] + b[1] + g[2]
    if trace > 0.0:
        return (1.0 + trace, g[1] - b[2], a[2] - g[0], b[0] - a[1])
    if a[0] >= b[1] and a[0] >= g[2]:
        return (g[1] - b[2], 1.0 + a[0] - b[1] - g[2], a[1] + b[0], a[2] + g[0])
    if b[1] >= g[2]:
        return (a[2] - g[0], a[1] + b[0], 1.0 - a[0] + b[1] - g[2], b[2] + g[1])
    return (b[0] - a[1], a[2] + g[0], b[2] + g[1], 1.0 - a[0] - b[1] + g[2])


@small
def record(q_out, L_out, row, q, L):
    """Store a sample. Number by number: a tuple assigned to a slice takes seconds to compile."""
    q_out[row, 0], q_out[row, 1], q_out[row, 2], q_out[row, 3] = q[0], q[1], q[2], q[3]
    L_out[row, 0], L_out[row, 1], L_out[row, 2] = L[0], L[1], L[2]


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`). A step fails where it cannot be projected; the size is the relative defect that is left."""
    J, J_inverse, moment, scales, q, L = model
    order, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    K, M1, M2 = constants(J, J_inverse, moment)
    scales = (scales[0], scales[1], 1.0 / scales[0], 1.0 / scales[1])
    record(q_out, L_out, 0, q, L)
    g, a, w = in_body(q, (0.0, 0.0, 1.0)), in_body(q, (1.0, 0.0, 0.0)), times(J_inverse, L)
    kept = values(J, moment, g, w)
    row, corrections, until_sample, defect = 0, 0, every, 0.0
    done = 0
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        for step in range(done + 1, last + 1):
            g4, a4, w4 = join(g[0], g[1], g[2], 0.0), join(a[0], a[1], a[2], 0.0), join(w[0], w[1], w[2], 0.0)
            dg, da, dw = orders(order, h, g4, a4, w4, K, M1, M2)
            g, a, w = split(g4 + dg), split(a4 + da), split(w4 + dw)
            g, a, w, more, defect = project(J, J_inverse, moment, kept, scales, g, a, w)
            corrections += more
            if not defect < LEFT:
                work = (step - 1) * order
                return Result(step - 1, work, corrections, work, defect, False)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                record(q_out, L_out, row, quaternion(g, a), times(J, w))
        done = last
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps * order, corrections, n_steps * order, defect, False)


MODEL_END, COEFFICIENTS_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    return loosen(march(model, coefficients, Workspace(*loose[COEFFICIENTS_END:])))
