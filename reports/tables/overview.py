"""Tables for someone who chooses an integrator: the cheapest for an error, what each method conserves, where each fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.outcome import OutcomeKind

from ..labels import shown
from . import work_precision
from .tables import Table, endings, keyed, number

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad, that the verdict is given for."""
KEPT, SMALL = 1e-10, 1e-4
"""Relative drift up to which a quantity counts as kept, and as drifting little."""
HARD, STABILITY = "hard_cases", "stability"
"""Studies, where a report has them, whose rows are the matrices of hard cases."""
DASH = "–"
FEW = 3
"""Scenes that a list of failures names at most."""


@dataclass(frozen=True)
class Cell:
    """A cell with a status, which the page shows by symbol, word and colour: good, fair, bad or none."""

    text: str
    status: str

    def __str__(self) -> str:
        return self.text


Cells = tuple[Sequence[str], Sequence[Sequence[str | Cell]]]
"""Header and rows, with statuses."""


def verdict(table: pd.DataFrame, points: pd.DataFrame) -> Cells:
    """Return the cheapest method for each of `ERRORS` on each scene, what it conserves and where it fails."""
    header = ["scene", "error, rad", "cheapest", "µs per simulated s", "best of ours", "best engine", "conserves", "fails"]
    drift, trouble = _drifts(table), _troubles(table)
    body = []
    for contest in work_precision.contests(points, ERRORS):
        costs = sorted((cost for cost in (contest.ours, contest.theirs) if cost), key=lambda cost: cost.time)
        best = costs[0]
        line = points[(points["scene"] == contest.scene) & (points["series"] == best.series)]
        body.append(
            [
                contest.scene,
                f"{contest.error:.0e}",
                best.series,
                number(best.time * 1e6, 3),
                _cost(contest.ours),
                _cost(contest.theirs),
                _conserved(drift, contest.scene, set(line["method"])),
                _where(trouble, set(line["method"])),
            ]
        )
    return header, body


def _cost(cost: work_precision.Cost | None) -> str:
    return f"{cost.series}: {number(cost.time * 1e6, 3)} µs" if cost else "none gets there"


def _drifts(table: pd.DataFrame) -> pd.DataFrame:
    """Return the largest drift of each quantity over the long runs: columns scene, method, label, quantity, value, status."""
    rows = table[table["study"] == "long_runs"]
    rows = keyed(rows).assign(status=endings(rows))
    rows = rows[rows["measure"].str.endswith(" max")]
    quantity = rows["measure"].str.replace(r"( drift)? max$", "", regex=True)
    return rows.assign(quantity=quantity)[["scene", "method", "label", "quantity", "value", "status", "outcome"]]


def _conserved(drift: pd.DataFrame, scene: str, methods: set[str]) -> str:
    """Return what all runs of a line keep, and the rest with how far it goes."""
    rows = drift[(drift["scene"] == scene) & drift["method"].isin(methods)].dropna(subset=["value"])
    if rows.empty:
        return "not measured"
    # A line of tolerances is as good as its tightest; that is the run with the smallest drift.
    worst = rows.groupby("quantity", sort=False)["value"].min()
    return "; ".join(f"{name} {graded(float(value)).text}" for name, value in worst.items())


def graded(value: float) -> Cell:
    """Return a drift with a symbol that is not its colour alone."""
    if math.isnan(value):
        return Cell(DASH, "none")
    symbol, status = ("✓", "good") if value <= KEPT else ("≈", "fair") if value <= SMALL else ("✗", "bad")
    return Cell(f"{symbol} {number(value)}", status)


def _troubles(table: pd.DataFrame) -> pd.DataFrame:
    """Return the runs that failed, and the scenes that a method has no run of: columns scene, method, outcome."""
    passed_over = [OutcomeKind.NO_ORDER, OutcomeKind.SKIPPED, OutcomeKind.MISSING]
    rows = table[~table["outcome"].isin(passed_over) & (table["study"] != STABILITY)]
    can = set(rows[rows["outcome"] == OutcomeKind.OK][["scene", "method"]].itertuples(index=False, name=None))
    pairs = zip(rows["scene"], rows["method"], rows["outcome"], strict=True)
    real = pd.Series(
        [
            status != OutcomeKind.OK and (status != OutcomeKind.UNSUPPORTED or (scene, method) not in can)
            for scene, method, status in pairs
        ],
        index=rows.index,
        dtype=bool,
    )
    return rows.loc[real, ["scene", "method", "outcome"]].drop_duplicates()


def _where(trouble: pd.DataFrame, methods: set[str]) -> str:
    """Return the scenes of each kind of failure; the hard cases have them all, so that here a few names stand for many."""
    rows = trouble[trouble["method"].isin(methods)]
    scenes: dict[str, dict[str, None]] = {}
    for scene, outcome in zip(rows["scene"], rows["outcome"], strict=True):
        scenes.setdefault(outcome, {})[scene] = None
    return "; ".join(f"{kind}: {_few(list(names))}" for kind, names in scenes.items()) or "nowhere here"


def _few(names: list[str]) -> str:
    if len(names) <= FEW:
        return ", ".join(names)
    return f"{', '.join(names[: FEW - 1])} and {len(names) - FEW + 1} more scenes"


def conservation(table: pd.DataFrame, scene: str) -> Cells:
    """Return the drift of every quantity with every method over the long runs on a scene, and how the run ended."""
    rows = _drifts(table)
    rows = rows[rows["scene"] == scene]
    quantities = list(rows["quantity"].unique())
    body = [_conservation_row(members, quantities) for _, members in rows.groupby("method", sort=False)]
    return ["method", *quantities, "run"], body


def _conservation_row(members: pd.DataFrame, quantities: list[str]) -> list[str | Cell]:
    first = members.iloc[0]
    values = members.set_index("quantity")["value"]
    return [
        shown(first["method"], first["label"]),
        *(graded(float(values.get(q, math.nan))) for q in quantities),
        ended(first["outcome"], first["status"]),
    ]


def ended(outcome: str, text: str = "") -> Cell:
    """Return how a run ended, with a symbol."""
    if outcome == OutcomeKind.OK:
        return Cell("✓ done", "good")
    text = text or outcome
    none = outcome in (OutcomeKind.UNSUPPORTED, OutcomeKind.MISSING, OutcomeKind.SKIPPED)
    return Cell(f"{DASH} {outcome}", "none") if none else Cell(f"✗ {text}", "bad")


def hard_cases(table: pd.DataFrame) -> Cells | None:
    """Return the matrix of hard cases, a row a method and a column a case; None where the report has no such study."""
    return _matrix(table[(table["study"] == HARD) & (table["role"] != "truth")], _case)


def stability(table: pd.DataFrame) -> Cells | None:
    """Return the matrix of the longest steps, as angles, and what ends them; None where the report has no such study."""
    return _matrix(table[(table["study"] == STABILITY) & (table["role"] != "truth")], _longest)


def _matrix(rows: pd.DataFrame, cell: Callable[[pd.DataFrame], Cell]) -> Cells | None:
    if rows.empty:
        return None
    cases = list(rows["scene"].unique())
    body: list[list[str | Cell]] = []
    for _, members in rows.groupby("method", sort=False):
        first = members.iloc[0]
        cells = [cell(members[members["scene"] == case]) for case in cases]
        body.append([shown(first["method"], first["label"]), *cells])
    return ["method", *cases], body


def _longest(rows: pd.DataFrame) -> Cell:
    """Return the longest step that works, rad, and how the next one fails."""
    works = rows[rows["measure"] == Measure.LONGEST_STEP.text]
    ends = [outcome for outcome in rows["outcome"] if outcome != OutcomeKind.OK]
    if works.empty or works["value"].isna().all():
        return ended(ends[0]) if ends else Cell(f"{DASH} not run", "none")
    text = f"{number(float(works['value'].max()))} rad"
    return Cell(f"≈ {text}, then {ends[0]}", "fair") if ends else Cell(f"✓ {text} and more", "good")


def _case(rows: pd.DataFrame) -> Cell:
    """Return how a method did on a case: its worst status, else its graded drift of energy and its attitude error."""
    if rows.empty:
        return Cell(f"{DASH} not run", "none")
    bad = rows[rows["outcome"] != OutcomeKind.OK]
    if len(bad):
        return ended(bad["outcome"].iloc[0], endings(bad[:1])[0])
    rows = keyed(rows)
    energy = rows[rows["measure"] == "energy drift max"]["value"]
    if not len(energy):
        return Cell(f"✓ {_first(rows)}", "good")
    drift = graded(float(energy.max()))
    error = rows[rows["measure"] == "attitude error max"]["value"]
    return replace(drift, text=f"{drift.text}; {number(float(error.max()))} rad") if len(error) else drift


def _first(rows: pd.DataFrame) -> str:
    row = rows.iloc[0]
    return f"{row['measure']} {number(float(row['value']))}"


def costs_paid_once(table: pd.DataFrame) -> Iterator[tuple[str, Table]]:
    """Yield for each scene what a method costs before its first step: conversion, compilation, the first call."""
    rows = table[(table["study"] == "speed") & (table["outcome"] == OutcomeKind.OK)]
    for scene, members in rows.groupby("scene", sort=False):
        named = members.assign(name=[shown(m, label) for m, label in zip(members["method"], members["label"], strict=True)])
        wide = named.pivot_table(index="name", columns="measure", values="value", sort=False)
        body = [[str(name), *_once(row)] for name, row in wide.iterrows()]
        yield str(scene), (["method", "prepare, ms", "first call, ms", "simulated second, µs"], body)


def _once(row: pd.Series[float]) -> list[str]:
    scales = (("prepare time", 1e3), ("first call time", 1e3), (work_precision.TIME, 1e6))
    return [number(float(row.get(measure, math.nan)) * scale, 3) for measure, scale in scales]


def imports(table: pd.DataFrame) -> Table:
    """Return what importing each library costs."""
    rows = table[table["measure"] == Measure.IMPORT.text]
    found = zip(rows["method"], rows["role"], rows["value"], strict=True)
    return ["library", "role", "import, ms"], [[name, role, number(seconds * 1e3, 3)] for name, role, seconds in found]
