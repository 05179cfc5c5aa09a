"""Units of columns: by their names, by the sizes of times, and by the agreement of attitudes and rates."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from conservative.attitude import Array
from conservative.errors import BadInput

from .attitudes import convert
from .layout import ORDERS, Layout, Options
from .names import UNITS, parse
from .times import DATES, DAYS, FRACTIONS

ANGULAR = 1.0, math.pi / 180
"""Units that angles and rates without a unit may have: rad and deg."""
AGREES, DISAGREES = 0.1, 0.5
"""Largest disagreement of attitudes and rates in their units, and the smallest one in all others, relative to the turns."""
SAME_SIZE, OTHER_SIZE = 0.7, 2.0
"""Logarithms of ratios of turns and rates: up to the first their sizes agree, from the second on they do not."""


def no_unit(path: Path | None, names: Sequence[str]) -> BadInput:
    """Return the error of columns whose unit is not known."""
    header = re.sub(r"\s*[(\[].*", "", names[0])
    allowed = f"--units deg or --units rad, or a header with units such as {header} (deg/s)"
    return BadInput("run", f"{path}, columns {', '.join(names)}, without a known unit", allowed)


def find_sizes(path: Path | None, layout: Layout, kind: str, names: Sequence[str], options: Options) -> dict[str, float]:
    """Return the sizes of the units of columns, nan for those that no name and no option has."""
    if kind == "time":
        if len(names) == 2:  # seconds and their fractions
            return {names[0]: 1.0, names[1]: FRACTIONS[parse(names[1]).all[-1]]}
        if names[0] in layout.steps:
            return {names[0]: layout.steps[names[0]]}
        if DAYS.intersection(parse(names[0]).words):
            return {names[0]: 86_400.0}
        if parse(names[0]).unit in DATES:
            return {names[0]: 1.0}
    usual: str | None = "s" if kind == "time" else "rad"
    texts, united = [parse(name).unit for name in names], kind in ("rates", "angles", "rotation vector")
    if None in texts and united:
        usual = None if "/" in (options.units or "") and kind != "rates" else options.units
        layout.notes += ["unit"] * (usual is not None)
    if not united and kind != "time":  # a unit behind a quaternion is no unit
        return dict.fromkeys(names, 1.0)
    sizes = [math.nan if (unit := text or usual) is None else UNITS.get(unit, 0.0) for text in texts]
    if 0.0 in sizes:
        raise no_unit(path, names)
    return dict(zip(names, sizes, strict=True))


def guess_time(values: Array, layout: Layout) -> None:
    """Guess the unit of large unnamed times from their size: seconds, milliseconds, microseconds or nanoseconds since 1970."""
    (name, size), *more = layout.used["time"].items()
    if more:  # seconds and their fractions: the sum would lose digits
        layout.origin = math.floor(values[0, 0]) if values[0, 0] > 1e6 else 0.0
        layout.notes += [f"Times are from {layout.origin:.0f} s on."] * bool(layout.origin)
    elif size == 1.0 and parse(name).unit is None and values[0, 0] > 1e11:  # 1e11 s is the year 5138
        power = 3 * int(1 + (values[0, 0] > 1e14) + (values[0, 0] > 1e17))
        layout.used["time"] = {name: 10.0**-power}
        layout.notes.append(f"{name} is read as a time since 1970 in 1e-{power} s, because of its size.")


def find_units(values: Array, layout: Layout, options: Options) -> None:
    """Find units that no column names: attitudes and rates agree in one choice of units only, or their format defines them.

    Kinds whose unit remains open are in `layout.open`. They are read in rad until the motion of the scene decides.
    """
    parts, time = layout.used, [*layout.used["time"]]
    open_ = [kind for kind, part in parts.items() if any(map(math.isnan, part.values()))]
    turns = values[:400, 1 + len(parts["rates"]) :]
    # Rotation vectors of up to a revolution are in rad: in degrees they would all be tiny.
    short = layout.attitude == "rotation vector" and len(turns) and np.linalg.norm(turns, axis=1).max() < 2.1 * math.pi
    usual = [1.0 if short and kind == layout.attitude else _usual(parts[kind]) for kind in open_]
    expected = (parts["time"][time[0]], *usual)
    ranked = rank_units(values, layout, options)
    # One choice agrees, and all others clearly do not. In wrong axes, or in another order, only the sizes agree.
    clear = len(ranked) > 1 and ranked[0][0] < AGREES and ranked[1][0] > DISAGREES
    if not clear:
        by_size = rank_units(values, layout, options, sizes_alone=True)
        if len(by_size) > 1 and by_size[0][0] < SAME_SIZE and by_size[1][0] > OTHER_SIZE:
            ranked, clear = by_size, True
    if clear:
        for kind, size, usual_size in zip(("time", *open_), ranked[0][1], expected, strict=True):
            if size != usual_size:
                unit = f"{size:g} s" if kind == "time" else "rad" if size == 1.0 else "deg"
                layout.notes.append(f"{', '.join(parts[kind])}: read in {unit}, because only so do attitudes and rates agree.")
        expected = ranked[0][1]
    layout.open = [kind for kind, size in zip(open_, expected[1:], strict=True) if size is None]
    set_sizes(layout, ("time", *open_), [1.0 if size is None else size for size in expected])
    if layout.numbered and options.quaternion is None and parts["rates"] and len(values) > 2:
        some = values[:400] * layout.sizes
        ordered = sorted((_disagreement(some, layout, replace(options, quaternion=order)), order) for order in ORDERS)
        if ordered[0][0] < AGREES and ordered[1][0] > DISAGREES:
            layout.order = ordered[0][1]
            names = ", ".join(layout.used["quaternion"])
            layout.notes.append(f"{names}: read as {layout.order}, because only so do attitudes and rates agree.")


def open_readings(layout: Layout, options: Options) -> list[tuple[Layout, Options]]:
    """Return the layouts and options in which a file may be read, if only the motion of the scene shows units or orders."""
    order = options.quaternion or layout.order
    orders = ORDERS if layout.numbered and order is None else (order,)
    out = []
    for sizes in product(ANGULAR, repeat=len(layout.open)):
        reading = replace(layout, used=dict(layout.used))
        set_sizes(reading, layout.open, sizes)
        out += [(reading, replace(options, quaternion=order)) for order in orders]
    return out


def set_sizes(layout: Layout, kinds: Sequence[str], sizes: Sequence[Any]) -> None:
    """Set the units of quantities; seconds and their fractions keep theirs."""
    for kind, size in zip(kinds, sizes, strict=True):
        if kind != "time" or len(layout.used[kind]) == 1:
            layout.used[kind] = dict.fromkeys(layout.used[kind], size)


def rank_units(values: Array, layout: Layout, options: Options, sizes_alone: bool = False) -> list[tuple[float, Any]]:
    """Return choices of units that no column names, of the time and of other quantities, by their disagreement.

    With `sizes_alone` the sizes of turns from row to row are compared with rates, and not their axes.
    """
    some, parts = values[:400], dict(layout.used)
    (time, size), *_ = parts["time"].items()
    open_ = [kind for kind, part in parts.items() if any(map(math.isnan, part.values()))]
    named = parse(time).unit is not None or time in layout.steps or size != 1.0
    whole = not named and bool((some[:, 0] == np.rint(some[:, 0])).all())
    choices = [(1.0, 1e-3, 1e-6, 1e-9) if whole else (size,), *[ANGULAR] * len(open_)]
    ranked: list[tuple[float, Any]] = []
    for sizes in product(*choices) if layout.attitude and parts["rates"] and len(some) > 2 else ():
        set_sizes(layout, ("time", *open_), sizes)
        orders = (options.quaternion,) if options.quaternion or not layout.numbered else ORDERS
        known = [replace(options, quaternion=order) for order in orders]
        off = [_disagreement(some * layout.sizes, layout, each, sizes_alone) for each in known]
        ranked.append((min(off), sizes))
    layout.used = parts
    return sorted(ranked)


def _disagreement(values: Array, layout: Layout, options: Options, sizes_alone: bool = False) -> float:
    """Return the difference between turns from row to row and the mean rates there, relative to the smaller of them.

    With `sizes_alone` it is the logarithm of the ratio of their sizes.
    """
    t, (R, w), _ = convert(values, layout, options)
    assert R is not None
    assert w is not None
    turned = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
    expected = (w[:-1] + w[1:]) / 2 * np.diff(t)[:, None]
    near = np.diff(t) <= 2 * np.median(np.diff(t))  # over a gap, the mean of two rates is no mean rate
    if not near.any():  # times that are no times
        return math.inf
    turned, expected = turned[near], expected[near]
    off, *sizes = (float(np.median(np.linalg.norm(x, axis=1))) for x in (turned - expected, turned, expected))
    if not min(sizes):
        return math.inf  # a body at rest shows no units
    return abs(math.log(sizes[0] / sizes[1])) if sizes_alone else off / min(sizes)


_OURS = ("w", "wb", "b"), ("omega", "bn", "b")


def _usual(names: Iterable[str]) -> float | None:
    """Return the unit of columns that name none, where their format defines it: ROS, MuJoCo, Basilisk, and this package."""
    words = parse(next(iter(names))).words
    known = {"angular", "velocity"} <= {*words} or {"twist", "angular"} <= {*words} or words[:3] in _OURS or "qvel" in words
    return 1.0 if known else None
