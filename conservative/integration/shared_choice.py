"""One method and one step for many bodies, from a wanted error: chosen on a few, verified on others.

All bodies share the steps, so the hardest one sets them. How hard a body is says the fastest turning that its energy allows,
sqrt(2 E / J_min): the truncation error of a step of order p is some power of the angle that the body turns by in it, and what a
run sums up grows with the number of turns. What this measure cannot see, as a start near a separatrix, which amplifies errors
but turns no faster, random bodies may show; of a body that is not looked at nothing is known.

1. The automatic choice (`conservative.methods.search`) takes method and step for the hardest body.
2. The step is cut until the estimates of the `HARDEST` and of `RANDOM` other bodies are within the error, or stall.
3. `VERIFIED` more bodies are estimated; what is off joins the others, and step 2 is repeated.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..batch import Batch
from ..errors import AccuracyNotReached
from ..grid import Grid
from ..method import Method
from ..methods.automatic import grid_of
from ..methods.between import Samples
from ..methods.search import Attempts, find_cheapest, stalls, step_factor
from ..methods.trials import trials_of
from ..outcome import ChoiceForMany
from .drifts import field_scales, momenta_of

HARDEST, RANDOM, VERIFIED = 3, 5, 8
"""Bodies that a step is chosen for, those of the fastest turning and others, and bodies that it is then verified on."""
SEED = 14
"""Of the choice of others: the same ensemble gets the same step."""
ATTEMPTS, FAILED, ROUNDS = 12, 5, 3
"""Steps tried for the bodies of one round, those on which a run fails, and rounds, at most."""
LONGEST = 0.8
"""Part of the longest step that the bodies looked at have, where accuracy does not depend on the step."""


@dataclass(frozen=True)
class Goal:
    """What is wanted of all bodies: an attitude error, rad, over a run of t_end, s, with these samples."""

    error: float
    t_end: float
    samples: Samples


def choose_for_all(bodies: Batch, goal: Goal) -> ChoiceForMany:
    """Return a method and a step for all bodies. A warning `AccuracyNotReached` says that one looked at is not near enough.

    Raises
    ------
    BadInput
        The error asks for more steps than the automatic choice takes.
    """
    numbers = pick(bodies)
    chosen, verified = numbers[: HARDEST + RANDOM], numbers[HARDEST + RANDOM :]
    method, dt = find_cheapest(trials_of(bodies.take(chosen[0])), goal.error, goal.t_end)
    if method.order is None:
        dt = min(dt, LONGEST * min(method.longest_step(bodies.take(i)) for i in numbers))
    attempts: Attempts = ()
    for _ in range(ROUNDS):
        tried = cut_step(bodies, chosen, method, dt, goal)
        attempts, dt = attempts + tried, tried[-1][0]
        grid = grid_of(dt, goal.t_end, goal.samples)
        found, worst = find_worst(bodies, verified, method, grid)
        if found <= goal.error or tried[-1][1] > goal.error:
            break
        chosen, verified = [*chosen, worst], [i for i in verified if i != worst]
    choice = ChoiceForMany(method, dt, goal.error, max(found, tried[-1][1]), attempts, len(numbers), grid)
    if not choice.reached:
        warnings.warn(AccuracyNotReached(goal.error, choice.estimate), stacklevel=4)
    return choice


def pick(bodies: Batch) -> list[int]:
    """Return the numbers of the bodies to look at: the hardest first, then random ones."""
    most, hardest = HARDEST + RANDOM + VERIFIED, pick_hardest(bodies)
    others = np.random.default_rng(SEED).permutation(len(bodies))[:most].tolist()
    return [*hardest, *(i for i in others if i not in hardest)][:most]


def pick_hardest(bodies: Batch) -> list[int]:
    """Return the numbers of the bodies that turn fastest with all their energy, the hardest first."""
    energy = np.sum(momenta_of(bodies) * bodies.w_WB_B0, axis=1) / 2 + field_scales(bodies)
    rates = np.sqrt(energy) / np.sqrt(bodies.principal[0].min(axis=1))
    fastest = np.argpartition(-rates, min(HARDEST, len(rates) - 1))[:HARDEST]
    return fastest[np.argsort(-rates[fastest], kind="stable")].tolist()


def cut_step(bodies: Batch, chosen: Sequence[int], method: Method, dt: float, goal: Goal) -> Attempts:
    """Return the steps tried from dt, s, on: the last is short enough for the chosen bodies, or shorter ones do not help."""
    attempts: Attempts = ()
    for _ in range(ATTEMPTS):
        grid = grid_of(dt, goal.t_end, goal.samples)
        found, _ = find_worst(bodies, chosen, method, grid)
        attempts = (*attempts, (grid.dt, found))
        failed = sum(not math.isfinite(estimate) for _, estimate in attempts)
        if found <= goal.error or failed > FAILED or stalls(attempts):
            break
        dt = grid.dt * step_factor(found, goal.error, method)
    return attempts


def find_worst(bodies: Batch, numbers: Sequence[int], method: Method, grid: Grid) -> tuple[float, int]:
    """Return the largest estimated error, rad, of the bodies of these numbers, and the number; 0 and -1 of none."""
    return max(((trials_of(bodies.take(i)).estimate_all(method, grid).total, i) for i in numbers), default=(0.0, -1))
