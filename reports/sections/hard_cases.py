"""Grades of each method on each hard case, by its motion and by its invariants, and the longest step that works."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from conservative.benchmarks.measures.errors import CONSERVED, SMALL
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import outcome_of
from conservative.benchmarks.studies.hard_cases import STUDY as HARD_CASES
from conservative.benchmarks.studies.stability import STUDY as STABILITY
from conservative.method import Role
from conservative.outcome import Outcome, OutcomeKind

from ..document.cells import DASH, angle, bound, grade, number, outcome_cell, tolerance
from ..document.model import Cell, Grade, Paragraph, Row, Section, Style, Table
from ..rows.names import of_study

RIGHT, USABLE = 1e-3, 0.1
"""Largest attitude errors, rad, of a motion that is called right, and usable."""
Record = dict[Any, Any]
_NOT_RUN = Cell(f"{DASH} not run", Grade.NONE)
_NOTHING = Cell(DASH, Grade.NONE)


def sections(table: pd.DataFrame) -> list[Section]:
    """Return the sections of hard cases and of stability, of those studies that the report has."""
    text = (
        "Every registered scene over the first part of its motion, at its own step, with two verdicts: the motion by its "
        f"largest attitude error (✓ up to {tolerance(RIGHT)} rad, ≈ up to {USABLE:g} rad, ✗ more), and the invariants by "
        f"the largest relative drift (✓ up to {tolerance(CONSERVED)}, ≈ up to {tolerance(SMALL)}, ✗ more). ✗ in both: the "
        f"run failed; {DASH}: not supported, or nothing to grade."
    )
    cases, steps = hard_cases(table), stability(table)
    graded = Section("Hard cases", [Paragraph(text), cases], "hard-cases", source={"study": HARD_CASES.name}) if cases else None
    longest = Section("Stability", [steps], "stability", source={"study": STABILITY.name}) if steps else None
    return [section for section in (graded, longest) if section]


def hard_cases(table: pd.DataFrame) -> Table | None:
    """Return a row for each case and a column for each method, the best methods first; None without that study."""
    rows = _competitors(table, HARD_CASES.name)
    if rows.empty:
        return None
    graded = {key: grades(members) for key, members in _by_method_and_scene(rows).items()}
    cases, missing = list(rows["scene"].unique()), _halves(_NOT_RUN, _NOT_RUN)

    def rank(method: str) -> tuple[int, ...]:
        """Return the number of cases in which the motion is not good, and the invariants."""
        cells = [graded.get((method, case), missing) for case in cases]
        return tuple(sum(cell.parts[half].grade is not Grade.GOOD for cell in cells) for half in (0, 1))

    methods = sorted(rows["method"].unique(), key=rank)
    names = dict(zip(rows["method"], rows["name"], strict=True))
    body: list[Row] = [[str(case), *(graded.get((method, case), missing) for method in methods)] for case in cases]
    caption = "Each cell: first the motion, then the invariants. Hover or tap for the numbers."
    return Table(["case", *(str(names[method]) for method in methods)], body, caption, Style.GRID)


def _by_method_and_scene(rows: pd.DataFrame) -> dict[tuple[str, str], list[Record]]:
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in rows.to_dict("records"):  # plain dictionaries: a table for each of a thousand groups takes ten seconds
        groups.setdefault((record["method"], record["scene"]), []).append(record)
    return groups


def _values(records: list[Record], measure: Measure) -> list[float]:
    return [record["value"] for record in records if record["measure"] == measure.text and not math.isnan(record["value"])]


def grades(records: list[Record]) -> Cell:
    """Return the grades of a method on a case: its failure, else the grades of its attitude error and of its worst drift."""
    for record in records:
        if record["outcome"] != OutcomeKind.OK:
            cell = outcome_cell(outcome_of(record))
            return _halves(cell, cell)
    errors = _values(records, Measure.ATTITUDE_MAX)
    motion = grade(max(errors), f"{angle(max(errors))} rad", (RIGHT, USABLE)) if errors else _NOTHING
    drifts = [row for row in records if row["measure"] == Measure.DRIFT_MAX.text and not math.isnan(row["value"])]
    if not drifts:
        return _halves(motion, _NOTHING)
    worst = max(drifts, key=lambda drift: drift["value"])
    return _halves(motion, grade(worst["value"], f"{bound(worst['value'])} {worst['quantity']}"))


def _halves(motion: Cell, invariants: Cell) -> Cell:
    text = str(motion) if motion == invariants else f"motion {motion}, invariants {invariants}"
    return Cell(text, parts=(motion, invariants))


def stability(table: pd.DataFrame) -> Table | None:
    """Return the longest step of each method on each scene, and how the next one fails; None without that study."""
    rows = _competitors(table, STABILITY.name)
    if rows.empty:
        return None
    cases, groups = list(rows["scene"].unique()), _by_method_and_scene(rows)
    names = dict(zip(rows["method"], rows["name"], strict=True))
    body: list[Row] = [
        [str(name), *(_longest(groups.get((method, case), [])) for case in cases)] for method, name in names.items()
    ]
    caption = "The longest step that works, as an angle |ω| dt in rad, and how the next one fails"
    return Table(["method", *cases], body, caption, Style.FILTERED)


def _competitors(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = of_study(table, study)
    return rows[rows["role"] != Role.TRUTH.value]


def _longest(records: list[Record]) -> Cell:
    ends = [record["outcome"] for record in records if record["outcome"] != OutcomeKind.OK]
    if not (steps := _values(records, Measure.LONGEST_STEP)):
        return outcome_cell(Outcome(OutcomeKind(ends[0]))) if ends else _NOT_RUN
    text = f"{number(max(steps))} rad"
    if ends:
        return Cell(Grade.FAIR.mark(f"{text}, then {ends[0]}"), Grade.FAIR, value=max(steps))
    return Cell(Grade.GOOD.mark(f"{text} and more"), Grade.GOOD, value=max(steps))
