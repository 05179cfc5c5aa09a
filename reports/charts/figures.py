"""Pictures of the measurements: error against time, drift over time, convergence. Tidy columns in, a chart out."""

from __future__ import annotations

from typing import Any

import altair as alt
import pandas as pd

from ..labels import without_tolerance
from ..tables.work_precision import front
from .style import BLACK, HEIGHT, WIDTH, colour_scale, dash_scale, power_axis, series_order, shape_scale, styled

FLOOR = 1e-17
"""What a logarithmic axis shows for an error of zero: below any round-off of a relative error in double precision."""


def log_channel(column: str, title: str, values: pd.Series[float]) -> dict[str, Any]:
    """Return field, scale and axis of a logarithmic channel."""
    positive = values[values > 0]
    low, high = (float(positive.min()) / 1.3, float(positive.max()) * 1.3) if len(positive) else (1e-1, 1.0)
    return {
        "shorthand": f"{column}:Q",
        "scale": alt.Scale(type="log", domain=[low, high], nice=False, clamp=True),
        "axis": power_axis(title, low, high),
    }


def _series_look(names: list[str], title: str) -> dict[str, Any]:
    """Return colour and mark of the lines, in one legend."""
    legend = alt.Legend(title=title, orient="right", columns=1, symbolOpacity=1)
    return {
        "color": alt.Color("series:N", scale=colour_scale(names), sort=names, legend=legend),
        "shape": alt.Shape("series:N", scale=shape_scale(names), sort=names, legend=legend),
    }


def work_precision(points: pd.DataFrame, scene: str) -> Any:
    """Return time against error for one scene, from `work_precision.points`; the Pareto front is the bold line."""
    data = points[points["scene"] == scene].assign(microseconds=lambda rows: rows["time"] * 1e6)
    names = series_order(data["series"])
    x = alt.X(**log_channel("error", "largest attitude error over the run, rad", data["error"]))
    y = alt.Y(**log_channel("microseconds", "wall time per simulated second, µs", data["microseconds"]))
    title = alt.Title(
        f"{scene}: time against error", subtitle="lower left is better; bold grey: the Pareto front of everything measured"
    )
    base = alt.Chart(data, width=2 * WIDTH - 180, height=2 * HEIGHT - 80, title=title).encode(x=x, y=y)
    best = alt.Chart(front(data)).mark_line(color=BLACK, opacity=0.22, strokeWidth=11, strokeCap="round", strokeJoin="round")
    lines = base.mark_line(strokeWidth=1.6).encode(
        color=_series_look(names, "method")["color"], detail="series:N", order="rank:Q"
    )
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(**_series_look(names, "method"))
    lines = lines.transform_window(rank="row_number()")
    return styled(best.encode(x=x, y=y, order="error:Q") + lines + marks)


def drift(drifts: pd.DataFrame, scene: str) -> Any:
    """Return the largest drift so far of each invariant over time, from `lines.drifts`, one panel an invariant.

    Of methods that differ in tolerance alone the loosest and the tightest are drawn.
    """
    data = _extremes(drifts[drifts["scene"] == scene]).assign(shown=lambda rows: rows["drift"].clip(lower=FLOOR))
    names = series_order(data["series"])
    return styled(alt.vconcat(*(_drift_panel(part, str(kind), names) for kind, part in data.groupby("quantity", sort=False))))


def _extremes(drifts: pd.DataFrame) -> pd.DataFrame:
    """Return drifts without the lines between the loosest and the tightest of several tolerances."""
    lines: dict[str, list[str]] = {}
    for name in drifts["series"].unique():
        lines.setdefault(without_tolerance(name), []).append(name)
    extremes = {name for names in lines.values() for name in (names[0], names[-1])}
    return drifts[drifts["series"].isin(extremes)]


def _drift_panel(data: pd.DataFrame, kind: str, names: list[str]) -> Any:
    y = alt.Y(**log_channel("shown", "largest so far, relative", data["shown"]))
    legend = alt.Legend(title="method", columns=1, symbolSize=300)
    return (
        alt.Chart(data, width=2 * WIDTH - 180, height=HEIGHT - 40, title=f"{data['scene'].iloc[0]}: drift of {kind}")
        .mark_line(strokeWidth=1.8, clip=True)
        .encode(
            x=alt.X("t:Q", title="t, s", scale=alt.Scale(nice=False)),
            y=y,
            color=alt.Color("series:N", scale=colour_scale(names), sort=names, legend=legend),
            strokeDash=alt.StrokeDash("series:N", scale=dash_scale(names), sort=names, legend=legend),
        )
    )


def convergence(errors: pd.DataFrame, fits: pd.DataFrame, scene: str) -> Any:
    """Return error against step for one scene, from `orders.errors` and `orders.fits`; the fits are the bold stretches."""
    slopes = fits[fits["scene"] == scene].set_index("series")["text"]
    data, lines = (_with_slopes(table[table["scene"] == scene], slopes) for table in (errors, fits))
    names = series_order(data["series"])
    x = alt.X(**log_channel("dt", "step, s", data["dt"]))
    y = alt.Y(**log_channel("error", "largest attitude error over the run, rad", data["error"]))
    look = _series_look(names, "method (observed order)")
    title = alt.Title(f"{scene}: convergence", subtitle="bold: the stretch that the order is fitted to, and the fit")
    base = alt.Chart(data, width=2 * WIDTH - 180, height=2 * HEIGHT - 80, title=title).encode(x=x, y=y, color=look["color"])
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(shape=look["shape"])
    bold = alt.Chart(_ends(lines)).mark_line(strokeWidth=6, opacity=0.35, strokeCap="round")
    return styled(bold.encode(x=x, y=y, color=look["color"]) + base.mark_line(strokeWidth=1.2) + marks)


def _with_slopes(table: pd.DataFrame, slopes: pd.Series[str]) -> pd.DataFrame:
    return table.assign(series=[f"{name} ({slopes[name]})" for name in table["series"]])


def _ends(fits: pd.DataFrame) -> pd.DataFrame:
    """Return the two ends of each fitted line as points."""
    ends = [fits.rename(columns={end: "dt", f"error_{end}": "error"})[["series", "dt", "error"]] for end in ("coarse", "fine")]
    return pd.concat(ends, ignore_index=True).dropna()
