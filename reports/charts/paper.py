"""The paper's figures, drawn again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import altair as alt
import pandas as pd

from conservative.benchmarks.studies.paper_figures import ENERGY, MOMENTUM, PAPER_MAP, RATES, REDUCED_MAP, X1, X2

from ..document.model import LegendEntry
from ..rows.lines import ANALYTICAL
from . import vega_embed
from .style import BLACK, BLUE, HEIGHT, SKY, VERMILION, WIDTH, apply_style

_TIME = alt.X("t:Q", title="t, s", axis=alt.Axis(tickCount=7, labelFlush=False))


class Panel(NamedTuple):
    """A panel for itself: its chart, what its lines are told by, what hovering shows, and the colour and dash of each line."""

    title: str
    chart: Any
    line: str
    value: tuple[str, str, str]
    lines: Mapping[str, tuple[str, str]]


PANEL_HEIGHT = 260


def embed(panels: Sequence[Panel]) -> tuple[list[vega_embed.Spec], list[LegendEntry]]:
    """Return panels and their legend as the page draws them."""
    charts = []
    for panel in panels:
        shown = [(panel.line, "N", "line"), ("t", "Q", "t, s"), panel.value]
        (chart,) = vega_embed.embed(panel.chart, shown, PANEL_HEIGHT)
        charts.append(chart | {"usermeta": {"name": panel.title}})
    lines = {line: look for panel in panels for line, look in panel.lines.items()}
    return charts, [LegendEntry(line, colour, "", dash) for line, (colour, dash) in lines.items()]


def panels_1(rates: pd.DataFrame, errors: pd.DataFrame) -> tuple[Panel, ...]:
    """Return the panels of figure 1."""
    found = [Panel("(a) body rates, rad/s", _rates(rates), "component", ("rate", "Q", "rad/s"), _looks(_RATES))]
    for letter, column, title in (("b", ENERGY, "relative error of energy"), ("c", MOMENTUM, "relative error of |L|")):
        chart = _errors(errors, column, title)
        found.append(Panel(f"({letter}) {title}", chart, "method", (column, "Q", "relative error"), _looks(_MAPS)))
    return tuple(found)


def panels_2(positions: pd.DataFrame) -> tuple[Panel, ...]:
    """Return the panels of figure 2."""
    looks = {run: (colour, dash) for run, colour, dash in zip(_runs(positions), _COLOURS, _DASHES, strict=False)}
    lines = {run: (colour, " ".join(map(str, dash))) for run, (colour, dash) in looks.items()}
    return tuple(
        Panel(f"({letter}) {x}, m", _positions(positions, x), "run", (x, "Q", f"{x}, m"), lines)
        for letter, x in (("b", X1), ("c", X2))
    )


_RATES = dict(zip(RATES, (VERMILION, SKY, BLACK), strict=True))
_MAPS = {PAPER_MAP: SKY, REDUCED_MAP: BLUE}
_COLOURS, _DASHES = (SKY, BLUE, BLACK), ([1, 0], [8, 4], [2, 2])


def _looks(colours: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    return {line: (colour, "1 0") for line, colour in colours.items()}


def _runs(positions: pd.DataFrame) -> list[str]:
    return [*(str(name) for name in positions["run"].unique() if name != ANALYTICAL), ANALYTICAL]


def figure_1(rates: pd.DataFrame, errors: pd.DataFrame) -> Any:
    """Return figure 1: (a) body rates with the reversals, (b) error of energy, (c) of |L|; see `lines` for the columns."""
    b = _errors(errors, ENERGY, "relative error of energy", "(b) Energy, Δt = 0.01 s, ε = 1e-8")
    c = _errors(errors, MOMENTUM, "relative error of |L|", "(c) Length of the angular momentum, Δt = 0.01 s, ε = 1e-8")
    return apply_style(alt.hconcat(_rates_panel(rates), alt.vconcat(b, c)).resolve_scale(color="independent"))


_COMPONENT = alt.Color("component:N", scale=alt.Scale(domain=list(_RATES), range=list(_RATES.values())), legend=None)


def _rates(rates: pd.DataFrame) -> Any:
    base = alt.Chart(rates, width=WIDTH, height=2 * HEIGHT - 80, title="(a) Body rates of the brick, Δt = 0.01 s, ε = 1e-8")
    y = alt.Y("rate:Q", title="rate, rad/s, body axes")
    return base.mark_line(strokeWidth=1.8).encode(x=_TIME, y=y, color=_COMPONENT)


def _rates_panel(rates: pd.DataFrame) -> Any:
    ends = rates.loc[rates.groupby("component")["t"].idxmax()]
    labels = alt.Chart(ends).mark_text(align="left", dx=5, fontSize=12, fontWeight="bold")
    return _rates(rates) + labels.encode(x="t:Q", y=alt.Y("rate:Q", stack=None), text="component:N", color=_COMPONENT)


def _errors(errors: pd.DataFrame, column: str, axis: str, title: str = "") -> Any:
    legend = alt.Legend(title=None, orient="bottom", symbolSize=300)
    colour = alt.Color("method:N", scale=alt.Scale(domain=list(_MAPS), range=list(_MAPS.values())), legend=legend)
    y = alt.Y(f"{column}:Q", title=axis, axis=alt.Axis(format=".1e", tickCount=5, minExtent=55))
    chart = alt.Chart(errors, width=WIDTH, height=HEIGHT - 80, title=title)
    return chart.mark_line(strokeWidth=1.2).encode(x=_TIME, y=y, color=colour)


def figure_2(positions: pd.DataFrame) -> Any:
    """Return figure 2: (b), (c), the coordinates x1 and x2 of the top's centre of mass for two steps, and exact."""
    panels = [_positions(positions, x, f"({letter}) Centre of mass of the top, {x}") for letter, x in (("b", X1), ("c", X2))]
    return apply_style(alt.hconcat(*panels))


def _positions(positions: pd.DataFrame, coordinate: str, title: str = "") -> Any:
    runs = _runs(positions)
    look = alt.Legend(title=None, orient="bottom", symbolSize=300)
    colour = alt.Color("run:N", scale=alt.Scale(domain=runs, range=list(_COLOURS)), legend=look, sort=runs)
    dash = alt.StrokeDash("run:N", scale=alt.Scale(domain=runs, range=list(_DASHES)), legend=look, sort=runs)
    y = alt.Y(f"{coordinate}:Q", title=f"{coordinate}, m")
    chart = alt.Chart(positions, width=WIDTH, height=HEIGHT, title=title)
    return chart.mark_line(strokeWidth=1.8).encode(x=_TIME, y=y, color=colour, strokeDash=dash)
