"""Tables of runs: those that failed, those that there could not be, and how well the truths agree."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.studies import ENGINES, HARD
from conservative.method import Role
from conservative.outcome import OutcomeKind

from .cells import Table, number, outcome_text
from .rows import of_study, outcomes, with_outcome, without_outcome

_ABSENT = (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING)
_ELSEWHERE = (*HARD, *ENGINES)
"""Studies with tables of their own."""


def failures(table: pd.DataFrame) -> Table:
    """Return the runs that did not reach their end or that the study did not wait for."""
    rows = without_outcome(table[~table["study"].isin(_ELSEWHERE)], OutcomeKind.OK, OutcomeKind.NO_ORDER, *_ABSENT)
    rows = rows.assign(text=list(map(outcome_text, outcomes(rows))))
    body = [
        [*map(str, key), ", ".join(members["study"].unique()), _steps(members)]
        for key, members in rows.groupby(["scene", "name", "text"], sort=False)
    ]
    return ["scene", "method", "outcome", "studies", "at steps, s"], body


def _steps(members: pd.DataFrame) -> str:
    steps = sorted(members["dt"].dropna().unique(), reverse=True)
    return ", ".join(f"{step:.3g}" for step in steps) or "–"


def unsupported(table: pd.DataFrame) -> Table:
    """Return what cannot be done, or is not installed, and why: a row a reason, with all methods that have it."""
    rows = with_outcome(table[~table["study"].isin(_ELSEWHERE)], *_ABSENT)
    # A reason can have numbers that differ from step to step: the first stands for all that a method has of a kind.
    rows = rows.assign(reason=rows.groupby(["scene", "outcome", "name"])["reason"].transform("first"))
    body = [
        [*map(str, key), ", ".join(members["name"].unique())]
        for key, members in rows.groupby(["scene", "outcome", "reason"], sort=False)
    ]
    return ["scene", "outcome", "why (numbers: of the first)", "methods"], body


def truths(table: pd.DataFrame) -> Table:
    """Return how well the two independent truths agree, for each scene and step."""
    rows = table[table["measure"] == Measure.AGREEMENT.text]
    body = [[row["scene"], f"{row['dt']:g}", row["label"], number(row["value"])] for _, row in rows.iterrows()]
    return ["scene", "dt, s", "truths", "largest angle between them, rad"], body


def failures_of_ours(table: pd.DataFrame) -> list[str]:
    """Return what of ours failed at the steps of the paper: one line each."""
    rows = of_study(table, "paper")
    rows = without_outcome(rows[rows["role"] == Role.OURS.value], OutcomeKind.OK, OutcomeKind.SKIPPED, *_ABSENT)
    lines = [
        f"{method} on {scene}, dt = {dt:g} s: {outcome}"
        for method, scene, dt, outcome in zip(rows["method"], rows["scene"], rows["dt"], outcomes(rows), strict=True)
    ]
    return list(dict.fromkeys(lines))
