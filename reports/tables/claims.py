"""Claims, where they are made, what was measured, and whether they hold: of families by their own word, and of the paper.

`Method.claims` says where something is claimed of a family; `order`, `conserves` and `candidacy` of its settings say what.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Any

import pandas as pd

from conservative import registry
from conservative.benchmarks.measures.measure import Measure, key
from conservative.declarations import BetterEnergy, Claims, Comparison, SameErrors
from conservative.errors import MissingEngine
from conservative.method import Method
from conservative.outcome import OutcomeKind
from conservative.scene import Scene

from .cells import Cell, Grade, Table, number
from .rows import prefix_quantity

HOLDS, FAILS, OPEN = (
    Cell("✓ holds", Grade.GOOD),
    Cell("✗ does not hold", Grade.BAD),
    Cell("– not measured here", Grade.NONE),
)
ENERGY, ATTITUDE = key(Measure.DRIFT_MAX, "energy"), key(Measure.ATTITUDE_MAX)
ROUND_OFF = 1e-12
"""Relative drift up to which a quantity is taken to be kept to round-off over the paper's runs."""
NO_TRUNCATION = 1e-11
"""Attitude error, rad, up to which a method is taken to have no truncation error over the paper's runs."""
ORDER_MARGIN = 0.25
"""How far an observed order may be from the one claimed."""
STUDY = "paper"
"""Name of the study that most claims are held against."""

Scenes = Mapping[str, Scene]
Settings = Callable[[type[Method]], Iterable[Method]]


@dataclass(frozen=True)
class Finding:
    """A claim and what came of it."""

    claim: str
    where: str
    measured: str
    verdict: Cell


def findings(table: pd.DataFrame, fits: pd.DataFrame, scenes: Iterable[Scene]) -> list[Finding]:
    """Return every claim that the report can say something about; `fits` are those of the attitude's error, see `orders`."""
    by_name = {scene.name: scene for scene in scenes}
    of_methods = [*_conservation(table, by_name), *_orders(fits), *_exactness(table)]
    return [*of_methods, *_comparisons(table, by_name), *_factor_four(table)]


def as_table(findings: list[Finding]) -> Table:
    """Return the findings as a table."""
    return ["claim", "where made", "measured", "verdict"], [[f.claim, f.where, f.measured, f.verdict] for f in findings]


def _judge(holds: bool) -> Cell:
    return HOLDS if holds else FAILS


def _families() -> list[tuple[type[Method], Claims]]:
    """Return the registered families that something is claimed of."""
    return [(family, family.claims) for family in registry.list_families().values() if family.claims is not None]


def _claimed(settings: Settings) -> Iterator[tuple[Method, Claims]]:
    """Yield settings of each family; none of one whose engine is not installed."""
    for family, claims in _families():
        try:
            methods = tuple(settings(family))
        except MissingEngine:
            continue
        yield from ((method, claims) for method in methods)


def _default(family: type[Method]) -> tuple[Method, ...]:
    return (family(),)


def _paper_rows(table: pd.DataFrame, method: str) -> pd.DataFrame:
    rows = table[(table["study"] == STUDY) & (table["method"] == method)]
    return rows[rows["outcome"] != OutcomeKind.UNSUPPORTED]


def _measured(table: pd.DataFrame, method: str, measure: str) -> pd.DataFrame:
    rows = prefix_quantity(_paper_rows(table, method))
    return rows[rows["measure"] == measure]


def _conservation(table: pd.DataFrame, scenes: Scenes) -> Iterator[Finding]:
    for method, claims in _claimed(_default):
        rows = _paper_rows(table, method.name)
        drifts = rows[(rows["measure"] == Measure.DRIFT_MAX.text) & rows["quantity"].isin(method.conserves)]
        for (scene, quantity), members in drifts.groupby(["scene", "quantity"], sort=False):
            steps = scenes[str(scene)].t_end / float(members["dt"].min())
            yield _drift(f"{method.name} keeps {quantity}", str(scene), claims, members, steps)


def _drift(claim: str, scene: str, claims: Claims, rows: pd.DataFrame, steps: float) -> Finding:
    extent, bound = "to round-off", ROUND_OFF
    if claims.drift_per_step is not None:
        extent, bound = "to the tolerance of its iteration in each step", claims.drift_per_step * steps
    worst = _worst(rows)
    measured = f"largest drift {number(worst)}, bound {number(bound)}"
    return Finding(f"{claim} {extent} ({scene})", claims.source, measured, _judge(worst <= bound))


def _worst(rows: pd.DataFrame) -> float:
    """Return the largest value; inf where a run failed."""
    return math.inf if rows["value"].isna().any() else float(rows["value"].max())


def _orders(fits: pd.DataFrame) -> Iterator[Finding]:
    claimed = {method.name: (method.order, claims.source) for method, claims in _claimed(lambda cls: cls.audit_settings())}
    for _, fit in fits[fits["method"].isin(list(claimed))].iterrows():
        order, source = claimed[fit["method"]]
        if order is not None:
            yield _order(f"{fit['method']} is of order {order} ({fit['scene']})", source, order, fit)


def _order(claim: str, where: str, order: int, fit: pd.Series[Any]) -> Finding:
    if fit["reason"]:
        return Finding(claim, where, str(fit["reason"]), OPEN)
    margin = max(ORDER_MARGIN, 3 * float(fit["stderr"]))
    holds = abs(fit["slope"] - order) <= margin
    return Finding(claim, where, f"slope {fit['text']} from {fit['points']} steps", _judge(holds))


def _exactness(table: pd.DataFrame) -> Iterator[Finding]:
    for method, claims in _claimed(_default):
        if method.candidacy is None or not method.candidacy.exact:
            continue
        for scene, members in _measured(table, method.name, ATTITUDE).groupby("scene", sort=False):
            worst, claim = _worst(members), f"{method.name} has no truncation error ({scene})"
            measured = f"largest attitude error {number(worst)} rad, bound {NO_TRUNCATION:g}"
            yield Finding(claim, claims.source, measured, _judge(worst <= NO_TRUNCATION))


def _comparisons(table: pd.DataFrame, scenes: Scenes) -> Iterator[Finding]:
    for _, claims in _families():
        yield from chain.from_iterable(_compare(each, claims.source, table, scenes) for each in claims.comparisons)


def _compare(claim: Comparison, source: str, table: pd.DataFrame, scenes: Scenes) -> Iterator[Finding]:
    return (
        _compare_errors(claim, source, table, scenes)
        if isinstance(claim, SameErrors)
        else _compare_energy(claim, source, table)
    )


def _compare_errors(claim: SameErrors, source: str, table: pd.DataFrame, scenes: Scenes) -> Iterator[Finding]:
    one, other = (_measured(table, method, ATTITUDE)[["scene", "dt", "value"]] for method in claim.methods)
    both = one.merge(other, on=["scene", "dt"], suffixes=("", "_other")).dropna()
    for scene, rows in both.groupby("scene", sort=False):
        if claim.free and not scenes[str(scene)].free:
            continue
        gap = float((rows["value"] / rows["value_other"] - 1).abs().max())
        measured = f"attitude errors differ by {number(gap)} of themselves at most, at {len(rows)} steps"
        yield Finding(f"{claim.words} ({scene})", source, measured, _judge(gap <= claim.tolerance))


def _compare_energy(claim: BetterEnergy, source: str, table: pd.DataFrame) -> Iterator[Finding]:
    """Compare the better method at its coarsest step with the other at its finest."""
    coarse, fine = _measured(table, claim.better, ENERGY), _measured(table, claim.worse, ENERGY)
    for scene in coarse["scene"].unique():
        one, other = _row_at(coarse, scene, max), _row_at(fine, scene, min)
        if one is None or other is None:
            continue
        words = f"{claim.words}, even with {one['dt'] / other['dt']:g} times its step ({scene})"
        shown = [number(row["value"]) if math.isfinite(row["value"]) else "failed" for row in (one, other)]
        measured = f"energy drift {shown[0]}, of the other at the smaller step {shown[1]}"
        holds = math.isfinite(one["value"]) and not one["value"] >= other["value"]
        yield Finding(words, source, measured, _judge(holds))


def _row_at(rows: pd.DataFrame, scene: str, extreme: Callable[[pd.Series[float]], float]) -> pd.Series[Any] | None:
    """Return the row of a scene at its longest or shortest step, None where it has none."""
    here = rows[rows["scene"] == scene]
    return None if here.empty else here[here["dt"] == extreme(here["dt"])].iloc[0]


def _factor_four(table: pd.DataFrame) -> Iterator[Finding]:
    distances = table[table["measure"] == Measure.PERIOD_DISTANCE.text]["value"].to_list()
    if not distances:
        return
    ratios = [before / after for before, after in pairwise(distances)]
    measured = "ratios " + ", ".join(number(ratio, 3) for ratio in ratios)
    holds = all(abs(ratio - 4) <= 0.4 for ratio in ratios)
    yield Finding("halving the step divides the top's position error by four", "paper, figure 2", measured, _judge(holds))
