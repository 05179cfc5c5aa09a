"""Steps of a Taylor series, each projected back onto the invariants, in any field that has an axis and a recurrence.

Axes D of the world have the field's axis for their third one; for a free body that is the direction of its momentum. The state
is g and a, third and first row of the attitude's matrix against D, and the rates w, all in principal axes:

    g' = g x w        a' = a x w        J w' = J w x w + T        T = g x dV/dg

Where the field turns about an axis at right angles to its own, axes D turn with it about their second one at the rate u: then
g' has u a more and a' has u g less, and the Jacobi integral E - u b.L, b the second row, takes the place of the energy, without
the momentum about the axis.

The coefficients of a step come from the field's recurrence (`axial`, `series`). After the step g and a are made orthonormal,
and energy and momentum about the axis are brought back to their values at the start as in `projected`: by Newton's method along
their gradients with respect to L and to a turn of the body. A momentum about an axis of symmetry, which the series keeps, is
left out of these gradients. The momentum of a free body is l g, whatever g, so that w follows from g, and only energy is left
to be restored. Source: E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration (2006), IV.4.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

from ..arithmetic import root
from ..potentials.turning import Turned
from . import entry, kernel, small
from .lanes import REGISTER, load_rows, save_columns, save_rows
from .protocol import Result, Workspace, find_ends, loosen, record
from .series import Series, sum_to_order
from .signals import call_handlers, end_of_block
from .traced import trace
from .vector import add, choose, cross, dot, product, scale, some, subtract, times

FAILURE = "the step ends too far from the invariants to be projected onto them"
"""Why a step fails."""
PAUSE = 2**16
"""Steps between two calls of handlers of signals."""
MOST_CORRECTIONS = 8
ENOUGH, NOISE = 2.0**-50, 2.0**-46
"""Relative defect that a correction may leave: round-off, and the defect that round-off alone can make."""
ROUND_OFF = 2.0**-50
"""Largest relative defect that counts as none."""
FAR, LEFT = 0.1, 1e-6
"""Largest relative defect a step may have before projection, and after it."""
SAFETY, SHORTEST = 0.8, 2.0**-30
"""Share of the longest part that a tolerance allows, and the shortest part of a step."""
DEPENDENT, FLAT, TINY = 1e-8, 1e-8, 1e-300
"""Regularisation: relative, of the gradients' Gram determinant and of squares of gradients, and added to what can be 0."""


class Model(NamedTuple):
    """The body, its field and its start in principal axes.

    `J` and `J_inverse` are moments and their inverses, `loose` is 1 for each component of L that a projection may change, else
    0, `scales` is what errors of energy, J, and momentum, kg m^2/s, are relative to. `left` is the quaternion that turns axes D
    to the world's, `g` and `a` are third and first row of the matrix against D, `q` and `L` attitude against the world and
    momentum, all at the start.
    """

    J: Any
    J_inverse: Any
    field: Any
    loose: Any
    scales: Any
    left: Any
    g: Any
    a: Any
    q: Any
    L: Any


class Coefficients(NamedTuple):
    """Order of the series, length of the step, s, and the largest size of the last two terms of its parts, 0 for no parts."""

    order: int
    h: float
    tolerance: float


class Free(NamedTuple):
    """No field; the size of the momentum, kg m^2/s, whose direction is g. See `UniformField` for the functions."""

    momentum: Any

    def find_constants(self, J_inverse):
        """Return nothing."""
        return ()

    def slope(self, constants, g):
        """Return V and dV/dg, 0."""
        return 0.0, (0.0, 0.0, 0.0)

    def series(self, constants, g, series):
        """Return a function that returns no torque."""
        return lambda c, n: None


def values(field, constants, L, n, g, w):
    """Return energy and momentum about the axis, with g longer by the factor n to first order, and dV/dg."""
    V, slope = field.slope(constants, g)
    return 0.5 * dot(L, w) + V + (n - 1.0) * dot(slope, g), n * dot(L, g), slope


def turning_values(field, constants, L, n, g, upright, w):
    """Return the Jacobi integral, the momentum about the axis, dV/dg and the rates of D, with g longer by n and a upright."""
    energy, momentum, slope = values(field, constants, L, n, g, w)
    o = scale(field.rate * n, cross(g, upright))
    return energy - dot(L, o), momentum, slope, o


@trace
def begin(model):
    """Return what `correct` takes, ((J2 - J3)/J1 and its kin), and rates.

    The first is (constants of the field, (J, J_inverse, loose), what is kept, scales and their inverses).
    """
    J, J_inverse, field, scales = model.J, model.J_inverse, model.field, model.scales
    constants, w = field.find_constants(J_inverse), times(J_inverse, model.L)
    K = times((J[1] - J[2], J[2] - J[0], J[0] - J[1]), J_inverse)
    n, upright, _ = straighten(model.g, model.a)
    if isinstance(field, Turned):
        kept = turning_values(field, constants, times(J, w), n, model.g, upright, w)[:2]
    else:
        kept = values(field, constants, times(J, w), n, model.g, w)[:2]
    scales = scales[0], scales[1], 1.0 / scales[0], 1.0 / scales[1]
    return (constants, (J, J_inverse, model.loose), kept, scales), K, w


@trace
def take_step(field, constants, order, h, K, g, a, w):
    """The state after one step, not projected, and its last two terms."""
    series = Series(w[0])
    start = tuple(series.vector(*v) for v in (g, a, w))
    turn = series.spread(field.rate) if isinstance(field, Turned) else None
    accelerate = field.series(constants, g, series)
    change, last, before = sum_to_order(series, order, h, start, series.vector(*K), accelerate, turn)
    end = tuple(v + d for v, d in zip(start, change, strict=True))
    return tuple(tuple(map(series.split, each)) for each in (end, last, before))


@trace
def sizes(scales, last, before):
    """The sizes of two terms: of rows of a rotation, and of rates in units of what all energy makes of the largest moment."""
    over = 0.5 * scales[1] * scales[2]
    return tuple(root(dot(g, g) + dot(a, a) + over * over * dot(w, w)) for g, a, w in (last, before))


@small
def stretch(tolerance, order, large):
    """By which factor a step may be longer, by the sizes of its last two terms."""
    last, before = large[0] + TINY, large[1] + TINY
    return min((tolerance / last) ** (1.0 / order), (tolerance / before) ** (1.0 / (order - 1)))


def significant(x, scale):
    """x, less in size by what counts as round-off of that scale: a continuous function, which amplifies no noise."""
    least = ROUND_OFF * scale
    return choose(x > least, x - least, choose(x < -least, x + least, 0.0))


def straighten(g, a):
    """Return 1/|g|, the vector a of length one and at right angles to g, both to first order, and by how much they were not."""
    n, m, c = 0.5 - 0.5 * dot(g, g), 0.5 - 0.5 * dot(a, a), dot(a, g)
    return 1.0 + n, subtract(scale(1.0 + m, a), scale(c, g)), abs(n) + abs(m) + abs(c)


def shortest_move(loose, scales, w, L, T, e, m, g):
    """Return (dL, turn of the body) that changes energy by e and momentum about the axis by m, to first order, and moves least.

    Gradients are with respect to (L / size, turn): (size w, -T) and (size g, L x g) with the torque T. The third that is
    returned is the share of e and m that regularisation leaves where it is.
    """
    turn, square = cross(L, g), scales[1] * scales[1]
    w, g = times(loose, w), times(loose, g)
    ee = square * dot(w, w) + dot(T, T) + FLAT * (scales[0] * scales[0]) + TINY
    mm = square * dot(g, g) + dot(turn, turn) + FLAT * square
    em = square * dot(w, g) - dot(T, turn)
    over = 1.0 / ((1.0 + DEPENDENT) * (ee * mm) - em * em)
    x, y = over * (mm * e - em * m), over * (ee * m - em * e)
    rest = over * (DEPENDENT * (ee * mm) + FLAT * (scales[0] * scales[0] * mm + square * ee))
    return scale(square, add(scale(x, w), scale(y, g))), add(scale(-x, T), scale(y, turn)), rest


def correct_in_field(field, constants, body, kept, scales, g, a, w):
    """`correct` where a field acts.

    The inverse length of g is two terms of its series (`projected.near_unit`), and energy and momentum are taken with g that
    long to first order, so that no product waits for another. What is left is of the size of the defect's square, and that
    share of the defect which regularisation leaves.
    """
    J, J_inverse, loose = body
    L, (n, upright, off) = times(J, w), straighten(g, a)
    energy, momentum, slope = values(field, constants, L, n, g, w)
    e, m = kept[0] - energy, kept[1] - momentum
    wanted = significant(e, scales[0]), significant(m, scales[1])
    dL, turn, rest = shortest_move(loose, scales, w, L, cross(g, slope), *wanted, g)
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, add(w, times(J_inverse, dL)), abs(e) * scales[2] + abs(m) * scales[3] + off, rest


def correct_free(field, constants, body, kept, scales, g, a):
    """`correct` of a free body: the momentum is along g, so that w follows from g, and energy is brought back by turning g."""
    J_inverse, (n, upright, off) = body[1], straighten(g, a)
    L = scale(n * field.momentum, g)
    e, slope = kept[0] - 0.5 * dot(L, times(J_inverse, L)), cross(times(J_inverse, L), L)
    flat = FLAT * (scales[0] * scales[0])
    over = 1.0 / (dot(slope, slope) + flat + TINY)
    turn = scale(significant(e, scales[0]) * over, slope)
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, times(J_inverse, scale(field.momentum, g)), abs(e) * scales[2] + off, flat * over


def correct_revolving(field, constants, body, kept, scales, g, a, w):
    """`correct` where the field turns: the Jacobi integral's gradients are the rates less those of D, and -(T + L x these)."""
    J, J_inverse, _ = body
    L, (n, upright, off) = times(J, w), straighten(g, a)
    jacobi, _, slope, o = turning_values(field, constants, L, n, g, upright, w)
    e = kept[0] - jacobi
    v, T = subtract(w, o), add(cross(g, slope), cross(L, o))
    square, flat = scales[1] * scales[1], FLAT * (scales[0] * scales[0])
    over = 1.0 / (square * dot(v, v) + dot(T, T) + flat + TINY)
    x = significant(e, scales[0]) * over
    dL, turn = scale(x * square, v), scale(-x, T)
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, add(w, times(J_inverse, dL)), abs(e) * scales[2] + off, flat * over


def find_correction(field, constants, body, kept, scales, g, a, w):
    """Return (g, a, w, relative defect before, share left) of a state brought closer to orthonormality and to what is `kept`.

    `body` is (J, J_inverse, loose) of `Model`; the share is what regularisation leaves of the defect.
    """
    if isinstance(field, Free):
        return correct_free(field, constants, body, kept, scales, g, a)
    if isinstance(field, Turned):
        return correct_revolving(field, constants, body, kept, scales, g, a, w)
    return correct_in_field(field, constants, body, kept, scales, g, a, w)


@trace
def correct(field, body, g, a, w):
    """Return (g, a, w) of `find_correction`, what is left of the relative defect, and whether to correct once more.

    Left are the defect's square, and the share that regularisation leaves of what is no round-off.
    """
    g, a, w, defect, rest = find_correction(field, *body, g, a, w)
    beyond_noise = choose(defect > NOISE, defect - NOISE, 0.0)
    left = defect * defect + choose(rest < 1.0, rest, 1.0) * beyond_noise
    return g, a, w, left, (left > ENOUGH) & (defect < FAR)


@partial(kernel, forceinline=True)
def project(field, body, g, a, w, active):
    """Return (g, a, w, corrections, relative defect left) of a state brought back to what is `kept`.

    Bodies that are not active, and those that need no further correction, wait for the others.
    """
    g, a, w, left, needed = correct(field, body, g, a, w)
    needed = needed & active
    corrections = 1
    while corrections < MOST_CORRECTIONS and some(needed):
        g1, a1, w1, left1, needed1 = correct(field, body, g, a, w)
        g, a, w, left = choose(needed, (g1, a1, w1, left1), (g, a, w, left))
        needed = needed & needed1
        corrections += 1
    return g, a, w, corrections, left


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


# Optimised twice: once alone, steps of a free body take 1.05 times and those in a turning field 1.06 times as long.
@partial(kernel, forceinline=True, ahead=True)
def march(model, coefficients, workspace):
    """Take the steps (`protocol`). A step fails where it cannot be projected; the size is the relative defect that is left."""
    field, left, g, a = model.field, model.left, model.g, model.a
    order, h, tolerance = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    body, K, w = begin(model)
    constants, _, _, scales = body
    record(0, model.q, model.L, q_out, L_out)
    row, corrections, until_sample, defect = 0, 0, every, 0.0
    done, parts, computed, part = 0, 0, 0, h
    while done < n_steps and defect < LEFT:
        last = end_of_block(done, n_steps, pause)
        while done < last:
            left_over, taken = h, 0
            while left_over > 0.0 and defect < LEFT:
                (g1, a1, w1), last_term, before = take_step(field, constants, order, part, K, g, a, w)
                computed += 1
                if tolerance > 0.0:
                    factor = stretch(tolerance, order, sizes(scales, last_term, before))
                    if not factor >= 1.0 and part > SHORTEST * h:
                        part = part * (SAFETY * factor if factor > 0.1 else 0.1)
                        continue
                    longest = SAFETY * factor * part
                left_over -= part
                taken += 1
                g, a, w, more, defect = project(field, body, g1, a1, w1, True)
                corrections += more
                if tolerance > 0.0:
                    rest = left_over if left_over > 0.0 else h
                    part = rest / math.ceil(rest / longest) if longest < rest else rest
            if not defect < LEFT:
                break
            done += 1
            parts += taken
            until_sample -= 1
            if until_sample == 0 or done == n_steps:
                until_sample = every
                row += 1
                record(row, product(left, quaternion(g, a)), times(model.J, w), q_out, L_out)
        if done < n_steps:
            call_handlers()
    return Result(done, parts * order, corrections, computed * order, defect, False)


MODEL_END, COEFFICIENTS_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    return loosen(march(model, coefficients, Workspace(*loose[COEFFICIENTS_END:])))


class Bodies(NamedTuple):
    """Bodies in lanes: as `Model`, and numbers that steps and samples need.

    `h` is the length of a step in the units of the body. `axes` are the rows of the rotation from axes D to the world's,
    `R_BP` those of the rotation from principal to body axes. Rates in the units of the body times `units` are those of samples:
    the third contains the spin if the body is described in a frame that does not spin.
    """

    J: Any
    J_inverse: Any
    field: Any
    loose: Any
    scales: Any
    g: Any
    a: Any
    L: Any
    h: Any
    axes: Any
    R_BP: Any
    units: Any


class Motion(NamedTuple):
    """Rows of the attitude's matrix and rates of bodies in lanes, and how many of their steps failed."""

    g: Any
    a: Any
    w: Any
    failed: Any


@trace
def find_sample(bodies, turn, g, a, w):
    """Return the rows of R_WB, one after the other, and w_WB_B; `turn` is cosine and sine of the angle of a spin left out."""
    b, (cos, sin), (x, y, z) = cross(g, a), turn, times(bodies.units, w)
    w = cos * x + sin * y, cos * y - sin * x, z
    R_WP = [add(add(scale(p, a), scale(q, b)), scale(r, g)) for p, q, r in bodies.axes]
    R_WP = [(cos * x + sin * y, cos * y - sin * x, z) for x, y, z in R_WP]
    return tuple(dot(row, axis) for row in (*R_WP, w) for axis in bodies.R_BP)


@entry
def enter_many(order, like, columns, motions, turns, done, until, n_steps, every, R_WB, w_WB_B):
    """Take the steps after `done` up to number `until`, each body in a lane of its own.

    `like` is a `Bodies` and a `Motion` of floats, whose numbers are in `columns` (., n) and `motions` (., n). Samples of every
    `every`-th step, and of the last of n_steps, go to R_WB (n samples 9,) and w_WB_B (n samples 3,), rad/s. `turns` (samples or
    1, 2, n) are cosines and sines of the angles of spins that are left out. A body whose step cannot be projected counts as
    failed from then on.
    """
    n, samples = columns.shape[1], 1 + (n_steps + every - 1) // every
    for at in range(0, n, REGISTER):
        bodies = load_rows(columns.reshape(-1), at, n, like[0], REGISTER)
        g, a, w, failed = load_rows(motions.reshape(-1), at, n, like[1], REGISTER)
        body, K, _ = begin(bodies)
        step, row = done, done // every
        while step < until:
            row += 1
            sampled = min(n_steps, row * every)
            end = min(until, sampled)
            while step < end:
                (g, a, w), _, _ = take_step(bodies.field, body[0], order, bodies.h, K, g, a, w)
                g, a, w, _, left = project(bodies.field, body, g, a, w, failed < 0.5)
                failed = choose(left < LEFT, failed, failed + 1.0)
                step += 1
            if step == sampled:
                turn = load_rows(turns.reshape(-1), 2 * n * min(row, len(turns) - 1) + at, n, 2, REGISTER)
                sample = find_sample(bodies, turn, g, a, w)
                save_columns(R_WB, 9 * (at * samples + row), 9 * samples, sample[:9])
                save_columns(w_WB_B, 3 * (at * samples + row), 3 * samples, sample[9:])
        save_rows(motions.reshape(-1), at, n, (g, a, w, failed))
