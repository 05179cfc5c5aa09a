"""Pictures of the measurements of a scene: error against time, drift over time, convergence. Tidy columns in, a chart out."""

from __future__ import annotations

from typing import Any

import altair as alt
import pandas as pd

from .style import BLACK, HEIGHT, WIDTH, Families, apply_style, colour_scale, dash_scale, families_of, power_axis, shape_scale

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


def _line_look(families: Families, title: str) -> dict[str, Any]:
    """Return colour and mark of the lines, in one legend."""
    legend = alt.Legend(title=title, orient="right", columns=1, symbolOpacity=1)
    return {
        "color": alt.Color("name:N", scale=colour_scale(families), sort=list(families), legend=legend),
        "shape": alt.Shape("name:N", scale=shape_scale(families), sort=list(families), legend=legend),
    }


def work_precision(points: pd.DataFrame, front: pd.DataFrame, scene: str) -> Any:
    """Return time against error, from `rows.points` of a scene and their `front`, which is the bold line."""
    data, best_points = (rows.assign(microseconds=rows["time"] * 1e6) for rows in (points, front))
    look = _line_look(families_of(data), "method")
    x = alt.X(**log_channel("error", "largest attitude error over the run, rad", data["error"]))
    y = alt.Y(**log_channel("microseconds", "wall time per simulated second, µs", data["microseconds"]))
    title = alt.Title(
        f"{scene}: time against error",
        subtitle="lower left is better; bold grey: fastest at each error, without closed forms",
    )
    base = alt.Chart(data, width=2 * WIDTH - 180, height=2 * HEIGHT - 80, title=title).encode(x=x, y=y)
    best = alt.Chart(best_points).mark_line(color=BLACK, opacity=0.22, strokeWidth=11, strokeCap="round", strokeJoin="round")
    lines = base.mark_line(strokeWidth=1.6).encode(color=look["color"], detail="name:N", order="rank:Q")
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(**look)
    lines = lines.transform_window(rank="row_number()")
    return apply_style(best.encode(x=x, y=y, order="error:Q") + lines + marks)


def drift(drifts: pd.DataFrame, scene: str) -> Any:
    """Return the largest drift so far of each invariant over time, from `lines.drifts` of a scene, one panel an invariant."""
    data = drifts.assign(shown=drifts["drift"].clip(lower=FLOOR))
    families = families_of(data)
    panels = [_drift_panel(part, f"{scene}: drift of {kind}", families) for kind, part in data.groupby("quantity", sort=False)]
    return apply_style(alt.vconcat(*panels))


def _drift_panel(data: pd.DataFrame, title: str, families: Families) -> Any:
    y = alt.Y(**log_channel("shown", "largest so far, relative", data["shown"]))
    legend = alt.Legend(title="method", columns=1, symbolSize=300)
    return (
        alt.Chart(data, width=2 * WIDTH - 180, height=HEIGHT - 40, title=title)
        .mark_line(strokeWidth=1.8, clip=True)
        .encode(
            x=alt.X("t:Q", title="t, s", scale=alt.Scale(nice=False)),
            y=y,
            color=alt.Color("name:N", scale=colour_scale(families), sort=list(families), legend=legend),
            strokeDash=alt.StrokeDash("name:N", scale=dash_scale(families), sort=list(families), legend=legend),
        )
    )


def convergence(errors: pd.DataFrame, fit_ends: pd.DataFrame, scene: str) -> Any:
    """Return error against step, from `lines.errors` of a scene and `lines.fit_ends`; the fits are the bold stretches."""
    x = alt.X(**log_channel("dt", "step, s", errors["dt"]))
    y = alt.Y(**log_channel("error", "largest attitude error over the run, rad", errors["error"]))
    look = _line_look(families_of(errors), "method (observed order)")
    title = alt.Title(f"{scene}: convergence", subtitle="bold: the stretch that the order is fitted to, and the fit")
    base = alt.Chart(errors, width=2 * WIDTH - 180, height=2 * HEIGHT - 80, title=title).encode(x=x, y=y, color=look["color"])
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(shape=look["shape"])
    bold = alt.Chart(fit_ends).mark_line(strokeWidth=6, opacity=0.35, strokeCap="round")
    return apply_style(bold.encode(x=x, y=y, color=look["color"]) + base.mark_line(strokeWidth=1.2) + marks)
