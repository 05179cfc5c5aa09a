"""What was measured of engines, a value for each setting of each: what their tables and their picture are made of."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from conservative.benchmarks.contest import cost
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.engines_at_one_step import AS_INSTALLED
from conservative.outcome import OK, Outcome, OutcomeKind

from . import work_precision
from .rows import of_measure, of_study, outcomes, with_outcome

ONE_STEP, OVER_STEPS = "engines_at_one_step", "engines_over_steps"
USABLE = 0.1
"""Largest attitude error over the run, rad, with which a step counts as usable."""
ERROR = 1e-3
"""Attitude error, rad, that a simulated second is timed at."""
MOMENTA = ("momentum", "vertical momentum")
"""Names of the momentum in the world that a scene conserves: of a free body, and about the axis of a field."""


@dataclass(frozen=True)
class Drift:
    """The largest drift of a quantity over the run, relative, and whether it was `gained` or `lost` at the end."""

    size: float = math.nan
    direction: str = ""


@dataclass(frozen=True)
class EngineRow:
    """One setting of one engine on one scene; nan where something was not measured.

    Attributes
    ----------
    engine, label, setting
        Such as `exudyn==1.13.6`, `exudyn==1.13.6/RK4` and `RK4`.
    series
        What its line of steps or tolerances is called.
    bits
        Of its numbers.
    as_installed, best
        Whether nothing is set but the step, and whether no setting of the engine has a smaller error.
    error
        Largest attitude error at the scene's step, rad.
    energy, momentum
        Drifts at that step.
    turns, true_turns
        How often the body turned over, and how often it does.
    order, order_stderr, expected_order, no_order
        As seen, as claimed, and why none was seen.
    longest_step
        The longest one, s, with an error of `USABLE` or less.
    step_time, second_time
        Wall time of a step of its own, s, and of a simulated second where the error is `ERROR`, s.
    outcome
        How the run at the scene's step ended.
    """

    engine: str
    label: str
    setting: str
    series: str
    outcome: Outcome = OK
    bits: float = math.nan
    as_installed: bool = False
    best: bool = False
    error: float = math.nan
    energy: Drift = Drift()
    momentum: Drift = Drift()
    turns: float = math.nan
    true_turns: float = math.nan
    order: float = math.nan
    order_stderr: float = math.nan
    expected_order: float = math.nan
    no_order: str = ""
    longest_step: float = math.nan
    step_time: float = math.nan
    second_time: float = math.nan


def engine_rows(table: pd.DataFrame, scene: str, points: pd.DataFrame) -> list[EngineRow]:
    """Return what was measured of engines on a scene, accurate ones first, those that did not run last.

    `table` has the rows of the studies of engines, with names (see `labels.with_names`), `points` those of `points_of` it.
    """
    at_step, over_steps = of_study(table, ONE_STEP, scene), of_study(table, OVER_STEPS, scene)
    lines = {str(name): rows for name, rows in over_steps.groupby("series", sort=False)}
    timed = {str(name): rows for name, rows in points[points["scene"] == scene].groupby("series", sort=False)}
    found = [_row(rows, lines, timed) for _, rows in at_step.groupby("label", sort=False)]
    return sorted(_mark_best(found), key=lambda row: (math.isnan(row.error), not row.outcome.ok, row.error, row.label))


def points_of(table: pd.DataFrame) -> pd.DataFrame:
    """Return error and time of the engines' runs over steps and tolerances: see `work_precision.points`."""
    return work_precision.points(table, OVER_STEPS)


def _row(rows: pd.DataFrame, lines: Mapping[str, pd.DataFrame], timed: Mapping[str, pd.DataFrame]) -> EngineRow:
    first = rows.iloc[0]
    line = lines.get(first["series"], rows.iloc[:0])
    engine = "==".join(filter(None, (first["engine"], first["version"])))
    row = EngineRow(engine, str(first["label"]), str(first["setting"]), str(first["series"]), _outcome(rows))
    row = replace(row, **_facts(rows), **_errors(rows), **_order(line))
    points = timed.get(first["series"])
    second = math.nan if points is None else cost(points["error"].tolist(), points["time"].tolist(), ERROR)
    has_step = not math.isnan(row.expected_order)
    longest = _longest_step(line) if has_step else math.nan
    per_step = _value(rows, Measure.TIME_PER_STEP) if has_step else math.nan
    return replace(row, longest_step=longest, step_time=per_step, second_time=second)


def _outcome(rows: pd.DataFrame) -> Outcome:
    """Return how the run at the scene's step ended; where that was well, how its timing did."""
    ends = pd.concat([of_measure(rows, measure) for measure in (Measure.ATTITUDE_MAX, Measure.TIME)])
    return next((outcome for outcome in outcomes(ends) if not outcome.ok), OK)


def _facts(rows: pd.DataFrame) -> dict[str, Any]:
    return {
        "bits": _value(rows, Measure.PRECISION),
        "expected_order": _value(rows, Measure.ORDER_EXPECTED),
        "as_installed": AS_INSTALLED in set(of_measure(rows, Measure.PRECISION)["detail"]),
    }


def _errors(rows: pd.DataFrame) -> dict[str, Any]:
    return {
        "error": _value(rows, Measure.ATTITUDE_MAX),
        "energy": _drift(rows, "energy"),
        "momentum": next((drift for name in MOMENTA if not math.isnan((drift := _drift(rows, name)).size)), Drift()),
        "turns": _value(rows, Measure.TURNS_OVER),
        "true_turns": _value(rows, Measure.TURNS_OVER_TRUE),
    }


def _drift(rows: pd.DataFrame, quantity: str) -> Drift:
    found = of_measure(rows, Measure.DRIFT_MAX, quantity)
    return Drift(float(found["value"].iloc[0]), str(found["detail"].iloc[0])) if len(found) else Drift()


def _order(line: pd.DataFrame) -> dict[str, Any]:
    found = of_measure(line, Measure.ORDER)
    reason = str(found["reason"].iloc[0]) if len(found) and found["outcome"].iloc[0] == OutcomeKind.NO_ORDER.value else ""
    return {"order": _value(line, Measure.ORDER), "order_stderr": _value(line, Measure.ORDER_STDERR), "no_order": reason}


def _longest_step(line: pd.DataFrame) -> float:
    good = with_outcome(of_measure(line, Measure.ATTITUDE_MAX), OutcomeKind.OK)
    return float(good[good["value"] <= USABLE]["dt"].max())


def _value(rows: pd.DataFrame, measure: Measure) -> float:
    found = of_measure(rows, measure)["value"]
    return float(found.iloc[0]) if len(found) else math.nan


def _mark_best(rows: list[EngineRow]) -> list[EngineRow]:
    """Return rows with the best of each engine marked: the smallest error, of equal ones the one that takes less time."""
    best: dict[str, EngineRow] = {}
    for row in rows:
        if not math.isnan(row.error) and _rank(row) < _rank(best.get(row.engine)):
            best[row.engine] = row
    return [replace(row, best=best.get(row.engine) is row) for row in rows]


def _rank(row: EngineRow | None) -> tuple[float, float]:
    if row is None:
        return (math.inf, math.inf)
    return (row.error, math.inf if math.isnan(row.second_time) else row.second_time)
