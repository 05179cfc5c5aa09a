"""Lines of pictures: samples over time, and errors over steps with their fitted orders."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd

from conservative.attitude import Array, from_quaternion
from conservative.benchmarks.measures.convergence_order import observed_order
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import convergence, motion
from conservative.method import Role
from conservative.outcome import OutcomeKind
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..animation.frames import ERROR, drift_name
from .names import of_measure, of_study, with_outcome

EXACT = "exact"
"""Name of the line of the exact motion."""
ERROR_COLUMNS = ("scene", "method", "family", "name", "dt", "error")
SURE = 0.5
"""Largest standard error of an order in a short table. Above it, the fit does not tell the order from the next one."""


def signed_drifts(samples: pd.DataFrame, scene: str, invariants: Iterable[str]) -> pd.DataFrame:
    """Return the relative drifts of the invariants of a scene: columns scene, method, family, name, t (s), quantity, drift."""
    rows = samples[(samples["study"] == motion.STUDY.name) & (samples["scene"] == scene)].rename(columns={"value": "drift"})
    names = {motion.SIGNED + name: name for name in invariants}
    rows = rows[rows["quantity"].isin(names) & rows["drift"].notna()]  # not every method has balances
    rows = rows.assign(quantity=rows["quantity"].map(names), name=_names(rows))
    return rows[["scene", "method", "family", "name", "t", "quantity", "drift"]].reset_index(drop=True)


def early_ends(rows: pd.DataFrame) -> dict[str, float]:
    """Return the last time of each line, by its name, that ends before the others; columns name and t."""
    ends = rows.groupby("name", sort=False)["t"].max()
    return {str(name): float(end) for name, end in ends[ends < 0.99 * ends.max()].items()}


def trajectories(samples: pd.DataFrame, scene: Scene) -> dict[str, Trajectory]:
    """Return the motion of each method over the first duration of a scene, by the name of the method."""
    rows = samples[(samples["study"] == motion.STUDY.name) & (samples["scene"] == scene.name)]
    points = _points(rows, ["method", "name", "t"], motion.STATES)
    return {
        str(method): Trajectory(
            scene,
            part["t"].to_numpy(),
            from_quaternion(part[list(motion.STATES[:4])].to_numpy()),
            part[list(motion.STATES[4:])].to_numpy(),
            str(part["name"].iloc[0]),
        )
        for method, part in points.groupby("method", sort=False)
    }


def largest_values(samples: pd.DataFrame, scene: Scene) -> dict[str, dict[str, Array]]:
    """Return the largest drifts and attitude error so far of each method, by the names of `animation.frames`, at its states."""
    rows = samples[(samples["study"] == motion.STUDY.name) & (samples["scene"] == scene.name)]
    names = {motion.LARGEST + invariant.name: drift_name(invariant) for invariant in scene.invariants} | {motion.ERROR: ERROR}
    found: dict[str, dict[str, Array]] = {}
    for (method, quantity), part in rows.groupby(["method", "quantity"], sort=False):
        if quantity in names:
            found.setdefault(str(method), {})[names[quantity]] = part["value"].to_numpy()
    return found


def curves(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the curves on spheres: columns scene, method, family, name, t (s), and the point x, y, z in radii."""
    keys = ["scene", "method", "family", "name", "t"]
    rows = samples[samples["study"] == motion.STUDY.name]
    return _points(rows.assign(name=_names(rows)), keys, motion.AXES)


def _names(rows: pd.DataFrame) -> pd.Series[str]:
    """Return the names of lines. The exact motion has one name, although some scenes have several solvers for it."""
    return rows["line"].where(rows["role"] != Role.TRUTH, EXACT)


def _points(rows: pd.DataFrame, keys: list[str], quantities: tuple[str, ...]) -> pd.DataFrame:
    """Return a row for each point, with a column for each quantity, in the order of measurement."""
    wide = rows[rows["quantity"].isin(quantities)].pivot(index=keys, columns="quantity", values="value").reset_index()
    order = rows[keys].drop_duplicates()
    return order.merge(wide, on=keys).reindex(columns=[*keys, *quantities])


def errors(table: pd.DataFrame, measure: Measure) -> pd.DataFrame:
    """Return the errors of the convergence study: columns scene, method, family, name, dt (s), error (unit of the measure)."""
    rows = with_outcome(of_measure(of_study(table, convergence.STUDY.name), measure), OutcomeKind.OK)
    return rows.rename(columns={"value": "error"})[list(ERROR_COLUMNS)].reset_index(drop=True)


def fits(errors: pd.DataFrame) -> pd.DataFrame:
    """Return the order of each line of `errors`.

    Columns scene, method, family, name, slope, stderr, floor, points, coarse and fine (the window, s), error_coarse and
    error_fine (of the fit at its ends), text (slope and its standard error), reason (why there is no fit); NaN without a fit.
    """
    keys = list(ERROR_COLUMNS[:4])
    rows = []
    for key, line in errors.groupby(keys, sort=False):
        steps, values = line["dt"].to_numpy(), line["error"].to_numpy()
        order = observed_order(steps, values)
        used, ends = list(order.used), [math.nan] * 4
        if used:
            x, y = np.log(steps[used]), np.log(values[used])
            fitted = y.mean() + order.slope * (x[[0, -1]] - x.mean())
            ends = np.exp([*x[[0, -1]], *fitted]).tolist()
        text = "no order" if order.reason else f"{order.slope:.2f} ± {order.stderr:.2f}"
        rows.append((*key, order.slope, order.stderr, order.floor, len(used), text, order.reason, *ends))
    columns = ("slope", "stderr", "floor", "points", "text", "reason", "coarse", "fine", "error_coarse", "error_fine")
    return pd.DataFrame(rows, columns=[*keys, *columns])


def orders(rows: pd.DataFrame) -> pd.Series[float]:
    """Return the observed order of each method by its name, if its standard error is at most `SURE`."""
    measures = Measure.ORDER, Measure.ORDER_STDERR
    order, error = (of_measure(rows, measure).groupby("method")["value"].last() for measure in measures)
    return order[~(error.reindex(order.index) > SURE)]


def with_slopes(rows: pd.DataFrame, fits: pd.DataFrame) -> pd.DataFrame:
    """Return errors or fits of one scene with the slope in each name, `reduced (2.00 ± 0.01)`, if it is sure (see `SURE`)."""
    sure = fits["text"].where(fits["stderr"] <= SURE, "no clear order")
    slopes = dict(zip(fits["name"], sure, strict=True))
    return rows.assign(name=[f"{name} ({slopes[name]})" for name in rows["name"]])


def fit_ends(fits: pd.DataFrame) -> pd.DataFrame:
    """Return the two ends of each fitted line as points: columns name, dt (s), error (rad); uncertain fits are left out."""
    fits = fits[fits["stderr"] <= SURE]
    ends = [fits.rename(columns={end: "dt", f"error_{end}": "error"})[["name", "dt", "error"]] for end in ("coarse", "fine")]
    return pd.concat(ends, ignore_index=True).dropna()
