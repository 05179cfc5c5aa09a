"""The hard cases: how each method did on each, judged twice, and the longest step that works."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.method import Role
from conservative.outcome import Outcome, OutcomeKind

from .cells import DASH, Cell, Grade, Row, Table, grade_drift, number, outcome_cell, tolerance
from .rows import of_measure, of_study, outcomes, without_outcome

RIGHT, USABLE = 1e-3, 0.1
"""Attitude errors, rad, up to which a motion is called right, and usable."""
TERMS = f"✓ up to {tolerance(RIGHT)} rad, ≈ up to {USABLE:g} rad, ✗ more"
"""How a motion is judged, in words."""
_NOT_RUN = Cell(f"{DASH} not run", Grade.NONE)
_NOTHING = Cell(DASH, Grade.NONE)


@dataclass(frozen=True)
class Judgement:
    """How a method did on a case: is the motion right, is kept what it keeps? A text's first letter is its symbol."""

    motion: Cell
    invariants: Cell

    def __str__(self) -> str:
        """Return both in words; how a run ended is said once."""
        if self.motion == self.invariants:
            return str(self.motion)
        return f"motion {self.motion}, invariants {self.invariants}"


@dataclass(frozen=True)
class HardCases:
    """All judgements: of each case, in the order of `methods`."""

    methods: tuple[str, ...]
    cases: tuple[tuple[str, tuple[Judgement, ...]], ...]

    @property
    def as_table(self) -> Table:
        """A row a method, a column a case."""
        by_method = zip(*(judgements for _, judgements in self.cases), strict=True)
        rows = [[name, *map(str, judgements)] for name, judgements in zip(self.methods, by_method, strict=True)]
        return ["method", *(case for case, _ in self.cases)], rows


def hard_cases(table: pd.DataFrame) -> HardCases | None:
    """Return how each method did on each case; None where the report has no such study.

    Methods come in the order in which they did well, ours and the engines' among each other.
    """
    rows = _competitors(table, "hard_cases")
    if rows.empty:
        return None
    found = {(str(m), str(s)): judge(members) for (m, s), members in rows.groupby(["method", "scene"], sort=False)}
    cases, missing = list(rows["scene"].unique()), Judgement(_NOT_RUN, _NOT_RUN)
    methods = sorted(rows["method"].unique(), key=lambda method: _rank([found.get((method, case), missing) for case in cases]))
    names = dict(zip(rows["method"], rows["name"], strict=True))
    every = ((case, tuple(found.get((method, case), missing) for method in methods)) for case in cases)
    return HardCases(tuple(str(names[method]) for method in methods), tuple((str(case), row) for case, row in every))


def _rank(judgements: list[Judgement]) -> tuple[int, int]:
    """Return how often a method did not do well: of the motion, then of the invariants."""
    bad = [[cell.grade for cell in cells] for cells in zip(*((j.motion, j.invariants) for j in judgements), strict=True)]
    motion, invariants = (sum(grade is not Grade.GOOD for grade in grades) for grades in bad)
    return motion, invariants


def judge(rows: pd.DataFrame) -> Judgement:
    """Return how a method did on a case: how its run failed, else the grades of its attitude error and of its worst drift."""
    ends = outcomes(without_outcome(rows, OutcomeKind.OK).head(1))
    if ends:
        return Judgement(outcome_cell(ends[0]), outcome_cell(ends[0]))
    drifts = rows[rows["measure"] == Measure.DRIFT_MAX.text].dropna(subset=["value"])
    worst = drifts.sort_values("value").iloc[-1] if len(drifts) else None
    error = of_measure(rows, Measure.ATTITUDE_MAX)["value"]
    return Judgement(
        _motion(float(error.max())) if len(error) else _NOTHING,
        _NOTHING if worst is None else _named(grade_drift(float(worst["value"])), str(worst["quantity"])),
    )


def _motion(error: float) -> Cell:
    symbol, grade = ("✓", Grade.GOOD) if error <= RIGHT else ("≈", Grade.FAIR) if error <= USABLE else ("✗", Grade.BAD)
    return Cell(f"{symbol} {number(error)} rad", grade)


def _named(cell: Cell, quantity: str) -> Cell:
    return Cell(f"{cell.text} {quantity}", cell.grade)


def stability(table: pd.DataFrame) -> Table | None:
    """Return the longest steps, as angles, and what ends them; None where the report has no such study."""
    return _matrix(_competitors(table, "stability"), _longest)


def _competitors(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = of_study(table, study)
    return rows[rows["role"] != Role.TRUTH.value]


def _matrix(rows: pd.DataFrame, cell: Callable[[pd.DataFrame], Cell]) -> Table | None:
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
