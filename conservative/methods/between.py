"""Samples at arbitrary times: each is computed from the step before it, by short steps of high order that add only round-off.

A sample is therefore as accurate as the steps before it, and conserves the same invariants. An interpolating polynomial would
be less accurate. The substeps use the coefficients of Dormand and Prince (`conservative.methods.coefficients.explicit`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any

import numpy as np

from ..attitude import Array, to_quaternion
from ..check import describe, real_array
from ..deferred_imports import kernels
from ..errors import BadInput, Diverged
from ..grid import ROUNDING, SAMPLE_BYTES, Grid, count_whole_steps, most_samples
from ..method import Method
from ..potentials.uniform_gravity import UniformField
from ..scene import Scene
from ..trajectory import Trajectory, cut_at_failure
from .coefficients.explicit import DORMAND_PRINCE_8
from .principal_axes import invariant_scales, principal_start
from .units import bound_rate, convert_scene, find_units

RADIANS = 0.5
"""First substep across a gap, as the largest possible rotation, rad."""
LONGEST = 6.0
"""Longest step, as the largest possible rotation, rad, of methods whose accuracy does not depend on it.

Shorter steps cost less than the substeps across longer gaps."""
MOST_KEPT = 10**6
"""Largest number of steps, evenly spaced, that are stored as starting points of samples."""


@dataclass(frozen=True, eq=False)
class SampleTimes:
    """The samples that a run stores.

    Attributes
    ----------
    spacing
        Sampling interval, s, that the steps have to divide; None for any steps.
    every
        Number of these intervals, or of steps, between samples.
    at
        Increasing times of the samples (n,), s, which replace the other two; None for evenly spaced samples.
    """

    spacing: float | None = None
    every: int = 1
    at: Array | None = None


def read_times(value: object, t_end: float) -> Array:
    """Return the times of samples (n,), s. An integer `value` is the number of times, evenly spaced from 0 to t_end, s.

    Raise `BadInput` if the times are not numbers, not finite, not increasing, not within 0 to t_end, or empty, or do not fit in
    memory.
    """
    allowed = f"times (n,), s, in increasing order from 0 to t_end = {t_end:g}, or their number, 2 or more"
    if not isinstance(value, bool) and isinstance(value, Integral):
        _require_count(int(value), 2, allowed)
        return np.linspace(0.0, t_end, int(value))
    t = real_array(value)
    if t is None or t.ndim != 1:
        raise BadInput("t_eval", describe(value), allowed)
    _require_count(len(t), 1, allowed)
    if not np.isfinite(t).all():
        raise BadInput("t_eval", f"{describe(t[~np.isfinite(t)][0].item())} at index {np.argmin(np.isfinite(t))}", allowed)
    if (np.diff(t) <= 0).any():
        i = int(np.argmax(np.diff(t) <= 0))
        raise BadInput("t_eval", f"{t[i + 1]:.17g} after {t[i]:.17g}, at index {i + 1}", allowed)
    if t[0] < 0 or t[-1] > t_end * (1 + 1e-9):
        raise BadInput("t_eval", f"times from {t[0]:.17g} to {t[-1]:.17g}", allowed)
    return t


def _require_count(n: int, least: int, allowed: str) -> None:
    """Raise `BadInput` unless there are at least `least` samples and they fit in memory."""
    if n < least:
        raise BadInput("t_eval", "none" if n == 0 else f"{n}", allowed)
    if n > most_samples():
        raise BadInput(
            "t_eval", f"{n} samples", f"{allowed}: up to {most_samples():.3g} fit in memory, {SAMPLE_BYTES} bytes each"
        )


def grid_before(scene: Scene, method: Method, dt: float, t: Array) -> Grid:
    """Return the grid of steps dt, s, from which samples at times t (n,), s, are computed."""
    dt = divide_step(scene, method, dt)
    n_steps = max(1, count_whole_steps(float(t[-1]), dt))
    return Grid(dt, n_steps, stride_of(n_steps))


def divide_step(scene: Scene, method: Method, dt: float) -> float:
    """Return the step dt, s, or an equal part of it if accuracy does not depend on the step and gaps would be long."""
    return dt if method.order is not None else dt / max(1, math.ceil(dt * bound_rate(scene) / LONGEST))


def stride_of(n_steps: int) -> int:
    """Return the number of steps between stored ones in a run of `n_steps` steps."""
    return max(1, n_steps // MOST_KEPT)


def sample_between(run: Trajectory, method: Method, grid: Grid, t: Array) -> Trajectory:
    """Return the samples at increasing times t (n,), s, from the run of a method on a grid.

    The samples of a failed run end at its last valid step.
    """
    if not len(run):
        return run
    row = np.searchsorted(run.t, t * (1 + ROUNDING), side="right") - 1
    gaps = t - run.t[row]
    gaps[np.abs(gaps) <= ROUNDING * t] = 0.0
    n = len(t) if run.ok else int(np.count_nonzero((row < len(run) - 1) | (gaps == 0.0)))
    row, gaps = row[:n], gaps[:n]
    supplied = None if run.supplied is None else run.supplied[row]
    R_WB, w_WB_B, done = move(run.scene, run.t[row], gaps, run.R_WB[row], run.w_WB_B[row], supplied)
    failure = run.failure if done == n else Diverged(float(run.t[row[done]]), "it turns too fast to be followed")
    R_WB, w_WB_B, frame, flight = R_WB[:done], w_WB_B[:done], run.frame, run.scene.flight
    if frame and flight:
        first = (samples[row[:done]] for samples in (run.R_WB, run.w_WB_B, *frame))
        frame = flight.follow(flight.fall_from(*flight.centre(*first), gaps[:done]), R_WB, w_WB_B)
    changes: dict[str, Any] = {"failure": failure, "frame": frame, "supplied": None if supplied is None else supplied[:done]}
    samples = replace(run, t=t[:done].copy(), R_WB=R_WB, w_WB_B=w_WB_B, **changes)
    return cut_at_failure(samples, method.conserves, method.bounds(run.scene, grid))


def attitudes_at(run: Trajectory, t: Array) -> Array:
    """Return the attitudes (n, 3, 3) of a run at increasing times t (n,), s, which can be a little later than its last sample.

    Each is the state of the sample before it, moved forward by integration; a spline through the samples is less accurate.
    From the time at which a state cannot be moved, they are nan.
    """
    row = np.clip(np.searchsorted(run.t, t * (1 + ROUNDING), side="right") - 1, 0, None)
    gaps = t - run.t[row]
    gaps[np.abs(gaps) <= ROUNDING * t] = 0.0
    R_WB, _, done = move(run.scene, run.t[row], gaps, run.R_WB[row], run.w_WB_B[row])
    R_WB[done:] = np.nan
    return R_WB


def move(
    scene: Scene, t: Array, gaps: Array, R_WB: Array, w_WB_B: Array, supplied: Array | None = None
) -> tuple[Array, Array, int]:
    """Move states at times t (n,), s, forward by gaps (n,), s. Return the attitudes, the rates and the number of moved states.

    Work and impulse of the loads in the gaps are added to `supplied` (n, 4).

    States are attitudes (n, 3, 3) and rates (n, 3), rad/s, body axes. If a state cannot be moved, the later ones are not moved
    either. States with a gap of 0 do not change.
    """
    far, R, w = np.flatnonzero(gaps), R_WB.copy(), w_WB_B.copy()
    if not len(far):
        return R, w, len(t)
    units = find_units(scene, scene.dt)
    scene = scene.derive(convert_scene, units)
    body, start = scene.body, scene.derive(principal_start)
    q = np.ascontiguousarray(to_quaternion(R[far] @ body.R_BP))
    L = np.zeros((len(far), 7 if scene.loaded else 3))
    L[:, :3] = (w[far] * units.time @ body.R_BP) * body.moments
    field: Any = UniformField(0.0, 0.0, 0.0) if start.field is None else start.field  # there is code for it anyway
    table = (*DORMAND_PRINCE_8.packed, np.array(DORMAND_PRINCE_8.c))
    limits, times = (invariant_scales(scene)[1], RADIANS / bound_rate(scene)), t[far] / units.time
    breaks = scene.smoothness(float(times[-1])).breaks
    now, left, edges = times.copy(), gaps[far] / units.time, np.concatenate([[-math.inf], breaks, [math.inf]])
    moved, waiting, last = len(far), np.arange(len(far)), np.searchsorted(times, times, side="right") - 1
    while len(waiting):  # once, or once more for each break point in a gap
        place = np.searchsorted(edges, now[waiting] * (1 + ROUNDING), side="right")
        for i in np.unique(place).tolist():
            some = waiting[place == i]
            lead, of, ahead = some, np.arange(len(some)), now[some] + left[some] >= edges[i]
            if ahead.any():  # samples after the same step have the same state at a break point: one is moved there for all
                lead, of = np.unique(np.where(ahead, last[some], some), return_inverse=True)
            if scene.loaded:
                field = field._replace(clock=(0.0, float(edges[i - 1]), float(edges[i])))
            at, gap, of_q, of_L = now[lead], np.minimum(left[lead], edges[i] - now[lead]), q[lead], L[lead]
            good = kernels("between").move(start.J_inverse, start.rotor, field, *table, *limits, at, gap, of_q, of_L)
            of_L[:, 3:] += L[lead, 3:]
            q[some], L[some], now[some], left[some] = of_q[of], of_L[of], (at + gap)[of], left[some] - gap[of]
            moved = moved if good == len(lead) else min(moved, int(some[of >= good].min()))
        waiting = waiting[left[waiting] > 0]
    moved_R, moved_w = np.empty((moved, 3, 3)), np.empty((moved, 3))
    kernels("samples").fill(times, 1, moved, q, L, start.axes(0.0), moved_R, moved_w)
    R[far[:moved]], w[far[:moved]] = moved_R, moved_w / units.time
    if supplied is not None:
        supplied[far] += L[:, 3:] * units.supply
    return R, w, len(t) if moved == len(far) else int(far[moved])
