"""The page: one HTML file with everything in it, to be read by someone choosing an integrator.

It opens from disk without a network: style, scripts, libraries and all data stand in the file.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from conservative.benchmarks.studies import long_runs, step_ladder

from ..charts import contrast
from ..charts.vega_embed import PageFigure
from ..tables import engine_tables, hard_cases, random_bodies, summary, throughput
from ..tables.cells import CONSERVED, SMALL, tolerance
from ..view import View
from . import libraries
from .figures import page_figures, paper_figures


def render(view: View, charts: dict[str, Any]) -> str:
    """Return the page; `charts` are the pictures of `figures.charts`."""
    figures, paper = page_figures(view, charts), paper_figures(view.paper)
    return _template().render(
        view=view,
        paper=paper,
        caveat=summary.CAVEAT,
        class_terms=summary.TERMS,
        sample_terms=summary.SAMPLE_TERMS,
        samples=step_ladder.SAMPLES,
        hard_terms=hard_cases.TERMS,
        many_terms=throughput.TERMS,
        random_terms=random_bodies.TERMS,
        figures=figures,
        engine_terms=engine_tables.TERMS,
        conserved=tolerance(CONSERVED),
        small=tolerance(SMALL),
        durations=f"{long_runs.DURATIONS:g}",
        charts=libraries.pack(json.dumps(_charts([*figures.values(), *paper]), separators=(",", ":"))),
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
