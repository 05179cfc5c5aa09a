"""The figures of the page: the charts of a scene's view, with words about them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd

from conservative.benchmarks.studies import long_runs, step_ladder

from ..charts import families, figures, spheres, vega_embed
from ..charts.style import colours, families_of
from ..charts.vega_embed import PATHS, Entry, PageFigure
from ..tables.families import under
from ..tables.summary import Summary
from ..view import SceneView
from .scene_charts import SceneCharts

NUMBERS = {
    "error": ("error", "Q", "attitude error, rad"),
    "microseconds": ("microseconds", "Q", "µs per simulated second"),
    "sample": ("sample", "Q", f"µs a sample, of {step_ladder.SAMPLES}"),
    "dt": ("dt", "Q", "step, s"),
    "method": ("method", "N", "setting"),
    "t": ("t", "Q", "t, s"),
    "drift": ("drift", "Q", "largest drift so far"),
    "name": ("name", "N", "method"),
    "setting": ("setting", "N", "setting"),
    "within": ("within", "N", "bodies"),
}
"""What hovering can show: field, kind, title."""


class SceneFigures(NamedTuple):
    """The figures of one scene."""

    work_precision: PageFigure
    drift: PageFigure
    convergence: PageFigure
    sphere: PageFigure | None


def scene_figures(scene: SceneView, charts: SceneCharts) -> SceneFigures:
    """Return the figures of a scene out of its charts."""
    return SceneFigures(
        first(scene.summary, f"work_precision_{scene.name}", scene.name),
        drift(scene),
        convergence(scene, charts.convergence),
        sphere(scene) if len(scene.curves) else None,
    )


def hover(*names: str) -> list[tuple[str, str, str]]:
    """Return what hovering shows beside the name of the line."""
    return [NUMBERS[name] for name in ("name", *names)]


def first(summary: Summary, name: str, what: str) -> PageFigure:
    """Return work against precision, the best of each family; what a summary shows at first is drawn, the rest at a press."""
    points = summary.points
    best = points[~points["single"].astype(bool)]
    lines = [(str(line), members) for line, members in best.groupby("name", sort=False)]
    title = f"{what}: computing time against attitude error, the best of each family"
    words = " ".join(["Lower left is better. Solid: ours, dashed: engines.", *under(lines, "error", "time")])
    hidden = [line for line, _ in lines if line not in summary.shown]
    shown = hover("setting", "error", "microseconds", *(["within"] if best["within"].any() else ["sample", "dt"]))
    charts = tuple(vega_embed.embed(families.work_precision(points), shown, 310, hidden)) if len(points) else ()
    legend = tuple(_entry(line, members, line in summary.shown) for line, members in lines)
    return PageFigure(name, title, words, charts, legend, "families")


def _entry(line: str, members: pd.DataFrame, shown: bool) -> Entry:
    family, kind = members[["family", "class"]].iloc[0]
    dash = " ".join(map(str, families.DASHES[kind]))
    return Entry(line, colours({line: family})[line], PATHS[families.SHAPES[kind]], dash, shown)


def drift(scene: SceneView) -> PageFigure:
    """Return the drift over time, of fewer samples than the picture beside report.md has."""
    words = "Each quantity has a panel: a level line stays, a rising one drifts. The table below says how far each goes."
    summary = " ".join([words, *_under_another(scene.thin_drifts)])
    charts = tuple(vega_embed.embed(figures.drift(scene.thin_drifts, scene.name), hover("t", "drift"), 220))
    legend = vega_embed.legend(families_of(scene.drifts), marks=False)
    return PageFigure(f"drift_{scene.name}", f"{scene.name}: drift over time", summary, charts, legend, "pairs")


def _under_another(drifts: pd.DataFrame) -> Iterator[str]:
    """Yield what lies exactly under another line in every panel, as do methods that keep everything to the last digit."""
    data = drifts.assign(shown=drifts["drift"].clip(lower=figures.FLOOR), panel=drifts["quantity"])
    lines = [(str(name), members.sort_values(["panel", "t"])) for name, members in data.groupby("name", sort=False)]
    return under(lines, "t", "shown")


def convergence(scene: SceneView, chart: Any) -> PageFigure:
    """Return error against step, with the fitted orders."""
    summary = "In brackets the fitted slope with its standard error; the bold stretch is what it is fitted to."
    charts = tuple(vega_embed.embed(chart, hover("dt", "error"), 520))
    legend = vega_embed.legend(families_of(scene.errors), marks=True)
    return PageFigure(f"convergence_{scene.name}", f"{scene.name}: attitude error against step", summary, charts, legend)


_POLHODE = (
    "polhode on the momentum sphere",
    "The angular momentum in body axes. The exact one is closed: a drift makes it a band, or leaves the sphere.",
)
_TRACE = (
    "trace of the axis on the unit sphere",
    "The axis in space. A band wider than the exact one tells of a long step, a wandering one of drift.",
)


def sphere(scene: SceneView) -> PageFigure:
    """Return the curves of a scene, a sphere each, and the names of the methods that have none."""
    kind, words = _POLHODE if scene.free else _TRACE
    run = f"At the scene's own step, over {long_runs.DURATIONS:g} durations."
    names = ", ".join(scene.without_curve)
    absent = f" Not drawn, as they fail or cannot do the scene: {names}." if names else ""
    charts = tuple(spheres.chart(curve) for _, curve in scene.curves.groupby("name", sort=False))
    title = f"{scene.name}: {kind}"
    return replace(PageFigure(f"sphere_{scene.name}", title, f"{run} {words}{absent}", charts, ()), view="sphere")
