"""The motion of a recommendation: its rate, its reference solution, and its amplification of a small disturbance."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from functools import lru_cache

import numpy as np

from conservative.attitude import Array, angle_between
from conservative.errors import AccuracyNotReached
from conservative.grid import Grid
from conservative.integration.one import integrate
from conservative.method import Method
from conservative.methods.units import bound_rate
from conservative.references.exact.method import Exact
from conservative.references.truth import Truth, reference
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.timing import wall_time
from ..studies import step_ladder
from .extrapolation import Amplification
from .probe import STEPS, Conditions

CLOSED_RADIANS, RADIANS = 60.0, 30.0
"""Length of short probes, rad turned, with a closed form and with multi-precision, which takes a second for ten radians."""
SAMPLES = 32
"""Least number of samples of a short probe."""
DISTURBANCE = 1e-9
"""Relative change of the rates at the start."""
AFFORDABLE = 0.3
"""Wall-time budget, s, of each of the two disturbed runs, where there is no closed form."""
DENSE = 256
MOST_GRIDS = 16
"""Grids whose exact attitudes are kept: methods that are probed alike share theirs."""


def prepare_conditions(scene: Scene, error: float, duration: float, cost_limit: float) -> tuple[Conditions, Truth]:
    """Return the conditions of all probes, and the reference solution."""
    trial = integrate_quietly(scene, 1e-3, min(duration, 2 * CLOSED_RADIANS / bound_rate(scene)))
    rate = max(float(np.linalg.norm(trial.w_WB_B, axis=1).max()), 1 / duration)  # at least one radian in the whole duration
    closed = Exact().unsupported(scene) is None
    length = min(duration, (CLOSED_RADIANS if closed else RADIANS) / rate)
    spacing = round_down(min(length / SAMPLES, step_ladder.RADIANS / rate))
    samples = math.ceil(length / spacing * (1 - 1e-9))
    # Runs with steps longer than the spacing end up to an eighth later.
    truth = reference(scene, Grid(spacing, samples + samples // 8 + 1))

    @lru_cache(maxsize=MOST_GRIDS)
    def closed_form(grid: Grid) -> Array:
        return Exact().solve(scene, grid).R_WB

    def sampled(grid: Grid) -> Array:
        """Return the attitudes at multiples of the spacing, all of which the reference solution has."""
        return truth.trajectory.R_WB[:: round(grid.dt / spacing)][: grid.n_samples]

    until = max(duration, truth.trajectory.t[-1]) if closed else samples * spacing
    attitudes = closed_form if closed else sampled
    nothing = Amplification(np.array([0.0, duration]), np.zeros(2), DISTURBANCE, "")
    conditions = Conditions(scene, error, duration, cost_limit, spacing, samples, attitudes, float(until), rate, nothing)
    return replace(conditions, amplification=_measure_amplification(conditions)), truth


def integrate_quietly(scene: Scene, error: float, t_end: float) -> Trajectory:
    """Return our own trajectory for an error; only its `choice` shows that the error was not reached."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyNotReached)
        return integrate(scene, error=error, t_end=t_end, on_failure="return")


def round_down(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is at most `value`."""
    power = math.floor(math.log10(value))
    digit = max(digit for digit in (1, 2, 5) if digit <= value / 10.0**power * (1 + 1e-9))
    return float(f"{digit}e{power}")


def _measure_amplification(conditions: Conditions) -> Amplification:
    """Return the effect of a small change of the initial rates: by closed forms, otherwise by our own method."""
    scene = conditions.scene
    size = float(np.linalg.norm(scene.w_WB_B0)) or conditions.rate
    off = scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 + DISTURBANCE * size * np.array([0.48, 0.64, 0.6]))
    exact = Exact().unsupported(scene) is None and Exact().unsupported(off) is None
    method, dt = (Exact(), conditions.duration) if exact else choose_ours(conditions, DISTURBANCE / 100)
    until = conditions.duration
    if not exact:  # as far as the method gets within the wall time
        n = max(1, math.ceil(conditions.short / dt))
        run = method.prepare(scene, Grid(dt, n, n))
        run()
        until = min(until, AFFORDABLE * n * dt / wall_time(run))
    times, factors = [], []
    for end in sorted({min(until, conditions.short), until}):
        n = DENSE if exact else max(DENSE // 8, math.ceil(end / dt))
        grid = Grid(end / n, n, max(1, n // DENSE))
        pair = [method.solve(each, grid) for each in (scene, off)]
        shared = min(map(len, pair))
        times.append(pair[0].t[:shared])
        factors.append(angle_between(pair[0].R_WB[:shared], pair[1].R_WB[:shared]) / DISTURBANCE)
    t, factor = np.concatenate(times), np.concatenate(factors)
    order = np.argsort(t, kind="stable")
    return Amplification(t[order], np.maximum.accumulate(factor[order]), DISTURBANCE, method.label)


def choose_ours(conditions: Conditions, error: float) -> tuple[Method, float]:
    """Return the method and the longest round step, s, of the automatic choice for an error, rad, over a short window."""
    length = conditions.short
    choice = integrate_quietly(conditions.scene, error, length).choice
    assert choice is not None  # an error was asked for
    return choice.method, conditions.step_at_most(min(choice.dt, length / STEPS))
