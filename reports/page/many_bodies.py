"""The section of many bodies: its picture, for the page and beside report.md."""

from __future__ import annotations

from typing import Any

from ..charts import throughput, vega_embed
from ..charts.style import families_of
from ..charts.vega_embed import PageFigure
from ..tables.throughput import ThroughputView

NAME = "many_bodies"
"""Of the picture's file, and of its figure on the page."""
HOVER = [
    ("name", "N", "method"),
    ("size", "Q", "number of bodies"),
    ("time", "Q", "µs a body and simulated second"),
]
"""What hovering over a point shows: field, kind, title."""


def chart(view: ThroughputView | None) -> Any:
    """Return the picture; None where nothing was measured."""
    return None if view is None or view.points.empty else throughput.costs(view.points)


def figure(view: ThroughputView, picture: Any) -> PageFigure:
    """Return the figure of the page, made of the same picture."""
    summary = "Time a body and simulated second at equal error, against the number of bodies; lower is better."
    charts = tuple(vega_embed.embed(picture, HOVER, 240))
    legend = vega_embed.legend(families_of(view.points), marks=False)
    return PageFigure(NAME, "Many bodies: what one of them costs", summary, charts, legend, "panels")
