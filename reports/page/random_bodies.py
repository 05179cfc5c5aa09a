"""The part of the first section that shows random bodies: its picture, for the page and beside report.md."""

from __future__ import annotations

from typing import Any

from ..charts import random_ratios, vega_embed
from ..charts.vega_embed import PageFigure
from ..tables.random_ratios import RandomView

NAME = "random_bodies"
"""Of the picture's file, and of its figure on the page."""


def chart(view: RandomView | None) -> Any:
    """Return the picture; None where nothing could be compared."""
    return None if view is None or view.points.empty else random_ratios.ratios(view.points, view.bodies, view.seed)


def figure(view: RandomView, picture: Any) -> PageFigure:
    """Return the figure of the page, made of the same picture."""
    title = "Random bodies: the cheapest engine's time over ours"
    band = "Line: geometric mean; band: from the worst body to the best; above the dashed line ours is faster."
    summary = f"Bodies in each field: {view.bodies}. {band}"
    return PageFigure(NAME, title, summary, tuple(vega_embed.embed(picture, (), 220)), (), "pairs")
