"""The end of `conservative report` on the terminal: a table per scene with one row per method."""

from __future__ import annotations

import math

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import costs
from conservative.benchmarks.studies import convergence, paper, speed
from conservative.method import Role
from conservative.scene import Scene

from ..document.cells import DASH, angle, bound, factor, number, outcome_cell, tolerance
from ..document.model import Row, Table
from ..rows import lines
from ..rows.names import ABSENT, display_name, largest_drifts, of_measure, of_study, outcomes, without_outcome
from .summary import MIDDLE

HEADER = ("attitude", "order", "µs/step", f"µs at {tolerance(MIDDLE)}")
LEGEND = (
    "energy, momenta: largest relative drift; attitude: largest error, rad; all at the scene's own step, or at the default "
    f"tolerance, and rounded up. order: measured order of convergence, standard error at most {lines.SURE:g}. µs at "
    f"{tolerance(MIDDLE)}: wall time per simulated second at this attitude error, rad. {DASH}: not measurable, or not reached."
)


def scene_table(table: pd.DataFrame, points: pd.DataFrame, scene: Scene, named: bool = False) -> Table:
    """Return one row per method on a scene, in the order of measurement, and a column for each of its invariants.

    Those that failed come last, with the reason; settings of a method that failed in the same way share a row.

    The table is that of `names.with_names`; the points are those of the scene (see `rows.points`). If the methods were `named`,
    each has its row, also if it does not support the scene or is not installed. Otherwise such methods have none, and methods
    that differ only in tolerance are one row, with the drifts and errors of the default tolerance, which is the last.
    """
    accuracy = of_study(table, paper.STUDY.name, scene.name)
    accuracy = accuracy[accuracy["role"] != Role.TRUTH.value]
    accuracy = accuracy if named else without_outcome(accuracy, *ABSENT)
    accuracy = accuracy[accuracy["dt"] == accuracy.groupby("method")["dt"].transform("max")]
    times = costs(points, [MIDDLE], ["series"]).set_index("series")["time"]
    orders = lines.orders(of_study(table, convergence.STUDY.name, scene.name))
    steps = of_measure(of_study(table, speed.STUDY.name, scene.name), Measure.TIME_PER_STEP).set_index("method")["value"]
    body: list[Row] = []
    failed: dict[tuple[str, str], list[str]] = {}
    for _, line in accuracy.groupby("method" if named else "series", sort=False):
        rows = line[line["method"] == line["method"].iloc[-1]]
        method, family, series = rows[["method", "family", "series"]].iloc[0]
        name, outcome = display_name(family, "", rows["setting" if named else "series_setting"].iloc[0]), outcomes(rows)[0]
        if not outcome.ok:
            failed.setdefault((family, str(outcome_cell(outcome, reason=True))), []).append(name)
            continue
        order, time = (float(known.get(key, math.nan)) for known, key in ((orders, method), (times, series)))
        cells = [
            *(bound(drift) for drift in largest_drifts(rows, scene).values()),
            angle(float(of_measure(rows, Measure.ATTITUDE_MAX)["value"].max())),
            DASH if math.isnan(order) else f"{order:.2f}",
            number(float(steps.get(method, math.nan)) * 1e6),
            factor(time * 1e6),
        ]
        body.append([name, *cells])
    header = ["method", *(each.name for each in scene.invariants), *HEADER]
    # In the first cell, because a terminal has no room for a column of reasons.
    body += [[f"{', '.join(names)}: {reason}", *[DASH] * (len(header) - 1)] for (_, reason), names in failed.items()]
    return Table(header, body, scene.name)
