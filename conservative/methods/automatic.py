"""From a wanted error to a method and a step: probe, pick, run, and say how good it is.

1. A short probe of each candidate, cutting steps until the difference of two step lengths says that the error is small enough.
2. The candidate with the least work for its step is taken: a count, not a time, so that the same scene gets the same choice.
3. The whole run, once more with twice the step. Their difference, not the probe, is the estimate that is reported: a probe
   cannot see how much a scene amplifies errors later on. Where it is above what was asked for, the step is cut and the run
   repeated.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np

from ..attitude import angle_between
from ..errors import AccuracyNotReached, IntegrationFailed, Unsupported
from ..method import Grid, Method
from ..scene import Scene
from ..trajectory import Choice, Trajectory
from .gauss import Gauss
from .lame import Lame
from .moser_veselov import MoserVeselov
from .projected import Projected
from .reduced import Reduced

SAFETY = 0.5
"""Share of the wanted error that steps are chosen for."""
MOST_TRUSTED = 30.0
"""Largest factor by which halving the step is trusted to shrink the error, whatever the order: round-off does not shrink."""
ASYMPTOTIC = 0.2
"""Difference of two runs, rad, from which on it says nothing about the error of either: angles end at pi."""
ATTEMPTS = 12
PROBE_RADIANS = 200.0
"""Length of a probe in units of the fastest turning that the energy allows."""


def candidates(scene: Scene) -> tuple[Method, ...]:
    """Return the methods worth probing on a scene: those on the frontier of time against error for its kind."""
    for method in (MoserVeselov(), Lame()):  # no truncation error
        if method.unsupported(scene) is None:
            return (method,)
    collocations = tuple(Gauss(stages) for stages in (2, 4, 6, 8))
    if collocations[0].unsupported(scene) is None:
        return Projected(), *collocations
    return Projected(), *(Reduced(order=order) for order in (2, 4, 6, 8))


def integrate_to_error(scene: Scene, error: float, t_end: float, spacing: float | None, sample_every: int) -> Trajectory:
    """Return the trajectory with the cheapest method and step found for an attitude error, rad; its `choice` says which.

    With `spacing` (s) steps divide it, and every `sample_every`-th multiple of it is sampled; without, every `sample_every`-th
    step.
    """
    method, dt = _cheapest(scene, error, t_end)
    attempts: list[tuple[float, float]] = []
    for _ in range(ATTEMPTS):
        grid = _grid(dt, t_end, spacing, sample_every)
        estimate, trajectory = _checked_run(method, scene, grid)
        attempts.append((grid.dt, estimate))
        if (trajectory.ok and estimate <= error) or _hopeless(attempts):
            break
        dt = grid.dt * _shrink(estimate, error, method)
    best = Choice(method, grid.dt, error, estimate, tuple(attempts))
    if trajectory.ok and not best.reached:
        warnings.warn(AccuracyNotReached(error, estimate), stacklevel=4)
    return replace(trajectory, choice=best)


def _grid(dt: float, t_end: float, spacing: float | None, sample_every: int) -> Grid:
    """Return a grid of an even number of steps of at most dt."""
    if spacing is None:
        n = 2 * max(1, math.ceil(t_end / dt / 2 * (1 - 1e-9)))
        return Grid(t_end / n, n, sample_every)
    each = 2 * max(1, math.ceil(spacing / dt / 2 * (1 - 1e-9)))
    n = each * math.ceil(t_end / spacing * (1 - 1e-9))
    return Grid(spacing / each, n, each * sample_every)


def _checked_run(method: Method, scene: Scene, grid: Grid) -> tuple[float, Trajectory]:
    """Return the estimated error and the trajectory of a run, from the same run at twice the step."""
    fine = method.prepare(scene, grid)()
    # Twice the step and half the samples where samples fall on odd steps: then coarse samples lie on every other fine one.
    odd = grid.every % 2
    coarse_grid = Grid(2 * grid.dt, grid.n_steps // 2, grid.every if odd else grid.every // 2)
    try:
        coarse = method.prepare(scene, coarse_grid)()
    except (IntegrationFailed, Unsupported):
        return math.inf, fine
    if not (fine.ok and coarse.ok):
        return math.inf, fine
    stride = 2 if odd else 1
    shared = fine.R_WB[::stride] if (len(fine) - 1) % stride == 0 else np.concatenate([fine.R_WB[::stride], fine.R_WB[-1:]])
    difference = float(angle_between(shared, coarse.R_WB).max())
    estimate = difference / _trusted(method) + _rounding(fine)
    return (estimate if difference < ASYMPTOTIC else math.inf), fine


def _rounding(trajectory: Trajectory) -> float:
    """Return what rounding the scene's own numbers turns the body by, rad: no comparison of two runs can see it."""
    speed = float(np.linalg.norm(trajectory.w_WB_B, axis=1).max())
    return float(np.finfo(float).eps / 2 * speed * trajectory.t[-1])


def _trusted(method: Method) -> float:
    """Return by how much less than the difference of two runs the finer one is off."""
    return 1.0 if method.order is None else min(2.0**method.order - 1, MOST_TRUSTED)


def _shrink(estimate: float, error: float, method: Method) -> float:
    """Return the factor for the next step."""
    if not math.isfinite(estimate) or method.order is None:
        return 0.5
    return min(0.9, max(0.1, (SAFETY * error / estimate) ** (1 / method.order)))


def _hopeless(attempts: list[tuple[float, float]]) -> bool:
    """Whether shorter steps have stopped helping: round-off."""
    estimates = [estimate for _, estimate in attempts if math.isfinite(estimate)]
    return len(estimates) >= 3 and min(estimates[-2:]) > 0.7 * estimates[-3]


def _rate(scene: Scene) -> float:
    """Return a rate, rad/s, that bounds how fast the scene moves: energy all kinetic about the axis of least inertia."""
    return math.sqrt(2 * scene.energy_scale / float(scene.body.moments.min()))


def _cheapest(scene: Scene, error: float, t_end: float) -> tuple[Method, float]:
    """Return the candidate with the least work per second at the step that its probe asks for, and that step."""
    probed = [(*_probe(method, scene, error, t_end), method) for method in candidates(scene)]
    _, dt, method = min(probed, key=lambda entry: entry[0])
    return method, dt


def _probe(method: Method, scene: Scene, error: float, t_end: float) -> tuple[float, float]:
    """Return (work per second, step) with which a short run of the method has its share of the error."""
    rate = _rate(scene)
    duration = min(t_end, PROBE_RADIANS / rate)
    share = SAFETY * error * min(1.0, 4 * duration / t_end)
    dt = duration / 2 if method.order else min(method.longest_step(scene) / 2, t_end / 16)
    attempts: list[tuple[float, float]] = []
    for _ in range(2 * ATTEMPTS):
        grid = _grid(dt, duration, None, 1)
        estimate, trajectory = _checked_run(method, scene, grid)
        attempts.append((grid.dt, estimate))
        if estimate <= share or method.order is None or _hopeless(attempts):
            break
        dt = grid.dt * _shrink(estimate, share / SAFETY, method)
    return (_work(method, trajectory) / duration if math.isfinite(estimate) else math.inf), grid.dt


def _work(method: Method, trajectory: Trajectory) -> float:
    """Return a count of work: corrections and steps, weighted by what they cost beside those of the other candidates."""
    correction, step = _costs(method)
    return correction * (trajectory.counters.iterations or 0) + step * trajectory.counters.steps


def _costs(method: Method) -> tuple[float, float]:
    """Return what a correction and what a step costs besides: ratios are what matters, and ns is their unit here."""
    if isinstance(method, Gauss):
        return 12.0 * method.stages, 50.0
    return (80.0, 340.0) if isinstance(method, Projected) else (50.0, 10.0)
