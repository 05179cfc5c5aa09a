"""The matrices of hard cases: how each method did on each, and the longest step that works."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pandas as pd

from conservative.benchmarks.measures.measure import Measure, key
from conservative.invariants import JACOBI_INTEGRAL
from conservative.method import Role
from conservative.outcome import Outcome

from .cells import DASH, Cell, Grade, Row, Table, grade_drift, number, outcome_cell
from .rows import of_measure, of_study, outcomes

_NOT_RUN = Cell(f"{DASH} not run", Grade.NONE)


def hard_cases(table: pd.DataFrame) -> Table | None:
    """Return how each method did on each case, a row a method and a column a case; None where the report has no such study."""
    return _matrix(of_study(table, "hard_cases"), _case)


def stability(table: pd.DataFrame) -> Table | None:
    """Return the longest steps, as angles, and what ends them; None where the report has no such study."""
    return _matrix(of_study(table, "stability"), _longest)


def _matrix(rows: pd.DataFrame, cell: Callable[[pd.DataFrame], Cell]) -> Table | None:
    rows = rows[rows["role"] != Role.TRUTH.value]
    if rows.empty:
        return None
    cases = list(rows["scene"].unique())
    return ["method", *cases], [_line(members, cases, cell) for _, members in rows.groupby("method", sort=False)]


def _line(members: pd.DataFrame, cases: list[str], cell: Callable[[pd.DataFrame], Cell]) -> Row:
    return [members["name"].iloc[0], *(cell(members[members["scene"] == case]) for case in cases)]


def _longest(rows: pd.DataFrame) -> Cell:
    """Return the longest step that works, rad, and how the next one fails."""
    ends = [outcome for outcome in outcomes(rows) if not outcome.ok]
    longest = of_measure(rows, Measure.LONGEST_STEP)["value"].max()
    if pd.isna(longest):
        return outcome_cell(Outcome(ends[0].kind)) if ends else _NOT_RUN
    text = f"{number(float(longest))} rad"
    return Cell(f"≈ {text}, then {ends[0].kind}", Grade.FAIR) if ends else Cell(f"✓ {text} and more", Grade.GOOD)


def _case(rows: pd.DataFrame) -> Cell:
    """Return how a method did on a case: how its run failed, else its graded drift of energy and its attitude error."""
    ends = [outcome for outcome in outcomes(rows) if not outcome.ok]
    if ends or rows.empty:
        return outcome_cell(ends[0]) if ends else _NOT_RUN
    energy = pd.concat([of_measure(rows, Measure.DRIFT_MAX, name)["value"] for name in ("energy", JACOBI_INTEGRAL)])
    if energy.empty:
        return Cell(f"✓ {_first(rows)}", Grade.GOOD)
    drift = grade_drift(float(energy.max()))
    error = of_measure(rows, Measure.ATTITUDE_MAX)["value"]
    return replace(drift, text=f"{drift.text}; {number(float(error.max()))} rad") if len(error) else drift


def _first(rows: pd.DataFrame) -> str:
    row = rows.iloc[0]
    return f"{key(Measure.from_text(row['measure']), row['quantity'])} {number(float(row['value']))}"
