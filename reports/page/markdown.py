"""The report as Markdown, with pictures beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from conservative.benchmarks.studies import long_runs, step_ladder
from conservative.deferred_imports import DEFAULT_METHOD

from ..charts import paper
from ..tables import engine_tables, hard_cases, random_bodies, summary, throughput
from ..tables.cells import CONSERVED, SMALL, markdown
from ..view import PaperView, View

Draw = Callable[[str, Any], str]
"""Draws a chart under a name, and returns the name of its file."""


def render(view: View, charts: Mapping[str, Any], draw: Draw) -> str:
    """Return report.md; `charts` are the pictures of `figures.charts`."""
    environment = Environment(
        loader=PackageLoader("conservative.reports"), undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False
    )
    environment.filters["table"] = markdown
    return environment.get_template("report.md.j2").render(
        view=view,
        random_terms=random_bodies.TERMS,
        many_terms=throughput.TERMS,
        pictures={name: draw(name, chart) for name, chart in charts.items()},
        default_method=DEFAULT_METHOD,
        durations=f"{long_runs.DURATIONS:g}",
        engine_terms=engine_tables.TERMS,
        class_terms=summary.TERMS,
        sample_terms=summary.SAMPLE_TERMS,
        samples=step_ladder.SAMPLES,
        caveat=summary.CAVEAT,
        hard_terms=hard_cases.TERMS,
        conserved=f"{CONSERVED:.0e}",
        small=f"{SMALL:.0e}",
        paper=list(_paper(view.paper, draw)),
    )


def _paper(view: PaperView, draw: Draw) -> Iterator[str]:
    """Yield the paper's figures that belong to the scenes of the report."""
    if len(view.body_rates):
        picture = draw("paper_figure_1", paper.figure_1(view.body_rates, view.conservation_errors))
        yield f"![Figure 1 of the paper: rates of the brick, errors of energy and momentum]({picture})"
    if len(view.centre_of_mass):
        picture = draw("paper_figure_2", paper.figure_2(view.centre_of_mass))
        yield f"![Figure 2 of the paper: centre of mass of the top]({picture})"
    if view.position_errors:
        yield "Error of the centre of mass of the top after one period of precession (the whole number of steps next to it):"
        yield markdown(view.position_errors)
