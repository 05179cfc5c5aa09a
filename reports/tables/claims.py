"""Claims, where they are made, what was measured, and whether they hold: the paper's, our own README's and the engines'."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.outcome import OutcomeKind
from conservative.scene import Scene

from . import orders
from .cells import Cell, Grade, Table, number
from .rows import keyed

HOLDS, FAILS, OPEN = (
    Cell("✓ holds", Grade.GOOD),
    Cell("✗ does not hold", Grade.BAD),
    Cell("– not measured here", Grade.NONE),
)
ENERGY = "energy drift max"
ROUND_OFF = 1e-12
"""Relative drift up to which a quantity is taken to be kept to round-off over the paper's runs."""
ORDER_MARGIN = 0.25
"""How far an observed order may be from the declared one."""

PAPER, README = "paper", "README, Methods"
MUJOCO = "MuJoCo documentation, Computation, Numerical integration"
DECLARED = {
    "convected": (2, PAPER),
    "reduced": (2, README),
    "reduced:order=4": (4, README),
    "reduced:order=6": (6, README),
    "gauss:stages=2": (4, README),
    "moser_veselov:order=4": (4, README),
    "mujoco": (4, MUJOCO),
    "mujoco:integrator=Euler": (1, MUJOCO),
}
"""Orders that are claimed, by method, and where."""
KEPT = {
    "convected": (("energy", "momentum", "vertical momentum"), PAPER),
    "reduced": (("energy", "momentum", "vertical momentum"), README),
    "gauss": (("energy", "momentum", "vertical momentum", "axial momentum"), README),
    "moser_veselov": (("energy", "momentum"), README),
    "lame": (("energy", "vertical momentum", "axial momentum"), README),
}
"""Quantities that are claimed to stay, by method, and where; those that a scene does not have are not asked for."""
PAPER_TOLERANCE = 1e-8
"""The paper iterates until the residual is below this, so its energy is kept to that, not to round-off."""


@dataclass(frozen=True)
class Finding:
    """A claim and what came of it."""

    claim: str
    where: str
    measured: str
    verdict: Cell


def findings(table: pd.DataFrame, scenes: Iterable[Scene]) -> list[Finding]:
    """Return every claim that the report can say something about."""
    by_name = {scene.name: scene for scene in scenes}
    of_tables = [*_orders(table), *_exact(table), *_same_map(table)]
    return [*_kept(table, by_name), *of_tables, *_mujoco(table, by_name), *_factor_four(table)]


def as_cells(found: list[Finding]) -> Table:
    """Return the findings as a table."""
    return ["claim", "where made", "measured", "verdict"], [[f.claim, f.where, f.measured, f.verdict] for f in found]


def _judged(holds: bool) -> Cell:
    return HOLDS if holds else FAILS


def _paper_rows(table: pd.DataFrame, method: str, measure: str) -> pd.DataFrame:
    rows = keyed(table[(table["study"] == "paper") & (table["method"] == method)])
    return rows[(rows["measure"] == measure) & (rows["outcome"] != OutcomeKind.UNSUPPORTED)]


def _kept(table: pd.DataFrame, scenes: Mapping[str, Scene]) -> Iterator[Finding]:
    for method, (quantities, where) in KEPT.items():
        for quantity in quantities:
            rows = _paper_rows(table, method, f"{quantity} drift max")
            for scene, members in rows.groupby("scene", sort=False):
                steps = scenes[str(scene)].t_end / float(members["dt"].min())
                yield _drift(f"{method} keeps {quantity}", str(scene), where, members, steps)


def _drift(claim: str, scene: str, where: str, rows: pd.DataFrame, steps: float) -> Finding:
    extent = "to the tolerance of its iteration in each step" if where == PAPER else "to round-off"
    bound = PAPER_TOLERANCE * steps if where == PAPER else ROUND_OFF
    worst = _worst(rows)
    measured = f"largest drift {number(worst)}, bound {number(bound)}"
    return Finding(f"{claim} {extent} ({scene})", where, measured, _judged(worst <= bound))


def _worst(rows: pd.DataFrame) -> float:
    """Return the largest value; inf where a run failed."""
    return math.inf if rows["value"].isna().any() else float(rows["value"].max())


def _orders(table: pd.DataFrame) -> Iterator[Finding]:
    rows = table[(table["study"] == "convergence") & table["method"].isin(list(DECLARED))]
    names = rows.drop_duplicates(["method", "scene"])
    for method, scene in zip(names["method"], names["scene"], strict=True):
        fits = orders.fits(orders.errors(rows[(rows["method"] == method) & (rows["scene"] == scene)], Measure.ATTITUDE_MAX))
        order, where = DECLARED[method]
        if len(fits):
            yield _order(f"{method} is of order {order} ({scene})", where, order, fits.iloc[0])


def _order(claim: str, where: str, order: int, fit: pd.Series[Any]) -> Finding:
    if fit["reason"]:
        return Finding(claim, where, str(fit["reason"]), OPEN)
    margin = max(ORDER_MARGIN, 3 * float(fit["stderr"]))
    return Finding(
        claim, where, f"slope {fit['text']} from {fit['points']} steps", _judged(abs(fit["slope"] - order) <= margin)
    )


def _exact(table: pd.DataFrame) -> Iterator[Finding]:
    for method in ("moser_veselov", "lame"):
        rows = _paper_rows(table, method, Measure.ATTITUDE_MAX.text)
        for scene, members in rows.groupby("scene", sort=False):
            worst = _worst(members)
            measured = f"largest attitude error {number(worst)} rad, bound 1e-11"
            yield Finding(f"{method} has no truncation error ({scene})", README, measured, _judged(worst <= 1e-11))


def _same_map(table: pd.DataFrame) -> Iterator[Finding]:
    """Compare the errors of the paper's map and of ours, which is said to be the same."""
    ours, theirs = (_paper_rows(table, method, Measure.ATTITUDE_MAX.text) for method in ("reduced", "convected"))
    both = ours.merge(theirs, on=["scene", "dt"], suffixes=("", "_paper")).dropna(subset=["value", "value_paper"])
    for scene, rows in both.groupby("scene", sort=False):
        gap = float((rows["value"] / rows["value_paper"] - 1).abs().max())
        measured = f"attitude errors differ by {number(gap)} of themselves at most, at {len(rows)} steps"
        yield Finding(f"reduced is the paper's map ({scene})", README, measured, _judged(gap <= 1e-3))


def _mujoco(table: pd.DataFrame, scenes: Mapping[str, Scene]) -> Iterator[Finding]:
    rows = keyed(table[(table["study"] == "paper") & table["method"].str.startswith("mujoco")])
    for scene, members in rows.groupby("scene", sort=False):
        rk4, single, implicit, fast = (
            _by_step(members, f"mujoco{setting}", measure)
            for setting, measure in (
                ("", ENERGY),
                (":integrator=Euler", ENERGY),
                (":integrator=implicit", Measure.ATTITUDE_MAX.text),
                (":integrator=implicitfast", Measure.ATTITUDE_MAX.text),
            )
        )
        if rk4 and single:
            yield _rk4_first(str(scene), rk4, single)
        if implicit and fast and scenes[str(scene)].free:
            yield _coincide(str(scene), implicit, fast)


def _by_step(rows: pd.DataFrame, method: str, measure: str) -> dict[float, float]:
    found = rows[(rows["method"] == method) & (rows["measure"] == measure)]
    return dict(zip(found["dt"], found["value"], strict=True))


def _rk4_first(scene: str, rk4: Mapping[float, float], single: Mapping[float, float]) -> Finding:
    """Compare RK4 at the coarsest step with Euler at the finest, a quarter of it: the same work."""
    coarse, fine = max(rk4), min(single)
    claim = f"RK4 is better than Euler on energy-conserving systems, even with {coarse / fine:g} times its step ({scene})"
    shown = [number(value) if math.isfinite(value) else "failed" for value in (rk4[coarse], single[fine])]
    measured = f"energy drift of RK4 {shown[0]}, of Euler at the smaller step {shown[1]}"
    holds = math.isfinite(rk4[coarse]) and not rk4[coarse] >= single[fine]
    return Finding(claim, MUJOCO, measured, _judged(holds))


def _coincide(scene: str, implicit: Mapping[float, float], fast: Mapping[float, float]) -> Finding:
    gaps = [abs(implicit[dt] / fast[dt] - 1) for dt in implicit.keys() & fast.keys()]
    claim = f"implicit and implicitfast coincide for a free body ({scene})"
    return Finding(claim, MUJOCO, f"attitude errors differ by {number(max(gaps))} of themselves", _judged(max(gaps) <= 1e-6))


def _factor_four(table: pd.DataFrame) -> Iterator[Finding]:
    distances = table[table["measure"] == Measure.PERIOD_DISTANCE.text]["value"].to_list()
    if not distances:
        return
    ratios = [before / after for before, after in pairwise(distances)]
    measured = "ratios " + ", ".join(number(ratio, 3) for ratio in ratios)
    holds = all(abs(ratio - 4) <= 0.4 for ratio in ratios)
    yield Finding("halving the step divides the top's position error by four", f"{PAPER}, figure 2", measured, _judged(holds))
