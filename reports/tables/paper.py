"""The table beside the paper's figure 2: how far off the top's centre of mass is after one period of precession."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.measures.measure import Measure

from .cells import Table
from .rows import of_study

_MEASURES = (Measure.PERIOD, Measure.PERIOD_X1, Measure.PERIOD_DISTANCE)


def position_errors(table: pd.DataFrame) -> Table | None:
    """Return errors of x1, and the distance, a row a step; None where the report has no such study."""
    rows = of_study(table, "paper_figures")
    if rows.empty:
        return None
    wide = rows.pivot(index="dt", columns="measure", values="value").sort_index(ascending=False)
    values = [(dt, *(row[measure.text] for measure in _MEASURES)) for dt, row in wide.iterrows()]
    body = [[f"{dt:g}", f"{t:g}", f"{x1:.4f}", f"{distance:.4f}"] for dt, t, x1, distance in values]
    return ["dt, s", "t, s", "error of x1, m", "distance, m"], body
