"""Integrate to a requested error: find the cheapest method and step, run them, and estimate the error of that run.

1. The candidates are tried over a short duration (`search`). Trial runs are cached (`trials`). The trial of a short motion is
   the whole run.
2. The chosen method makes the whole run, and repeats it with twice the step (Richardson's step doubling). The difference is the
   reported estimate. Shorter trials cannot provide it, because a scene can amplify errors later. If
   the estimate is above the requested error, the step is cut and the run repeated, unless the cause is rounding of the scene.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace

from ..errors import AccuracyNotReached, BadInput
from ..grid import Grid, count_steps, require_memory
from ..method import Method
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Choice, Trajectory
from .between import SampleTimes, divide_step, sample_between, stride_of
from .search import even_grid, find_cheapest, step_factor, stops_falling
from .trials import ASYMPTOTIC, Estimate, parts_for, trials_of

ATTEMPTS = 12
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
    method, dt = find_cheapest(trials, error, t_end)

    def grid_with(dt: float) -> Grid:
        return grid_of(dt, t_end, samples, parts_for(scene))

    dt = dt if samples.at is None else divide_step(scene, method, dt)
    attempts = cut_step(method, dt, error, grid_with, lambda grid: trials.estimate(method, grid, sensitivity=True)[0])
    grid = grid_with(min(reversed(attempts), key=lambda attempt: attempt[1])[0])  # of the smallest error
    estimated, trajectory = trials.estimate(method, grid, sensitivity=True)
    choice = Choice(method, grid.dt, error, estimated.total, attempts)
    trajectory = method.solve(scene, grid) if trajectory is None else trajectory
    if samples.at is not None:
        trajectory = sample_between(trajectory, method, grid, samples.at)
    if trajectory.ok and not choice.reached:
        warnings.warn(AccuracyNotReached(error, estimated.total, estimated.sensitivity or 0.0), stacklevel=3)
    return replace(trajectory, choice=choice)


def cut_step(
    method: Method, dt: float, error: float, grid_with: Callable[[float], Grid], estimate: Callable[[Grid], Estimate]
) -> tuple[tuple[float, float], ...]:
    """Cut a step dt, s, until the estimated error is at most `error`, rad, or shorter steps do not help.

    Return the steps tried, s, and the estimated total error of each, rad. `grid_with` returns the grid of the whole run for a
    step, s, and `estimate` the estimate of a run, including its sensitivity. Raise `BadInput` if the first step makes more
    steps or samples than are possible.
    """
    grid = grid_with(dt)
    attempts: tuple[tuple[float, float], ...] = ()
    while True:
        run = estimate(grid)
        attempts = (*attempts, (grid.dt, run.total))
        rounding = run.noise
        within = error - rounding if rounding < error else rounding  # no step reduces the effect of rounding the scene
        if run.error <= within or rounding >= ASYMPTOTIC or len(attempts) == ATTEMPTS:
            return attempts
        if stops_falling([total for _, total in attempts]):
            return attempts
        try:
            grid = grid_with(grid.dt * step_factor(run.error, within, method))
        except BadInput:  # too many steps or samples: the best run so far is the result
            return attempts


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
    each = parts * count_steps(samples.spacing, parts * dt)
    n = each * count_steps(t_end, samples.spacing)
    require_memory("sample_every", n, min(each * samples.every, n))
    return Grid(samples.spacing / each, n, min(each * samples.every, n))
