"""Names and classes of methods, and the selection of rows."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from enum import StrEnum
from functools import lru_cache

import pandas as pd

from conservative import registry
from conservative.benchmarks.measures.errors import OF_TRUTH
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import outcome_of
from conservative.benchmarks.recommendation.probe import Probe
from conservative.benchmarks.recommendation.recommend import Advice
from conservative.benchmarks.studies.case import names_of
from conservative.benchmarks.studies.selection import tolerance_setting
from conservative.errors import BadInput, MissingEngine, NotLoadable
from conservative.method import Method, Role
from conservative.outcome import Outcome, OutcomeKind
from conservative.scene import Scene
from conservative.scenes.random_body import random_body

_in_a_field = lru_cache(maxsize=1)(random_body)
_PADDED = re.compile(r"(?<=\de)-0(?=\d)")


def display_name(family: str, version: str, setting: str) -> str:
    """Return the name of a method in tables and pictures: `mujoco 4.0.0 RK4`, with tolerances such as 1e-6 instead of 1e-06."""
    return " ".join(filter(None, (family, "" if _has_version(family) else version, _PADDED.sub("-", setting))))


@lru_cache(maxsize=256)
def _has_version(family: str) -> bool:
    return bool(family and registry.read_name(family).version)


def with_names(rows: pd.DataFrame) -> pd.DataFrame:
    """Return measurements or samples with two more columns: `name` of the method, and `line`, the name of its series."""
    return rows.assign(name=_names(rows, "setting"), line=_names(rows, "series_setting"))


def _names(rows: pd.DataFrame, setting: str) -> pd.Series[str]:
    parts: Iterable[tuple[str, ...]] = zip(*(rows[column] for column in ("family", "version", setting)), strict=True)
    return pd.Series([display_name(*part) for part in parts], index=rows.index, dtype="string")


def setting_text(probe: Probe) -> str:
    """Return the step or the tolerance of a probe."""
    name = tolerance_setting(probe.method)
    return f"dt = {probe.dt:.7g} s" if name is None else f"{name} = {probe.setting:.0e}"


def method_text(advice: Advice) -> str:
    """Return the name of a method with the version of its engine, without the searched setting."""
    if advice.best is None:
        return advice.line.replace(":", " ")
    names = names_of(advice.best.method)
    return display_name(names["family"], names["version"], names["series_setting"])


class MethodClass(StrEnum):
    """The class in which a method is compared, in the order of tables."""

    GENERAL = "our general integrators"
    SOLUTION = "our solutions of integrable motions"
    BASELINE = "textbook baselines"
    SOLVER = "ODE solvers"
    ENGINE = "physics engines"


ABSENT = (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING)
"""Outcomes of runs that were not made."""
OF_ENGINES = (MethodClass.SOLVER, MethodClass.ENGINE)
"""Classes of engines."""


def class_of(role: str, method: str) -> MethodClass:
    """Return the class of a method; one that cannot be loaded is a general integrator or a physics engine.

    A method of ours is a general integrator if it supports a random body in a field, whose motion has no closed form. A solver
    has a tolerance, a physics engine a step size.
    """
    loaded = load_method(method)
    if role == Role.OURS:
        return MethodClass.SOLUTION if loaded and loaded.unsupported(_in_a_field()) else MethodClass.GENERAL
    if role == Role.BASELINE:
        return MethodClass.BASELINE
    return MethodClass.SOLVER if loaded and tolerance_setting(loaded) else MethodClass.ENGINE


def of_classes(points: pd.DataFrame, *kinds: MethodClass) -> pd.DataFrame:
    """Return the points of methods of some classes."""
    return points[points["class"].isin(kinds)]


@lru_cache(maxsize=1024)
def load_method(method: str) -> Method | None:
    """Return the method with a name, None if it cannot be loaded."""
    try:
        return registry.method(method)
    except (BadInput, MissingEngine, NotLoadable):
        return None


def of_study(table: pd.DataFrame, study: str, scene: str | None = None) -> pd.DataFrame:
    """Return the rows of a study about methods, without the agreement of the reference solutions."""
    rows = table[(table["study"] == study) & (table["measure"] != Measure.AGREEMENT.text)]
    return rows if scene is None else rows[rows["scene"] == scene]


def at_own_step(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a study at the scene's own step, which is the longest of each method."""
    return rows[rows["dt"] == rows.groupby("method")["dt"].transform("max")]


def of_measure(rows: pd.DataFrame, measure: Measure, quantity: str = "") -> pd.DataFrame:
    """Return the rows of a measure, and of one quantity if it is a drift."""
    return rows[(rows["measure"] == measure.text) & (rows["quantity"] == quantity)]


def largest_drifts(run: pd.DataFrame, scene: Scene) -> dict[str, float]:
    """Return the largest drift of each invariant of a scene in the rows of a run, NaN if there is none.

    The drift of a balance includes the work and impulse that the method sums, or of the reference solution if the method does
    not sum them.
    """
    values = run[run["measure"] == Measure.DRIFT_MAX.text].groupby("quantity")["value"].max()
    found = {}
    for invariant in scene.invariants:
        own, of_truth = (float(values.get(invariant.name + end, math.nan)) for end in ("", OF_TRUTH))
        found[invariant.name] = of_truth if math.isnan(own) else own
    return found


def outcomes(rows: pd.DataFrame) -> list[Outcome]:
    """Return the outcome of each row."""
    return [outcome_of(row) for _, row in rows.iterrows()]


def with_outcome(rows: pd.DataFrame, *kinds: OutcomeKind) -> pd.DataFrame:
    """Return the rows with one of some outcomes."""
    return rows[rows["outcome"].isin([kind.value for kind in kinds])]


def without_outcome(rows: pd.DataFrame, *kinds: OutcomeKind) -> pd.DataFrame:
    """Return the rows without some outcomes."""
    return rows[~rows["outcome"].isin([kind.value for kind in kinds])]
