"""Work against precision for someone who chooses: the best of each family, and its single settings.

A picture has these columns: `name` (of the family), `class` (see `classes`), `single` (whether a line is that of one setting),
`line` (what to call that line), `setting` (of a point), `error` (rad), `time` (s per simulated second), `sample` (s per sample,
of a scene), `dt` (s), and `within`, on how many bodies the error is reached where there are several.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import zip_longest

import numpy as np
import pandas as pd

from ..labels import display_name
from .classes import OF_ENGINES, MethodClass
from .work_precision import front

COLUMNS = ("name", "family", "class", "single", "line", "setting", "error", "time", "sample", "dt", "within")
AT_FIRST = 8
"""Lines that a picture shows at first."""
SAME = 0.01
"""Difference of two values, relative, that no picture shows."""


def picture(points: pd.DataFrame) -> pd.DataFrame:
    """Return the picture of one scene, from `work_precision.points`: of each family all that nothing of its own beats."""
    found = points.assign(
        name=[_family_name(*row) for row in zip(points["family"], points["version"], points["class"], strict=True)],
        line=points["name"],
        setting=points["method"],
        within="",
    )
    best = [front(members).assign(single=False, line=name) for name, members in found.groupby("name", sort=False)]
    return joined([*best, found.assign(single=True)])


def joined(parts: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Return parts of a picture as one, with its columns alone."""
    filled = [part.reindex(columns=list(COLUMNS)) for part in parts if len(part)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(COLUMNS))


def _family_name(family: str, version: str, kind: str) -> str:
    name = display_name(family, version, "")
    return f"{name}, integrable motions only" if kind == MethodClass.SOLUTION else name


def first_names(picture: pd.DataFrame) -> tuple[str, ...]:
    """Return the families that a picture shows at first: the cheapest of ours and of engines in turn, `AT_FIRST` at most."""
    best = picture[~picture["single"].astype(bool)]
    ranked = sorted((_rank(line), str(name)) for name, line in best.groupby("name", sort=False))
    classes = dict(zip(best["name"], best["class"], strict=True))
    sides = [[name for _, name in ranked if (classes[name] in OF_ENGINES) is engine] for engine in (False, True)]
    return tuple(name for pair in zip_longest(*sides) for name in pair if name)[:AT_FIRST]


def _rank(line: pd.DataFrame) -> tuple[int, float]:
    """Return the smallest decade of error that a line gets to, and the time to its middle one."""
    return -int(-math.log10(max(float(line["error"].min()), 1e-16)) // 3), float(line["time"].median())


def under(lines: Iterable[tuple[str, pd.DataFrame]], x: str, y: str) -> Iterator[str]:
    """Yield a sentence for each line under which others lie exactly; lines have columns x and y, numbers above 0."""
    left = dict(lines)
    while left:
        name, line = left.popitem()
        hidden = [other for other, points in left.items() if _same(points, line, x, y)]
        if hidden:
            yield f"Exactly under {name}: {', '.join(hidden)}."
        left = {other: points for other, points in left.items() if other not in hidden}


def _same(one: pd.DataFrame, other: pd.DataFrame, x: str, y: str) -> bool:
    return len(one) == len(other) and all(np.allclose(one[c], other[c], rtol=SAME, atol=0) for c in (x, y))
