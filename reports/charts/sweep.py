"""The picture of a sweep."""

from __future__ import annotations

import vl_convert

from conservative.integration.ensemble import Ensemble

from .style import apply_style


def svg(ensemble: Ensemble) -> str:
    """Return the distributions of an ensemble as SVG."""
    return str(vl_convert.vegalite_to_svg(apply_style(ensemble.plot()).to_dict()))
