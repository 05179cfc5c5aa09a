"""Series steps as long as a tolerance allows, with samples between their ends: the series itself, projected (`taylor`).

The coefficients belong to a guessed length, the last step's. Their last terms determine the length (A. Jorba and M.
Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods, 2005), and the values of
the polynomials there are the end of the step. No step is rejected, and the first guess hardly matters. Samples are values of
the same polynomials, several at once in the lanes of a register. Ends and samples are projected onto the invariants. Samples
are therefore as accurate as steps, and no step ends at one.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..arithmetic import choose, cosine, sine
from . import entry, kernel
from .compiler.lanes import REGISTER, cache_by_types, gather_numbers, load, load_rows, save_columns
from .compiler.series import TWICE, Series, recall
from .compiler.signals import call_handlers, end_of_block
from .compiler.traced import fast_exp2, fast_log2, trace
from .compiler.vector import accumulate, every, fill_like, fuse
from .protocol import Result, loosen
from .samples import END, RATE, turn_by_orbit
from .taylor import BETWEEN, ENOUGH, LEFT, begin, correct, find_sample, grow, project
from .taylor import FAILURE as FAILURE
from .taylor import PAUSE as PAUSE

SHARE, SLOW = 0.5, 0.25
"""Largest term, in tolerances, and unit of rates, in rates of the slowest axis at the same energy. With these, the
median error of random bodies is at most heyoka's with the same tolerance, 1e-3 or less."""
SHORTEST, LONGER = 2.0**-30, 4.0
"""Shortest step, in distances of the grid's times, and log2 of the longest one, in guessed lengths: terms can underflow."""


class Frame(NamedTuple):
    """Conversion of states to samples.

    `axes` are the rows of the rotation from axes D to world axes, `R_BP` the rows of the rotation from principal to body axes,
    () if these are the same. `units` are factors of the rates. `spin` is () or, in a non-spinning frame, the omitted rate,
    rad/s.
    """

    axes: Any
    R_BP: Any
    units: Any
    spin: Any


@trace
def expand(field, constants, order, h, K, g, a, w, over, largest, over_order):
    """Return the share of a step at which the two terms before the last are so large, and the terms of `evaluate`.

    `largest` is log2 of the size's square; rates count `over` times. `over_order` are halves of the terms' inverse orders.
    """
    series, _, (_, *sized), terms = grow(field, constants, order, h, K, g, a, w)
    squares = (sum(series.split(fuse(w * over, w * over, fuse(a, a, g * g)))) for g, a, w in sized)
    x, y = ((largest - fast_log2(square)) * factor for square, factor in zip(squares, over_order, strict=True))
    least = choose(x < y, x, y)
    return fast_exp2(choose(least < LONGER, least, LONGER)), terms.locate()


@trace
def add_terms(x, s, terms, n, m):
    """Return s^2 x plus s times the coefficients n, plus the coefficients m = n - 1; x can be ()."""
    series = Series(s)
    pairs = zip(recall(terms, n, series), recall(terms, m, series), strict=True)
    added = [fuse(c, s, d) for c, d in pairs]
    return tuple(fuse(y, s * s, d) for y, d in zip(x, added, strict=True)) if x else tuple(added)


@trace
def add_start(x, s, g, a, w):
    """Return the state after s x is added; x is r of vectors (`Vectors`)."""
    series = Series(s)
    starts = (series.vector(*(fill_like(c, s) for c in v)) for v in (g, a, w))
    return tuple(series.split(fuse(series.shuffle(y, TWICE), s, v)) for y, v in zip(x, starts, strict=True))


@partial(kernel, forceinline=True)
def evaluate(terms, order, s, g, a, w):
    """Return the states at a share s of the guessed length, or at several, from the start of a step. They are not projected."""
    # Two terms at once, of an even order: half as many sums wait for each other.
    x = add_terms((), s, terms, order, order - 1)
    for n in range(order - 2, 0, -2):
        x = add_terms(x, s, terms, n, n - 1)
    return add_start(x, s, g, a, w)


@trace
def find_turn(spin, t, further):
    """Return cosine and sine of the spin's angle at a time, s, plus a further angle, which can be (); () without a spin."""
    if not spin:
        return ()
    cos, sin = cosine(spin[0] * t), sine(spin[0] * t)
    return (cos * further[0] - sin * further[1], sin * further[0] + cos * further[1]) if further else (cos, sin)


@kernel
def copy(values, at, out, to, n):
    """Copy n numbers of one array, from `at` on, to another one, from `to` on."""
    for i in range(n):
        out[to + i] = values[at + i]


@kernel
def complete(result, n_steps, sampled, h, first, axes, R_WB, w_WB_B):
    """Fill the first sample, and turn the others from the axes of an orbit.

    Return the fields of the result and the number of samples.
    """
    copy(first, 0, R_WB.reshape(-1), 0, 9)
    copy(first, 9, w_WB_B.reshape(-1), 0, 3)
    n = len(R_WB) if result.done == n_steps else 1 + result.done // sampled
    if axes[RATE] != 0.0:
        for i in range(1, n):
            turn_by_orbit(axes, min(i * sampled, n_steps) * h, i, R_WB)
    return (*loosen(result), n)


@partial(kernel, forceinline=True)
def march(model, frame, order, h, largest, n_steps, sampled, pause, lanes, room, R_WB, w_WB_B):
    """Fill R_WB (9 n,) and w_WB_B (3 n,) from the second sample on (`protocol`).

    The order is even. The grid's times are h, s, apart. `largest` is as `bind` passes it to `expand`, `lanes` are the numbers
    0, 1, ... of the lanes. `room` (12 `REGISTER`,) has the samples of the lanes if not all of them are samples of the run. A
    step that cannot be projected fails; the size is the relative defect that remains at its end.
    """
    field, g, a = model.field, model.g, model.a
    body, K, w = begin(model)
    constants, _, _, scales = body
    places = lanes * float(sampled)
    further = find_turn(frame.spin, places * h, ())
    row, done, following, corrections, steps, computed, defect, good = 1, 0, min(sampled, n_steps), 0, 0, 0, 0.0, True
    # Times are in units of h: the step begins at whole + rest; its next sample is at `following`. 1 rad is guessed at first.
    whole, rest, carry, over = 0, 0.0, 0.0, 0.5 / SLOW * scales[1] * scales[2]
    length, over_order = 1.0 / (scales[1] * max(*model.J_inverse) * h), (0.5 / (order - 1), 0.5 / (order - 2))
    while done < n_steps and good:
        pausing = end_of_block(computed, 2**62, pause)
        while done < n_steps and good and computed < pausing:
            share, terms = expand(field, constants, order, length * h, K, g, a, w, over, largest, over_order)
            computed += 1
            inverse, left = 1.0 / length, (n_steps - whole) - rest
            share = min(max(share, SHORTEST * inverse), left * inverse)
            step = share * length if share < left * inverse else left
            g1, a1, w1 = evaluate(terms, order, share, g, a, w)
            g1, a1, w1, defect, needed = correct(field, body, BETWEEN, g1, a1, w1)
            g1, a1, w1, more, defect = project(field, body, BETWEEN, g1, a1, w1, defect, needed)
            corrections += 1 + more
            good = defect < LEFT
            ahead = (following - whole) - rest
            while good and done < n_steps and ahead <= step:
                at = min(ahead + places, step)
                g2, a2, w2 = evaluate(terms, order, at * inverse, g, a, w)
                g2, a2, w2, defects, needs = correct(field, body, ENOUGH, g2, a2, w2)
                g2, a2, w2, _, defects = project(field, body, ENOUGH, g2, a2, w2, defects, needs)
                good = every(defects < LEFT)
                sample = find_sample(frame, find_turn(frame.spin, following * h, further), g2, a2, w2)
                direct = 3 * (row + REGISTER) <= len(w_WB_B)
                save_columns(R_WB if direct else room, 9 * row if direct else 0, 9, sample[:9])
                save_columns(w_WB_B if direct else room, 3 * row if direct else 9 * REGISTER, 3, sample[9:])
                for i in range(REGISTER):
                    # A shorter last interval does not fit the angles of the lanes.
                    if good and done < n_steps and ahead <= step and (i == 0 or following - done == sampled):
                        if not direct:
                            copy(room, 9 * i, R_WB, 9 * row, 9)
                            copy(room, 9 * REGISTER + 3 * i, w_WB_B, 3 * row, 3)
                        row, done, following = row + 1, following, min(following + sampled, n_steps)
                        ahead = (following - whole) - rest
            g, a, w = g1, a1, w1
            steps += 1
            # Whole distances are counted as integers, so that late times have as many digits as early ones.
            rest, carry = accumulate(rest, carry, step)
            passed = math.floor(rest)
            whole, rest, length = whole + int(passed), rest - passed, step
        if done < n_steps:
            call_handlers()
    return Result(done, steps * order, corrections, computed * order, defect, False)


@cache_by_types
def enter_like(like):
    """Return `march` as Python calls it (`taylor.enter_like`)."""

    @entry
    def enter(numbers, order, n_steps, sampled, pause, R_WB, w_WB_B):
        """Fill the samples. The last numbers are the lanes, room for samples, the first sample and the axes of all samples."""
        model, frame, h, largest = load_rows(numbers, 0, 1, like, 1)
        at = len(numbers) - END
        axes, first, room = numbers[at:], numbers[at - 12 : at], numbers[at - 12 - 12 * REGISTER : at - 12]
        lanes = load(numbers, at - 12 - 13 * REGISTER, REGISTER)
        flat = R_WB.reshape(-1), w_WB_B.reshape(-1)
        result = march(model, frame, order, h, largest, n_steps, sampled, pause, lanes, room, *flat)
        return complete(result, n_steps, sampled, h, first, axes, R_WB, w_WB_B)

    return enter


def bind(model, frame, order, h, tolerance, first, axes):
    """Return `march` as Python calls it (`protocol`), without the arguments that are given here.

    `first` (12,) are attitude, by rows, and rates, rad/s, of the first sample, `axes` are from `samples.gather_axes`.
    """
    numbers, like = gather_numbers((model, frame, h, 2.0 * math.log2(SHARE * tolerance)))
    lanes, room = np.arange(float(REGISTER)), np.zeros(12 * REGISTER)
    return partial(enter_like(like), np.concatenate([numbers, lanes, room, first, axes]), order)
