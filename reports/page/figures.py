"""The figures of the page: the charts of a scene's view, with words about them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from conservative.benchmarks.studies import long_runs

from ..charts import figures, spheres, vega_embed
from ..charts.vega_embed import Figure, Spec
from ..tables.work_precision import front
from ..view import SceneView

DRIFT_SAMPLES = 40
"""Samples of a line of drift: it only ever grows, so few are enough."""
NUMBERS = {
    "error": ("error", "Q", "attitude error, rad"),
    "microseconds": ("microseconds", "Q", "µs per simulated second"),
    "dt": ("dt", "Q", "step, s"),
    "method": ("method", "N", "setting"),
    "t": ("t", "Q", "t, s"),
    "drift": ("drift", "Q", "largest drift so far"),
    "series": ("series", "N", "method"),
}
"""What hovering can show: field, kind, title."""


class SceneFigures(NamedTuple):
    """The figures of one scene."""

    work_precision: Figure
    drift: Figure
    convergence: Figure
    sphere: Figure


def scene_figures(scene: SceneView) -> SceneFigures:
    """Return the figures of a scene."""
    return SceneFigures(work_precision(scene), drift(scene), convergence(scene), sphere(scene))


def hover(*names: str) -> list[tuple[str, str, str]]:
    """Return what hovering shows beside the name of the line."""
    return [NUMBERS[name] for name in ("series", *names)]


def work_precision(scene: SceneView) -> Figure:
    """Return error against time, with the Pareto front in words."""
    points = scene.points
    names = ", ".join(dict.fromkeys(front(points)["series"])) or "nobody"
    lines = points["series"].nunique()
    summary = f"{len(points)} measured points of {lines} lines. On the Pareto front, cheap to dear: {names}."
    chart = figures.work_precision(points, scene.name)
    charts = vega_embed.embed(chart, hover("method", "error", "microseconds", "dt"), 520)
    title = f"{scene.name}: wall time against attitude error, both logarithmic"
    return _figure(f"work_precision_{scene.name}", title, summary, charts, marks=True)


def drift(scene: SceneView) -> Figure:
    """Return the drift over time, of fewer samples than were measured."""
    every = max(1, long_runs.SAMPLES // DRIFT_SAMPLES)
    rows = scene.drifts
    thin = rows[rows.groupby(["series", "quantity"], sort=False).cumcount(ascending=False) % every == 0]
    summary = "Each quantity has a panel: a level line stays, a rising one drifts. The table below says how far each goes."
    charts = vega_embed.embed(figures.drift(thin, scene.name), hover("t", "drift"), 220)
    return _figure(f"drift_{scene.name}", f"{scene.name}: drift over time", summary, charts, marks=False)


def convergence(scene: SceneView) -> Figure:
    """Return error against step, with the fitted orders."""
    charts = vega_embed.embed(figures.convergence(scene.errors, scene.fits, scene.name), hover("dt", "error"), 520)
    summary = "In brackets the fitted slope with its standard error; the bold stretch is what it is fitted to."
    return _figure(f"convergence_{scene.name}", f"{scene.name}: attitude error against step", summary, charts, marks=True)


def _figure(name: str, title: str, summary: str, charts: list[Spec], marks: bool) -> Figure:
    return Figure(name, title, summary, tuple(charts), vega_embed.legend(vega_embed.lines(charts), marks))


_POLHODE = (
    "polhode on the momentum sphere",
    "The angular momentum in body axes. The exact one is closed: a drift makes it a band, or leaves the sphere.",
)
_TRACE = (
    "trace of the axis on the unit sphere",
    "The axis in space. A band wider than the exact one tells of a long step, a wandering one of drift.",
)


def sphere(scene: SceneView) -> Figure:
    """Return the curves of a scene, a sphere each, and the names of the methods that have none."""
    kind, words = _POLHODE if scene.free else _TRACE
    run = f"At the scene's own step, over {long_runs.DURATIONS:g} durations."
    names = ", ".join(scene.without_curve)
    absent = f" Not drawn, as they fail or cannot do the scene: {names}." if names else ""
    charts = tuple(spheres.chart(scene.curves, scene.name, str(name)) for name in scene.curves["series"].unique())
    title = f"{scene.name}: {kind}"
    return replace(Figure(f"sphere_{scene.name}", title, f"{run} {words}{absent}", charts, ()), view="sphere")
