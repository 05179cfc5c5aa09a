"""The picture of many bodies: what one of them costs against how many there are, a panel for each kind and error."""

from __future__ import annotations

from typing import Any

import altair as alt
import pandas as pd

from ..document.cells import tolerance
from .figures import log_channel
from .style import HEIGHT, WIDTH, apply_style, colour_scale, dash_scale, families_of


def costs(points: pd.DataFrame) -> Any:
    """Return time against number of bodies from the points of a `ThroughputView`; columns are errors, rows kinds of bodies."""
    families = families_of(points)
    legend = alt.Legend(title="method", orient="bottom", columns=2, symbolSize=300)
    look = {
        "color": alt.Color("name:N", scale=colour_scale(families), sort=list(families), legend=legend),
        "strokeDash": alt.StrokeDash("name:N", scale=dash_scale(families), sort=list(families), legend=legend),
    }
    rows = [
        alt.hconcat(*(_panel(part, str(kind), error, points, look) for error, part in here.groupby("error", sort=False)))
        for kind, here in points.groupby("kind", sort=False)
    ]
    title = alt.Title("Many bodies: what one of them costs", subtitle="at equal error (median of the bodies); lower is better")
    return apply_style(alt.vconcat(*rows, title=title))


def _panel(part: pd.DataFrame, kind: str, error: Any, points: pd.DataFrame, look: dict[str, Any]) -> Any:
    x = alt.X(**log_channel("size", "number of bodies", points["size"]))
    y = alt.Y(**log_channel("time", "µs a body and simulated second", points["time"]))
    title = f"{kind.replace('_', ' ')}, {tolerance(error)} rad"
    base = alt.Chart(part, width=WIDTH - 130, height=HEIGHT - 20, title=title).encode(x=x, y=y, **look)
    shown = [alt.Tooltip("name:N"), alt.Tooltip("size:Q"), alt.Tooltip("time:Q", format=".3g")]
    marks = (
        alt.Chart(part)
        .mark_point(filled=True, size=30, opacity=1)
        .encode(x=x, y=y, color=look["color"].legend(None), tooltip=shown)
    )
    return base.mark_line(strokeWidth=1.6).encode(tooltip=shown) + marks
