"""Series steps as long as a tolerance allows, with samples between their ends: the series itself, projected (`taylor`).

The coefficients belong to a guessed length, that of the step before. The last two terms then determine the length of the step
(A. Jorba and M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods, 2005), so
no step is repeated. Samples and the end of the step are values of the same polynomials, by Horner's scheme, each projected onto
the invariants, several at once in the lanes of a register. Samples are therefore as accurate as steps, and no step ends at one.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

from ..arithmetic import cosine, root, sine
from . import entry, kernel, small
from .lanes import REGISTER, load, save_columns
from .protocol import Result, find_ends, loosen
from .series import recall
from .signals import call_handlers, end_of_block
from .taylor import BETWEEN, ENOUGH, LEFT, TINY, Model, begin, correct, expand, project
from .taylor import FAILURE as FAILURE
from .taylor import PAUSE as PAUSE
from .traced import trace
from .vector import accumulate, add, apply, cross, dot, every, fill_like, fuse, scale, times

SAFETY, SHORTEST = 0.8, 2.0**-30
"""Factor between a step and the longest that the tolerance allows, and the shortest step, in distances of the grid's times."""
MOST_STEPS = 2**62
"""More steps than can be taken."""


class Coefficients(NamedTuple):
    """Order of the series, distance of the grid's times, s, and tolerance for the last two terms."""

    order: int
    h: float
    tolerance: float


class Frame(NamedTuple):
    """Conversion of states to samples.

    `axes` are the rows of the rotation from axes D to world axes, `R_BP` those from principal to body axes, () if they are the
    same. `units` are factors of the rates. `spin` is () or, in a non-spinning frame, the omitted rate, rad/s.
    """

    axes: Any
    R_BP: Any
    units: Any
    spin: Any


@trace
def take_step(field, constants, order, h, K, g, a, w, scales):
    """Return the state after one step, not projected, the sizes of the last two terms, and what `recall` needs of all.

    Rates are in units of the rate of the slowest axis at the same energy.
    """
    end, *terms, coefficients = expand(field, constants, order, h, K, g, a, w)
    over = 0.5 * scales[1] * scales[2]
    sizes = tuple(root(dot(g, g) + dot(a, a) + over * over * dot(w, w)) for g, a, w in terms)
    return end, sizes, coefficients.locate()


@small
def stretch(tolerance, order, large):
    """Return the factor by which the step may grow, from the sizes of its last two terms."""
    last, before = large[0] + TINY, large[1] + TINY
    return min((tolerance / last) ** (1.0 / order), (tolerance / before) ** (1.0 / (order - 1)))


recall = trace(recall)


@trace
def add_product(x, s, terms):
    """Return s x + terms, three vectors each; x can be ()."""
    if not x:
        return tuple(tuple(fill_like(c, s) for c in v) for v in terms)
    return tuple(tuple(fuse(y, s, c) for y, c in zip(*each, strict=True)) for each in zip(x, terms, strict=True))


@partial(kernel, forceinline=True)
def evaluate(terms, order, s, state):
    """Return the states at shares s of a step from `state`, not projected."""
    x = add_product((), s, recall(terms, order))
    for n in range(order - 1, 0, -1):
        x = add_product(x, s, recall(terms, n))
    return add_product(x, s, state)


@trace
def find_turn(spin, t):
    """Return cosine and sine of the angle of the spin at a time, s; () without a spin."""
    return (cosine(spin[0] * t), sine(spin[0] * t)) if spin else ()


@trace
def find_sample(frame, turn, further, g, a, w):
    """Return R_WB by rows and w_WB_B; the spin's angle is the sum of those of `turn` and `further` (`find_turn`)."""
    b = cross(g, a)
    rows = [add(add(scale(p, a), scale(q, b)), scale(r, g)) for p, q, r in frame.axes] + [times(frame.units, w)]
    if turn:
        (c, s), (c1, s1) = turn, further
        cos, sin = c * c1 - s * s1, s * c1 + c * s1
        rows = [(cos * x + sin * y, cos * y - sin * x, z) for x, y, z in rows]
    return tuple(x for row in rows for x in (apply(frame.R_BP, row) if frame.R_BP else row))


@partial(kernel, forceinline=True, ahead=True)
def march(model, coefficients, frame, n_steps, sampled, pause, lanes, R_WB, w_WB_B):
    """Fill R_WB (9 n,) and w_WB_B (3 n,) from the second sample on, n `REGISTER` more than the samples (`protocol`).

    `lanes` are the numbers 0, 1, ... of the lanes. A step that cannot be projected fails; the size is the relative defect that
    remains at its end.
    """
    field, g, a = model.field, model.g, model.a
    order, h, tolerance = coefficients
    body, K, w = begin(model)
    constants, _, _, scales = body
    ahead = load(lanes, 0, REGISTER) * float(sampled)
    further = find_turn(frame.spin, ahead * h)
    row, done, following, corrections, steps, computed, defect, good = 1, 0, min(sampled, n_steps), 0, 0, 0, 0.0, True
    # Times are in units of h: the step begins at whole + rest and has a length; its next sample is at `following`.
    whole, rest, carry, length = 0, 0.0, 0.0, 1.0
    while done < n_steps and good:
        pausing = end_of_block(computed, MOST_STEPS, pause)
        while done < n_steps and good and computed < pausing:
            (g1, a1, w1), sizes, terms = take_step(field, constants, order, length * h, K, g, a, w, scales)
            computed += 1
            factor = stretch(tolerance, order, sizes)
            if not factor >= 1.0 and length > SHORTEST:
                length *= SAFETY * factor if factor > 0.1 else 0.1
                continue
            g1, a1, w1, defect, needed = correct(field, body, BETWEEN, g1, a1, w1)
            g1, a1, w1, more, defect = project(field, body, BETWEEN, g1, a1, w1, defect, needed)
            corrections += 1 + more
            good = defect < LEFT
            first = (following - whole) - rest
            while good and done < n_steps and first <= length:
                at = min(first + ahead, length)
                g2, a2, w2 = evaluate(terms, order, at * (1.0 / length), (g, a, w))
                g2, a2, w2, left, needs = correct(field, body, ENOUGH, g2, a2, w2)
                g2, a2, w2, _, left = project(field, body, ENOUGH, g2, a2, w2, left, needs)
                good = every(left < LEFT)
                sample = find_sample(frame, find_turn(frame.spin, following * h), further, g2, a2, w2)
                save_columns(R_WB, 9 * row, 9, sample[:9])
                save_columns(w_WB_B, 3 * row, 3, sample[9:])
                for i in range(REGISTER):
                    # A shorter last interval does not fit the angles of the lanes.
                    if good and done < n_steps and first <= length and (i == 0 or following - done == sampled):
                        row, done, following = row + 1, following, min(following + sampled, n_steps)
                        first = (following - whole) - rest
            g, a, w = g1, a1, w1
            steps += 1
            rest, carry = accumulate(rest, carry, length)
            passed = math.floor(rest)
            whole, rest = whole + int(passed), rest - passed
            length = min(max(SAFETY * factor * length, SHORTEST), (n_steps - whole) - rest)
        if done < n_steps:
            call_handlers()
    return Result(done, steps * order, corrections, computed * order, defect, False)


MODEL_END, COEFFICIENTS_END = find_ends(Model, Coefficients)
FRAME_END = COEFFICIENTS_END + len(Frame._fields)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    return loosen(march(model, coefficients, Frame(*loose[COEFFICIENTS_END:FRAME_END]), *loose[FRAME_END:]))
