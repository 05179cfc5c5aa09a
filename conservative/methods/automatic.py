"""Integrate to a requested error: find the cheapest method and step, run them, and estimate the error of that run.

1. The candidates are tried over a short duration (`search`). Trial runs are cached (`trials`). The trial of a short motion is
   the whole run.
2. The chosen method makes the whole run, and repeats it with twice the step (Richardson's step doubling). The difference is the
   reported estimate. Shorter trials cannot provide it, because a scene can amplify errors later. If
   the estimate is above the requested error, the step is cut and the run repeated, unless the cause is rounding of the scene.
3. If a load or a function of a user acts, and no step reaches the error or the motion is not smooth, an adaptive method
   follows, whose tolerance is cut in the same way. The run with the smallest estimate is the result. Long runs are made only
   if shorter ones show the order of the method, so that the search on a function that is smooth nowhere ends early.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from ..errors import AccuracyNotReached, BadInput
from ..grid import Grid, count_steps, require_memory
from ..method import Method
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Choice, Trajectory
from .adaptive import MOST_TRIES, work_of_try
from .between import SampleTimes, divide_step, sample_between, stride_of
from .projected import Projected
from .search import (
    MOST_CALLING,
    adaptive_method,
    adaptive_spacing,
    even_grid,
    fallback,
    find_cheapest,
    refine_until,
    step_factor,
)
from .trials import ASYMPTOTIC, MOST_CHOICES, Estimate, Trials, parts_for, presumed_smooth, trials_of

ATTEMPTS = 12
"""Largest number of settings that are tried."""
TOLERANCES, LEAST_TOLERANCE = 5, 1e-14
"""Largest number of tolerances of an adaptive method that are tried, and the smallest one."""
MOST_STEPS = 10**10
"""Largest number of steps of a run: about a quarter of an hour by the fastest method."""


def integrate_to_error(
    scene: Scene,
    error: float,
    t_end: float,
    samples: SampleTimes,
    progress: Callable[[Progress], object] | None = None,
) -> Trajectory:
    """Return the trajectory with the cheapest method and step for an attitude error, rad, up to t_end, s; see its `choice`.

    `progress` is called as `integrate` describes. Raise `BadInput` if the error needs more than `MOST_STEPS` steps.
    """
    trials = trials_of(scene, progress)
    tried, trajectory = choose(trials, error, t_end, samples)
    method, grid, estimated = best_of(tried)
    attempts = tuple((attempt.grid.dt, attempt.estimate.total) for attempt in tried)
    total, rough = estimated.total, find_rough(tried)
    if isinstance(method, Projected) and method.tolerance is not None and samples.at is not None:
        trajectory = method.solve_at(scene, grid, samples.at)
        total = max(total, trajectory.control.local) if trajectory.control else total
    else:
        trajectory = method.solve(scene, grid) if trajectory is None else trajectory
        if samples.at is not None:
            trajectory = sample_between(trajectory, method, grid, samples.at)
    choice = Choice(method, grid.dt, error, total, attempts)
    if trajectory.ok and not choice.reached:
        warnings.warn(AccuracyNotReached(error, total, estimated.sensitivity or 0.0, rough), stacklevel=3)
    return replace(trajectory, choice=choice)


def choose(trials: Trials, error: float, t_end: float, samples: SampleTimes) -> tuple[list[Attempt], Trajectory | None]:
    """Return the runs that were tried for an error, rad, up to t_end, s, and the trajectory of the best one if it was made now.

    Runs that an earlier call has tried are those of its search, which depends on nothing else.
    """
    key, choices = (error, t_end, samples.spacing, samples.every, samples.at is None), trials.known.choices
    if key in choices:
        grid = best_of(choices[key]).grid
        require_memory("sample_every", grid.n_steps, grid.every)
        return choices[key], None
    method, dt = find_cheapest(trials, error, t_end)
    dt = dt if samples.at is None else divide_step(trials.scene, method, dt)

    def estimate(method: Method, grid: Grid) -> Estimate:
        return trials.estimate(method, grid, sensitivity=True)[0]

    tried = reach(trials.scene, method, dt, error, t_end, samples, estimate)
    best = best_of(tried)
    _, trajectory = trials.estimate(best.method, best.grid, sensitivity=True)
    if len(choices) >= MOST_CHOICES:
        choices.clear()
    choices[key] = tried
    return tried, trajectory


Estimating = Callable[[Method, Grid], Estimate]
"""The estimate of a run, including its sensitivity."""


class Attempt(NamedTuple):
    """A run over the whole duration, and its estimate."""

    method: Method
    grid: Grid
    estimate: Estimate

    def share(self, error: float) -> float:
        """Return the share of an error, rad, that the steps may have: none of them reduces the effect of rounding the scene."""
        noise = self.estimate.noise
        return error - noise if noise < error else noise

    def settles(self, error: float) -> bool:
        """Return whether the run reaches an error, rad, or rounding prevents that any run does."""
        return self.estimate.error <= self.share(error) or self.estimate.noise >= ASYMPTOTIC


Finer = Callable[[list[Attempt]], tuple[Method, Grid] | None]


def _refine(first: tuple[Method, Grid], finer: Finer, error: float, estimate: Estimating, most: int) -> list[Attempt]:
    """Return runs with finer and finer settings until the estimated error is at most `error`, rad, or they do not help."""

    def attempt(setting: tuple[Method, Grid]) -> Attempt:
        return Attempt(*setting, estimate(*setting))

    return refine_until([attempt(first)], finer, attempt, lambda run: run.settles(error), lambda run: run.estimate.total, most)


def best_of(tried: Sequence[Attempt]) -> Attempt:
    """Return the attempt with the smallest estimate, the last one of equals; one that ended early only if all did."""
    return min(reversed(tried), key=lambda attempt: (attempt.estimate.failed, attempt.estimate.total))


def find_rough(tried: Sequence[Attempt]) -> float | None:
    """Return a time, s, near which the motion is not smooth, by the last attempt that shows one; None if none does."""
    return next((attempt.estimate.rough for attempt in reversed(tried) if attempt.estimate.rough is not None), None)


def reach(
    scene: Scene,
    method: Method,
    dt: float,
    error: float,
    t_end: float,
    samples: SampleTimes,
    estimate: Estimating,
) -> list[Attempt]:
    """Return the runs that were tried for an error, rad, up to t_end, s: with a method, from a step dt, s, on.

    Raise `BadInput` if the first step makes more steps or
    samples than are possible.
    """
    tried: list[Attempt] = []
    parts = parts_for(scene)
    most = MOST_CALLING if scene.calls_python else MOST_STEPS
    if getattr(method, "tolerance", None) is None:
        tried = cut_step(method, dt, error, lambda dt: grid_of(dt, t_end, samples, parts), estimate, most)
        if presumed_smooth(scene) or method.order is None or best_of(tried).estimate.total <= error:
            return tried
        if scene.smoothness(t_end).noise:
            return tried
    tried += cut_tolerance(adaptive_method(error), sampling_grid(t_end, samples), error, estimate)
    if all(attempt.estimate.failed for attempt in tried):
        method, dt = fallback(scene, t_end)
        grid = grid_of(dt, t_end, samples, parts)
        tried.append(Attempt(method, grid, estimate(method, grid)))
    return tried


def sampling_grid(t_end: float, samples: SampleTimes) -> Grid:
    """Return the grid of a run with a tolerance to t_end, s: its steps are the intervals between samples, s."""
    if samples.at is not None or samples.spacing is None:
        every = 1 if samples.at is not None else samples.every
        return even_grid(t_end, adaptive_spacing(t_end), every, 1)
    n = count_steps(t_end, samples.spacing)
    require_memory("sample_every", n, min(samples.every, n))
    return Grid(samples.spacing, n, min(samples.every, n))


def cut_tolerance(method: Projected, grid: Grid, error: float, estimate: Estimating) -> list[Attempt]:
    """Cut the tolerance of a method until the estimated error is at most `error`, rad, or smaller ones do not help."""

    def finer(tried: list[Attempt]) -> tuple[Method, Grid] | None:
        last = tried[-1]
        assert isinstance(last.method, Projected)
        assert last.method.tolerance is not None
        if last.estimate.failed or sum(attempt.estimate.work for attempt in tried) > 2 * MOST_TRIES * work_of_try(last.method):
            return None
        if last.method.tolerance <= LEAST_TOLERANCE or (len(tried) > 1 and math.isinf(last.estimate.error)):
            return None
        factor = 1e-2
        if math.isfinite(last.estimate.error):
            # The error is about proportional to the tolerance. A quarter leaves a margin.
            factor = min(0.3, max(1e-5, last.share(error) / last.estimate.error / 4))
        return Projected(tolerance=max(LEAST_TOLERANCE, factor * last.method.tolerance)), grid

    return _refine((method, grid), finer, error, estimate, TOLERANCES)


def cut_step(
    method: Method, dt: float, error: float, grid_with: Callable[[float], Grid], estimate: Estimating, most: int = MOST_STEPS
) -> list[Attempt]:
    """Cut a step dt, s, until the estimated error is at most `error`, rad, or shorter steps do not help.

    `grid_with` returns the grid of the whole run for a step, s. Runs of more than `most` steps follow only runs that show the
    order of the method. Raise `BadInput` if the first step makes more steps or samples than are possible.
    """

    def finer(tried: list[Attempt]) -> tuple[Method, Grid] | None:
        last = tried[-1]
        if last.estimate.rough is not None:  # an adaptive method is faster
            return None
        try:
            grid = grid_with(last.grid.dt * step_factor(last.estimate.error, last.share(error), method))
        except BadInput:  # too many steps or samples: the best run so far is the result
            return None
        return None if grid.n_steps > most and not last.estimate.ordered else (method, grid)

    return _refine((method, grid_with(dt)), finer, error, estimate, ATTEMPTS)


def grid_of(dt: float, t_end: float, samples: SampleTimes, parts: int = 2) -> Grid:
    """Return a grid of a multiple of `parts` steps of at most dt to t_end, both in s, that contains the samples.

    Raise `BadInput` if there are more than `MOST_STEPS` steps, or the samples do not fit in memory.
    """
    if t_end / dt > MOST_STEPS:
        raise BadInput("error", f"one that takes {t_end / dt:.3g} steps", f"one that takes at most {MOST_STEPS:g} steps")
    if samples.at is not None:
        return even_grid(t_end, dt, stride_of(int(t_end / dt)), parts)
    if samples.spacing is None:
        require_memory("sample_every", math.ceil(t_end / dt), samples.every)
        return even_grid(t_end, dt, samples.every, parts)
    per_sample = parts * count_steps(samples.spacing, parts * dt)
    n = per_sample * count_steps(t_end, samples.spacing)
    require_memory("sample_every", n, min(per_sample * samples.every, n))
    return Grid(samples.spacing / per_sample, n, min(per_sample * samples.every, n))
