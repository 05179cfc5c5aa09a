"""Times at which functions of time are not smooth, and steps that resolve them.

The functions of a scene are evaluated at `SCANNED` + 1 equally spaced times. Jumps and corners between two of them are found
by bisection; steps then end there. Elsewhere the integral over blocks of several lengths by Simpson's rule is compared with the
sum over all times: blocks for which both agree are short enough for a step. A pulse that is shorter than t_end / `SCANNED` can
be missed. If not even two intervals agree, the worst intervals are scanned again, more finely: a function that is not smooth
there, either, is noise, and no step resolves it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from ..attitude import Array, rotation_about
from ..check import read_only
from ..errors import BadInput

SCANNED = 2**16
"""Number of intervals of a scan."""
AGREED = 1e-3
"""Largest difference of both integrals, relative to the integral of the magnitude."""
ATTITUDE, OTHER = (read_only(rotation_about(axis, angle)) for axis, angle in (((1.0, 2.0, 3.0), 1.0), ((-3.0, 1.0, 2.0), 2.0)))
"""Attitudes of a scan, along no axis: a torque may be 0 in symmetric ones. A jump or corner at `ATTITUDE` belongs to the time
if there is one at `OTHER` as well; otherwise it belongs to the attitude."""
STEEP = 10.0
"""An interval may have a jump if it changes the value by this multiple of the change of a neighbour. The same ratio of second
differences is for corners."""
MOST_JUMPS, MOST_CORNERS = 1000, 4096
"""More of them are noise."""
LEAST_BEND = 1e-10
"""Second differences of a scan that are smaller, relative to the largest value, are not corners."""
NARROW, ZOOM = 1e-11, 8
"""Corners are found to this share of t_end, by dividing an interval into `ZOOM` parts again and again."""
WORST, CLOSER = 8, 1024
"""Noise is searched in the worst blocks: their number, and the parts of each interval there."""
NARROWER = 64
"""Ratio of the two spacings at which second differences are compared. From the wide spacing to the narrow one, they fall with
its square in a smooth function, with its first power at a corner, and not at all in noise."""


class Smoothness(NamedTuple):
    """Break points (n,) above 0, s; the longest step that resolves the functions, s; the interval, s, in which longer steps
    have the largest error; and whether no step resolves the functions.
    """

    breaks: Array
    step: float
    interval: tuple[float, float]
    noise: bool = False


SMOOTH = Smoothness(np.empty(0), math.inf, (0.0, math.inf))
"""Smoothness of a scene without loads that depend on time."""


@lru_cache(maxsize=64)
def examine(loads: tuple[Any, ...], t_end: float) -> Smoothness:
    """Return the smoothness of loads (`conservative.potentials.load.OfTime`) from 0 to t_end, s.

    Functions of time and attitude are evaluated at `ATTITUDE`. So the result is the same for all scenes with these loads,
    such as the bodies of an ensemble, and found once.
    """
    if all(load.origin for load in loads):  # loads in other units: a scan takes a second, its result can be converted
        (_, unit), *_ = (load.origin for load in loads)
        in_s = examine(tuple(load.origin[0] for load in loads), t_end * unit)
        first, last = in_s.interval
        return Smoothness(read_only(in_s.breaks / unit), in_s.step / unit, (first / unit, last / unit), in_s.noise)
    step, interval, noise = math.inf, (0.0, t_end), False
    breaks = np.unique(np.concatenate([np.empty(0), *(load.breaks for load in loads)]))
    times = np.linspace(0.0, t_end, SCANNED + 1)
    for load in loads:
        function = partial(_at_attitude, load.value, ATTITUDE) if load.of_attitude else load.value
        try:
            values = np.array([function(t) for t in times.tolist()], dtype=float).reshape(SCANNED + 1, -1)
        except Exception:  # a table; or a function that fails, which the run reports
            continue
        other = partial(_at_attitude, load.value, OTHER) if load.of_attitude else None
        jumps = _drop_near(_find_jumps(function, times, values, other), breaks, 1e-12 * t_end)
        if jumps and not load.may_jump:
            raise BadInput(load.name, f"a function that jumps at t = {jumps[0]:g} s", "a function without jumps")
        breaks = np.union1d(breaks, jumps)
        breaks = np.union1d(breaks, _drop_near(_find_corners(function, times, values, other), breaks, 1e-9 * t_end))
        resolved, where = _resolve(times, values, breaks)
        if resolved <= times[1] and (place := _find_noise(function, times, values, breaks)) is not None:
            step, interval, noise = resolved, place, True
        elif resolved < step and not noise:
            step, interval = resolved, where
    return Smoothness(read_only(breaks[breaks > 0]), step, interval, noise)


def _at_attitude(function: Callable[[float, Array], Array], R_WB: Array, t: float) -> Array:
    return function(t, R_WB)


def _drop_near(times: list[float], breaks: Array, distance: float) -> list[float]:
    """Return the times, s, that are farther than a distance, s, from all break points (n,), s."""
    return [t for t in times if not len(breaks) or np.abs(breaks - t).min() > distance]


def _value(function: Callable[[float], Array], t: float) -> Array:
    return np.asarray(function(t), dtype=float).ravel()


def _find_jumps(function: Callable[[float], Array], times: Array, values: Array, other: Any) -> list[float]:
    """Return the times of jumps, s, of a function of time.

    A jump of a function of time and attitude counts if `other`, the function at another attitude, jumps there too.
    """
    change = np.linalg.norm(np.diff(values, axis=0), axis=1)
    # The smaller change of both neighbours: next to a jump a function may be steep on one side.
    around = np.minimum(np.append(change[1], change[:-1]), np.append(change[1:], change[-2]))
    steep = np.flatnonzero(change > STEEP * around + 1e-9 * np.abs(values).max())
    jumps = []
    for i in steep.tolist() if len(steep) <= MOST_JUMPS else ():
        a, b, low, high = times[i], times[i + 1], values[i], values[i + 1]
        while (middle := (a + b) / 2) not in (a, b):  # until no float is between them; keep the half that changes more
            value = _value(function, float(middle))
            if np.linalg.norm(value - low) > np.linalg.norm(high - value):
                b, high = middle, value
            else:
                a, low = middle, value
        if np.linalg.norm(high - low) > change[i] / 4:  # otherwise the function is only steep
            again = other and np.linalg.norm(_value(other, float(b)) - _value(other, float(a)))
            if again is None or again > AGREED * change[i]:
                jumps.append(float(b))
    return jumps


def _find_corners(function: Callable[[float], Array], times: Array, values: Array, other: Any) -> list[float]:
    """Return the times, s, at which the slope of a function jumps. `other` is as in `_find_jumps`.

    A second difference across a corner is much larger than its neighbours. It is the jump of the slope times the spacing, for
    any spacing, which distinguishes a corner from noise and from what is smooth in shorter intervals.
    """
    largest = float(np.abs(values).max())
    bend = np.linalg.norm(values[:-2] - 2 * values[1:-1] + values[2:], axis=1)  # at times[1:-1]
    left, right = np.append(0.0, bend[:-1]), np.append(bend[1:], 0.0)
    # A corner between two times bends at both, so the next but one are compared.
    around = np.maximum(np.append((0.0, 0.0), bend[:-2]), np.append(bend[2:], (0.0, 0.0)))
    sharp = (bend > STEEP * around + LEAST_BEND * largest) & (bend >= left) & (bend > right)
    places = np.flatnonzero(sharp)
    corners = []
    for i in places.tolist() if len(places) <= MOST_CORNERS else ():
        a, b = float(times[i]), float(times[i + 2])
        # The change of the slope: a corner between two times contributes to the second differences at both.
        turn = float(bend[max(0, i - 1) : i + 2].sum()) / float(times[1])
        corner = _narrow(function, a, b, turn, NARROW * float(times[-1]), largest)
        if corner is not None and other is not None:
            h = float(times[1]) / 4
            again = np.linalg.norm(_value(other, corner - h) - 2 * _value(other, corner) + _value(other, corner + h))
            corner = corner if again > AGREED * turn * h else None
        if corner is not None:
            corners.append(corner)
    return corners


def _narrow(function: Callable[[float], Array], a: float, b: float, turn: float, width: float, largest: float) -> float | None:
    """Return the time of a corner between a and b, s, at which the slope changes by `turn`, to a width, s; None without one."""
    while b - a > width:
        t = np.linspace(a, b, ZOOM + 1)
        values = np.array([_value(function, time) for time in t.tolist()])
        bend = np.linalg.norm(values[:-2] - 2 * values[1:-1] + values[2:], axis=1)
        i, spacing = int(bend.argmax()), float(t[1] - t[0])
        here = float(bend[max(0, i - 1) : i + 2].sum())
        if here < turn * spacing / 4:
            return None
        a, b = float(t[i]), float(t[i + 2])
        if here < 1e-12 * largest:  # rounding shows no more
            break
    return (a + b) / 2


def _resolve(times: Array, values: Array, breaks: Array) -> tuple[float, tuple[float, float]]:
    """Return the length of the longest blocks that Simpson's rule integrates, s, and the worst block of twice the length, s."""
    total, step = float(np.abs(values).mean(axis=0).max()), float(times[1])
    size, result = 2, (step, (0.0, float(times[-1])))
    while size <= SCANNED:
        off = _compare_blocks(times, values, breaks, size)
        if off.mean() > AGREED * total:
            worst = int(off.argmax())
            return result[0], (float(times[worst * size]), float(times[(worst + 1) * size]))
        result, size = (size * step, result[1]), 2 * size
    return math.inf, result[1]


def _compare_blocks(times: Array, values: Array, breaks: Array, size: int) -> Array:
    """Return the difference of Simpson's rule and the sum over all times in blocks of so many intervals; 0 at breaks."""
    blocks = values[:-1].reshape(-1, size, values.shape[1])
    ends = np.concatenate([blocks[1:, 0], values[-1:]])
    dense = blocks.mean(axis=1) + (ends - blocks[:, 0]) / (2 * size)  # the trapezoidal rule with all times
    rule = (blocks[:, 0] + 4 * blocks[:, size // 2] + ends) / 6
    off: Array = np.abs(rule - dense).max(axis=1)
    for side in ("left", "right"):  # a break point between two blocks is part of both
        off[np.searchsorted(times[::size], breaks, side).clip(1, len(off)) - 1] = 0.0
    return off


def _find_noise(function: Callable[[float], Array], times: Array, values: Array, breaks: Array) -> tuple[float, float] | None:
    """Return an interval, s, in which a function is not smooth, if most of the worst blocks have one; otherwise None."""
    worst = np.argsort(-_compare_blocks(times, values, breaks, 2), kind="stable")[:WORST]
    noisy = []
    for i in (2 * worst).tolist():
        a, b = float(times[i]), float(times[i + 2])
        closer = np.array([_value(function, t) for t in np.linspace(a, b, 2 * CLOSER + 1).tolist()])
        far, near = (
            float(np.linalg.norm(closer[: -2 * n] - 2 * closer[n:-n] + closer[2 * n :], axis=1).max()) for n in (NARROWER, 1)
        )
        if near > far / (4 * NARROWER):  # far / NARROWER at a corner, far / NARROWER^2 where smooth
            noisy.append((a, b))
    return noisy[0] if len(noisy) > WORST / 2 else None


class Unresolved(NamedTuple):
    """A table that steps do not resolve: the longest step that does, s, the step with the largest error, s, and its corners."""

    step: float
    interval: tuple[float, float]
    corners: int


def find_unresolved(load: Any, dt: float, n_steps: int) -> Unresolved | None:
    """Return the description of a table that n steps dt, s, do not resolve; None if they resolve it.

    A table is not resolved if it has more corners than steps, and Simpson's rule over each step differs from the integral of
    the table, as in `examine`. A smooth function that is sampled densely is resolved.
    """
    if not isinstance(load.value, tuple):
        return None
    end = n_steps * dt
    corners = int(np.count_nonzero((load.breaks > 0) & (load.breaks < end)))
    if corners <= n_steps:
        return None
    times, rows = load.value[0], load.value[1].reshape(len(load.value[0]), -1)
    off = _compare(times, rows, dt, n_steps)
    worst, step, n = int(off.argmax()), dt, n_steps
    while corners > n and off.mean() > AGREED:
        step, n = step / 2, 2 * n
        off = _compare(times, rows, step, n)
    return Unresolved(step, (worst * dt, (worst + 1) * dt), corners) if n > n_steps else None


def _compare(times: Array, rows: Array, dt: float, n_steps: int) -> Array:
    """Return the difference (n,) of Simpson's rule from the mean of a table in each of n steps dt, s, relative to its size.

    A table is linear between its times and held after them; at a jump a step has the value of its own side.
    """
    ends: Array = dt * np.arange(n_steps + 1, dtype=float)
    sums = np.vstack([np.zeros(rows.shape[1]), np.cumsum(np.diff(times)[:, None] * (rows[1:] + rows[:-1]) / 2, axis=0)])

    def at(t: Array, side: Any) -> tuple[Array, Array]:
        """Return the values at times and the integrals up to them."""
        i = np.clip(np.searchsorted(times, t, side) - 1, 0, len(times) - 2)
        gap, after = times[i + 1] - times[i], (t - times[i])[:, None]
        share = np.divide(after, gap[:, None], out=np.ones_like(after), where=gap[:, None] > 0)
        value = rows[i] + np.minimum(share, 1.0) * (rows[i + 1] - rows[i])
        inside = np.minimum(after, gap[:, None])
        return value, sums[i] + inside * (rows[i] + value) / 2 + (after - inside) * value

    (first, low), (last, high) = at(ends[:-1], "right"), at(ends[1:], "left")
    middle = at(ends[:-1] + dt / 2, "right")[0]
    mean, rule = (high - low) / np.diff(ends)[:, None], (first + 4 * middle + last) / 6
    size = np.maximum(np.abs(mean), np.abs(rule)).mean(axis=0).max()
    return np.abs(rule - mean).max(axis=1) / (size or 1.0)
