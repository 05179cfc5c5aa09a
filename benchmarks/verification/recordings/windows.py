"""The stretch of free motion in a recording of a throw, which also has the hand before and the catch after it.

A wrong program must not become right by a window, so a stretch decides only if it stands out: noise alone is left in it, the
moments of the body and no damping follow from it, and torques act for some time before and after it, but not in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import cumulative_simpson

from conservative.attitude import Array

from ..compare import HUGE, SIGMAS, Compared, allow, estimate_noise, exact
from ..mistakes.scenes import with_inertia

FEWEST, LEAST_TURN = 50, 1.0
"""Smallest stretch, rows and rad."""
MEAN, ANGLE, PART = 4, 0.15, 40
"""Rows in the means that are compared to find torques: a turn of 0.15 rad, at least 4 rows and at most 1/40 of all."""
FORCED = 6.0
"""Change of the momentum without a torque, in standard deviations of its noise, from which a torque acts."""
OUTSIDE = 2.6
"""Smallest number of rows with a torque before and after a stretch, in rows of a mean. A kick makes 2 of them."""
JUMP, WITHIN, TURN = 2.0, 0.05, 0.5
"""Error outside, in allowed errors, that is reached within this share of the rows and this angle, rad, at most.

Errors of a program grow slowly, or with the angle.
"""
COHERENT = 0.45
"""Mean of errors outside over their size, of another motion. Noise in 16 rows or more has 0.25."""
UNRELATED = 0.5
"""Smallest median error outside, over the rates in a stretch. Rates with a bias or a kick still follow the free motion."""
RESTS = 0.15
"""Largest rate of a body at rest, relative to the rates in a stretch."""
LEAVE = 2.6
"""Mean error of `MEAN` rows, in deviations of the noise, from which rows do not belong to a stretch. Noise alone has 1.6."""
NEARLY = 1.2
"""First guess of the noise over the smallest estimate from a part of the rows."""
COARSE = 0.5
"""Largest turn from row to row, rad."""
CERTAIN = 4.0
"""Largest difference of the ratios of moments, and of a damping, from those of the scene, in standard deviations."""
SHARP = 0.05
"""Largest uncertainty of the ratios of moments, and of the damping over the stretch, with which a stretch decides."""


@dataclass(frozen=True)
class Stretch:
    """Rows of free motion, `first` to `last`, and why they do not decide alone; "" if they do."""

    first: int
    last: int
    open: str


def find_stretch(case: Compared) -> Stretch | None:
    """Return the longest stretch of free motion of rates with noise; None without one that stands out from the other rows."""
    w, t = case.data[1], case.t
    body = case.scene.body
    if w is None or not case.scene.free or body.rotor_momentum is not None or len(t) < FEWEST:
        return None
    case = case.rescale(float(np.linalg.norm(w, axis=1).max()) or 1.0)
    if case.gap > COARSE:
        return None
    with np.errstate(all="ignore"):
        L = w @ body.inertia
        # Without a torque, the momentum in body axes minus the integral of L x w is constant.
        constant: Any = np.linalg.solve(body.inertia, (L - cumulative_simpson(np.cross(L, w), x=t, axis=0, initial=0.0)).T).T
    if not np.isfinite(constant).all():
        return None
    mean = max(MEAN, min(int(ANGLE / case.gap), len(t) // PART))
    # The hand adds to the noise of the sensor, so the first guess is the smallest noise of any part.
    parts = [slice(k, k + FEWEST) for k in range(0, len(t) - FEWEST + 1, FEWEST // 2)]
    noise = NEARLY * min(float(estimate_noise(t[some], (None, w[some]))[0][1]) for some in parts)
    first, last, turns = 0, 0, np.linalg.norm(w, axis=1) * np.gradient(t)
    free = np.zeros(len(t), bool)
    for _ in range(3):
        free = _free(constant, noise, mean)
        first, last = _longest(free, turns)
        if last - first < FEWEST:
            return None
        noise = float(estimate_noise(t[first:last], (None, w[first:last]))[0][1])
    if noise <= 1e-6 * case.scale:  # no noise of a sensor
        return None
    return _refine(case, first, last, noise, ~free, turns, mean)


def _free(constant: Array, noise: float, mean: int) -> Array:
    """Return in which rows (n,) no torque acts, by the means of rows before and after each."""
    n = len(constant)
    sums = np.vstack([np.zeros(3), np.cumsum(constant, axis=0)])
    means = (sums[mean:] - sums[:-mean]) / mean
    change = np.linalg.norm(means[mean:] - means[:-mean], axis=1) / (noise * math.sqrt(2 / mean) or 1e-300)
    free = np.ones(n, bool)
    free[mean : mean + len(change)] = change < FORCED
    return free


def _longest(free: Array, turns: Array) -> tuple[int, int]:
    """Return the first row of the run of True with the largest turn, and the row after it. `turns` (n,) are rad a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], free.astype(int), [0]])))
    sums = np.append(0.0, np.cumsum(turns))
    runs = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    return max(runs, key=lambda run: sums[run[1]] - sums[run[0]], default=(0, 0))


def _refine(case: Compared, first: int, last: int, noise: float, forced: Array, turns: Array, mean: int) -> Stretch | None:
    """Return the stretch around rows without a torque whose rows are explained by one start, and whether it decides."""
    n, relative, w = len(case.t), noise / case.scale, case.data[1]
    assert w is not None
    own = allow((0.0, 0.0), (float(case.noise[0]), relative))

    def part(a: int, b: int) -> Compared:
        some = case.take(slice(a, b))
        some = replace(some, t=some.t - some.t[0], start=0.0, allowed=own.errors, noise=own.noise, rounded=(0.0, 0.0))
        return replace(some, free=(3, 4, 5)).read(None, some.data[1])

    inner = part(first, last)
    started = inner.at(inner.fit(exact(inner), np.zeros(0), np.zeros(0))[0])
    if not started.passes(started.error):
        return None
    # The same motion before and after.
    limit, speed = SIGMAS * relative, np.linalg.norm(w, axis=1)
    typical = float(np.median(speed[first:last])) / case.scale
    reach = max(MEAN, min(int(WITHIN * (last - first)), int(TURN / case.gap)))
    sides = []
    for rows in (np.arange(first)[::-1], np.arange(last, n)):
        total, rows = len(rows), rows[: 2 * len(inner.t)]
        difference = _differences(started, case.t[rows] - case.t[first], w[rows])
        error = np.linalg.norm(difference, axis=1)
        means = np.convolve(np.append(0.0, error), np.full(MEAN, 1 / MEAN))[1 : len(error) + 1]
        off = np.flatnonzero((error > limit) | (means > LEAVE * relative))
        good = int(off[0]) if len(off) else min(len(error), len(inner.t))
        jump = bool((error[good : good + reach] > JUMP * limit).any()) and _coherent(difference[good:], limit, 4 * mean)
        jump = jump and bool(np.median(error[good:]) > UNRELATED * typical)
        acts = forced[rows[max(0, good - mean) :]][: 8 * mean].sum() >= OUTSIDE * mean
        rests = np.median(np.append(speed[rows[good + reach :]][: 8 * mean], [math.inf])) < RESTS * typical * case.scale
        sides.append((good, total - good, jump and bool(acts), jump and bool(rests)))
    (more_before, _, hand_before, _), (more_after, _, hand_after, _) = sides
    clear = [acts or rests for *_, acts, rests in sides]
    if not any(clear) or any(rows >= MEAN and not side for (_, rows, *_), side in zip(sides, clear, strict=True)):
        return None  # the motion departs slowly, or goes on as a free motion
    for share in (1.0, 0.5, 0.0):  # the hand lets go of a body little by little
        a, b = first - int(share * more_before), last + int(share * more_after)
        whole = part(a, b)
        whole = whole.at(whole.fit(exact(whole), np.zeros(0), np.zeros(0))[0])
        if passed := whole.passes(whole.error):
            break
    if not passed or whole.turned < LEAST_TURN or b - a < FEWEST:
        return None
    first, last = a, b
    others = np.concatenate([forced[:first], np.ones(last - first, bool), forced[last:]])
    k, m = _longest(~others, turns)
    several = m - k >= FEWEST and turns[k:m].sum() >= LEAST_TURN
    if first < MEAN or (several and n - last < MEAN):
        return None  # a program begins with its motion; a kick makes two stretches
    reason = _open(whole)
    if reason == "":
        sides_at_rest = " and ".join(name for name, hand in (("before", hand_before), ("after", hand_after)) if not hand)
        if several:
            reason = "other rows may be free motion, too"
        elif n - last < MEAN:
            reason = "the file has no rows of another motion after them"
        elif sides_at_rest:
            reason = f"the body is at rest {sides_at_rest} them"
    return None if reason is None else Stretch(first, last - 1, reason)


def _differences(case: Compared, t: Array, w: Array) -> Array:
    """Return the errors of rates (n, 3), relative, at times that increase, or decrease from the start on.

    Backwards in time, rates with the other sign are a free motion.
    """
    if not len(t):
        return np.zeros((0, 3))
    sign = math.copysign(1.0, t[-1])
    made = case.equations().solve(0.0, case.scene.R_WB0[None], sign * case.scene.w_WB_B0[None], np.abs(t))[1][0]
    return np.nan_to_num((sign * made - w) / case.scale, nan=HUGE)


def _coherent(difference: Array, limit: float, count: int) -> bool:
    """Return whether rows (n, 3) outside are another motion: most of the first ones are off, and not to all sides as noise."""
    for some in (difference[:count], difference[count : 2 * count]):
        sizes = np.linalg.norm(some, axis=1)
        off = len(some) >= MEAN and np.median(sizes) > limit
        if off and np.linalg.norm(some.mean(axis=0)) > COHERENT * np.sqrt(np.mean(sizes**2)):
            return True
    return False


def _open(case: Compared) -> str | None:
    """Return why a stretch does not decide alone, "" if it does, and None if it is the motion of another body, or damped.

    The ratios of the moments and a damping are fitted to it. They have to be those of the body, and certain.
    """
    body, length = case.scene.body, float(case.t[-1] - case.start)

    def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        made = []
        for i, (a, b, damping) in enumerate(np.clip(p, -2, 2)):
            inertia = body.R_BP @ np.diag(body.moments * np.exp([0.0, a, b])) @ body.R_BP.T
            equations = case.equations(with_inertia(case.scene, inertia) or case.scene, damping=damping / length)
            made.append(equations.solve(case.start, R[[i]], w[[i]], case.t[:n]))
        return np.concatenate([R for R, _ in made]), np.concatenate([w for _, w in made])

    # The stretch fits the body, so that one step of Gauss and Newton finds what fits better.
    small = 1e-5
    # Turns of the start, the first three numbers, do not change rates.
    R, w = case.evaluate(motion, small * np.eye(7, 9, k=2) * (np.arange(7) > 0)[:, None])
    d = (case.differences(R, w)[..., 9:] / case.noise[1]).reshape(7, -1)
    slopes = (d[1:] - d[0]) / small
    numbers = -np.linalg.lstsq(slopes.T, d[0], rcond=None)[0][3:]
    square = slopes @ slopes.T
    # A number that the rows do not show has a large deviation.
    deviations = np.sqrt(np.diag(np.linalg.inv(square + 1e-14 * np.trace(square) * np.eye(6))))[3:]
    if (np.abs(numbers) > CERTAIN * deviations + 1e-6).any():
        return None
    return "" if (deviations < SHARP).all() else "they are too few, or too noisy, to show the moments of the body"
