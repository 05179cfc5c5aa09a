"""The picture of engines: error against time, a line for each engine at its best, a dashed one for it as installed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import altair as alt
import pandas as pd

from .figures import log_channel
from .style import (
    BLUE,
    GREEN,
    HEIGHT,
    INDIGO,
    OLIVE,
    ORANGE,
    PURPLE,
    SHAPES,
    SKY,
    TEAL,
    VERMILION,
    WIDTH,
    WINE,
    apply_style,
)

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, INDIGO, SKY, WINE, OLIVE, TEAL)
"""Ten colours; with the eight marks they make 40 looks, as many as engines that anybody tells apart."""
KINDS = ("at its best", "as installed")
SOLID, DASHED = [1, 0], [5, 3]

Look = tuple[str, str]
"""Colour and mark of an engine."""


def looks(names: Iterable[str]) -> Mapping[str, Look]:
    """Return colour and mark of each engine, in the order of the legend, which is that of their names."""
    ordered = sorted(set(names), key=str.lower)
    return {name: (COLOURS[i % len(COLOURS)], SHAPES[i % len(SHAPES)]) for i, name in enumerate(ordered)}


def work_precision(points: pd.DataFrame, scene: str) -> Any:
    """Return time against error, from the points of an `EngineScene`."""
    data = points.assign(microseconds=points["time"] * 1e6)
    x = alt.X(**log_channel("error", "largest attitude error over the run, rad", data["error"]))
    y = alt.Y(**log_channel("microseconds", "wall time per simulated second, µs", data["microseconds"]))
    subtitle = "lower left is better; solid: at its best, dashed: as installed; runs less than 1 rad off"
    title = alt.Title(f"{scene}: engines, time against error", subtitle=subtitle)
    base = alt.Chart(data, width=2 * WIDTH - 180, height=2 * HEIGHT - 80, title=title).encode(x=x, y=y, **_look(data))
    lines = base.mark_line(strokeWidth=1.6).encode(detail="setting:N", order="rank:Q", strokeDash=_dash())
    lines = lines.transform_window(rank="row_number()")
    return apply_style(lines + base.mark_point(filled=True, size=48, opacity=1))


def _look(data: pd.DataFrame) -> dict[str, Any]:
    found = looks(data["name"])
    colours, marks = ([look[part] for look in found.values()] for part in (0, 1))
    legend = alt.Legend(title="engine", orient="right", columns=1, symbolOpacity=1)
    return {
        "color": alt.Color("name:N", scale=alt.Scale(domain=list(found), range=colours), sort=list(found), legend=legend),
        "shape": alt.Shape("name:N", scale=alt.Scale(domain=list(found), range=marks), sort=list(found), legend=legend),
    }


def _dash() -> alt.StrokeDash:
    return alt.StrokeDash("kind:N", scale=alt.Scale(domain=list(KINDS), range=[SOLID, DASHED]), legend=None)
