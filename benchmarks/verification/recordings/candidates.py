"""Columns that may be the same quantity: whether they agree with each other, or which of them agrees with the other data."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from conservative.attitude import Array
from conservative.check import LARGEST, SMALLEST
from conservative.errors import BadInput

from .digits import find_quantum
from .layout import ATTITUDES, Layout, Options
from .names import UNITS, parse
from .quantities import is_world
from .times import FRACTIONS, rank
from .units import find_sizes, guess_time, rank_units

Sample = Callable[[Sequence[str]], Array]
"""A function that returns the first rows of columns; it raises `BadInput` for columns without numbers."""
SAME = 1e-6
"""Largest difference of equal columns, relative to the largest number, or to the gap of times."""
MOST = 12
"""Largest number of sets of columns of a quantity, or of times, of which the data choose."""
BETTER, AGREES = 0.1, 0.1
"""Largest disagreement of attitudes and rates, relative to the next one, and to the turns."""
Sets = dict[str, list[list[str]]]


def compared_with(kind: str) -> str:
    """Return the reason of columns that are compared with those of a quantity, instead of with the exact motion."""
    return f"compared with the {kind if kind in ('rates', 'angles') else f'columns of the {kind}'}, which are used"


def decide_time(times: list[list[str]], motion: Sequence[str], layout: Layout, sample: Sample) -> list[list[str]]:
    """Return the times that are left: one, if the likeliest ones have the same steps. Others are unused, with the reason."""
    times = [part for time in times for part in _parts(time, sample)] if len(times) <= MOST else times
    if len(times) < 2 or len(times) > MOST:
        return times
    values = {tuple(time): _seconds(time, sample) for time in times}
    usable = [time for time in times if _increases(values[tuple(time)])]
    if not usable:
        usable = times[:1]
    best = min(rank(time, motion) for time in usable)
    likely = [time for time in usable if rank(time, motion) == best]
    likely.sort(key=lambda time: _grain(values[tuple(time)]))
    first = likely[0]
    same = [time for time in usable if time == first or _same_steps(values[tuple(first)], values[tuple(time)])]
    text = ", ".join(first)
    for time in times:
        if time in usable and time not in same and time in likely:
            continue
        reason = f"another time with the same steps as {text}, which is used"
        if time not in usable:
            reason = f"a time by its name, but not by its numbers; {text} is used"
        elif time not in same:
            reason = f"a time by its name, but its steps differ from those of {text}, which is used"
        if time != first:
            layout.unused |= dict.fromkeys(time, reason)
    return [first, *(time for time in likely if time not in same)]


def _parts(time: list[str], sample: Sample) -> list[list[str]]:
    """Return seconds and their fractions as one time, or as two if the second one is no fraction by its numbers."""
    if len(time) == 2:
        try:
            whole, fraction = (sample([name])[:, 0] for name in time)
        except BadInput:
            return [time]
        whole, fraction = whole[np.isfinite(whole)], fraction[np.isfinite(fraction)]
        if np.abs(fraction).max(initial=0.0) * FRACTIONS[parse(time[1]).all[-1]] > 1 or (whole != np.rint(whole)).any():
            return [[name] for name in time]
    return [time]


def _seconds(time: Sequence[str], sample: Sample) -> Array:
    """Return the numbers of a time; those of seconds and fractions in s, from the first one on."""
    try:
        x = np.column_stack([sample([name])[:, 0] for name in time])
    except BadInput:
        return np.empty(0)
    x = x[(np.abs(x) <= LARGEST).all(axis=1)]
    return x[:, 0] if len(time) == 1 else x[:, 0] - x[:1, 0] + x[:, 1] * FRACTIONS[parse(time[1]).all[-1]]


def _increases(t: Array) -> bool:
    """Return whether numbers are times: they do not decrease, except where a counter begins again."""
    steps = np.diff(t)
    return bool(len(steps) and (steps > 0).any() and (steps < 0).sum() <= max(1, len(steps) // 50))


def _grain(t: Array) -> float:
    """Return the last bit of times relative to their gap, in powers of ten, and 1e-9 for smaller ones."""
    if not _increases(t):
        return 0.0
    gaps = np.diff(t)
    bit = float(np.spacing(np.abs(t).max()) / np.median(gaps[gaps > 0]))
    return float(np.ceil(np.log10(max(bit, 1e-9))))


def _same_steps(t: Array, other: Array) -> bool:
    """Return whether two times have the same steps, in units that differ by a power of ten or a day."""
    n = min(len(t), len(other))
    bits = 4 * np.spacing(np.abs(t).max(initial=0.0)), 4 * np.spacing(np.abs(other).max(initial=0.0))
    t, other = t[:n] - t[:1], other[:n] - other[:1]
    if n < 2 or not SMALLEST < t[-1] < LARGEST or not SMALLEST < other[-1] < LARGEST:
        return False
    size = math.log10(other[-1]) - math.log10(t[-1])
    ratios = [10.0 ** round(size + math.log10(days)) / days for days in (1.0, 86_400.0, 1 / 86_400)]
    ratio = min(ratios, key=lambda ratio: abs(math.log10(ratio) - size))
    gap = float(np.median(np.diff(t)))
    allowed = SAME * gap + bits[0] + bits[1] / ratio
    return bool(np.abs(other / ratio - t).max() <= allowed)


def decide_sets(
    times: list[list[str]], sets: Sets, layout: Layout, options: Options, sample: Sample
) -> list[dict[str, list[str]]]:
    """Return the readings of a file that are left, each with its time, rates and attitudes.

    Sets with the same numbers are one reading, and the others are compared with it. Of different ones, attitudes and rates
    choose the one with which they agree.
    """
    if max(map(len, sets.values())) > MOST:
        return [
            {"time": time} | {kind: some[i % len(some)] for kind, some in sets.items()} for time in times for i in range(MOST)
        ]
    for kind, members in sets.items():
        sets[kind] = _without_same(kind, members, layout, options, sample)
    readings: list[dict[str, list[str]]] = [{"time": time} for time in times]
    for kind, members in sets.items():
        readings = [{**reading, kind: some} for some in members for reading in readings]
    attitude = next((kind for kind in ATTITUDES if kind in sets), None)
    if len(readings) == 1 or attitude is None or "rates" not in sets or len(readings) > 64:
        return readings
    ranked = sorted(
        ((_disagreement(reading, attitude, layout, options, sample), i) for i, reading in enumerate(readings)),
        key=lambda pair: pair[0],
    )
    if ranked[0][0] > AGREES or ranked[1][0] * BETTER < ranked[0][0]:
        agreeing = [readings[i] for off, i in ranked if off <= AGREES]
        return agreeing if len(agreeing) > 1 else readings
    best = readings[ranked[0][1]]
    open_ = [kind for kind in best if any(reading[kind] != best[kind] for reading in readings)]
    for kind in open_:
        partner = "rates" if kind in ATTITUDES else "attitudes" if kind == "rates" else "attitudes and rates"
        layout.notes.append(
            f"{', '.join(best[kind])}: chosen as {kind}, because {partner} agree with these columns, and not with others."
        )
        for reading in readings:
            names = [name for name in reading[kind] if name not in best[kind]]
            layout.unused |= dict.fromkeys(names, f"the {partner} do not agree with these columns, but with others")
            layout.decided += names
    return [best]


def _without_same(kind: str, sets: list[list[str]], layout: Layout, options: Options, sample: Sample) -> list[list[str]]:
    """Return sets without those that have the numbers of one before; they are compared with it. World axes follow body axes."""
    if len(sets) < 2:
        return sets
    out = list[list[str]]()
    if kind == "rates" and not options.world and any(not is_world(members) for members in sets):
        world = [members for members in sets if is_world(members)]
        sets = [members for members in sets if not is_world(members)]
        for members in world:
            layout.also.append((kind, members))
            layout.unused |= dict.fromkeys(members, compared_with(kind))
    for members in sets:
        equal = next((known for known in out if _equal(kind, known, members, sample)), None)
        if equal is None:
            out.append(members)
        else:
            layout.also.append((kind, members))
            layout.unused |= dict.fromkeys(members, compared_with(kind))
    return out


def _equal(kind: str, names: Sequence[str], others: Sequence[str], sample: Sample) -> bool:
    """Return whether two sets of columns have the same numbers up to rounding, units and the sign of quaternions."""
    try:
        a, b = sample(names), sample(others)
    except BadInput:
        return False
    n = min(len(a), len(b))
    a, b = a[:n], b[:n]
    rows = (np.abs(a) <= LARGEST).all(axis=1) & (np.abs(b) <= LARGEST).all(axis=1)
    a, b = a[rows], b[rows]
    if not len(a):
        return False
    if kind == "quaternion":
        b = b * np.where((a * b).sum(axis=1, keepdims=True) < 0, -1, 1)
    units = [UNITS.get(parse(some[0]).unit or "", 1.0) for some in (names, others)]
    off = np.abs(a * units[0] - b * units[1]).max()
    rounding = find_quantum(a) * units[0] + find_quantum(b) * units[1]
    return bool(off <= SAME * np.abs(a * units[0]).max() + 2 * rounding)


def _disagreement(reading: Mapping[str, list[str]], attitude: str, layout: Layout, options: Options, sample: Sample) -> float:
    """Return the disagreement of attitudes and rates in the units in which it is smallest."""
    trial = Layout(layout.names, steps=layout.steps)
    try:
        for kind in ("time", "rates", attitude):
            trial.used[kind] = find_sizes(None, trial, kind, reading[kind], options)
        values = sample([*trial.columns])
        guess_time(values, trial)
        values = trial.join_time(values)
    except BadInput:
        return math.inf
    values = values[(np.abs(values) <= LARGEST).all(axis=1)]
    if len(values) < 3 or (np.diff(values[:, 0]) <= 0).any():
        return math.inf
    with np.errstate(all="ignore"):
        try:
            return rank_units(values, trial, replace(options))[0][0]
        except (ValueError, IndexError):
            return math.inf
