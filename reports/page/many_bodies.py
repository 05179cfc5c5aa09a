"""The section of many bodies: its picture, for the page and beside report.md."""

from __future__ import annotations

from typing import Any

from ..charts import throughput, vega_embed
from ..charts.vega_embed import PageFigure
from ..tables.throughput import ThroughputView

NAME = "many_bodies"
"""Of the picture's file, and of its figure on the page."""


def chart(view: ThroughputView | None) -> Any:
    """Return the picture; None where nothing was measured."""
    return None if view is None or view.points.empty else throughput.costs(view.points)


def figure(picture: Any) -> PageFigure:
    """Return the figure of the page, made of the same picture."""
    summary = "Time a body and simulated second at equal error, against the number of bodies; lower is better."
    return PageFigure(NAME, "Many bodies: what one of them costs", summary, tuple(vega_embed.embed(picture, (), 220)), ())
