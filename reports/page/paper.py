"""The paper's figures on the page: a chart for each of their panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..charts import paper, vega_embed
from ..charts.vega_embed import Entry, PageFigure
from ..view import PaperView

HEIGHT = 260


def figures(view: PaperView) -> tuple[PageFigure, ...]:
    """Return the figures that belong to the scenes of the report."""
    found = []
    if len(view.body_rates):
        words = (
            "The brick, disturbed by 1e-8, turns over again and again about its middle axis; signed errors of energy and |L|."
        )
        panels = paper.panels_1(view.body_rates, view.conservation_errors)
        found.append(_figure("paper_figure_1", "Figure 1 of the paper: body rates, energy and momentum", words, panels))
    if len(view.centre_of_mass):
        words = "The top's centre of mass for two steps, and exact; what the map keeps is in the tables of drift above."
        panels = paper.panels_2(view.centre_of_mass)
        found.append(_figure("paper_figure_2", "Figure 2 of the paper: centre of mass of the top", words, panels))
    return tuple(found)


def _figure(name: str, title: str, words: str, panels: Sequence[paper.Panel]) -> PageFigure:
    charts = tuple(_embedded(panel) for panel in panels)
    lines = {line: look for panel in panels for line, look in panel.lines.items()}
    legend = tuple(Entry(line, colour, "", dash) for line, (colour, dash) in lines.items())
    return PageFigure(name, title, words, charts, legend, "panels")


def _embedded(panel: paper.Panel) -> dict[str, Any]:
    shown = [(panel.line, "N", "line"), ("t", "Q", "t, s"), panel.value]
    (chart,) = vega_embed.embed(panel.chart, shown, HEIGHT)
    return chart | {"usermeta": {"name": panel.title}}
