"""Choose one method and one step for many bodies: chosen on a few of them, verified on others.

All bodies share the step, so the most demanding body determines it: the one whose energy allows the fastest rotation,
sqrt(2 E / J_min), because the truncation error of a step grows with a power of its angle. Random bodies may show other causes,
such as an initial state near a separatrix, which amplifies errors without faster rotation. Nothing is known about bodies that
are not tried.

1. The automatic choice (`conservative.methods.search`) finds method and step for the most demanding body.
2. The step is cut until the estimates of the `HARDEST` and of `RANDOM` other bodies are within the error, or stall.
3. `VERIFIED` more bodies are tried. The worst one joins the others if its error is too large, and step 2 is repeated.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np

from ..batch import Batch
from ..errors import AccuracyNotReached, BadInput
from ..grid import Grid
from ..method import Method
from ..methods.automatic import best_of, find_rough, reach
from ..methods.between import SampleTimes
from ..methods.search import find_cheapest
from ..methods.trials import Estimate, trials_of
from ..outcome import ChoiceForMany

HARDEST, RANDOM, VERIFIED = 3, 5, 8
"""Numbers of bodies for which the step is chosen (the fastest ones and random ones), and on which it is verified."""
SEED = 14
"""Seed of the random bodies, so that the same ensemble gets the same step."""
ROUNDS = 3
"""Largest number of choices of the step, each with the worst verified body of the one before."""
LONGEST = 0.8
"""Step as a share of the longest possible one, for methods whose accuracy does not depend on the step."""


def choose_for_all(bodies: Batch, error: float, t_end: float, samples: SampleTimes) -> ChoiceForMany:
    """Return a method and a step for all bodies, for an attitude error, rad, of a run to t_end, s, with these samples.

    Warn with `AccuracyNotReached` if a body that was tried has a larger error. Raise `BadInput` if the error needs more steps
    than the automatic choice takes.
    """
    numbers = pick(bodies)
    chosen, verified = numbers[: HARDEST + RANDOM], numbers[HARDEST + RANDOM :]
    method, dt = find_cheapest(trials_of(bodies.take(chosen[0])), error, t_end, bodies=len(bodies))
    if method.order is None:
        dt = min(dt, LONGEST * min(method.longest_step(bodies.take(i)) for i in numbers))
    attempts: tuple[tuple[float, float], ...] = ()
    for _ in range(ROUNDS):
        tried = reach(
            bodies.scene,
            method,
            dt,
            error,
            t_end,
            samples,
            lambda method, grid: find_worst(bodies, chosen, method, grid)[0],  # noqa: B023  # called in this round only
        )
        attempts += tuple((attempt.grid.dt, attempt.estimate.total) for attempt in tried)
        method, grid, best = best_of(tried)
        dt, estimate, rough = grid.dt, best.total, find_rough(tried)
        worst, number = find_worst(bodies, verified, method, grid)
        if worst.total <= error or estimate > error:
            break
        chosen, verified = [*chosen, number], [i for i in verified if i != number]
    choice = ChoiceForMany(method, dt, error, max(worst.total, estimate), attempts, len(numbers), grid)
    if not choice.reached:
        rough = worst.rough if rough is None else rough
        warnings.warn(AccuracyNotReached(error, choice.estimate, rough=rough), stacklevel=3)
    return choice


def pick(bodies: Batch) -> list[int]:
    """Return the numbers of the bodies to try: the most demanding first, then random ones."""
    most, hardest = HARDEST + RANDOM + VERIFIED, pick_hardest(bodies)
    others = np.random.default_rng(SEED).permutation(len(bodies))[:most].tolist()
    return [*hardest, *(i for i in others if i not in hardest)][:most]


def pick_hardest(bodies: Batch) -> list[int]:
    """Return the numbers of the bodies whose energy allows the fastest rotation, the fastest first."""
    rates = np.sqrt(bodies.energies) / np.sqrt(bodies.principal[0].min(axis=1))
    fastest = np.argpartition(-rates, min(HARDEST, len(rates) - 1))[:HARDEST]
    return fastest[np.argsort(-rates[fastest], kind="stable")].tolist()


def find_worst(bodies: Batch, numbers: Sequence[int], method: Method, grid: Grid) -> tuple[Estimate, int]:
    """Return the estimate with the largest total error among the bodies of these numbers, and its number; 0 and -1 if none."""
    worst = Estimate(0.0, 0.0), -1
    for i in numbers:
        estimate, _ = trials_of(bodies.take(i)).estimate(method, grid, sensitivity=True)
        worst = (estimate, i) if estimate.total > worst[0].total or worst[1] < 0 else worst
        if math.isinf(worst[0].total):  # no other body is worse
            break
    return worst


def require_steps(method: Method, bodies: Batch, grid: Grid) -> None:
    """Raise `BadInput` if the step is too long for one of the bodies that may rotate fastest.

    Other bodies for which it is too long become `NotRun` when they are integrated. Methods with a kernel refuse a step only if
    they have a longest one. For others of them nothing is prepared, which would take as long as runs of hundreds of bodies.
    """
    if method.method_info.kernel and method.longest_step(bodies.first) == math.inf:
        return
    for i in pick_hardest(bodies):
        scene = bodies.take(i)
        try:
            if method.unsupported(scene) is None:
                method.prepare(scene, grid)
        except BadInput as refusal:
            raise BadInput(refusal.argument, f"{refusal.got} (body {i})", refusal.allowed) from None
