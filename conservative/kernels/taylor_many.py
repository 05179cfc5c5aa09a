"""Steps of `taylor` for many bodies, each in a lane of its own: the same functions, traced for lanes.

A body whose step cannot be projected is counted as one that has failed from there on; its neighbours take no notice.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from . import entry
from .lanes import REGISTER
from .lanes_tuples import any_above, load_tuple, save_samples, save_tuple
from .taylor import ENOUGH, FAR, LEFT, MOST_CORRECTIONS, find_beginning, find_correction, find_left, take_step
from .taylor import Free as Free
from .traced import add, cross, dot, scale, times, trace, where_above


class Models(NamedTuple):
    """As `taylor.Model`, with what steps and samples are made of; numbers of it are columns of an array.

    `h` is the length of a step in the units of the body. `axes` are the rows of the rotation from axes D to the world's,
    `R_BP` those of that from principal to body axes, and `units` what rates in the units of the body are multiplied by to
    be those of samples: the third has the spin in it where the body turns in a frame that does not.
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


class State(NamedTuple):
    """Rows of the attitude's matrix and rates, and in how many steps nothing could be done: 0, but for those that failed."""

    g: Any
    a: Any
    w: Any
    failed: Any


@trace
def begin_body(model):
    """Return the field's constants, J and its inverse, what is kept and its scales, as `correct` takes them, and K."""
    constants, K, _, kept, scales = find_beginning(model)
    return (constants, (model.J, model.J_inverse, model.loose), kept, scales), K


@trace
def correct_once(field, body, g, a, w, failed):
    """Return a corrected state, what is left of its defect, and how much of that another correction may take."""
    return find_correction_needed(field, body, g, a, w, failed)


def find_correction_needed(field, body, g, a, w, failed):
    """`correct_once` for functions that are traced."""
    g, a, w, defect, rest = find_correction(field, *body, g, a, w)
    left = find_left(defect, rest)
    return g, a, w, left, where_above(where_above(left, defect, FAR), failed, 0.5)


@trace
def correct_again(field, body, state, left, needed):
    """The same, of a state in which bodies that need no correction stay as they are."""
    g, a, w, failed = state
    *found, new_left, new_needed = find_correction_needed(field, body, g, a, w, failed)
    pairs = zip(found, (g, a, w), strict=True)
    g, a, w = (tuple(where_above(x, ENOUGH, needed, y) for x, y in zip(*pair, strict=True)) for pair in pairs)
    return g, a, w, where_above(new_left, ENOUGH, needed, left), where_above(new_needed, ENOUGH, needed, 0.0)


@trace
def count_failures(failed, left):
    """One more where too much of a defect is left, or where it is not a number."""
    return where_above(failed, left, LEFT, failed + 1.0)


@trace
def find_sample(model, turn, g, a, w):
    """Return the rows of R_WB, one after the other, and w_WB_B; `turn` is cosine and sine of the angle of a spin left out."""
    b, (cos, sin), (x, y, z) = cross(g, a), turn, times(model.units, w)
    w = cos * x + sin * y, cos * y - sin * x, z
    R_WP = [add(add(scale(p, a), scale(q, b)), scale(r, g)) for p, q, r in model.axes]
    R_WP = [(cos * x + sin * y, cos * y - sin * x, z) for x, y, z in R_WP]
    return tuple(dot(row, axis) for row in (*R_WP, w) for axis in model.R_BP)


@entry
def enter(order, like, columns, states, turns, done, until, n_steps, every, R_WB, w_WB_B):
    """Take the steps after `done` up to number `until`.

    `like` is a `Models` and a `State` of floats, of which `columns` (., n) and `states` (., n) have the numbers. Samples of
    every `every`-th step, and of the last of n_steps, go to R_WB (n samples 9,) and w_WB_B (n samples 3,), rad/s. `turns`
    (samples or 1, 2, n) are cosines and sines of the angles of spins that are left out.
    """
    samples = 1 + (n_steps + every - 1) // every
    for at in range(0, columns.shape[1], REGISTER):
        model, (g, a, w, failed) = load_tuple(like[0], columns, at), load_tuple(like[1], states, at)
        body, K = begin_body(model)
        step, row = done, done // every
        while step < until:
            row += 1
            sampled = min(n_steps, row * every)
            end = min(until, sampled)
            while step < end:
                (g, a, w), _, _ = take_step(model.field, body[0], order, model.h, K, g, a, w)
                g, a, w, left, needed = correct_once(model.field, body, g, a, w, failed)
                corrections = 1
                while corrections < MOST_CORRECTIONS and any_above(needed, ENOUGH):
                    g, a, w, left, needed = correct_again(model.field, body, (g, a, w, failed), left, needed)
                    corrections += 1
                failed = count_failures(failed, left)
                step += 1
            if step == sampled:
                turn = load_tuple((0.0, 0.0), turns[min(row, len(turns) - 1)], at)
                found = find_sample(model, turn, g, a, w)
                save_samples(R_WB, 9 * (at * samples + row), 9 * samples, found[:9])
                save_samples(w_WB_B, 3 * (at * samples + row), 3 * samples, found[9:])
        save_tuple(states, at, (g, a, w, failed))
