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
from .layout import Layout, Options
from .names import split_name


def no_unit(path: Path, names: Sequence[str]) -> BadInput:
    """Return the error of columns whose unit is not known."""
    header = re.sub(r"\s*[(\[].*", "", names[0])
    allowed = f"a header such as {header} (deg/s), or one without a unit and --units deg or rad"
    return BadInput("run", f"{path}, columns {', '.join(names)}, without a known unit", allowed)


def guess_time(values: Array, layout: Layout) -> None:
    """Guess the unit of large unnamed times from their size: seconds, milliseconds, microseconds or nanoseconds since 1970."""
    (name, size), *more = layout.used["time"].items()
    if more:  # seconds and their fractions: the sum would lose digits
        layout.origin = math.floor(values[0, 0]) if values[0, 0] > 1e6 else 0.0
        layout.notes += [f"Times are from {layout.origin:.0f} s on."] * bool(layout.origin)
    elif size == 1.0 and split_name(name)[1] is None and values[0, 0] > 1e11:  # 1e11 s is the year 5138
        power = 3 * int(1 + (values[0, 0] > 1e14) + (values[0, 0] > 1e17))
        layout.used["time"] = {name: 10.0**-power}
        layout.notes.append(f"{name} is read as a time since 1970 in 1e-{power} s, because of its size.")


def find_units(path: Path, values: Array, layout: Layout, options: Options) -> None:
    """Find units that no column names: attitudes and rates agree in one choice of units only, or their format defines them."""
    parts, some, (time, *_) = layout.used, values[:400], layout.used["time"]
    open_ = [kind for kind, part in parts.items() if any(map(math.isnan, part.values()))]
    turns = some[:, 1 + len(parts["rates"]) :]
    # Rotation vectors of up to a revolution are in rad: in degrees they would all be tiny.
    short = layout.attitude == "rotation vector" and np.linalg.norm(turns, axis=1).max() < 2.1 * math.pi
    usual = [1.0 if short and kind == layout.attitude else _usual(parts[kind]) for kind in open_]
    expected = (parts["time"][time], *usual)
    whole = split_name(time)[1] is None and expected[0] == 1.0 and bool((some[:, 0] == np.rint(some[:, 0])).all())
    choices = [(1.0, 1e-3, 1e-6, 1e-9) if whole else expected[:1], *[(1.0, math.pi / 180)] * len(open_)]
    ranked: list[tuple[float, Any]] = []

    def choose(sizes: Sequence[Any]) -> None:
        for kind, size in zip(("time", *open_), sizes, strict=True):
            if len(parts[kind]) != 2:  # seconds and their fractions
                parts[kind] = dict.fromkeys(parts[kind], size)

    for sizes in product(*choices) if layout.attitude and parts["rates"] and len(some) > 2 else ():
        choose(sizes)
        orders = (options.quaternion,) if options.quaternion or not layout.numbered else ("wxyz", "xyzw")
        off = [_disagreement(some * layout.sizes, layout, replace(options, quaternion=order)) for order in orders]
        ranked.append((min(off), sizes))
    ranked.sort()
    # One choice agrees, and all others clearly do not.
    if len(ranked) > 1 and ranked[0][0] < 0.1 and ranked[1][0] > 0.5:
        for kind, size, usual_size in zip(("time", *open_), ranked[0][1], expected, strict=True):
            if size != usual_size:
                unit = f"{size:g} s" if kind == "time" else "rad" if size == 1.0 else "deg"
                layout.notes.append(f"{', '.join(parts[kind])}: read in {unit}, because only so do attitudes and rates agree.")
        expected = ranked[0][1]
    if None in expected:
        raise no_unit(path, [*parts[open_[0]]])
    choose(expected)


def _disagreement(values: Array, layout: Layout, options: Options) -> float:
    """Return the difference between turns from row to row and the mean rates there, relative to the smaller of them."""
    t, (R, w), _ = convert(values, layout, options)
    assert R is not None
    assert w is not None
    turned = Rotation.from_matrix(np.swapaxes(R[:-1], 1, 2) @ R[1:]).as_rotvec()
    expected = (w[:-1] + w[1:]) / 2 * np.diff(t)[:, None]
    return float(np.linalg.norm(turned - expected) / (min(np.linalg.norm(turned), np.linalg.norm(expected)) or 1.0))


def _usual(names: Iterable[str]) -> float | None:
    """Return the unit of columns that name none, where their format defines it: ROS, MuJoCo, Basilisk, and this package."""
    key = split_name(next(iter(names)))[0]
    return 1.0 if re.search(r"wwbb|angularvelocity[xyz]|qvel|omegabnb|sigma", key) else None
