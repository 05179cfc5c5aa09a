"""From a wanted error to a method and a step: search the cheapest, run it, and say how good it is.

1. The candidates are tried over a short while (`search`), by trial runs that are remembered (`trials`).
2. The one that is chosen makes the whole run, once more with twice the step. Their difference, not that of a trial, is the
   estimate that is reported: a trial cannot see how much a scene amplifies errors later on. Where it is above what was asked
   for, the step is cut and the run repeated.

Which families are candidates, and what their work costs, they say themselves: `Method.candidacy`, `Method.cost`.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace

from ..errors import AccuracyNotReached, BadInput
from ..method import Grid, Method
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Choice, Trajectory
from .between import Samples, divide_step, sample_between, spread
from .search import Attempts, even_grid, find_cheapest, stalls, step_factor
from .trials import Trials, trials_of

ATTEMPTS = 12
MOST_STEPS = 10**10
"""Steps that a run may be given: some quarter of an hour by the fastest method."""


def integrate_to_error(
    scene: Scene,
    error: float,
    t_end: float,
    samples: Samples,
    progress: Callable[[Progress], object] | None = None,
) -> Trajectory:
    """Return the trajectory with the cheapest method and step found for an attitude error, rad; its `choice` says which.

    The run takes t_end, s; `progress` is called as `integrate` says.

    Raises
    ------
    BadInput
        The error asks for more than `MOST_STEPS` steps.
    """
    trials = trials_of(scene, progress)
    method, dt = find_cheapest(trials, error, t_end)
    dt = dt if samples.at is None else divide_step(scene, method, dt)
    attempts: Attempts = ()
    for _ in range(ATTEMPTS):
        grid = grid_of(dt, t_end, samples)
        found, trajectory = _recall_or_run(trials, method, grid)
        attempts = (*attempts, (grid.dt, found))
        if found <= error or stalls(attempts):
            break
        dt = grid.dt * step_factor(found, error, method)
    best = Choice(method, grid.dt, error, found, attempts)
    trajectory = method.solve(scene, grid) if trajectory is None else trajectory
    if samples.at is not None:
        trajectory = sample_between(trajectory, method, grid, samples.at)
    if trajectory.ok and not best.reached:
        warnings.warn(AccuracyNotReached(error, found), stacklevel=4)
    return replace(trajectory, choice=best)


def _recall_or_run(trials: Trials, method: Method, grid: Grid) -> tuple[float, Trajectory | None]:
    """Return the estimated error, rad, of a run, and the run; None for a run whose estimate is known."""
    if (method, grid) in trials.known:
        return trials.estimate(method, grid).error, None
    found, trajectory = trials.make(method, grid)
    return found.error, trajectory


def grid_of(dt: float, t_end: float, samples: Samples) -> Grid:
    """Return a grid of an even number of steps of at most dt, s, to t_end, s, with the samples, or steps to reach them from.

    Raises
    ------
    BadInput
        They are more than `MOST_STEPS`.
    """
    if t_end / dt > MOST_STEPS:
        raise BadInput("error", f"what takes {t_end / dt:.3g} steps", f"what {MOST_STEPS:g} steps reach: a larger one")
    if samples.at is not None:
        return even_grid(t_end, dt, spread(int(t_end / dt)))
    if samples.spacing is None:
        return even_grid(t_end, dt, samples.every)
    each = 2 * max(1, math.ceil(samples.spacing / dt / 2 * (1 - 1e-9)))
    n = each * math.ceil(t_end / samples.spacing * (1 - 1e-9))
    return Grid(samples.spacing / each, n, min(each * samples.every, n))
