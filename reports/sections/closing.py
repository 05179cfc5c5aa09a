"""The end of `conservative report` on the terminal: a table per scene with one row per method."""

from __future__ import annotations

import math

import pandas as pd

from conservative.benchmarks.contest import costs
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import convergence, paper, speed
from conservative.method import Role

from ..document.cells import DASH, factor, number, tolerance
from ..document.model import Table
from ..rows import lines
from ..rows.names import of_measure, of_study
from .summary import MIDDLE

HEADER = ("method", "energy", "momentum", "attitude", "order", "µs/step", f"µs at {tolerance(MIDDLE)}")
LEGEND = (
    "energy, momentum: largest relative drift; attitude: largest error, rad; all at the scene's own step, or at the default "
    f"tolerance. order: measured order of convergence, standard error at most {lines.SURE:g}. µs at "
    f"{tolerance(MIDDLE)}: wall time per simulated second at this attitude error, rad. {DASH}: not measurable, or not reached."
)


def scene_table(table: pd.DataFrame, points: pd.DataFrame, scene: str) -> Table:
    """Return one row per method that was run on a scene, in the order of measurement.

    Methods that differ only in tolerance are one row, with the drifts and errors of the default tolerance, which is the last.
    The table is that of `names.with_names`; the points are those of the scene (see `rows.points`).
    """
    accuracy = of_study(table, paper.STUDY.name, scene)
    accuracy = accuracy[(accuracy["role"] != Role.TRUTH.value) & accuracy["value"].notna()]
    times = costs(points, [MIDDLE], ["series"]).set_index("series")["time"]
    orders = lines.orders(of_study(table, convergence.STUDY.name, scene))
    steps = of_measure(of_study(table, speed.STUDY.name, scene), Measure.TIME_PER_STEP).set_index("method")["value"]
    body = []
    for series, line in accuracy.groupby("series", sort=False):
        method = str(line["method"].iloc[-1])
        rows = line[(line["method"] == method) & (line["dt"] == line["dt"].max())]
        drifts = rows[rows["measure"] == Measure.DRIFT_MAX.text]
        energy, momentum = (drifts[drifts["quantity"].str.contains(part)]["value"].max() for part in ("energy", "moment"))
        order = float(orders.get(method, math.nan))
        body.append(
            [
                " ".join(filter(None, rows[["family", "series_setting"]].iloc[0])),
                number(float(energy)),
                number(float(momentum)),
                number(float(of_measure(rows, Measure.ATTITUDE_MAX)["value"].max())),
                DASH if math.isnan(order) else f"{order:.2f}",
                number(float(steps.get(method, math.nan)) * 1e6),
                factor(float(times.get(series, math.nan)) * 1e6),
            ]
        )
    return Table(HEADER, body, scene)
