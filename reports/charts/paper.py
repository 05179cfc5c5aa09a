"""The paper's figures, drawn again."""

from __future__ import annotations

from typing import Any

import altair as alt
import pandas as pd

from conservative.benchmarks.studies.paper_figures import ENERGY, MOMENTUM, PAPER_MAP, RATES, REDUCED_MAP, X1, X2

from ..tables.lines import ANALYTICAL
from .style import BLACK, BLUE, HEIGHT, SKY, VERMILION, WIDTH, apply_style

_TIME = alt.X("t:Q", title="t, s", axis=alt.Axis(tickCount=7, labelFlush=False))


def figure_1(rates: pd.DataFrame, errors: pd.DataFrame) -> Any:
    """Return figure 1: (a) body rates with the reversals, (b) error of energy, (c) of |L|; see `lines` for the columns."""
    b = _error_panel(errors, ENERGY, "(b) Energy", "relative error of energy")
    c = _error_panel(errors, MOMENTUM, "(c) Length of the angular momentum", "relative error of |L|")
    return apply_style(alt.hconcat(_rates_panel(rates), alt.vconcat(b, c)).resolve_scale(color="independent"))


def _rates_panel(rates: pd.DataFrame) -> Any:
    names = list(RATES)
    colour = alt.Color("component:N", scale=alt.Scale(domain=names, range=[VERMILION, SKY, BLACK]), legend=None)
    base = alt.Chart(rates, width=WIDTH, height=2 * HEIGHT - 80, title="(a) Body rates of the brick, Δt = 0.01 s, ε = 1e-8")
    lines = base.mark_line(strokeWidth=1.8).encode(x=_TIME, y=alt.Y("rate:Q", title="rate, rad/s, body axes"), color=colour)
    ends = rates.loc[rates.groupby("component")["t"].idxmax()]
    labels = alt.Chart(ends).mark_text(align="left", dx=5, fontSize=12, fontWeight="bold")
    return lines + labels.encode(x="t:Q", y=alt.Y("rate:Q", stack=None), text="component:N", color=colour)


def _error_panel(errors: pd.DataFrame, column: str, title: str, axis: str) -> Any:
    names = [PAPER_MAP, REDUCED_MAP]
    legend = alt.Legend(title=None, orient="bottom", symbolSize=300)
    colour = alt.Color("method:N", scale=alt.Scale(domain=names, range=[SKY, BLUE]), legend=legend)
    y = alt.Y(f"{column}:Q", title=axis, axis=alt.Axis(format=".1e", tickCount=5, minExtent=55))
    chart = alt.Chart(errors, width=WIDTH, height=HEIGHT - 80, title=f"{title}, Δt = 0.01 s, ε = 1e-8")
    return chart.mark_line(strokeWidth=1.2).encode(x=_TIME, y=y, color=colour)


def figure_2(positions: pd.DataFrame) -> Any:
    """Return figure 2: (b), (c), the coordinates x1 and x2 of the top's centre of mass for two steps, and exact."""
    panels = [_position_panel(positions, X1, "(b)"), _position_panel(positions, X2, "(c)")]
    return apply_style(alt.hconcat(*panels))


def _position_panel(positions: pd.DataFrame, coordinate: str, letter: str) -> Any:
    runs = [*(name for name in positions["run"].unique() if name != ANALYTICAL), ANALYTICAL]
    look = alt.Legend(title=None, orient="bottom", symbolSize=300)
    colour = alt.Color("run:N", scale=alt.Scale(domain=runs, range=[SKY, BLUE, BLACK]), legend=look, sort=runs)
    dash = alt.StrokeDash("run:N", scale=alt.Scale(domain=runs, range=[[1, 0], [8, 4], [2, 2]]), legend=look, sort=runs)
    y = alt.Y(f"{coordinate}:Q", title=f"{coordinate}, m")
    chart = alt.Chart(positions, width=WIDTH, height=HEIGHT, title=f"{letter} Centre of mass of the top, {coordinate}")
    return chart.mark_line(strokeWidth=1.8).encode(x=_TIME, y=y, color=colour, strokeDash=dash)
