"""From a wanted error to a method and a step: probe the candidates, take the cheapest, run it, and say how good it is.

1. A short probe of each candidate, cutting steps until the difference of two step lengths says that the error is small enough.
2. The candidate with the least work at its step is taken: a count, not a time, so that the same scene gets the same choice.
3. The whole run, once more with twice the step. Their difference, not the probe, is the estimate that is reported: a probe
   cannot see how much a scene amplifies errors later on. Where it is above what was asked for, the step is cut and the run
   repeated.

Which families are candidates, and what their work costs, they say themselves: `Method.candidacy`, `Method.cost`.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from .. import registry
from ..attitude import Array, angle_between
from ..declarations import Candidacy
from ..errors import AccuracyNotReached, BadInput, IntegrationFailed, MissingEngine, Unsupported
from ..method import Grid, Method, Role
from ..scene import Scene
from ..trajectory import Choice, Trajectory
from .units import bound_rate

SAFETY = 0.5
"""Share of the wanted error that steps are chosen for."""
LARGEST_FACTOR = 30.0
"""Largest factor by which halving the step is trusted to shrink the error, whatever the order: round-off does not shrink."""
ASYMPTOTIC = 0.2
"""Errors above this, rad, are saturated (angles end at pi) and are not used."""
ATTEMPTS = 12
STALLED = 0.7
"""Shorter steps have stopped helping when two in a row leave more than this share of the error before them."""
PROBE_RADIANS = 200.0
"""Length of a probe in units of the fastest turning that the energy allows."""
MOST_STEPS, MOST_PROBED = 10**10, 10**7
"""Steps that a run may be given, and a probe: some quarter of an hour, and a second, by the fastest method."""
MOST_COMPARED = 10**5
"""Samples of a probe at most."""

Attempts = list[tuple[float, float]]
"""Steps tried, s, with the estimated error of each, rad."""


def candidates(scene: Scene) -> tuple[Method, ...]:
    """Return the methods worth probing on a scene: an exact family alone where one supports it, else one of each group."""
    found: dict[str, tuple[Method, ...]] = {}
    for family, candidacy in _ranked_families():
        settings = _settings(family)
        if not settings or settings[0].unsupported(scene) is not None:
            continue
        if candidacy.exact:
            return settings
        found.setdefault(candidacy.group or family.family, settings)
    return tuple(chain.from_iterable(found.values()))


def _ranked_families() -> list[tuple[type[Method], Candidacy]]:
    """Return the families of ours that are candidates, in the order of their ranks."""
    ours = [family for family in registry.list_families().values() if family.role == Role.OURS]
    found = [(family, family.candidacy) for family in ours if family.candidacy is not None]
    return sorted(found, key=lambda entry: entry[1].rank)


def _settings(family: type[Method]) -> tuple[Method, ...]:
    """Return the settings of a family that are probed; none where what it needs is not installed."""
    try:
        return family.candidate_settings()
    except MissingEngine:
        return ()


def integrate_to_error(scene: Scene, error: float, t_end: float, spacing: float | None, sample_every: int) -> Trajectory:
    """Return the trajectory with the cheapest method and step found for an attitude error, rad; its `choice` says which.

    With `spacing` (s) steps divide it, and every `sample_every`-th multiple of it is sampled; without, every `sample_every`-th
    step.

    Raises
    ------
    BadInput
        The error asks for more than `MOST_STEPS` steps.
    """
    method, dt = _find_cheapest(scene, error, t_end)
    attempts: Attempts = []
    for _ in range(ATTEMPTS):
        grid = _even_grid(dt, t_end, spacing, sample_every)
        estimate, trajectory = _run_twice(method, scene, grid)
        attempts.append((grid.dt, estimate))
        if estimate <= error or _stalls(attempts):
            break
        dt = grid.dt * _step_factor(estimate, error, method)
    best = Choice(method, grid.dt, error, estimate, tuple(attempts))
    if trajectory.ok and not best.reached:
        warnings.warn(AccuracyNotReached(error, estimate), stacklevel=4)
    return replace(trajectory, choice=best)


def _find_cheapest(scene: Scene, error: float, t_end: float) -> tuple[Method, float]:
    """Return the candidate with the least work per second at the step that its probe asks for, and that step."""
    probes = [(*_probe(method, scene, error, t_end), method) for method in candidates(scene)]
    _, dt, method = min(probes, key=lambda entry: entry[0])
    return method, dt


def _probe(method: Method, scene: Scene, error: float, t_end: float) -> tuple[float, float]:
    """Return (work per second, step) with which a short run of the method has its share of the error."""
    duration = min(t_end, PROBE_RADIANS / bound_rate(scene))
    share = error * min(1.0, 4 * duration / t_end)
    dt = duration / 2 if method.order else min(method.longest_step(scene) / 2, t_end / 16)
    attempts: Attempts = []
    for _ in range(2 * ATTEMPTS):
        if duration / dt > MOST_PROBED:  # out of the question, while another candidate gets there
            return math.inf, dt
        grid = _even_grid(dt, duration, None, max(1, int(duration / dt / MOST_COMPARED)))
        estimate, trajectory = _run_twice(method, scene, grid)
        attempts.append((grid.dt, estimate))
        if estimate <= SAFETY * share or method.order is None or _stalls(attempts):
            break
        dt = grid.dt * _step_factor(estimate, share, method)
    return (_count_work(method, trajectory) / duration if math.isfinite(estimate) else math.inf), grid.dt


def _count_work(method: Method, trajectory: Trajectory) -> float:
    """Return a count of work: corrections and steps, weighted by what they cost beside those of the other candidates."""
    return method.cost.correction * (trajectory.counters.iterations or 0) + method.cost.step * trajectory.counters.steps


def _even_grid(dt: float, t_end: float, spacing: float | None, sample_every: int) -> Grid:
    """Return a grid of an even number of steps of at most dt. Raise `BadInput` if they are more than `MOST_STEPS`."""
    if t_end / dt > MOST_STEPS:
        raise BadInput("error", f"what takes {t_end / dt:.3g} steps", f"what {MOST_STEPS:g} steps reach: a larger one")
    if spacing is None:
        n = 2 * max(1, math.ceil(t_end / dt / 2 * (1 - 1e-9)))
        return Grid(t_end / n, n, min(sample_every, n))
    each = 2 * max(1, math.ceil(spacing / dt / 2 * (1 - 1e-9)))
    n = each * math.ceil(t_end / spacing * (1 - 1e-9))
    return Grid(spacing / each, n, min(each * sample_every, n))


def _run_twice(method: Method, scene: Scene, grid: Grid) -> tuple[float, Trajectory]:
    """Return the estimated error, rad, inf where a run fails, and the trajectory of a run, from one more at twice the step."""
    fine = method.solve(scene, grid)
    # Half the samples where samples fall on odd steps: then coarse samples lie on every other fine one.
    stride = 1 + grid.every % 2
    try:
        coarse = method.solve(scene, Grid(2 * grid.dt, grid.n_steps // 2, grid.every * stride // 2))
    except (IntegrationFailed, MissingEngine, Unsupported):
        return math.inf, fine
    if not (fine.ok and coarse.ok):
        return math.inf, fine
    difference = float(angle_between(_every(stride, fine.R_WB), coarse.R_WB).max())
    estimate = difference / _convergence_factor(method) + _rounding_error(fine)
    return (estimate if difference < ASYMPTOTIC else math.inf), fine


def _every(stride: int, R_WB: Array) -> Array:
    """Return every `stride`-th attitude of (n, 3, 3), and the last."""
    return R_WB[::stride] if (len(R_WB) - 1) % stride == 0 else np.concatenate([R_WB[::stride], R_WB[-1:]])


def _convergence_factor(method: Method) -> float:
    """Return by which factor the finer of two runs is less off than their difference."""
    return 1.0 if method.order is None else min(2.0**method.order - 1, LARGEST_FACTOR)


def _rounding_error(trajectory: Trajectory) -> float:
    """Return what rounding the scene's own numbers turns the body by, rad: no comparison of two runs can see it."""
    speed = float(np.linalg.norm(trajectory.w_WB_B, axis=1).max())
    return float(np.finfo(float).eps / 2 * speed * trajectory.t[-1])


def _step_factor(estimate: float, error: float, method: Method) -> float:
    """Return the factor for the next step, from the estimated error and that wanted, rad."""
    if not math.isfinite(estimate) or method.order is None:
        return 0.5
    return min(0.9, max(0.1, (SAFETY * error / estimate) ** (1 / method.order)))


def _stalls(attempts: Attempts) -> bool:
    """Return whether shorter steps have stopped helping."""
    return stops_falling([estimate for _, estimate in attempts if math.isfinite(estimate)])


def stops_falling(errors: Sequence[float]) -> bool:
    """Return whether errors, rad, of finer and finer settings have stopped falling, as at round-off."""
    return len(errors) >= 3 and min(errors[-2:]) > STALLED * errors[-3]
