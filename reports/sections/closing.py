"""The end of `conservative report` on the terminal: a table per scene, one row per method, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from conservative.benchmarks.contest import cheapest, costs
from conservative.benchmarks.measures.measure import Measure
from conservative.method import Role

from ..document.cells import DASH, factor, number, tolerance
from ..document.model import Table
from ..rows.names import OF_ENGINES, MethodClass, of_classes, of_measure, of_study
from .summary import MIDDLE

HEADER = ("method", "energy", "momentum", "attitude", "order", "µs/step", f"µs at {tolerance(MIDDLE)}")
LEGEND = (
    "energy, momentum: largest relative drift; attitude: largest error, rad; all at the scene's own step, or at the default "
    f"tolerance. order: measured order of convergence. µs at {tolerance(MIDDLE)}: wall time per simulated second at an "
    f"attitude error of {tolerance(MIDDLE)} rad. {DASH}: not measurable, or not reached."
)


def scene_table(table: pd.DataFrame, points: pd.DataFrame, scene: str) -> Table:
    """Return one row per method that was run on a scene, in the order of measurement.

    Methods that differ only in tolerance are one row, with the drifts and errors of the default tolerance, which is the last.

    Parameters
    ----------
    table
        Measurements with names (see `labels.with_names`).
    points
        Errors and times of the scene (see `rows.points`).
    scene
        Name of the scene.
    """
    accuracy = of_study(table, "paper", scene)
    accuracy = accuracy[(accuracy["role"] != Role.TRUTH.value) & accuracy["value"].notna()]
    reached = costs(points, [MIDDLE], ["series"])
    times = dict(zip(reached["series"], reached["time"], strict=True))
    orders = _values(of_measure(of_study(table, "convergence", scene), Measure.ORDER))
    steps = _values(of_measure(of_study(table, "speed", scene), Measure.TIME_PER_STEP))
    body = []
    for series, line in accuracy.groupby("series", sort=False):
        method = str(line["method"].iloc[-1])
        rows = line[(line["method"] == method) & (line["dt"] == line["dt"].max())]
        drifts = rows[rows["measure"] == Measure.DRIFT_MAX.text]
        energy, momentum = (drifts[drifts["quantity"].str.contains(part)]["value"].max() for part in ("energy", "moment"))
        order = orders.get(method, math.nan)
        body.append(
            [
                " ".join(filter(None, rows[["family", "series_setting"]].iloc[0])),
                number(float(energy)),
                number(float(momentum)),
                number(float(of_measure(rows, Measure.ATTITUDE_MAX)["value"].max())),
                DASH if math.isnan(order) else f"{order:.2f}",
                number(steps.get(method, math.nan) * 1e6),
                factor(times.get(series, math.nan) * 1e6),
            ]
        )
    return Table(HEADER, body, scene)


def _values(rows: pd.DataFrame) -> dict[str, float]:
    return dict(zip(rows["method"], rows["value"], strict=True))


def verdict(points: pd.DataFrame, scenes: Sequence[str]) -> str:
    """Return one sentence: on each scene, the fastest engine against our fastest general integrator at `MIDDLE` rad."""
    reached = costs(points, [MIDDLE])
    clauses = [_clause(reached[reached["scene"] == scene], scene) for scene in scenes]
    return f"At {tolerance(MIDDLE)} rad, without closed forms: {'; '.join(clauses)}."


def _clause(reached: pd.DataFrame, scene: str) -> str:
    ours, engine = cheapest(of_classes(reached, MethodClass.GENERAL)), cheapest(of_classes(reached, *OF_ENGINES))
    if ours is None or engine is None:
        there = ours or engine
        return f"on {scene} only {there.name} reaches it" if there else f"on {scene} no method reaches it"
    fast, slow = (ours, engine) if ours.time <= engine.time else (engine, ours)
    return f"on {scene} {fast.name} is {factor(slow.time / fast.time)} times as fast as {slow.name}"
