"""The picture of random bodies: the cheapest engine's time over ours against the error, a panel for each field."""

from __future__ import annotations

from typing import Any

import altair as alt
import pandas as pd

from .figures import log_channel
from .style import BLUE, GREY, HEIGHT, WIDTH, apply_style, power_axis

COLUMNS = 2
SHOWN = {"error": "attitude error, rad", "mean": "engine / ours, mean", "worst": "worst body", "best": "best body"}
"""What hovering over a point shows: fields and titles."""


def ratios(points: pd.DataFrame, bodies: int, seed: int) -> Any:
    """Return the ratios over errors from the points of a `RandomView`: mean, and a band from the worst body to the best."""
    lowest, highest = float(points["worst"].min()), float(points["best"].max())
    low, high = min(lowest, 0.9) / 1.1, max(highest, 1.1) * 1.1
    y = {"scale": alt.Scale(type="log", domain=[low, high], nice=False), "axis": power_axis("engine / ours", low, high)}
    panels = [_panel(part, str(field), y) for field, part in points.groupby("field", sort=False)]
    title = alt.Title(
        f"Random bodies: the cheapest engine's time over ours ({bodies} in each field, seed {seed})",
        subtitle="line: geometric mean; band: from the worst body to the best; above the dashed line ours is faster",
    )
    return apply_style(alt.concat(*panels, columns=COLUMNS, title=title))


def _panel(part: pd.DataFrame, field: str, y: dict[str, Any]) -> Any:
    x = alt.X(**log_channel("error", "largest attitude error, rad", part["error"]))
    base = alt.Chart(part, width=WIDTH - 60, height=HEIGHT - 60, title=field).encode(x=x)
    band = base.mark_area(color=BLUE, opacity=0.18).encode(y=alt.Y("worst:Q", **y), y2="best:Q")
    shown = [alt.Tooltip(f"{name}:Q", format=".3g", title=title) for name, title in SHOWN.items()]
    mark = base.mark_line(color=BLUE, strokeWidth=2, point=alt.OverlayMarkDef(color=BLUE, size=40))
    line = mark.encode(y=alt.Y("mean:Q", **y), tooltip=shown)
    even = alt.Chart(pd.DataFrame({"even": [1.0]})).mark_rule(color=GREY, strokeDash=[5, 3]).encode(y=alt.Y("even:Q", **y))
    return band + even + line
