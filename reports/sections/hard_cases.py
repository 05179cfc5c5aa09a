"""The hard cases: how each method does on each, judged twice, and the longest step that works."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.method import Role
from conservative.outcome import Outcome, OutcomeKind

from ..document.cells import CONSERVED, DASH, SMALL, grade_drift, number, outcome_cell, tolerance
from ..document.model import Cell, Grade, Paragraph, Row, Section, Style, Table
from ..rows.names import of_measure, of_study, outcomes, without_outcome

RIGHT, USABLE = 1e-3, 0.1
"""Largest attitude errors, rad, of a motion that is called right, and usable."""
_NOT_RUN = Cell(f"{DASH} not run", Grade.NONE)
_NOTHING = Cell(DASH, Grade.NONE)


def sections(table: pd.DataFrame) -> list[Section]:
    """Return the sections of hard cases and of stability, of those studies that the report has."""
    words = (
        "Every registered scene over the first part of its motion, at its own step, with two verdicts: the motion by its "
        f"largest attitude error (✓ up to {tolerance(RIGHT)} rad, ≈ up to {USABLE:g} rad, ✗ more), and the invariants by "
        f"the largest relative drift (✓ up to {tolerance(CONSERVED)}, ≈ up to {tolerance(SMALL)}, ✗ more). ✗ in both: the "
        f"run failed; {DASH}: not supported, or nothing to judge."
    )
    cases, steps = hard_cases(table), stability(table)
    found = []
    if cases:
        found.append(Section("Hard cases", [Paragraph(words), cases], "hard-cases"))
    if steps:
        found.append(Section("Stability", [steps], "stability"))
    return found


def hard_cases(table: pd.DataFrame) -> Table | None:
    """Return a row for each case and a column for each method, the best methods first; None without that study."""
    rows = _competitors(table, "hard_cases")
    if rows.empty:
        return None
    judged = {(str(m), str(s)): judge(members) for (m, s), members in rows.groupby(["method", "scene"], sort=False)}
    cases, missing = list(rows["scene"].unique()), _judgement(_NOT_RUN, _NOT_RUN)
    methods = sorted(rows["method"].unique(), key=lambda method: _rank([judged.get((method, case), missing) for case in cases]))
    names = dict(zip(rows["method"], rows["name"], strict=True))
    body: list[Row] = [[str(case), *(judged.get((method, case), missing) for method in methods)] for case in cases]
    caption = "Each cell: first the motion, then the invariants. Hover or tap for the numbers."
    return Table(["case", *(str(names[method]) for method in methods)], body, caption, Style.GRID)


def _rank(judgements: list[Cell]) -> tuple[int, ...]:
    """Return how many cases a method does not do well: of the motion, then of the invariants."""
    return tuple(sum(each.parts[half].grade is not Grade.GOOD for each in judgements) for half in (0, 1))


def judge(rows: pd.DataFrame) -> Cell:
    """Return the judgement of a method on a case: its failure, else the grades of its attitude error and of its worst drift."""
    ends = outcomes(without_outcome(rows, OutcomeKind.OK).head(1))
    if ends:
        return _judgement(outcome_cell(ends[0]), outcome_cell(ends[0]))
    drifts = rows[rows["measure"] == Measure.DRIFT_MAX.text].dropna(subset=["value"])
    invariants = _NOTHING
    if len(drifts):
        worst = drifts.sort_values("value").iloc[-1]
        drift = grade_drift(float(worst["value"]))
        invariants = Cell(f"{drift.text} {worst['quantity']}", drift.grade)
    error = of_measure(rows, Measure.ATTITUDE_MAX)["value"]
    return _judgement(_motion(float(error.max())) if len(error) else _NOTHING, invariants)


def _judgement(motion: Cell, invariants: Cell) -> Cell:
    text = str(motion) if motion == invariants else f"motion {motion}, invariants {invariants}"
    return Cell(text, parts=(motion, invariants))


def _motion(error: float) -> Cell:
    symbol, grade = ("✓", Grade.GOOD) if error <= RIGHT else ("≈", Grade.FAIR) if error <= USABLE else ("✗", Grade.BAD)
    return Cell(f"{symbol} {number(error)} rad", grade)


def stability(table: pd.DataFrame) -> Table | None:
    """Return the longest step of each method on each scene, and how the next one fails; None without that study."""
    rows = _competitors(table, "stability")
    if rows.empty:
        return None
    cases = list(rows["scene"].unique())
    body = [
        [members["name"].iloc[0], *(_longest(members[members["scene"] == case]) for case in cases)]
        for _, members in rows.groupby("method", sort=False)
    ]
    caption = "The longest step that works, as an angle |ω| dt in rad, and how the next one fails"
    return Table(["method", *cases], body, caption, Style.FILTERED)


def _competitors(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = of_study(table, study)
    return rows[rows["role"] != Role.TRUTH.value]


def _longest(rows: pd.DataFrame) -> Cell:
    ends = [outcome for outcome in outcomes(rows) if not outcome.ok]
    longest = of_measure(rows, Measure.LONGEST_STEP)["value"].max()
    if pd.isna(longest):
        return outcome_cell(Outcome(ends[0].kind)) if ends else _NOT_RUN
    text = f"{number(float(longest))} rad"
    return Cell(f"≈ {text}, then {ends[0].kind}", Grade.FAIR) if ends else Cell(f"✓ {text} and more", Grade.GOOD)
