"""Errors and times of runs over steps and tolerances: the points of lines, whose costs are in `benchmarks.contest`."""

from __future__ import annotations

import math

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.paper import APPROXIMATE
from conservative.method import Role
from conservative.outcome import OutcomeKind

from .classes import class_of
from .rows import of_study, with_outcome

DECADES = tuple(10.0**-k for k in range(1, 14))
_NAMES = ["family", "version", "setting", "series_setting", "name", "line"]
_KEYS = ["scene", "series", "method", *_NAMES, "role", "dt"]


def points(
    table: pd.DataFrame, study: str = "work_precision", time: Measure = Measure.TIME, untimed: bool = False
) -> pd.DataFrame:
    """Return the points of the work-precision study, or of another one with errors and times over steps.

    Parameters
    ----------
    table
        Measurements with names (see `labels.with_names`).
    study, time
        Name of the study, and the measure of the time.
    untimed
        Whether settings without a time are included, as points with the time NaN.

    Returns
    -------
    pd.DataFrame
        Columns scene, series, name (of its line), method, family, version, setting (of the line), role, class (see `classes`),
        dt, error (rad) and time (s per simulated second); each line coarse to fine. An error below the resolution of the
        reference solution is raised to it.
    """
    rows = with_outcome(of_study(table, study), OutcomeKind.OK)
    values = {Measure.ATTITUDE_MAX.text: "error", time.text: "time"}
    rows = rows[rows["measure"].isin(list(values)) & (rows["role"] != Role.TRUTH.value)]
    wide = rows.pivot_table(index=_KEYS, columns="measure", values="value").reset_index()
    wide = rows[_KEYS].drop_duplicates().merge(wide, how="left", on=_KEYS)  # pivot_table orders rows by the values of the keys
    wide = wide.reindex(columns=[*_KEYS, *values]).rename(columns=values)
    wide["error"] = wide["error"].clip(lower=wide["scene"].map(truth_resolution(table)).fillna(0.0))
    wide = wide.dropna(subset=["error"] if untimed else ["error", "time"]).reset_index(drop=True)
    kinds = [class_of(role, method).value for role, method in zip(wide["role"], wide["method"], strict=True)]
    return _name_lines(wide.assign(**{"class": pd.Series(kinds, index=wide.index, dtype="string")}))


def all_points(table: pd.DataFrame) -> pd.DataFrame:
    """Return the points of the work-precision study, and those of engines that only their own study has."""
    ours, engines = points(table), points(table, "engines_over_steps")
    known = set(zip(ours["scene"], ours["name"], strict=True))
    new = [key not in known for key in zip(engines["scene"], engines["name"], strict=True)]
    return pd.concat([ours, engines[new]], ignore_index=True) if any(new) else ours


def truth_resolution(table: pd.DataFrame) -> dict[str, float]:
    """Return the largest angle between two reference solutions, rad, for scenes without an exact one (see `Truth`)."""
    rows = table[(table["measure"] == Measure.AGREEMENT.text) & (table["detail"] == APPROXIMATE)]
    return {str(scene): float(value) for scene, value in rows.groupby("scene")["value"].max().items()}


def _name_lines(rows: pd.DataFrame) -> pd.DataFrame:
    """Return points under the name and the setting of their line; a line of several methods differs in tolerance."""
    alone = rows.groupby("series")["method"].transform("nunique") == 1
    name, setting = rows["name"].where(alone, rows["line"]), rows["setting"].where(alone, rows["series_setting"])
    return rows.assign(name=name, setting=setting).drop(columns=["line", "series_setting"])


def front(points: pd.DataFrame) -> pd.DataFrame:
    """Return the points of one scene that no other beats in both error and time, cheapest first."""
    ordered = points.sort_values(["time", "error"])
    best_before = ordered["error"].cummin().shift(fill_value=math.inf)
    return ordered[ordered["error"] < best_before]
