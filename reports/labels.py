"""What tables and pictures call a method: its family first, then the version of the engine, then the setting."""

from __future__ import annotations

import re
from collections.abc import Iterable

import pandas as pd

from conservative.benchmarks.recommendation.probe import Probe
from conservative.benchmarks.recommendation.recommend import Advice
from conservative.benchmarks.studies.case import names_of
from conservative.benchmarks.studies.selection import tolerance_setting

_PADDED = re.compile(r"(?<=\de)-0(?=\d)")


def display_name(family: str, version: str, setting: str) -> str:
    """Return what to call a method: `mujoco 4.0.0 RK4`; ours without the version, which the end of the report has.

    Tolerances are written as people do: 1e-6, where Python has 1e-06.
    """
    return " ".join(filter(None, (family, "" if "@" in family else version, _PADDED.sub("-", setting))))


def with_names(rows: pd.DataFrame) -> pd.DataFrame:
    """Return measurements or samples with two more columns: `name` of the method, and `line`, the name of its series."""
    return rows.assign(name=_names(rows, "setting"), line=_names(rows, "series_setting"))


def _names(rows: pd.DataFrame, setting: str) -> pd.Series[str]:
    parts: Iterable[tuple[str, ...]] = zip(*(rows[column] for column in ("family", "version", setting)), strict=True)
    return pd.Series([display_name(*part) for part in parts], index=rows.index, dtype="string")


def setting_text(probe: Probe) -> str:
    """Return the setting of a probe as text: a step or a tolerance."""
    name = tolerance_setting(probe.method)
    return f"dt = {probe.dt:.7g} s" if name is None else f"{name} = {probe.setting:.0e}"


def method_text(advice: Advice) -> str:
    """Return the name of a method, with the version of its engine, without the setting that is searched."""
    if advice.best is None:
        return advice.line.replace(":", " ")
    names = names_of(advice.best.method)
    return display_name(names["family"], names["version"], names["series_setting"])
