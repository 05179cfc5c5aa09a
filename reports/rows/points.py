"""Errors and times of runs over steps and tolerances, and the picture of the best of each family.

A picture has the columns `name` (of the family), `family`, `class`, `setting` (of a point), `error` (rad), `time` (s per
simulated second), `times` (of each process), `sample` (s per sample, of a scene), `dt` (s), and `within` (on how many bodies
the error is reached, if there are several).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import zip_longest

import numpy as np
import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import work_precision
from conservative.benchmarks.studies.paper import APPROXIMATE
from conservative.method import Role
from conservative.outcome import OutcomeKind

from .names import MethodClass, class_of, display_name, of_study, with_outcome

DECADES = tuple(10.0**-k for k in range(1, 14))
_NAMES = ["family", "version", "setting", "series_setting", "name", "line"]
_KEYS = ["scene", "series", "method", *_NAMES, "role", "dt"]


def points(
    table: pd.DataFrame, study: str = work_precision.STUDY.name, time: Measure = Measure.TIME, untimed: bool = False
) -> pd.DataFrame:
    """Return the points of the work-precision study, or of another one with errors and times over steps.

    Parameters
    ----------
    table
        Measurements with names (see `names.with_names`).
    study, time
        Name of the study, and the measure of the time.
    untimed
        True if settings without a time are included, as points with the time NaN.

    Returns
    -------
    pd.DataFrame
        Columns scene, series, name (of its line), method, family, version, setting (of the line), role, class (see
        `names.MethodClass`), dt, error (rad), time (s per simulated second) and times (of each process); each line coarse to
        fine. An error below the resolution of the reference solution is raised to it.
    """
    rows = with_outcome(of_study(table, study), OutcomeKind.OK)
    rows = rows[rows["role"] != Role.TRUTH.value]
    errors, timed = (rows[rows["measure"] == measure.text] for measure in (Measure.ATTITUDE_MAX, time))
    wide = errors[[*_KEYS, "value"]].rename(columns={"value": "error"}).merge(pooled(timed, _KEYS), how="left", on=_KEYS)
    # The largest angle between two reference solutions, rad, of scenes without an exact one (see `Truth`).
    agreement = table[(table["measure"] == Measure.AGREEMENT.text) & (table["detail"] == APPROXIMATE)]
    resolution = agreement.groupby("scene")["value"].max()
    wide["error"] = wide["error"].clip(lower=wide["scene"].map(resolution).fillna(0.0))
    wide = wide.dropna(subset=["error"] if untimed else ["error", "time"]).reset_index(drop=True)
    kinds = [class_of(role, method).value for role, method in zip(wide["role"], wide["method"], strict=True)]
    # A method alone on its line keeps its own name and setting. Methods that differ only in tolerance have the name and the
    # setting of their line.
    alone = wide.groupby("series")["method"].transform("nunique") == 1
    name, setting = wide["name"].where(alone, wide["line"]), wide["setting"].where(alone, wide["series_setting"])
    wide = wide.assign(name=name, setting=setting, **{"class": pd.Series(kinds, index=wide.index, dtype="string")})
    return wide.drop(columns=["line", "series_setting"])


def pooled(timed: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Return rows of times with a row for each value of `keys`: `time`, the geometric mean, and `times`, of each process."""
    # Times from a single process have no number.
    wide = timed.assign(process=timed["process"].fillna(0)).pivot_table(index=keys, columns="process", values="value")
    times = pd.Series([tuple(row) for row in wide.to_numpy()], dtype=object)
    return wide.index.to_frame(index=False).assign(time=np.exp(np.log(wide).mean(axis=1)).to_numpy(), times=times)


def front(points: pd.DataFrame) -> pd.DataFrame:
    """Return the points of one scene that no other beats in both error and time, fastest first."""
    ordered = points.sort_values(["time", "error"])
    best_before = ordered["error"].cummin().shift(fill_value=math.inf)
    return ordered[ordered["error"] < best_before]


COLUMNS = ("name", "family", "class", "setting", "error", "time", "times", "sample", "dt", "within")
SAME = 0.01
"""Relative difference of two values that a picture does not show."""


def picture(points: pd.DataFrame) -> pd.DataFrame:
    """Return the picture of the points of one scene: the front of each family."""
    named = points.assign(
        name=[
            display_name(family, version, "") + ", integrable motions only" * (kind == MethodClass.SOLUTION)
            for family, version, kind in zip(points["family"], points["version"], points["class"], strict=True)
        ],
        setting=points["method"],
        within="",
    )
    return joined([front(members) for _, members in named.groupby("name", sort=False)])


def joined(parts: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Return parts of a picture as one, with the columns of a picture."""
    filled = [part.reindex(columns=list(COLUMNS)) for part in parts if len(part)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(COLUMNS))


def names_in_turn(picture: pd.DataFrame) -> tuple[str, ...]:
    """Return the families in the order of a legend: the best of our integrators, physics engines and solvers in turn.

    Our closed forms come last, as they solve integrable motions only.
    """
    ranked = sorted((_rank(line), str(name)) for name, line in picture.groupby("name", sort=False))
    classes = dict(zip(picture["name"], picture["class"], strict=True))
    turns = (MethodClass.GENERAL, MethodClass.ENGINE, MethodClass.SOLVER)
    sides = [[name for _, name in ranked if classes[name] == kind] for kind in turns]
    rest = [name for _, name in ranked if classes[name] not in turns]
    return tuple([name for names in zip_longest(*sides) for name in names if name] + rest)


def _rank(line: pd.DataFrame) -> tuple[int, float]:
    """Return the smallest error that a line reaches, in groups of three decades, and its median time.

    Within a group, the faster line ranks first.
    """
    return -int(-math.log10(max(float(line["error"].min()), 1e-16)) // 3), float(line["time"].median())


def under(lines: Iterable[tuple[str, pd.DataFrame]], x: str, y: str) -> Iterator[str]:
    """Yield a sentence for each line under which others lie exactly; lines have columns x and y, numbers above 0."""
    left = dict(lines)
    while left:
        name, line = left.popitem()  # the last line is drawn on top
        hidden = [
            other
            for other, points in left.items()
            if len(points) == len(line) and all(np.allclose(points[c], line[c], rtol=SAME, atol=0) for c in (x, y))
        ]
        if hidden:
            yield f"Exactly under {name}: {', '.join(hidden)}."
        left = {other: points for other, points in left.items() if other not in hidden}
