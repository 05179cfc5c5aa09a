"""Series steps as long as a tolerance allows, with samples between their ends: the series itself, projected (`taylor`).

The coefficients belong to a guessed length. Their last two terms determine the guess for the next step (A. Jorba and M. Zou, A
software package for the numerical integration of ODEs by means of high-order Taylor methods, 2005). A step whose terms exceed
the tolerance is computed again, shorter: the first one, and few others. Samples and the end of the step are values of the same
polynomials, by Horner's scheme, each projected onto the invariants, several samples at once in the lanes of a register. Samples
are therefore as accurate as steps, and no step ends at one.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

from ..arithmetic import cosine, root, sine
from . import entry, kernel
from .axial import TINY
from .compiler.lanes import REGISTER, load, save_columns
from .compiler.series import recall
from .compiler.signals import call_handlers, end_of_block
from .compiler.traced import trace
from .compiler.vector import accumulate, dot, every, fill_like, fuse
from .protocol import Result, find_ends, loosen
from .taylor import BETWEEN, ENOUGH, LEFT, Model, begin, correct, expand, find_sample, project
from .taylor import FAILURE as FAILURE
from .taylor import PAUSE as PAUSE

SAFETY, SHORTEST = 0.8, 2.0**-30
"""Factor between a step and the longest that the tolerance allows, and the shortest step, in distances of the grid's times."""


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
def find_turn(spin, t, further):
    """Return cosine and sine of the spin's angle at a time, s, plus a further angle, which can be (); () without a spin."""
    if not spin:
        return ()
    cos, sin = cosine(spin[0] * t), sine(spin[0] * t)
    return (cos * further[0] - sin * further[1], sin * further[0] + cos * further[1]) if further else (cos, sin)


@partial(kernel, forceinline=True, ahead=True)
def march(model, frame, order, h, tolerance, n_steps, sampled, pause, lanes, R_WB, w_WB_B):
    """Fill R_WB (9 n,) and w_WB_B (3 n,) from the second sample on, n `REGISTER` more than the samples (`protocol`).

    The series has an order and a tolerance for its last two terms; the grid's times are h, s, apart. `lanes` are the numbers 0,
    1, ... of the lanes. A step that cannot be projected fails; the size is the relative defect that remains at its end.
    """
    field, g, a = model.field, model.g, model.a
    body, K, w = begin(model)
    constants, _, _, scales = body
    ahead = load(lanes, 0, REGISTER) * float(sampled)
    further = find_turn(frame.spin, ahead * h, ())
    row, done, following, corrections, steps, computed, defect, good = 1, 0, min(sampled, n_steps), 0, 0, 0, 0.0, True
    # Times are in units of h: the step begins at whole + rest and has a length; its next sample is at `following`.
    whole, rest, carry, length = 0, 0.0, 0.0, 1.0
    while done < n_steps and good:
        pausing = end_of_block(computed, 2**62, pause)
        while done < n_steps and good and computed < pausing:
            (g1, a1, w1), sizes, terms = take_step(field, constants, order, length * h, K, g, a, w, scales)
            computed += 1
            last, before = sizes[0] + TINY, sizes[1] + TINY
            factor = min((tolerance / last) ** (1.0 / order), (tolerance / before) ** (1.0 / (order - 1)))
            # The factor of a step that overflows is 0 or nan: a tenth of its length is tried.
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
                sample = find_sample(frame, find_turn(frame.spin, following * h, further), g2, a2, w2)
                save_columns(R_WB, 9 * row, 9, sample[:9])
                save_columns(w_WB_B, 3 * row, 3, sample[9:])
                for i in range(REGISTER):
                    # A shorter last interval does not fit the angles of the lanes.
                    if good and done < n_steps and first <= length and (i == 0 or following - done == sampled):
                        row, done, following = row + 1, following, min(following + sampled, n_steps)
                        first = (following - whole) - rest
            g, a, w = g1, a1, w1
            steps += 1
            # Whole distances are counted as integers, so that late times have as many digits as early ones.
            rest, carry = accumulate(rest, carry, length)
            passed = math.floor(rest)
            whole, rest = whole + int(passed), rest - passed
            length = min(max(SAFETY * factor * length, SHORTEST), (n_steps - whole) - rest)
        if done < n_steps:
            call_handlers()
    return Result(done, steps * order, corrections, computed * order, defect, False)


MODEL_END, FRAME_END = find_ends(Model, Frame)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    return loosen(march(Model(*loose[:MODEL_END]), Frame(*loose[MODEL_END:FRAME_END]), *loose[FRAME_END:]))
