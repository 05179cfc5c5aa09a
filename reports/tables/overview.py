"""Tables for someone who chooses an integrator: the cheapest for an error, and what each method conserves."""

from __future__ import annotations

import math

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.outcome import OutcomeKind

from .cells import Row, Table, grade_drift, number, outcome_cell, tolerance
from .rows import of_study, outcomes, with_outcome, without_outcome
from .work_precision import CheapestLine, Contest, contests

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, that the verdict is given for."""
FEW = 3
"""Scenes that a list of failures names at most."""


def verdict(table: pd.DataFrame, points: pd.DataFrame) -> Table:
    """Return the cheapest method for each of `ERRORS` on each scene, what it conserves and where it fails."""
    header = ["scene", "error, rad", "cheapest", "µs per simulated s", "best of ours", "best engine", "conserves", "fails"]
    drifts, troubles = long_run_drifts(table), scenes_in_trouble(table)
    return header, [_verdict(contest, points, drifts, troubles) for contest in contests(points, ERRORS)]


def _verdict(contest: Contest, points: pd.DataFrame, drifts: pd.DataFrame, troubles: pd.DataFrame) -> Row:
    best = min((cost for cost in (contest.ours, contest.theirs) if cost), key=lambda cost: cost.time)
    methods = set(points[(points["scene"] == contest.scene) & (points["name"] == best.name)]["method"])
    return [
        contest.scene,
        tolerance(contest.error),
        best.name,
        number(best.time * 1e6, 3),
        _cost(contest.ours),
        _cost(contest.theirs),
        _conserves(drifts[(drifts["scene"] == contest.scene) & drifts["method"].isin(methods)]),
        _where(troubles[troubles["method"].isin(methods)]),
    ]


def _cost(cost: CheapestLine | None) -> str:
    return f"{cost.name}: {number(cost.time * 1e6, 3)} µs" if cost else "none gets there"


def long_run_drifts(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the largest drift of each quantity over the long runs; orthonormality is a quantity here."""
    rows = of_study(table, "long_runs")
    rows = rows[rows["measure"].isin([Measure.DRIFT_MAX.text, Measure.ORTHONORMALITY.text])]
    return rows.assign(quantity=rows["quantity"].mask(rows["quantity"] == "", "orthonormality"))


def _conserves(drifts: pd.DataFrame) -> str:
    """Return what all runs of a line conserve, and the rest with how far it goes."""
    rows = drifts.dropna(subset=["value"])
    if rows.empty:
        return "not measured"
    # A line of tolerances is as good as its tightest; that is the run with the smallest drift.
    best = rows.groupby("quantity", sort=False)["value"].min()
    return "; ".join(f"{name} {grade_drift(float(value))}" for name, value in best.items())


_NO_TROUBLE = (OutcomeKind.OK, OutcomeKind.NO_ORDER, OutcomeKind.SKIPPED, OutcomeKind.MISSING)


def scenes_in_trouble(table: pd.DataFrame) -> pd.DataFrame:
    """Return where runs failed, and the scenes that a method has no run of: columns scene, method, family, outcome."""
    rows = table[table["study"] != "stability"]
    runs = set(with_outcome(rows, OutcomeKind.OK)[["scene", "method"]].itertuples(index=False, name=None))
    bad = without_outcome(rows, *_NO_TROUBLE)[["scene", "method", "family", "outcome"]].drop_duplicates()
    real = [row.outcome != OutcomeKind.UNSUPPORTED or (row.scene, row.method) not in runs for row in bad.itertuples()]
    return bad[pd.Series(real, index=bad.index, dtype=bool)]


def _where(troubles: pd.DataFrame) -> str:
    """Return the scenes of each kind of failure; the hard cases have them all, so that here a few names stand for many."""
    kinds = troubles.groupby("outcome", sort=False)["scene"].unique()
    return "; ".join(f"{kind}: {_few(list(scenes))}" for kind, scenes in kinds.items()) or "nowhere here"


def _few(names: list[str]) -> str:
    if len(names) <= FEW:
        return ", ".join(names)
    return f"{', '.join(names[: FEW - 1])} and {len(names) - FEW + 1} more scenes"


def conservation(table: pd.DataFrame, scene: str) -> Table:
    """Return the drift of every quantity with every method over the long runs on a scene, and how the run ended."""
    rows = long_run_drifts(table)
    rows = rows[rows["scene"] == scene]
    quantities = list(rows["quantity"].unique())
    return ["method", *quantities, "run"], [_conservation(group, quantities) for _, group in rows.groupby("method", sort=False)]


def _conservation(rows: pd.DataFrame, quantities: list[str]) -> Row:
    first, values = rows.iloc[0], rows.set_index("quantity")["value"]
    cells = [grade_drift(float(values.get(quantity, math.nan))) for quantity in quantities]
    return [first["name"], *cells, outcome_cell(outcomes(rows)[0])]
