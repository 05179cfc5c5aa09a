"""The page: one HTML file with everything in it, to be read by someone choosing an integrator.

It opens from disk without a network: style, scripts, the Vega libraries and all data stand in the file.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import pandas as pd

from conservative.benchmarks.studies import long_runs
from conservative.scene import Scene

from ..charts import figures, spheres, vega_embed
from ..charts.style import BLACK, BLUE, INDIGO, OLIVE, VERMILION, WINE
from ..charts.vega_embed import Figure, Spec
from ..run.provenance import Provenance
from ..tables import claims, headline, orders, overview, tables, work_precision
from ..tables.overview import Cells
from ..tables.tables import Table

if TYPE_CHECKING:
    from ..document import Measured, Plan

DARK = {BLACK: "#FFFFFF", BLUE: "#4CA6E8", INDIGO: "#9A8CFF", WINE: "#E07BA8", OLIVE: "#C2C25A", VERMILION: "#FF7F32"}
"""Colours that are too dark on a dark page, and what stands for them there."""
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


@dataclass(frozen=True)
class SceneParts:
    """What the page has of one scene."""

    name: str
    source: str
    t_end: str
    dt: str
    work_precision: Figure
    contests: Table
    drift: Figure
    conservation: Cells
    convergence: Figure
    order: Table
    accuracy: Table
    spheres: Figure


def render(made: Plan, measured: Measured, source: Provenance) -> str:
    """Return the page; from measurements alone."""
    points = work_precision.points(measured.table)
    curves = spheres.curves(measured.samples)
    parts = [_scene(scene, made, measured, points, curves) for scene in made.scenes]
    table = measured.table
    return _template().render(
        made=source,
        quick=made.quick,
        others=[f"{name} {version}" for name, version in source.packages.items() if name not in source.compared],
        errors=", ".join(f"{error:.0e}" for error in overview.ERRORS),
        kept=f"{overview.KEPT:.0e}",
        small=f"{overview.SMALL:.0e}",
        durations=f"{long_runs.DURATIONS:g}",
        verdict=overview.verdict(table, points),
        sentences=headline.lines(work_precision.contests(points)),
        scenes=parts,
        hard_cases=overview.hard_cases(table),
        stability=overview.stability(table),
        once=list(overview.costs_paid_once(table)),
        imports=overview.imports(table),
        audit=claims.as_cells(claims.findings(table, made.scenes)),
        truths=tables.truths(table),
        failures=tables.failures(table),
        unsupported=tables.unsupported(table),
        charts=_in_script({"figures": {figure.name: figure.charts for figure in _figures(parts)}, "dark": DARK}),
        vega=_vega(),
    )


def _template() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("conservative.reports")
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("page.html.j2")


@cache
def _vega() -> str:
    """Return Vega, Vega-Lite and Vega-Embed as one script."""
    import vl_convert

    return str(vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;")).replace("</script", "<\\/script")


def _in_script(content: Any) -> str:
    """Return JSON that can stand in a script element."""
    return json.dumps(content, separators=(",", ":"), ensure_ascii=False).replace("</", "<\\/")


def _figures(parts: Sequence[SceneParts]) -> Iterator[Figure]:
    for part in parts:
        yield from (part.work_precision, part.drift, part.convergence, part.spheres)


def _scene(scene: Scene, made: Plan, measured: Measured, points: pd.DataFrame, curves: pd.DataFrame) -> SceneParts:
    table, name = measured.table, scene.name
    return SceneParts(
        name=name,
        source=scene.source,
        t_end=f"{scene.t_end:g}",
        dt=f"{scene.dt:g}",
        work_precision=_work_precision(points, name),
        contests=tables.contests([contest for contest in work_precision.contests(points) if contest.scene == name]),
        drift=_drift(tables.drift_samples(measured.samples), name),
        conservation=overview.conservation(table, name),
        convergence=_convergence(table, name),
        order=tables.order(table, name),
        accuracy=tables.accuracy(table, name),
        spheres=_spheres(curves, scene, spheres.absent(curves, name, made.methods)),
    )


def _hovering(*names: str) -> list[tuple[str, str, str]]:
    return [NUMBERS[name] for name in ("series", *names)]


def _work_precision(points: pd.DataFrame, scene: str) -> Figure:
    data = points[points["scene"] == scene]
    names = ", ".join(dict.fromkeys(work_precision.front(data)["series"])) or "nobody"
    summary = f"{len(data)} measured points of {data['series'].nunique()} lines. On the Pareto front, cheap to dear: {names}."
    title = f"{scene}: wall time against attitude error, both logarithmic"
    charts = vega_embed.embedded(figures.work_precision(points, scene), _hovering("method", "error", "microseconds", "dt"), 520)
    return _figure(f"work_precision_{scene}", title, summary, charts, marks=True)


def _drift(samples: pd.DataFrame, scene: str) -> Figure:
    rows = samples[samples["scene"] == scene]
    every = max(1, long_runs.SAMPLES // DRIFT_SAMPLES)
    thin = rows[rows.groupby(["series", "invariant"], sort=False).cumcount(ascending=False) % every == 0]
    summary = "Each quantity has a panel: a level line stays, a rising one drifts. The table below says how far each goes."
    charts = vega_embed.embedded(figures.drift(thin, scene), _hovering("t", "drift"), 220)
    return _figure(f"drift_{scene}", f"{scene}: drift over time", summary, charts, marks=False)


def _convergence(table: pd.DataFrame, scene: str) -> Figure:
    errors = orders.errors(table)
    chart = figures.convergence(errors, orders.fits(errors), scene)
    charts = vega_embed.embedded(chart, _hovering("dt", "error"), 520)
    summary = "In brackets the fitted slope with its standard error; the bold stretch is what it is fitted to."
    return _figure(f"convergence_{scene}", f"{scene}: attitude error against step", summary, charts, marks=True)


def _figure(name: str, title: str, summary: str, charts: list[Spec], marks: bool) -> Figure:
    return Figure(name, title, summary, tuple(charts), vega_embed.legend(vega_embed.lines(charts), marks))


def _spheres(curves: pd.DataFrame, scene: Scene, absent: list[str]) -> Figure:
    names = curves[curves["scene"] == scene.name]["series"].unique()
    what = (
        "The angular momentum in body axes. The exact one is closed: a drift makes it a band, or leaves the sphere."
        if scene.free
        else "The axis in space. A band wider than the exact one tells of a long step, a wandering one of drift."
    )
    run = f"At the scene's own step, over {long_runs.DURATIONS:g} durations."
    kind = "polhode on the momentum sphere" if scene.free else "trace of the axis on the unit sphere"
    missing = f" Not drawn, as they fail or cannot do the scene: {', '.join(absent)}." if absent else ""
    charts = tuple(spheres.chart(curves, scene.name, str(name)) for name in names)
    return replace(Figure(f"sphere_{scene.name}", f"{scene.name}: {kind}", f"{run} {what}{missing}", charts, ()), view="sphere")
