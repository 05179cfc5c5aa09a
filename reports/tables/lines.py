"""Samples of the studies as lines of pictures."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.studies import long_runs, sphere_curves
from conservative.benchmarks.studies.paper_figures import BRICK, ENERGY, EXACT, MOMENTUM, RATES, TOP, X1, X2

ANALYTICAL = "analytical"
"""What the exact motion is called in the paper's figure 2."""
THIN = 40
"""Samples of a line of drift on the page: it only ever grows, so few are enough."""


def _of_study(samples: pd.DataFrame, study: str) -> pd.DataFrame:
    return samples[samples["study"] == study]


def drifts(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the drifts over time: columns scene, family, name, t (s), quantity, drift (relative, the largest so far).

    Of methods that differ in tolerance alone those with the loosest and the tightest are there.
    """
    rows = _extremes(_of_study(samples, "long_runs")).rename(columns={"value": "drift"})
    return rows[["scene", "family", "name", "t", "quantity", "drift"]].reset_index(drop=True)


def _extremes(rows: pd.DataFrame) -> pd.DataFrame:
    """Return samples without those between the loosest and the tightest of several tolerances."""
    names = rows.groupby(["scene", "line"])["name"]
    return rows[(rows["name"] == names.transform("first")) | (rows["name"] == names.transform("last"))]


def thin(drifts: pd.DataFrame) -> pd.DataFrame:
    """Return drifts with every so many samples of a line, up to its last, so that about `THIN` are left."""
    every = max(1, long_runs.SAMPLES // THIN)
    left = drifts.groupby(["scene", "name", "quantity"], sort=False).cumcount(ascending=False)
    return drifts[left % every == 0].reset_index(drop=True)


def curves(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the curves on spheres: columns scene, method, family, name, t (s), and the point x, y, z in radii."""
    keys = ["scene", "method", "family", "name", "t"]
    return _points(_of_study(samples, "sphere_curves"), keys, sphere_curves.AXES)


def _points(rows: pd.DataFrame, keys: list[str], quantities: tuple[str, ...]) -> pd.DataFrame:
    """Return a row for each point of some quantities' lines, in the order in which they were measured."""
    wide = rows[rows["quantity"].isin(quantities)].pivot(index=keys, columns="quantity", values="value").reset_index()
    order = rows[keys].drop_duplicates()
    return order.merge(wide, on=keys).reindex(columns=[*keys, *quantities])


def body_rates(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the paper's figure 1(a): columns t (s), component, rate (rad/s) of the brick's body rates."""
    rows = _of_figure(samples, BRICK)
    rows = rows[rows["quantity"].isin(RATES)].rename(columns={"quantity": "component", "value": "rate"})
    return rows[["t", "component", "rate"]].reset_index(drop=True)


def conservation_errors(samples: pd.DataFrame) -> pd.DataFrame:
    """Return figures 1(b) and 1(c): columns t (s), method, energy and momentum, errors of energy and |L|, relative, signed."""
    return _points(_of_figure(samples, BRICK), ["t", "method"], (ENERGY, MOMENTUM))


def centre_of_mass(samples: pd.DataFrame) -> pd.DataFrame:
    """Return figures 2(b) and 2(c): columns t (s), run, x1, x2 (m), the top's centre of mass for two steps, and exact."""
    rows = _of_figure(samples, TOP)
    runs = [_run(method, dt) for method, dt in zip(rows["method"], rows["dt"], strict=True)]
    return _points(rows.assign(run=pd.Series(runs, index=rows.index, dtype="string")), ["t", "run"], (X1, X2))


def _of_figure(samples: pd.DataFrame, scene: str) -> pd.DataFrame:
    rows = _of_study(samples, "paper_figures")
    return rows[rows["scene"] == scene]


def _run(method: str, dt: float) -> str:
    return ANALYTICAL if method == EXACT else f"Δt = {dt:g} s"
