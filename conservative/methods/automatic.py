"""From a wanted error to a method and a step: search the cheapest, run it, and say how good it is.

1. The candidates are tried over a short while (`search`), by trial runs that are remembered (`trials`).
2. The one that is chosen makes the whole run, once more with twice the step. Their difference, not that of a trial, is the
   estimate that is reported: a trial cannot see how much a scene amplifies errors later on. Where it is above what was asked
   for, the step is cut and the run repeated, as long as that is not what rounding the scene causes.

Which families are candidates, and what their work costs, is on their cards: `Method.card`.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace

from ..errors import AccuracyNotReached, BadInput
from ..grid import Grid, require_memory
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Choice, Trajectory
from .between import Samples, divide_step, sample_between, spread
from .search import Attempts, even_grid, find_cheapest, stalls, step_factor
from .trials import ASYMPTOTIC, trials_of

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
    grid = grid_of(dt, t_end, samples)
    attempts: Attempts = ()
    best: tuple[float, Grid, Trajectory | None] = (math.inf, grid, None)
    while True:
        known = trials.known.get((method, grid))
        made: Trajectory | None = None
        if known is None or known.sensitivity is None:
            known, made = trials.make(method, grid, sensitivity=True)
        attempts = (*attempts, (grid.dt, known.total))
        if known.total <= best[0]:
            best = known.total, grid, made
        moved = known.sensitivity or 0.0
        within = error - moved if moved < error else moved  # no step helps against what rounding the scene causes
        if known.error <= within or moved >= ASYMPTOTIC or stalls(attempts) or len(attempts) == ATTEMPTS:
            break
        try:
            grid = grid_of(grid.dt * step_factor(known.error, within, method), t_end, samples)
        except BadInput:  # more steps or samples than can be: what there is has to do
            break
    estimate, grid, trajectory = best
    choice = Choice(method, grid.dt, error, estimate, attempts)
    trajectory = method.solve(scene, grid) if trajectory is None else trajectory
    if samples.at is not None:
        trajectory = sample_between(trajectory, method, grid, samples.at)
    if trajectory.ok and not choice.reached:
        warnings.warn(AccuracyNotReached(error, estimate), stacklevel=4)
    return replace(trajectory, choice=choice)


def grid_of(dt: float, t_end: float, samples: Samples) -> Grid:
    """Return a grid of an even number of steps of at most dt, s, to t_end, s, with the samples, or steps to reach them from.

    Raises
    ------
    BadInput
        They are more than `MOST_STEPS`, or their samples do not fit in memory.
    """
    if t_end / dt > MOST_STEPS:
        raise BadInput("error", f"one that takes {t_end / dt:.3g} steps", f"one that takes at most {MOST_STEPS:g} steps")
    if samples.at is not None:
        return even_grid(t_end, dt, spread(int(t_end / dt)))
    if samples.spacing is None:
        require_memory("sample_every", math.ceil(t_end / dt), samples.every)
        return even_grid(t_end, dt, samples.every)
    each = 2 * max(1, math.ceil(samples.spacing / dt / 2 * (1 - 1e-9)))
    n = each * math.ceil(t_end / samples.spacing * (1 - 1e-9))
    require_memory("sample_every", n, min(each * samples.every, n))
    return Grid(samples.spacing / each, n, min(each * samples.every, n))
