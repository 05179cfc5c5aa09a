"""Equal steps of a Taylor series, each projected back onto the invariants, in any field that has an axis and a recurrence.

The third of the axes D is the field's axis; for a free body it is the direction of the momentum. The state consists of g and
a, the third and the first row of the attitude's matrix relative to D, and the rates w, all in principal axes:

    g' = g x w        a' = a x w        J w' = (J w + r) x w + T        T = g x dV/dg

with the momentum r of a rotor.

If the field turns about an axis perpendicular to its own, the axes D turn with it at the rate u, about the second of them.
Then g' has the additional term u a and a' the additional term -u g. The Jacobi integral E - u b.L, with the second row b, is
conserved instead of the energy, and the momentum about the axis is not conserved.

The coefficients of a step come from the field's recurrence (`series`). After the step, g and a are made orthonormal. Energy and
momentum about the axis are restored to their initial values as in `projected`: by Newton's method along their gradients with
respect to L and to a rotation of the body. The series conserves the momentum about an axis of symmetry, so these gradients
exclude it. The momentum of a free body is l g for any g, so w follows from g, and only the energy is restored. One correction
leaves the square of a step's error, which is enough between samples; samples are corrected to round-off. Source: E. Hairer, C.
Lubich and G. Wanner, Geometric Numerical Integration (2006), IV.4.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..potentials.turning import Turned
from . import entry, kernel, small
from .axial import FLAT, TINY, significant
from .compiler.lanes import REGISTER, cache_by_identity, cache_by_types, gather_numbers, load_rows, save_rows
from .compiler.series import Series, Vectors, sum_orders, sum_to_order
from .compiler.signals import call_handlers, end_of_block
from .compiler.traced import trace
from .compiler.vector import accumulate, add, apply, choose, cross, dot, product, scale, some, subtract, times
from .protocol import Output, Result, Workspace, deliver, record, record_lanes
from .samples import END

FAILURE = "the step ends too far from the invariants to be projected onto them"
"""Reason that a step fails."""
PAUSE = 2**16
"""Steps between two calls of handlers of signals."""
MOST_CORRECTIONS = 8
"""Largest number of corrections of a projection."""
ENOUGH, NOISE = 2.0**-50, 2.0**-46
"""Relative defect after which a sample is not corrected further, and the largest defect that round-off alone can cause."""
BETWEEN = 2.0**-24
"""Relative defect after which a step is not corrected further. Each step is projected onto the initial values, so what is left
does not add up, and it is at most 1/4096 of the step's own error, whose square it is."""
FAR, LEFT = 0.1, 1e-6
"""Largest relative defect of a step before and after projection."""
DEPENDENT = 1e-8
"""Regularisation, relative, of the gradients' Gram determinant."""


class Model(NamedTuple):
    """The body, its field and its start in principal axes.

    `J` and `J_inverse` are the moments and their inverses. `loose` is 1 for each component of L that a projection may change,
    otherwise 0. `scales` are the reference scales of energy, J, and momentum, kg m^2/s. `left` is the quaternion of the
    rotation from axes D to world axes. `g` and `a` are the third and the first row of the matrix relative to D, `q` and `L` the
    attitude in the world and the momentum, all at the start. `rotor` is the momentum of the rotor, which L does not contain; ()
    without one.
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
    rotor: Any = ()


class Coefficients(NamedTuple):
    """Order of the series, and step size, s."""

    order: int
    h: float


class Free(NamedTuple):
    """No field: size of the momentum, kg m^2/s, whose direction is g. `UniformField` explains the functions."""

    momentum: Any

    def find_constants(self, J_inverse):
        """Return J/l, by which g follows from the rates."""
        return tuple(1.0 / (self.momentum * x + TINY) for x in J_inverse)

    def slope(self, constants, g):
        """Return V and dV/dg, 0."""
        return 0.0, (0.0, 0.0, 0.0)

    def series(self, constants, g, series):
        """Return a function that returns no torque."""
        return lambda c, n: None


def whole(rotor, L):
    """Return the momentum L of the body plus the momentum of its rotor, which is () without one."""
    return add(L, rotor) if rotor else L


def values(field, constants, L, rotor, n, g, w):
    """Return energy and momentum about the axis for n g instead of g, to first order, and dV/dg."""
    V, slope = field.slope(constants, g)
    return 0.5 * dot(L, w) + V + (n - 1.0) * dot(slope, g), n * dot(whole(rotor, L), g), slope


def turning_values(field, constants, L, rotor, n, g, upright, w):
    """Return the Jacobi integral, the momentum about the axis, dV/dg and the rates of D, for n g and `upright` as g and a."""
    energy, momentum, slope = values(field, constants, L, rotor, n, g, w)
    o = scale(field.rate * n, cross(g, upright))
    return energy - dot(whole(rotor, L), o), momentum, slope, o


@trace
def begin(model):
    """Return (constants of the field, (J, J_inverse, loose, r), conserved values, scales and their inverses), K, and the rates.

    K = ((J2 - J3)/J1, (J3 - J1)/J2, (J1 - J2)/J3), and with a rotor of momentum r also J^-1 (r2, r3, r1) and J^-1 (r3, r1, r2).
    """
    J, J_inverse, field, scales, rotor = model.J, model.J_inverse, model.field, model.scales, getattr(model, "rotor", ())
    constants, w = field.find_constants(J_inverse), times(J_inverse, model.L)
    K = times((J[1] - J[2], J[2] - J[0], J[0] - J[1]), J_inverse)
    if rotor:
        K = (*K, *times(J_inverse, (rotor[1], rotor[2], rotor[0])), *times(J_inverse, (rotor[2], rotor[0], rotor[1])))
    n, upright, _ = straighten(model.g, model.a)
    if isinstance(field, Turned):
        kept = turning_values(field, constants, times(J, w), rotor, n, model.g, upright, w)[:2]
    else:
        kept = values(field, constants, times(J, w), rotor, n, model.g, w)[:2]
    scales = scales[0], scales[1], 1.0 / scales[0], 1.0 / scales[1]
    return (constants, (J, J_inverse, model.loose, rotor), kept, scales), K, w


def grow(field, constants, order, h, K, g, a, w):
    """Return the kind of a step's series, its start, the sum and terms of an order (`sum_orders`), and all coefficients."""
    series = Series(w[0])
    start = tuple(series.vector(*v) for v in (g, a, w))
    turn = series.broadcast(field.rate) if isinstance(field, Turned) else None
    ratio = series.vector(*constants) if isinstance(field, Free) and len(K) == 3 else None
    accelerate, terms = field.series(constants, g, series), Vectors(series, len(start))
    if len(K) > 3:
        accelerate = add_rotor(accelerate, series.vector(*K[3:6]), series.vector(*K[6:]))
    sums = sum_orders(series, terms, series.broadcast(h), start, series.vector(*K[:3]), accelerate, turn, ratio)
    return series, start, sum_to_order(order, sums), terms


def add_rotor(accelerate, first, second):
    """Return `accelerate` with the torque r x w of a rotor of momentum r; the vectors are from `begin`."""

    def accelerate_all(c, n):
        torque, own = accelerate(c, n), first * c[n, 5] - second * c[n, 4]
        return own if torque is None else torque + own

    return accelerate_all


@trace
def take_step(field, constants, order, h, K, g, a, w):
    """Return the state after one step, not projected."""
    series, start, (change, *_), _ = grow(field, constants, order, h, K, g, a, w)
    return tuple(series.split(v + d) for v, d in zip(start, change, strict=True))


def straighten(g, a):
    """Return 1/|g| and a made orthonormal to g, both to first order, and the defect of orthonormality."""
    n, m, c = 0.5 - 0.5 * dot(g, g), 0.5 - 0.5 * dot(a, a), dot(a, g)
    return 1.0 + n, subtract(scale(1.0 + m, a), scale(c, g)), abs(n) + abs(m) + abs(c)


def shortest_move(loose, scales, w, L, T, e, m, g):
    """Return the smallest (dL, rotation of the body) that changes energy by e and momentum about the axis by m, to first order.

    Gradients are with respect to (L / size, rotation): (size w, -T) and (size g, L x g) with the torque T. The third result is
    the share of e and m that regularisation leaves uncorrected.
    """
    turn, square = cross(L, g), scales[1] * scales[1]
    w, g = times(loose, w), times(loose, g)
    ee = square * dot(w, w) + dot(T, T) + FLAT * (scales[0] * scales[0]) + TINY
    mm = square * dot(g, g) + dot(turn, turn) + FLAT * square
    em = square * dot(w, g) - dot(T, turn)
    over = 1.0 / ((1.0 + DEPENDENT) * (ee * mm) - em * em)
    # Cramer's rule for ee x + em y = e, em x + mm y = m: no branch, and one division
    x, y = over * (mm * e - em * m), over * (ee * m - em * e)
    rest = over * (DEPENDENT * (ee * mm) + FLAT * (scales[0] * scales[0] * mm + square * ee))
    return scale(square, add(scale(x, w), scale(y, g))), add(scale(-x, T), scale(y, turn)), rest


def correct_in_field(field, constants, body, kept, scales, g, a, w):
    """Correct a state in a field (`find_correction`).

    The inverse length of g is two terms of its series, and energy and momentum belong to the normalised g to first order, so
    that no product waits for another. The remaining defect is of the size of the square of the first one, plus the share that
    regularisation leaves.
    """
    J, J_inverse, loose, rotor = body
    L, (n, upright, off) = times(J, w), straighten(g, a)
    energy, momentum, slope = values(field, constants, L, rotor, n, g, w)
    e, m = kept[0] - energy, kept[1] - momentum
    wanted = significant(e, scales[0]), significant(m, scales[1])
    dL, turn, rest = shortest_move(loose, scales, w, whole(rotor, L), cross(g, slope), *wanted, g)
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, add(w, times(J_inverse, dL)), abs(e) * scales[2] + abs(m) * scales[3] + off, rest


def correct_free(field, constants, body, kept, scales, g, a):
    """Correct a free body: the momentum is along g, so w follows from g, and rotating g restores the energy."""
    (_, J_inverse, _, rotor), (n, upright, off) = body, straighten(g, a)
    L = scale(n * field.momentum, g)
    own = subtract(L, rotor) if rotor else L
    e, slope = kept[0] - 0.5 * dot(own, times(J_inverse, own)), cross(times(J_inverse, own), L)
    flat = FLAT * (scales[0] * scales[0])
    over = 1.0 / (dot(slope, slope) + flat + TINY)
    turn = scale(significant(e, scales[0]) * over, slope)
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    L = scale(field.momentum, g)
    return g, a, times(J_inverse, subtract(L, rotor) if rotor else L), abs(e) * scales[2] + off, flat * over


def correct_revolving(field, constants, body, kept, scales, g, a, w):
    """Correct a state in a field that turns at rates o: the gradients of the Jacobi integral are w - o and -(T + L x o)."""
    J, J_inverse, _, rotor = body
    L, (n, upright, off) = times(J, w), straighten(g, a)
    jacobi, _, slope, o = turning_values(field, constants, L, rotor, n, g, upright, w)
    e = kept[0] - jacobi
    v, T = subtract(w, o), add(cross(g, slope), cross(whole(rotor, L), o))
    square, flat = scales[1] * scales[1], FLAT * (scales[0] * scales[0])
    over = 1.0 / (square * dot(v, v) + dot(T, T) + flat + TINY)
    x = significant(e, scales[0]) * over
    dL, turn = scale(x * square, v), scale(-x, T)
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, add(w, times(J_inverse, dL)), abs(e) * scales[2] + off, flat * over


def find_correction(field, constants, body, kept, scales, g, a, w):
    """Return (g, a, w) closer to orthonormality and to the values `kept`, the relative defect before, and the share left.

    `body` is (J, J_inverse, loose, rotor) of `Model`. The share is the part of the defect that regularisation leaves.
    """
    if isinstance(field, Free):
        return correct_free(field, constants, body, kept, scales, g, a)
    if isinstance(field, Turned):
        return correct_revolving(field, constants, body, kept, scales, g, a, w)
    return correct_in_field(field, constants, body, kept, scales, g, a, w)


@trace
def correct(field, body, enough, g, a, w):
    """Return (g, a, w) of `find_correction`, the relative defect that remains, and whether to correct once more.

    The square of the defect remains, and the share that regularisation leaves of the part above round-off.
    """
    if hasattr(field, "advance"):
        g, defect, rest = field.correct(g)
    else:
        g, a, w, defect, rest = find_correction(field, *body, g, a, w)
    beyond_noise = choose(defect > NOISE, defect - NOISE, 0.0)
    left = defect * defect + choose(rest < 1.0, rest, 1.0) * beyond_noise
    return g, a, w, left, (left > enough) & (defect < FAR)


@trace
def start_of(model):
    """Return `begin`, and g, a, w and the sums of angles with what was rounded off."""
    if hasattr(model.field, "advance"):
        return ((), ()), (), (model.g, (), ()), model.a
    body, K, w = begin(model)
    return body, K, (model.g, model.a, w), ()


@trace
def advance(field, constants, order, h, K, g, a, w, angles):
    """Return the state after one step, not projected, and the sums of angles."""
    if not hasattr(field, "advance"):
        return take_step(field, constants, order, h, K, g, a, w), angles
    x, changes = field.advance(order, h, g)
    return (x, a, w), tuple(accumulate(*angle, change) for angle, change in zip(angles, changes, strict=True))


@trace
def find_rows(field, g, a, w, angles):
    """Return g, a and w of a state."""
    return field.find_rows(g, [x for x, _ in angles]) if angles else (g, a, w)


@partial(kernel, forceinline=True)
def project(field, body, enough, g, a, w, left, needed):
    """Return (g, a, w) projected onto the invariants, the number of corrections, and the relative defect that remains.

    Bodies that need no correction, or none after some corrections, do not change. `left` is their defect before.
    """
    corrections = 0
    while corrections < MOST_CORRECTIONS and some(needed):
        g1, a1, w1, left1, needed1 = correct(field, body, enough, g, a, w)
        g, a, w, left = choose(needed, (g1, a1, w1, left1), (g, a, w, left))
        needed = needed & needed1
        corrections += 1
    return g, a, w, corrections, left


@small
def quaternion(g, a):
    """Return the quaternion, of any length, of the matrix with third row g and first row a."""
    # One body can branch, and computes one of four formulas. The length has no meaning (`samples.to_body_axes`).
    b = cross(g, a)
    trace = a[0] + b[1] + g[2]
    if trace > 0.0:
        return (1.0 + trace, g[1] - b[2], a[2] - g[0], b[0] - a[1])
    if a[0] >= b[1] and a[0] >= g[2]:
        return (g[1] - b[2], 1.0 + a[0] - b[1] - g[2], a[1] + b[0], a[2] + g[0])
    if b[1] >= g[2]:
        return (a[2] - g[0], a[1] + b[0], 1.0 - a[0] + b[1] - g[2], b[2] + g[1])
    return (b[0] - a[1], a[2] + g[0], b[2] + g[1], 1.0 - a[0] - b[1] + g[2])


@partial(kernel, forceinline=True)
def march(model, coefficients, workspace):
    """Take the steps (`protocol`). A step that cannot be projected fails; the size is the relative defect that remains."""
    field, left = model.field, model.left
    order, h = coefficients
    n_steps, every, pause, q_out, L_out = workspace
    body, K, (g, a, w), angles = start_of(model)
    constants = body[0]
    record(0, model.q, model.L, q_out, L_out)
    row, corrections, until_sample, done, defect = 0, 0, every, 0, 0.0
    while done < n_steps and defect < LEFT:
        last = end_of_block(done, n_steps, pause)
        while done < last:
            (g1, a1, w1), angles = advance(field, constants, order, h, K, g, a, w, angles)
            g, a, w, defect, needed = correct(field, body, BETWEEN, g1, a1, w1)
            g, a, w, more, defect = project(field, body, BETWEEN, g, a, w, defect, needed)
            corrections += 1 + more
            if not defect < LEFT:
                break
            done += 1
            until_sample -= 1
            if until_sample == 0 or done == n_steps:
                until_sample = every
                row += 1
                # The motion continues from the state before, so that it does not depend on the samples.
                g1, a1, w1, more, _ = project(field, body, ENOUGH, g, a, w, defect, defect > ENOUGH)
                corrections += more
                g1, a1, w1 = find_rows(field, g1, a1, w1, angles)
                record(row, product(left, quaternion(g1, a1)), times(model.J, w1), q_out, L_out)
        if done < n_steps:
            call_handlers()
    # The step that failed was computed, too.
    taken = done + (not defect < LEFT)
    return Result(done, done * order, corrections, taken * order, defect, False)


@cache_by_types
def enter_like(like):
    """Return `march` as Python calls it, for a model and a step size arranged like `like`."""

    @entry
    def enter(numbers, order, n_steps, every, pause, q, L, R_WB, w_WB_B):
        """Take the numbers of the model, the step size and the axes of samples as one array.

        A named tuple as an argument takes 1.1 us, an array 0.1 us.
        """
        model, h = load_rows(numbers, 0, 1, like, 1)
        workspace = Workspace(n_steps, every, pause, q, L)
        result = march(model, Coefficients(order, h), workspace)
        return deliver(result, workspace, Output(numbers[len(numbers) - END :], R_WB, w_WB_B))

    return enter


def bind(model, coefficients, axes):
    """Return `march` as Python calls it (`protocol`), without the arguments that are given here."""
    numbers, enter = gather_model(model)
    return partial(enter, np.concatenate([numbers, [coefficients.h], axes]), coefficients.order)


@cache_by_identity
def gather_model(model):
    """Return the numbers of a model, and `enter` for it."""
    numbers, like = gather_numbers(model)
    return numbers, enter_like((like, 0.0))


class Bodies(NamedTuple):
    """Bodies in lanes: the numbers of `Model`, and others for steps and samples.

    `h` is the step size in the units of the body. `axes` are the rows of the rotation from axes D to world axes, and `R_BP`
    the rows of the rotation from principal to body axes. `units` converts rates of the body's units to rad/s; its third part
    contains the spin if the body is described in a non-spinning frame.
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


class LaneState(NamedTuple):
    """Rows of the attitude's matrix and rates of bodies in lanes, the step that failed (0: none), and its defect."""

    g: Any
    a: Any
    w: Any
    failed: Any
    defect: Any


@trace
def find_sample(bodies, turn, g, a, w):
    """Return R_WB by rows and w_WB_B; `turn` is cosine and sine of the angle of the frame's spin, () without one."""
    b = cross(g, a)
    rows = [add(add(scale(p, a), scale(q, b)), scale(r, g)) for p, q, r in bodies.axes] + [times(bodies.units, w)]
    if turn:
        cos, sin = turn
        rows = [(cos * x + sin * y, cos * y - sin * x, z) for x, y, z in rows]
    return tuple(x for row in rows for x in (apply(bodies.R_BP, row) if bodies.R_BP else row))


@entry
def enter_many(order, like, columns, motions, turns, done, until, n_steps, every, R_WB, w_WB_B):
    """Take the steps after `done` up to number `until`, each body in a lane of its own.

    `like` is a `Bodies` and a `LaneState` of floats, whose numbers are in `columns` (., n) and `motions` (., n). Samples of
    every `every`-th step, and of the last of n_steps, go to R_WB (n samples 9,) and w_WB_B (n samples 3,), rad/s. `turns`
    (samples or 1, 2, n) are cosines and sines of the angles of spins that are left out. A body whose step cannot be projected
    counts as failed from then on; its samples after that step have no meaning.
    """
    n, samples = columns.shape[1], 1 + (n_steps + every - 1) // every
    for at in range(0, n, REGISTER):
        bodies = load_rows(columns.reshape(-1), at, n, like[0], REGISTER)
        g, a, w, failed, defect = load_rows(motions.reshape(-1), at, n, like[1], REGISTER)
        body, K, _ = begin(bodies)
        step, row = done, done // every
        while step < until:
            row += 1
            sampled = min(n_steps, row * every)
            end = min(until, sampled)
            while step < end:
                g, a, w = take_step(bodies.field, body[0], order, bodies.h, K, g, a, w)
                g, a, w, left, needed = correct(bodies.field, body, BETWEEN, g, a, w)
                g, a, w, _, left = project(bodies.field, body, BETWEEN, g, a, w, left, needed & (failed < 0.5))
                step += 1
                failing = choose(left < LEFT, 1.0, failed) < 0.5
                if some(failing):
                    failed, defect = choose(failing, (1.0 * step, left), (failed, defect))
            if step == sampled:
                turn = load_rows(turns.reshape(-1), 2 * n * min(row, len(turns) - 1) + at, n, 2, REGISTER)
                needed = (left > ENOUGH) & (failed < 0.5)
                g1, a1, w1, _, _ = project(bodies.field, body, ENOUGH, g, a, w, left, needed)
                sample = find_sample(bodies, turn, g1, a1, w1)
                record_lanes(at, row, samples, sample[:9], R_WB)
                record_lanes(at, row, samples, sample[9:], w_WB_B)
        save_rows(motions.reshape(-1), at, n, (g, a, w, (failed, defect)))
