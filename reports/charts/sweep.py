"""The picture of a sweep."""

from __future__ import annotations

from conservative.integration.ensemble import Ensemble

from .style import apply_style, svg_text


def svg(ensemble: Ensemble) -> str:
    """Return the distributions of an ensemble as SVG."""
    return svg_text(apply_style(ensemble.plot()))
