"""Rows of the measurements, with their names (see `labels.with_names`), as tables and pictures pick them."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import outcome_of
from conservative.outcome import Outcome, OutcomeKind


def of_study(table: pd.DataFrame, study: str, scene: str | None = None) -> pd.DataFrame:
    """Return what a study says of methods, on one scene if that is given: not how well the two truths agree."""
    rows = table[(table["study"] == study) & (table["measure"] != Measure.AGREEMENT.text)]
    return rows if scene is None else rows[rows["scene"] == scene]


def of_measure(rows: pd.DataFrame, measure: Measure, quantity: str = "") -> pd.DataFrame:
    """Return the rows of a measure, of a drift those of one quantity."""
    return rows[(rows["measure"] == measure.text) & (rows["quantity"] == quantity)]


def prefix_quantity(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows with the quantity in front of the measure: `energy drift max`."""
    return rows.assign(measure=(rows["quantity"] + " " + rows["measure"]).str.lstrip())


def outcomes(rows: pd.DataFrame) -> list[Outcome]:
    """Return the outcome of each row."""
    return [outcome_of(row) for _, row in rows.iterrows()]


def with_outcome(rows: pd.DataFrame, *kinds: OutcomeKind) -> pd.DataFrame:
    """Return the rows whose outcome is one of some kinds."""
    return rows[rows["outcome"].isin([kind.value for kind in kinds])]


def without_outcome(rows: pd.DataFrame, *kinds: OutcomeKind) -> pd.DataFrame:
    """Return the rows whose outcome is none of some kinds."""
    return rows[~rows["outcome"].isin([kind.value for kind in kinds])]
