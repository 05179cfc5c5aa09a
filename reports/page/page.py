"""The page: one HTML file with everything in it, to be read by someone choosing an integrator.

It opens from disk without a network: style, scripts, libraries and all data stand in the file.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from itertools import chain
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from conservative.benchmarks.studies import long_runs, step_ladder

from ..charts import contrast
from ..charts.vega_embed import PageFigure
from ..tables import engine_tables, hard_cases, random_ratios, summary, throughput
from ..tables.cells import CONSERVED, SMALL, tolerance
from ..view import View
from . import engines, libraries, many_bodies, paper, random_bodies
from .figures import first, scene_figures
from .scene_charts import SceneCharts


def render(view: View, charts: Mapping[str, SceneCharts], of_engines: Mapping[str, Any], of_random: Any = None) -> str:
    """Return the page.

    `charts` are those of each scene by its name, `of_engines` the pictures of engines alike, `of_random` that of random bodies,
    if there is one.
    """
    figures = {scene.name: scene_figures(scene, charts[scene.name]) for scene in view.scenes}
    engine_figures = engines.figures(view.engines, of_engines)
    random_figure = random_bodies.figure(view.random, of_random) if view.random and of_random is not None else None
    many = many_bodies.chart(view.throughput)
    many_figure = many_bodies.figure(view.throughput, many) if view.throughput and many is not None else None
    first_figure, paper_figures = first(view.first, "first", view.about), paper.figures(view.paper)
    of_scenes = chain.from_iterable(figures.values())
    drawn = [first_figure, *of_scenes, *engine_figures.values(), *paper_figures, random_figure, many_figure]
    return _template().render(
        view=view,
        first_figure=first_figure,
        paper=paper_figures,
        caveat=summary.CAVEAT,
        class_terms=summary.TERMS,
        sample_terms=summary.SAMPLE_TERMS,
        samples=step_ladder.SAMPLES,
        hard_terms=hard_cases.TERMS,
        random_figure=random_figure,
        many_figure=many_figure,
        many_terms=throughput.TERMS,
        random_terms=random_ratios.TERMS,
        figures=figures,
        engine_figures=engine_figures,
        engine_terms=engine_tables.TERMS,
        conserved=tolerance(CONSERVED),
        small=tolerance(SMALL),
        durations=f"{long_runs.DURATIONS:g}",
        charts=libraries.pack(json.dumps(_charts(filter(None, drawn)), separators=(",", ":"))),
        libraries=libraries.packed(),
    )


def _template() -> Template:
    loader = PackageLoader("conservative.reports")
    environment = Environment(loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["whole"] = _whole
    environment.filters["narrow"] = _narrow
    return environment.get_template("page.html.j2")


def _whole(text: str) -> Markup:
    """Return a sentence in which no line ends within a number such as 1e-3, or between it and its unit; `this` is code."""
    whole = re.sub(r"[\d.]+e-\d+(?: rad)?", r'<span class="n">\g<0></span>', str(escape(text)))
    return Markup(re.sub(r"`(.+?)`", r"<code>\1</code>", whole))


def _narrow(name: str) -> Markup:
    """Return a name in which a line may end after each underscore, so that a narrow column has whole words."""
    return Markup(str(escape(name)).replace("_", "_<wbr>"))


def _charts(figures: Iterable[PageFigure]) -> dict[str, Any]:
    """Return what the page's script draws, and what stands for colours that cannot be seen well on a light or a dark page."""
    charts = {figure.name: figure.charts for figure in figures}
    found = contrast.colours_in(json.dumps(charts))
    papers = {"light": contrast.LIGHT_PAPER, "dark": contrast.DARK_PAPER}
    return {"figures": charts, "colours": {name: contrast.stand_ins(found, paper) for name, paper in papers.items()}}
