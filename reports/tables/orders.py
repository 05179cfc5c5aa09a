"""Errors over steps, and the orders fitted to them, as pictures and tables take them."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from conservative.attitude import Array
from conservative.benchmarks.measures.convergence_order import Order, observed_order

from ..labels import shown

ERROR = "attitude error max"
RATES = "rate error max"


def errors(table: pd.DataFrame, measure: str = ERROR) -> pd.DataFrame:
    """Return columns scene, series, dt (s), error of the convergence study, coarse to fine; runs that failed are not in it."""
    rows = table[(table["study"] == "convergence") & (table["measure"] == measure) & (table["outcome"] == "ok")]
    names = [shown(method, label) for method, label in zip(rows["method"], rows["label"], strict=True)]
    return (
        rows.rename(columns={"value": "error"}).assign(series=names)[["scene", "series", "dt", "error"]].reset_index(drop=True)
    )


def fits(found: pd.DataFrame) -> pd.DataFrame:
    """Return the order of each line of `errors`.

    Columns scene, series, slope, stderr, floor, points, coarse and fine (the window, s), error_coarse and error_fine (of the
    fit at its ends), text (slope and its standard error), reason (why there is none); nan where there is no fit.
    """
    groups = found.groupby(["scene", "series"], sort=False)
    return pd.DataFrame([dict(zip(("scene", "series"), key, strict=True)) | _fit(line) for key, line in groups])


def _fit(line: pd.DataFrame) -> dict[str, object]:
    steps, values = line["dt"].to_numpy(), line["error"].to_numpy()
    order = observed_order(steps, values)
    used = list(order.used)
    ends = _ends(order, np.log(steps[used]), np.log(values[used])) if used else (math.nan,) * 4
    text = "no order" if order.reason else f"{order.slope:.2f} ± {order.stderr:.2f}"
    numbers = {"slope": order.slope, "stderr": order.stderr, "floor": order.floor, "points": len(used), "text": text}
    return numbers | {"reason": order.reason} | dict(zip(("coarse", "fine", "error_coarse", "error_fine"), ends, strict=True))


def _ends(order: Order, x: Array, y: Array) -> tuple[float, float, float, float]:
    """Return the fitted line's coarse and fine step, and its errors there."""
    heights = y.mean() + order.slope * (x[[0, -1]] - x.mean())
    return float(np.exp(x[0])), float(np.exp(x[-1])), float(np.exp(heights[0])), float(np.exp(heights[1]))
