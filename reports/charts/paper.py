"""The paper's figures, drawn again."""

from __future__ import annotations

from typing import Any

import altair as alt
import pandas as pd

from conservative.benchmarks.studies.paper_figures import ENERGY, MOMENTUM, PAPER_MAP, RATES, REDUCED_MAP, X1, X2

from ..document.model import LegendEntry
from ..rows.lines import ANALYTICAL
from . import vega_embed
from .style import HEIGHT, PALETTE, WIDTH, apply_style, scale

PANEL_HEIGHT = 260
_TIME = alt.X("t:Q", title="t, s", axis=alt.Axis(tickCount=7, labelFlush=False))
_RATE_COLOURS = {rate: PALETTE[name] for rate, name in zip(RATES, ("vermilion", "sky", "black"), strict=True)}
_MAP_COLOURS = {PAPER_MAP: PALETTE["sky"], REDUCED_MAP: PALETTE["blue"]}
_RUN_LOOKS = ((PALETTE["sky"], [1, 0]), (PALETTE["blue"], [8, 4]), (PALETTE["black"], [2, 2]))


Drawn = tuple[Any, list[vega_embed.Spec], list[LegendEntry]]
"""The picture of a figure, and its panels and legend on the page."""


def figure_1(rates: pd.DataFrame, errors: pd.DataFrame) -> Drawn:
    """Return figure 1: (a) body rates with the reversals, (b) error of energy, (c) of |L|; see `lines` for the columns."""
    ends = rates.loc[rates.groupby("component")["t"].idxmax()]
    colour = alt.Color("component:N", scale=scale(_RATE_COLOURS), legend=None)
    title = "(a) Body rates of the brick, Δt = 0.01 s, ε = 1e-8"
    base = alt.Chart(rates, width=WIDTH, height=2 * HEIGHT - 80, title=title)
    lines = base.mark_line(strokeWidth=1.8).encode(x=_TIME, y=alt.Y("rate:Q", title="rate, rad/s, body axes"), color=colour)
    labels = alt.Chart(ends).mark_text(align="left", dx=5, fontSize=12, fontWeight="bold")
    a = lines + labels.encode(x="t:Q", y=alt.Y("rate:Q", stack=None), text="component:N", color=colour)
    b = _errors(errors, ENERGY, "relative error of energy", "(b) Energy, Δt = 0.01 s, ε = 1e-8")
    c = _errors(errors, MOMENTUM, "relative error of |L|", "(c) Length of the angular momentum, Δt = 0.01 s, ε = 1e-8")
    picture = apply_style(alt.hconcat(a, alt.vconcat(b, c)).resolve_scale(color="independent"))
    shown: list[vega_embed.Shown] = [
        ("component", "N", "rate"), ("method", "N", "method"), ("t", "Q", "t, s"), ("rate", "Q", "rad/s"),
        (ENERGY, "Q", "relative error of energy"), (MOMENTUM, "Q", "relative error of |L|"),
    ]  # fmt: skip
    legend = [LegendEntry(name, shade, "", "1 0") for name, shade in (_RATE_COLOURS | _MAP_COLOURS).items()]
    return picture, vega_embed.embed(picture, shown, PANEL_HEIGHT), legend


def _errors(errors: pd.DataFrame, column: str, axis: str, title: str) -> Any:
    legend = alt.Legend(title=None, orient="bottom", symbolSize=300)
    y = alt.Y(f"{column}:Q", title=axis, axis=alt.Axis(format=".1e", tickCount=5, minExtent=55))
    chart = alt.Chart(errors, width=WIDTH, height=HEIGHT - 80, title=title).mark_line(strokeWidth=1.2)
    return chart.encode(x=_TIME, y=y, color=alt.Color("method:N", scale=scale(_MAP_COLOURS), legend=legend))


def figure_2(positions: pd.DataFrame) -> Drawn:
    """Return figure 2: (b), (c), the coordinates x1 and x2 of the top's centre of mass for two steps, and exact."""
    runs = [*(str(name) for name in positions["run"].unique() if name != ANALYTICAL), ANALYTICAL]
    legend = alt.Legend(title=None, orient="bottom", symbolSize=300)
    colours, dashes = (alt.Scale(domain=runs, range=[look[part] for look in _RUN_LOOKS]) for part in (0, 1))
    look = {
        "color": alt.Color("run:N", scale=colours, legend=legend, sort=runs),
        "strokeDash": alt.StrokeDash("run:N", scale=dashes, legend=legend, sort=runs),
    }
    panels = [
        alt.Chart(positions, width=WIDTH, height=HEIGHT, title=f"({letter}) Centre of mass of the top, {coordinate}")
        .mark_line(strokeWidth=1.8)
        .encode(x=_TIME, y=alt.Y(f"{coordinate}:Q", title=f"{coordinate}, m"), **look)
        for letter, coordinate in (("b", X1), ("c", X2))
    ]
    picture = apply_style(alt.hconcat(*panels))
    shown: list[vega_embed.Shown] = [("run", "N", "line"), ("t", "Q", "t, s"), (X1, "Q", f"{X1}, m"), (X2, "Q", f"{X2}, m")]
    looks = zip(runs, _RUN_LOOKS, strict=False)
    entries = [LegendEntry(run, colour, "", " ".join(map(str, dash))) for run, (colour, dash) in looks]
    return picture, vega_embed.embed(picture, shown, PANEL_HEIGHT), entries
