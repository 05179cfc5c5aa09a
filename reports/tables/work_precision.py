"""Error against time: what each side needs to reach an error, and where it is beaten.

The cost of an error on a line of measured points is that of `cost_at_error`: no lucky point counts, between two neighbouring
points the time is interpolated log-log, and nothing is extrapolated.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures import cost_at_error
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.paper import APPROXIMATE
from conservative.method import Role
from conservative.outcome import OutcomeKind

from .rows import of_study, with_outcome

_NAMES = ["family", "version", "setting", "series_setting", "name", "line"]
DECADES = tuple(10.0**-k for k in range(1, 14))
_KEYS = ["scene", "series", "method", *_NAMES, "role", "dt"]


@dataclass(frozen=True)
class CheapestLine:
    """The line that gets to an error in the least time, and that time, s per simulated second."""

    name: str
    time: float


@dataclass(frozen=True)
class Contest:
    """An error, and the cheapest way there of either side; None where a side does not get there.

    Ours are whatever the points have of ours: general integrators, or solutions of integrable motions (see `classes`).
    """

    scene: str
    error: float
    ours: CheapestLine | None
    theirs: CheapestLine | None

    @property
    def ratio(self) -> float:
        """How many times faster ours is; below 1 where theirs is; nan where a side does not get there."""
        return self.theirs.time / self.ours.time if self.ours and self.theirs else math.nan

    @property
    def lost(self) -> bool:
        """Whether an engine gets there faster, or alone."""
        return self.theirs is not None and (self.ours is None or self.ratio < 1)


def points(table: pd.DataFrame, study: str = "work_precision", time: Measure = Measure.TIME) -> pd.DataFrame:
    """Return the measured points of the work-precision study, or of another one with errors and times over steps.

    Columns scene, series, name (what to call its line), method, family, version, setting (of the line), role, dt, error (rad),
    time (s per simulated second, by the measure `time`); of each line coarse to fine. An error below what the truth is known
    to is raised to that.
    """
    rows = with_outcome(of_study(table, study), OutcomeKind.OK)
    values = {Measure.ATTITUDE_MAX.text: "error", time.text: "time"}
    rows = rows[rows["measure"].isin(list(values))]
    wide = rows.pivot_table(index=_KEYS, columns="measure", values="value").reset_index()
    wide = rows[_KEYS].drop_duplicates().merge(wide, how="left", on=_KEYS)  # pivot_table orders rows by the values of the keys
    wide = wide.reindex(columns=[*_KEYS, *values]).rename(columns=values)
    wide["error"] = wide["error"].clip(lower=wide["scene"].map(truth_resolution(table)).fillna(0.0))
    return _name_lines(wide.dropna(subset=["error", "time"]).reset_index(drop=True))


def all_points(table: pd.DataFrame) -> pd.DataFrame:
    """Return the points of the work-precision study, and those of engines that only their own study has."""
    ours, engines = points(table), points(table, "engines_over_steps")
    known = set(zip(ours["scene"], ours["name"], strict=True))
    new = [key not in known for key in zip(engines["scene"], engines["name"], strict=True)]
    return pd.concat([ours, engines[new]], ignore_index=True) if any(new) else ours


def truth_resolution(table: pd.DataFrame) -> dict[str, float]:
    """Return, for scenes whose truth is approximate (see `Truth`), how far two of its kind agree, rad."""
    rows = table[(table["measure"] == Measure.AGREEMENT.text) & (table["detail"] == APPROXIMATE)]
    return {str(scene): float(value) for scene, value in rows.groupby("scene")["value"].max().items()}


def _name_lines(rows: pd.DataFrame) -> pd.DataFrame:
    """Return points under the name and the setting of their line; a line of several methods differs in tolerance."""
    alone = rows.groupby("series")["method"].transform("nunique") == 1
    name, setting = rows["name"].where(alone, rows["line"]), rows["setting"].where(alone, rows["series_setting"])
    return rows.assign(name=name, setting=setting).drop(columns=["line", "series_setting"])


def front(points: pd.DataFrame) -> pd.DataFrame:
    """Return the points of one scene that no other beats in both error and time, cheap to dear."""
    ordered = points.sort_values(["time", "error"])
    best_before = ordered["error"].cummin().shift(fill_value=math.inf)
    return ordered[ordered["error"] < best_before]


def cost(line: pd.DataFrame, error: float) -> float:
    """Return the time at which a line, points coarse to fine, gets to an error; nan where it does not."""
    return cost_at_error.cost(line["error"].tolist(), line["time"].tolist(), error)


def contests(points: pd.DataFrame, decades: Iterable[float] = DECADES) -> list[Contest]:
    """Return the contest at each decade that at least one side reaches, for each scene."""
    out = []
    for scene, members in points.groupby("scene", sort=False):
        for error in decades:
            ours, theirs = (_cheapest(members[members["role"] == role.value], error) for role in (Role.OURS, Role.ENGINE))
            if ours or theirs:
                out.append(Contest(str(scene), error, ours, theirs))
    return out


def _cheapest(members: pd.DataFrame, error: float) -> CheapestLine | None:
    costs = [CheapestLine(str(name), cost(line, error)) for name, line in members.groupby("name", sort=False)]
    return min((c for c in costs if not math.isnan(c.time)), key=lambda c: c.time, default=None)
