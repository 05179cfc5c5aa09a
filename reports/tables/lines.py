"""Samples of the studies as lines of pictures."""

from __future__ import annotations

import pandas as pd

from conservative.benchmarks.studies import sphere_curves
from conservative.benchmarks.studies.paper_figures import BRICK, ENERGY, EXACT, MOMENTUM, RATES, TOP, X1, X2

from ..labels import display_name

ANALYTICAL = "analytical"
"""What the exact motion is called in the paper's figure 2."""


def _of_study(samples: pd.DataFrame, study: str) -> pd.DataFrame:
    """Return the samples of a study with another column `series`: what to call the method."""
    rows = samples[samples["study"] == study]
    names = [display_name(method, label) for method, label in zip(rows["method"], rows["label"], strict=True)]
    return rows.assign(series=pd.Series(names, index=rows.index, dtype="string"))


def drifts(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the drifts over time: columns scene, series, t (s), quantity, drift (relative, the largest so far)."""
    rows = _of_study(samples, "long_runs").rename(columns={"value": "drift"})
    return rows[["scene", "series", "t", "quantity", "drift"]].reset_index(drop=True)


def curves(samples: pd.DataFrame) -> pd.DataFrame:
    """Return the curves on spheres: columns scene, method, series, t (s), and the point x, y, z in units of the radius."""
    return _points(_of_study(samples, "sphere_curves"), ["scene", "method", "series", "t"], sphere_curves.AXES)


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
