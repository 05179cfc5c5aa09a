"""The search for right samples that a recorder repeated or interpolated in rows that are closer than the samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion

from .compare import FLOOR, ROUND_OFF, UNITS_OF_DIGITS, Compared, Solution, exact
from .explanation import Explanation, Trial, attempt
from .mistakes.samples import RESAMPLED, TURNS, Resampling
from .solution import States

STRAIGHT = 4.0
"""Distance of a row from the line between its neighbours, in units of its digits, up to which the three lie on it."""
FEWEST_SAMPLES = 4
"""Smallest number of samples that show that they are equally far apart."""
EVEN = 0.02
"""Largest distance of samples from equal distances, relative to the distance of the rows."""


NEAR = 0.01
"""Share of the error up to which the times of samples are fitted as well."""
SMALL = np.full(2, 1e-7)
"""Changes of the times of samples for slopes, s."""


class Grid(NamedTuple):
    """Samples at the times `first` + k `spacing`, s, the first of which is in the file."""

    first: float
    spacing: float


def find_resampled(case: Compared) -> Iterator[Explanation | None]:
    """Yield right motions of which rows repeat or interpolate samples.

    Rows between two samples lie on a line, and attitudes on a great circle of quaternions. Where lines meet there is a sample,
    which need not be a row. Digits alone are allowed to be left: what looks like noise in such rows is the distance of lines
    from the motion.
    """
    if case.step is not None or len(case.t) < 3 * FEWEST_SAMPLES:
        return
    rounded = np.maximum(case.rounded, ROUND_OFF)
    case = case.change(
        allowed=np.minimum(case.allowed, np.maximum(FLOOR, UNITS_OF_DIGITS * rounded)), noise=np.minimum(case.noise, rounded)
    )
    R, w = case.data
    held = [_runs(x) for x in case.data]
    kinks = [
        None if R is None or held[0] is not None else _kinks_of_attitudes(case, R),
        None if w is None or held[1] is not None else _kinks_of_rates(case, w),
    ]
    for mistake in RESAMPLED:
        laws = (mistake.attitudes, mistake.rates)
        signs = held if mistake.held else kinks
        if [sign is not None for sign in signs] == [law is not None for law in laws]:
            yield (_held if mistake.held else _between)(case, mistake, next(sign for sign in signs if sign is not None))


def _runs(x: Array | None) -> Any:
    """Return for each row which sample it repeats (n,); None if rows do not come in runs of equal ones."""
    if x is None:
        return None
    new = np.append(True, (np.diff(x, axis=0) != 0).reshape(len(x) - 1, -1).any(axis=1))
    starts = np.flatnonzero(new)
    lengths = np.diff(starts)  # the last run may be cut off
    if len(lengths) < FEWEST_SAMPLES or np.ptp(lengths[1:]) > 1 or lengths[1:].mean() < 1.05:
        return None
    return np.cumsum(new) - 1


def _held(case: Compared, mistake: Resampling, sample: Any) -> Explanation | None:
    """Return the explanation by rows that repeat samples, each row one with a known number."""
    starts = np.flatnonzero(np.append(True, np.diff(sample) > 0))
    guess = float(np.polyfit(sample[starts], case.t[starts], 1)[0])
    whole = np.ptp(np.diff(starts)) == 0
    if mistake.attitudes and mistake.rates and whole and starts[1] == 2:
        return None  # one in two rows is held, as other mistakes of some rows are

    def build(of: Compared) -> Solution | None:
        def motion(R: Array, w: Array, p: Array, count: int) -> tuple[Array, Array]:
            made = []
            for i, spacing in enumerate(p[:, 0].tolist() if p.shape[1] else [guess]):
                some = slice(i, i + 1) if p.shape[1] else slice(None)
                made.append(_choose(mistake, *_solve(of, R[some], w[some], of.start + sample[:count] * spacing, of.t[:count])))
            return np.concatenate([a for a, _ in made]), np.concatenate([b for _, b in made])

        return motion

    trial = Trial((mistake,), build, () if whole else mistake.numbers)
    explanation = attempt(case, trial, None if whole else [guess], known={"spacing": guess} if whole else {})
    return None if explanation is None else replace(explanation, trial=None, numbers=1)


def _choose(mistake: Resampling, sampled: tuple[Array, Array], right: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return attitudes and rates from samples, or right ones for a quantity without a law."""
    return (sampled if mistake.attitudes else right)[0], (sampled if mistake.rates else right)[1]


def _solve(case: Compared, R: Array, w: Array, *times: Array) -> list[tuple[Array, Array]]:
    """Return exact motions (B, n, 3, 3), (B, n, 3) from states (B, 3, 3), (B, 3) at the start, at several times (n,) each."""
    flat, places = np.unique(np.maximum(np.concatenate(times), case.start), return_inverse=True)
    turned, rates = exact(replace(case, t=flat, data=(None, None)))(R, w, np.zeros((len(R), 0)), len(flat))
    parts = np.split(places.ravel(), np.cumsum([len(each) for each in times])[:-1])
    return [(turned[:, part], rates[:, part]) for part in parts]


def _quaternions(R: Array) -> Array:
    """Return quaternions (n, 4) of attitudes, each of the sign that is nearer to the one before."""
    q = to_quaternion(R)
    return q * np.cumprod(np.append(1.0, np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1.0, 1.0)))[:, None]


def _beside_arc(q: Array) -> Array:
    """Return the distances (n - 2,) of quaternions from the great circle through their neighbours, rad."""
    a, b = q[:-2], q[2:]
    c = b - (a * b).sum(axis=1, keepdims=True) * a
    c = c / np.maximum(np.linalg.norm(c, axis=1, keepdims=True), 1e-300)
    x = q[1:-1]
    return 2 * np.linalg.norm(x - (x * a).sum(axis=1, keepdims=True) * a - (x * c).sum(axis=1, keepdims=True) * c, axis=1)


def _beside_line(t: Array, w: Array) -> Array:
    """Return the distances (n - 2,) of rates from the line between their neighbours, rad/s."""
    share = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, None]
    return np.linalg.norm(w[1:-1] - w[:-2] - share * (w[2:] - w[:-2]), axis=1)


def _places(beside: Array, of_motion: Array, digits: float) -> Any:
    """Return the samples as pairs of rows between which they are, equal ones for a row; None if rows do not show them."""
    off = beside > STRAIGHT * digits
    if np.median(of_motion) < 2 * STRAIGHT * digits or off.mean() > 0.7 or off.sum() < FEWEST_SAMPLES:
        return None
    rows = np.flatnonzero(off) + 1
    groups = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    if max(map(len, groups)) > 2 or len(groups) < FEWEST_SAMPLES:
        return None
    places = np.array([(group[0], group[-1]) for group in groups])
    return places[(places[:, 0] >= 2) & (places[:, 1] < len(beside))]


def _kinks_of_rates(case: Compared, w: Array) -> Grid | None:
    """Return the samples between which rates lie on lines; None without any."""
    t, digits = case.t, max(case.rounded[1], ROUND_OFF) * case.scale
    places = _places(_beside_line(t, w), _beside_line(t, case.exact[1]), digits)
    if places is None or len(places) < FEWEST_SAMPLES:
        return None
    times = []
    for i, j in places:
        if i == j:
            times.append(float(t[i]))
            continue
        before, after = (w[i] - w[i - 1]) / (t[i] - t[i - 1]), (w[j + 1] - w[j]) / (t[j + 1] - t[j])
        change, apart = before - after, w[j] - w[i] - after * (t[j] - t[i])
        times.append(float(t[i] + change @ apart / (change @ change)))
    return _even(np.array(times), t)


def _even(times: Array, t: Array, weights: Array | None = None) -> Grid | None:
    """Return samples at equal distances that are at times (m,), s, some of which may be missing."""
    gap = float(np.median(np.diff(times)))
    for _ in range(3):
        number = np.rint((times - times[0]) / gap)
        if not number.any():
            return None
        gap, first = np.polyfit(number, times, 1)
    if np.median(np.abs(times - first - number * gap)) > EVEN * np.median(np.diff(t)):
        return None
    count = np.floor((first - t[0]) / gap + 1e-6)  # the first one in the file
    return Grid(float(first - count * gap), float(gap))


def _kinks_of_attitudes(case: Compared, R: Array) -> dict[str, Grid] | None:
    """Return the samples between which attitudes lie on great circles, by the way of interpolation; None without any."""
    t, digits, q = case.t, max(case.rounded[0], ROUND_OFF), _quaternions(R)
    places = _places(_beside_arc(q), _beside_arc(_quaternions(case.exact[0])), digits)
    if places is None or len(places) < FEWEST_SAMPLES:
        return None
    corners = np.array([q[i] if i == j else _meet(q[i - 1], q[i], q[j], q[j + 1]) for i, j in places])
    gap = np.median(np.diff(t[places].mean(axis=1)))
    out, beside = dict[str, Grid](), dict[str, float]()
    for key, (_, law) in TURNS.items():
        numbers, times, number = list[Array](), list[Array](), 0.0
        for (before, after), a, b in zip(pairwise(places), corners[:-1], corners[1:], strict=False):
            steps = round(float(t[after].mean() - t[before].mean()) / gap)
            inside = np.arange(before[1], after[0] + 1)
            if steps == 1:
                angle, x = _arc(a, b), np.array([_arc(a, row) for row in q[inside]])
                shares = np.linspace(0, 1, 4001)
                numbers.append(number + np.interp(2 * x, law(shares, np.full(4001, 2 * angle)), shares))
                times.append(t[inside])
            number += steps
        if not numbers:
            continue
        flat, at = np.concatenate(numbers), np.concatenate(times)
        spacing, first = np.polyfit(flat, at, 1)
        count = np.floor((first - t[0]) / spacing + 1e-6)
        out[key] = Grid(float(first - count * spacing), float(spacing))
        beside[key] = float(np.abs(at - first - spacing * flat).max())
    best = min(beside.values(), default=0.0)
    return {key: grid for key, grid in out.items() if beside[key] <= 3 * best} or None


def _arc(a: Array, b: Array) -> float:
    """Return the angle of an arc between two quaternions."""
    return float(2 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b)))


def _meet(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return the quaternion in which the great circles through two pairs meet, next to the pairs."""
    weights = np.linalg.svd(np.stack([a, b, c, d], axis=1))[2][-1]
    x = a * weights[0] + b * weights[1]
    return x / np.linalg.norm(x) * np.sign(x @ b)


def _between(case: Compared, mistake: Resampling, grid: Any) -> Explanation | None:
    """Return the explanation by rows between samples, the first of which is in the file."""
    if isinstance(grid, dict):
        grid = next((grid[key] for key in grid if mistake.key.startswith(key)), None)
        if grid is None:
            return None
    tiny = 1e-6 * float(np.diff(case.t).min())
    last = grid.first + grid.spacing * np.floor((case.t[-1] - grid.first) / grid.spacing + 1e-6)
    rows = (case.t >= grid.first - tiny) & (case.t < last + tiny)
    if rows.sum() < 2 * FEWEST_SAMPLES:
        return None
    some, numbers = case.take(rows), (case.t[rows] - grid.first) / grid.spacing
    at_row = abs(some.t[0] - grid.first) <= tiny
    R, w = _state(case, grid.first) if not at_row else tuple(None if x is None else x[0] for x in some.data)
    changes = {name: x for name, x in (("R_WB0", R), ("w_WB_B0", w)) if x is not None}
    have = [*range(3)] * (case.data[0] is not None) + [*range(3, 6)] * (case.data[1] is not None)
    scene = some.scene.rename(some.scene.name, **changes)
    some = replace(some, scene=scene, start=min(grid.first, float(some.t[0])), free=some.free if at_row else tuple(have))
    k = np.floor(numbers + 1e-6).astype(int)
    trial = Trial((mistake,), lambda of: _interpolated(of, mistake, grid, k))
    explanation, none = None, np.zeros(0)
    for fit in (False, True):  # where lines meet is imprecise in files with few digits
        if some.free:  # the state at the first sample is read where two lines meet
            numbers, small = (np.array(grid), SMALL) if fit else (none, none)
            initial, numbers, _ = some.fit(_interpolated(some, mistake, grid, k), numbers, small)
            some, grid = some.at(initial), Grid(*numbers.tolist()) if fit else grid
        explanation = attempt(some, trial, known={"spacing": grid.spacing})
        if explanation is None or explanation.explains or explanation.share > NEAR:
            break
    return None if explanation is None else replace(explanation, trial=None, numbers=2)


def _interpolated(case: Compared, mistake: Resampling, grid: Grid, k: Any) -> Solution:
    """Return rows between the k-th sample (n,) and the next one, for the times of samples, or other ones as numbers."""

    def one(R: Array, w: Array, grid: Grid, n: int) -> tuple[Array, Array]:
        after, own = case.t[:n] - grid.first, k[:n]
        share = np.maximum(after / grid.spacing - own, 0.0)
        times = case.start + grid.spacing * np.arange(int(own.max()) + 2), case.start + after
        known, right = _solve(case, R, w, *(np.asarray(each, float) for each in times))
        made = []
        for law, x, y in zip((mistake.attitudes, mistake.rates), known, right, strict=True):
            made.append(y if law is None else np.stack([law(share, each[own], each[own + 1]) for each in x]))
        return made[0], made[1]

    def motion(R: Array, w: Array, p: Array, n: int) -> tuple[Array, Array]:
        if not p.shape[1]:
            return one(R, w, grid, n)
        made = [one(R[[i]], w[[i]], Grid(*row.tolist()), n) for i, row in enumerate(p)]
        return np.concatenate([a for a, _ in made]), np.concatenate([b for _, b in made])

    return motion


def _state(case: Compared, time: float) -> States:
    """Return the attitude and the rates of a file at a time between two rows."""
    i = int(np.clip(np.searchsorted(case.t, time) - 1, 0, len(case.t) - 2))
    share = (time - case.t[i]) / (case.t[i + 1] - case.t[i])
    R, w = case.data
    q = None if R is None else (1 - share) * _quaternions(R[i : i + 2])[0] + share * _quaternions(R[i : i + 2])[1]
    return (
        None if q is None else from_quaternion(q / np.linalg.norm(q)),
        None if w is None else w[i] + share * (w[i + 1] - w[i]),
    )
