"""What each method conserves over long runs, and where it fails."""

from __future__ import annotations

import math

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.outcome import OutcomeKind

from ..document.model import Row, Style, Table
from .cells import grade_drift, outcome_cell
from .rows import of_study, outcomes, with_outcome, without_outcome


def long_run_drifts(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the largest drift of each quantity over the long runs; orthonormality is a quantity here."""
    rows = of_study(table, "long_runs")
    rows = rows[rows["measure"].isin([Measure.DRIFT_MAX.text, Measure.ORTHONORMALITY.text])]
    return rows.assign(quantity=rows["quantity"].mask(rows["quantity"] == "", "orthonormality"))


_NO_TROUBLE = (OutcomeKind.OK, OutcomeKind.NO_ORDER, OutcomeKind.SKIPPED, OutcomeKind.MISSING)


def scenes_in_trouble(table: pd.DataFrame) -> pd.DataFrame:
    """Return where runs failed, and the scenes that a method has no run of: columns scene, method, family, outcome."""
    rows = table[table["study"] != "stability"]
    runs = set(with_outcome(rows, OutcomeKind.OK)[["scene", "method"]].itertuples(index=False, name=None))
    bad = without_outcome(rows, *_NO_TROUBLE)[["scene", "method", "family", "outcome"]].drop_duplicates()
    real = [row.outcome != OutcomeKind.UNSUPPORTED or (row.scene, row.method) not in runs for row in bad.itertuples()]
    return bad[pd.Series(real, index=bad.index, dtype=bool)]


def conservation(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every quantity with every method over the long runs on a scene, the best first, and how it ended."""
    rows = long_run_drifts(table)
    rows = rows[rows["scene"] == scene]
    quantities = list(rows["quantity"].unique())
    members = sorted((group for _, group in rows.groupby("method", sort=False)), key=_worst)
    body = [_conservation(group, quantities) for group in members]
    return Table(["method", *quantities, "run"], body, f"{scene}: largest drift in long runs", Style.FILTERED)


def _worst(rows: pd.DataFrame) -> tuple[bool, float]:
    """Return what a method is ranked by: runs that ended well come first, then the largest drift counts."""
    return bool(rows["value"].isna().any()), float(rows["value"].max())


def _conservation(rows: pd.DataFrame, quantities: list[str]) -> Row:
    first, values = rows.iloc[0], rows.set_index("quantity")["value"]
    cells = [grade_drift(float(values.get(quantity, math.nan))) for quantity in quantities]
    return [first["name"], *cells, outcome_cell(outcomes(rows)[0])]
