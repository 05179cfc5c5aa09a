"""Errors over steps, and the orders fitted to them, as pictures and tables take them."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from conservative.attitude import Array
from conservative.benchmarks.measures.convergence_order import Order, observed_order
from conservative.benchmarks.measures.measure import Measure
from conservative.outcome import OutcomeKind

from .rows import of_measure, of_study, with_outcome

COLUMNS = ("scene", "method", "family", "name", "dt", "error")


def errors(table: pd.DataFrame, measure: Measure) -> pd.DataFrame:
    """Return the errors of the convergence study by a measure, coarse to fine; runs that failed are not among them.

    Columns scene, method, family, name (what to call it), dt (s), error (unit of the measure).
    """
    rows = with_outcome(of_measure(of_study(table, "convergence"), measure), OutcomeKind.OK)
    return rows.rename(columns={"value": "error"})[list(COLUMNS)].reset_index(drop=True)


def fits(errors: pd.DataFrame) -> pd.DataFrame:
    """Return the order of each line of `errors`.

    Columns scene, method, family, name, slope, stderr, floor, points, coarse and fine (the window, s), error_coarse and
    error_fine (of the fit at its ends), text (slope and its standard error), reason (why there is none); nan without a fit.
    """
    keys = list(COLUMNS[:4])
    groups = errors.groupby(keys, sort=False)
    return pd.DataFrame([dict(zip(keys, key, strict=True)) | _fit(line) for key, line in groups], columns=[*keys, *_FIT])


def with_slopes(rows: pd.DataFrame, fits: pd.DataFrame) -> pd.DataFrame:
    """Return errors or fits of one scene with the slope in each name: `reduced (2.00 ± 0.01)`."""
    slopes = dict(zip(fits["name"], fits["text"], strict=True))
    return rows.assign(name=[f"{name} ({slopes[name]})" for name in rows["name"]])


def fit_ends(fits: pd.DataFrame) -> pd.DataFrame:
    """Return the two ends of each fitted line as points: columns name, dt (s), error (rad)."""
    ends = [fits.rename(columns={end: "dt", f"error_{end}": "error"})[["name", "dt", "error"]] for end in ("coarse", "fine")]
    return pd.concat(ends, ignore_index=True).dropna()


_FIT = ("slope", "stderr", "floor", "points", "text", "reason", "coarse", "fine", "error_coarse", "error_fine")


def _fit(line: pd.DataFrame) -> dict[str, object]:
    steps, values = line["dt"].to_numpy(), line["error"].to_numpy()
    order = observed_order(steps, values)
    used = list(order.used)
    ends = _ends(order, np.log(steps[used]), np.log(values[used])) if used else (math.nan,) * 4
    text = "no order" if order.reason else f"{order.slope:.2f} ± {order.stderr:.2f}"
    return dict(zip(_FIT, (order.slope, order.stderr, order.floor, len(used), text, order.reason, *ends), strict=True))


def _ends(order: Order, x: Array, y: Array) -> tuple[float, float, float, float]:
    """Return the fitted line's coarse and fine step, and its errors there."""
    heights = y.mean() + order.slope * (x[[0, -1]] - x.mean())
    return float(np.exp(x[0])), float(np.exp(x[-1])), float(np.exp(heights[0])), float(np.exp(heights[1]))
