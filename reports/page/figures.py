"""The pictures of a report, for report.md and its page, and the figures of the page: pictures with words about them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from conservative.benchmarks.studies import long_runs, step_ladder

from ..charts import engines, families, figures, paper, random_ratios, spheres, throughput, vega_embed
from ..charts.style import colours, families_of
from ..charts.vega_embed import PATHS, Entry, PageFigure
from ..tables.engine_scenes import EngineScene
from ..tables.families import under
from ..tables.summary import Summary
from ..view import PaperView, SceneView, View

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
    "kind": ("kind", "N", "taken"),
    "size": ("size", "Q", "number of bodies"),
    "time": ("time", "Q", "µs a body and simulated second"),
}
"""What hovering can show: field, kind, title."""
PAPER_HEIGHT = 260


def charts(view: View) -> dict[str, Any]:
    """Return the pictures of a report by the names of their files; report.md and the page share them."""
    found: dict[str, Any] = {}
    for scene in view.scenes:
        found[f"work_precision_{scene.name}"] = figures.work_precision(scene.points, scene.front, scene.name)
        found[f"drift_{scene.name}"] = figures.drift(scene.drifts, scene.name)
        found[f"convergence_{scene.name}"] = figures.convergence(scene.errors, scene.fit_ends, scene.name)
    for of_engines in view.engines:
        if len(of_engines.points):
            found[f"engines_{of_engines.name}"] = engines.work_precision(of_engines.points, of_engines.name)
    if view.random and not view.random.points.empty:
        found["random_bodies"] = random_ratios.ratios(view.random.points, view.random.bodies, view.random.seed)
    if view.throughput and not view.throughput.points.empty:
        found["many_bodies"] = throughput.costs(view.throughput.points)
    return found


def page_figures(view: View, pictures: dict[str, Any]) -> dict[str, PageFigure]:
    """Return the figures of the page by name, in its order; most are made of the same pictures as report.md."""
    found = [first(view.first, "first", view.about)]
    for scene in view.scenes:
        found.append(first(scene.summary, f"work_precision_{scene.name}", scene.name))
        found.append(drift(scene))
        found.append(convergence(scene, pictures[f"convergence_{scene.name}"]))
        if len(scene.curves):
            found.append(sphere(scene))
    found += [engine_figure(scene, pictures[f"engines_{scene.name}"]) for scene in view.engines if len(scene.points)]
    if view.random and "random_bodies" in pictures:
        band = "Line: geometric mean; band: from the worst body to the best; above the dashed line ours is faster."
        summary = f"Bodies in each field: {view.random.bodies}. {band}"
        panels = tuple(vega_embed.embed(pictures["random_bodies"], (), 220))
        found.append(
            PageFigure("random_bodies", "Random bodies: the cheapest engine's time over ours", summary, panels, (), "pairs")
        )
    if view.throughput and "many_bodies" in pictures:
        summary = "Time a body and simulated second at equal error, against the number of bodies; lower is better."
        panels = tuple(vega_embed.embed(pictures["many_bodies"], hover("size", "time"), 240))
        legend = vega_embed.legend(families_of(view.throughput.points), marks=False)
        found.append(PageFigure("many_bodies", "Many bodies: what one of them costs", summary, panels, legend, "panels"))
    return {figure.name: figure for figure in found}


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


def engine_figure(scene: EngineScene, picture: Any) -> PageFigure:
    """Return error against time of the engines of a scene."""
    count = scene.points["name"].nunique()
    summary = f"{len(scene.points)} measured runs of {count} engines; solid lines at their best, dashed ones as installed."
    title = f"{scene.name}: engines, wall time against attitude error"
    embedded = tuple(vega_embed.embed(picture, hover("kind", "setting", "error", "microseconds", "dt"), 520))
    entries = (Entry(name, colour, PATHS[mark], "") for name, (colour, mark) in engines.looks(scene.points["name"]).items())
    return PageFigure(f"engines_{scene.name}", title, summary, embedded, tuple(entries))


def paper_figures(view: PaperView) -> tuple[PageFigure, ...]:
    """Return the figures that belong to the scenes of the report."""
    found = []
    if len(view.body_rates):
        words = (
            "The brick, disturbed by 1e-8, turns over again and again about its middle axis; signed errors of energy and |L|."
        )
        panels = paper.panels_1(view.body_rates, view.conservation_errors)
        found.append(_paper_figure("paper_figure_1", "Figure 1 of the paper: body rates, energy and momentum", words, panels))
    if len(view.centre_of_mass):
        words = "The top's centre of mass for two steps, and exact; what the map keeps is in the tables of drift above."
        panels = paper.panels_2(view.centre_of_mass)
        found.append(_paper_figure("paper_figure_2", "Figure 2 of the paper: centre of mass of the top", words, panels))
    return tuple(found)


def _paper_figure(name: str, title: str, words: str, panels: Sequence[paper.Panel]) -> PageFigure:
    charts = tuple(_paper_panel(panel) for panel in panels)
    lines = {line: look for panel in panels for line, look in panel.lines.items()}
    legend = tuple(Entry(line, colour, "", dash) for line, (colour, dash) in lines.items())
    return PageFigure(name, title, words, charts, legend, "panels")


def _paper_panel(panel: paper.Panel) -> dict[str, Any]:
    shown = [(panel.line, "N", "line"), ("t", "Q", "t, s"), panel.value]
    (chart,) = vega_embed.embed(panel.chart, shown, PAPER_HEIGHT)
    return chart | {"usermeta": {"name": panel.title}}
