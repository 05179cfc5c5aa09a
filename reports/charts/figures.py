"""Charts of measurements: tidy columns in, an Altair chart out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import altair as alt
import numpy as np
import pandas as pd

from conservative.presentation import time_unit

from ..document.cells import tolerance
from ..rows.names import MethodClass
from .style import HEIGHT, PALETTE, SHAPES, WIDTH, apply_style, colours, families_of, look, power_axis, scale

FLOOR = 1e-17
"""Replaces an error of zero on a logarithmic axis; below any round-off of a relative error in double precision."""
_CLASSES: Mapping[str, tuple[str, list[int]]] = {
    MethodClass.GENERAL.value: ("circle", [1, 0]),
    MethodClass.SOLUTION.value: ("diamond", [1, 0]),
    MethodClass.BASELINE.value: ("cross", [2, 2]),
    MethodClass.SOLVER.value: ("square", [6, 3]),
    MethodClass.ENGINE.value: ("triangle-up", [2, 2]),
}
CLASS_SHAPES = {name: shape for name, (shape, _) in _CLASSES.items()}
"""Mark of each class of methods."""
CLASS_DASHES = {name: dash for name, (_, dash) in _CLASSES.items()}
"""Dash of each class; ours are solid."""
_ENGINE_COLOURS = tuple(
    PALETTE[name] for name in ("blue", "vermilion", "green", "orange", "purple", "indigo", "sky", "wine", "olive", "teal")
)
LABELS_AT = 0.86
"""Place of the label of a guide, from its first end to its second."""
LABEL = (0.1, 0.04)
"""Width and height of the label of a guide, relative to the chart."""
_GROWTHS = (("∝ √t", 0.5), ("∝ t", 1.0))
"""Growth of an error whose parts are random, and of one whose parts have the same direction."""
_KINDS = {"at its best": [1, 0], "as installed": [5, 3]}


def log_channel(column: str, title: str, values: pd.Series[float]) -> dict[str, Any]:
    """Return field, scale and axis of a logarithmic channel."""
    positive = values[values > 0]
    low, high = (float(positive.min()) / 1.3, float(positive.max()) * 1.3) if len(positive) else (1e-1, 1.0)
    return {
        "shorthand": f"{column}:Q",
        "scale": alt.Scale(type="log", domain=[low, high], nice=False, clamp=True),
        "axis": power_axis(title, low, high),
    }


def _with_range(points: pd.DataFrame, name: str = "microseconds") -> pd.DataFrame:
    """Return points with times in µs: the geometric mean of all processes, and the range of these, low and high.

    Times of a single process have no range: both ends are the time.
    """
    ends = []
    for processes, mean in zip(points["times"] if "times" in points else points["time"], points["time"], strict=True):
        times = [time for time in processes if not math.isnan(time)] if isinstance(processes, tuple) else []
        ends.append((min(times), max(times)) if len(times) > 1 else (mean, mean))
    low, high = np.array(ends, dtype=float).reshape(-1, 2).T * 1e6
    return points.drop(columns="times", errors="ignore").assign(**{name: points["time"] * 1e6, "low": low, "high": high})


def _bars(base: alt.Chart, data: pd.DataFrame, y: alt.Y, **channels: Any) -> list[alt.Chart]:
    """Return the bars from the fastest to the slowest process of each time; none if a single process measured them."""
    if not (data["high"] > data["low"]).any():
        return []
    ends = {"y": alt.Y("low:Q", scale=y["scale"], axis=y["axis"]), "y2": "high:Q"}
    return [base.mark_rule(strokeWidth=1.2, opacity=0.7).encode(**ends, **channels)]


def _about_bars(data: pd.DataFrame) -> str:
    return "; bars: from the fastest process to the slowest" * bool((data["high"] > data["low"]).any())


def _guides(ends: pd.DataFrame, x: alt.X, y: alt.Y) -> list[alt.Chart]:
    """Return dashed rising lines of known slopes with labels, from the two ends of each: columns of text, x and y."""
    base = alt.Chart(ends).encode(x=x, y=y)
    lines = base.mark_line(strokeDash=[3, 3], strokeWidth=1, color=PALETTE["grey"], clip=True).encode(detail="text:N")
    logs: Any = ends.set_index("text").apply(np.log).groupby("text")
    first, second = logs.first(), logs.last()
    places = np.exp(first + LABELS_AT * (second - first)).reset_index()  # labels at the ends would run into an axis
    halo, plain = ({"stroke": "white", "strokeWidth": 3}, {"color": PALETTE["grey"]})  # over lines of the grid
    labels = [alt.Chart(places).mark_text(align="left", dx=8, dy=9, fontSize=10, **style) for style in (halo, plain)]
    return [lines, *(label.encode(x=x, y=y, text="text:N") for label in labels)]


def _large(data: pd.DataFrame, title: str, subtitle: str) -> Any:
    return alt.Chart(data, width=2 * WIDTH - 180, height=2 * HEIGHT - 80, title=alt.Title(title, subtitle=subtitle))


def _time_against_error(data: pd.DataFrame) -> tuple[alt.X, alt.Y]:
    x = alt.X(**log_channel("error", "largest attitude error over the run, rad", data["error"]))
    times = pd.concat([data["low"], data["high"]])
    return x, alt.Y(**log_channel("microseconds", "wall time per simulated second, µs", times))


def work_precision(points: pd.DataFrame, front: pd.DataFrame, scene: str) -> Any:
    """Return time against error, from the points of a scene (see `rows.points`) and their `front`, which is the bold line."""
    data, best_points = map(_with_range, (points, front))
    channels = look(families_of(data), "shape", title="method", orient="right", symbolOpacity=1)
    x, y = _time_against_error(data)
    subtitle = "lower left is better; bold grey: fastest at each error, without closed forms" + _about_bars(data)
    base = _large(data, f"{scene}: time against error", subtitle).encode(x=x, y=y)
    best = alt.Chart(best_points).mark_line(
        color=PALETTE["black"], opacity=0.22, strokeWidth=11, strokeCap="round", strokeJoin="round"
    )
    lines = base.mark_line(strokeWidth=1.6).encode(color=channels["color"], detail="name:N", order="rank:Q")
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(**channels)
    lines = lines.transform_window(rank="row_number()")
    bars = _bars(base, data, y, color=channels["color"])
    return apply_style(alt.layer(best.encode(x=x, y=y, order="error:Q"), *bars, lines, marks))


def best_of_families(picture: pd.DataFrame) -> Any:
    """Return time against error of the best of each family; columns as in `rows.points`."""
    data = _with_range(picture).assign(sample=picture["sample"] * 1e6, rank=range(len(picture)))
    families = families_of(data)
    x = alt.X(**log_channel("error", "largest attitude error, rad", data["error"]))
    y = alt.Y(**log_channel("microseconds", "µs per simulated second", pd.concat([data["low"], data["high"]])))
    base = alt.Chart(data, width=WIDTH, height=HEIGHT).encode(x=x)
    line = base.mark_line(strokeWidth=2.2, point=alt.OverlayMarkDef(size=50, filled=True, opacity=1))
    colour = alt.Color("name:N", scale=scale(colours(families)), sort=list(families))
    chart = line.encode(
        y=y,
        color=colour,
        shape=alt.Shape("class:N", scale=scale(CLASS_SHAPES)),
        strokeDash=alt.StrokeDash("class:N", scale=scale(CLASS_DASHES)),
        order=alt.Order("rank:Q"),
    )
    bars = _bars(base, data, y, color=colour)
    return apply_style(alt.layer(*bars, chart) if bars else chart)


def _over_time(rows: pd.DataFrame) -> tuple[pd.DataFrame, alt.X]:
    """Return rows with times t, s, and the axis of their times, in the unit of the axis."""
    unit, length = time_unit(float(rows["t"].max()))
    return rows.assign(t=rows["t"] / length), alt.X("t:Q", title=f"t, {unit}", scale=alt.Scale(nice=False))


def signed_drift(drifts: pd.DataFrame) -> Any:
    """Return the drift over time with its sign, from `lines.signed_drifts` of a scene, a panel for each invariant."""
    channels = look(families_of(drifts), "strokeDash", title="method", symbolSize=300)
    panels = []
    for kind, part in drifts.groupby("quantity", sort=False):
        ends = part["drift"].min(), part["drift"].max()
        largest = max(-ends[0], ends[1])
        powers = [10.0**k for k in range(-12, 13, 3)]
        if 0 < largest < powers[0]:
            decade = math.floor(math.log10(largest))
            # Round-off alone: one number on each side.
            powers = [max(power for power in (float(f"{digit}e{decade}") for digit in (1, 2, 5)) if power <= largest)]
        # Ticks up to ten times beyond the ends, so that each side has one.
        ticks = [-p for p in powers if -p >= 10 * ends[0]] + [0.0] + [p for p in powers if p <= 10 * ends[1]]
        axis = alt.Axis(
            title="relative change", values=ticks, labelExpr="datum.value == 0 ? 'exact' : format(datum.value, '~e')"
        )
        y = alt.Y("drift:Q", axis=axis, scale=alt.Scale(type="symlog", constant=1e-14, nice=False))
        part, x = _over_time(part)
        chart = alt.Chart(part, width=WIDTH, height=HEIGHT, title=str(kind)).mark_line(strokeWidth=2)
        panels.append(chart.encode(x=x, y=y, **channels))
    return apply_style(alt.hconcat(*panels))


def recorded(rows: pd.DataFrame, name: str, limits: Mapping[str, float]) -> Any:
    """Return errors and drifts of a recorded motion, a panel for each quantity, beside its limit."""
    panels = []
    shown = rows.assign(shown=rows["value"].clip(lower=FLOOR))[rows["t"] > rows["t"].min()]
    for kind, part in shown.groupby("quantity", sort=False):
        part, x = _over_time(part)
        base = alt.Chart(part, width=2 * WIDTH - 180, height=HEIGHT - 130, title=f"{name}: {kind}").mark_line(strokeWidth=1.4)
        limit = limits.get(str(kind))
        sizes = part["shown"] if limit is None else pd.concat([part["shown"], pd.Series([limit])])
        y = alt.Y(**log_channel("shown", "size" if limit is None else "size; dashed: allowed", sizes))
        chart = base.encode(x=x, y=y, color=alt.value(PALETTE["blue"]))
        if limit is not None:
            line = alt.Chart(pd.DataFrame({"shown": [limit]})).mark_rule(strokeDash=[6, 4]).encode(y=y)
            chart = alt.layer(chart, line)
        panels.append(chart)
    return apply_style(alt.vconcat(*panels))


def two_back_ends(rows: pd.DataFrame, motion: str) -> Any:
    """Return the errors of two back ends and the difference between them over time: columns t, quantity and value."""
    shown = rows.assign(shown=rows["value"].clip(lower=FLOOR))
    names = list(dict.fromkeys(shown["quantity"]))
    shown, x = _over_time(shown)
    colour = alt.Color(
        "quantity:N",
        scale=alt.Scale(domain=names, range=[PALETTE[name] for name in ("blue", "vermilion", "grey")]),
        sort=names,
        legend=alt.Legend(title=None, orient="bottom", columns=1, labelLimit=400),
    )
    dash = alt.StrokeDash("quantity:N", scale=alt.Scale(domain=names, range=[[1, 0], [1, 0], [6, 4]]), sort=names, legend=None)
    y = alt.Y(**log_channel("shown", "size", shown["shown"]))
    chart = alt.Chart(shown, width=2 * WIDTH - 180, height=HEIGHT, title=f"Two back ends: {motion}")
    return apply_style(chart.mark_line(strokeWidth=2).encode(x=x, y=y, color=colour, strokeDash=dash))


def growth(lines: pd.DataFrame) -> Any:
    """Return the largest error so far over time; rows of panels are quantities, columns scenes. Columns as in `long_time`."""
    data = lines.assign(shown=lines["value"].clip(lower=FLOOR))
    channels = look(families_of(data), "strokeDash", title="method", orient="bottom", columns=4, symbolSize=300)
    x, y = (alt.X(**log_channel("t", "turns", data["t"])), alt.Y(**log_channel("shown", "largest so far", data["shown"])))
    panels = []
    for (scene, quantity), part in data.groupby(["scene", "quantity"], sort=False):
        chart = alt.Chart(part, width=WIDTH - 60, height=HEIGHT - 60, title=f"{scene}: {quantity}")
        drawn = chart.mark_line(strokeWidth=1.8, clip=True).encode(x=x, y=y, **channels)
        panels.append(alt.layer(*_guides(growth_guides(part, data["shown"].max()), x, y), drawn))
    return apply_style(alt.concat(*panels, columns=3))


def growth_guides(part: pd.DataFrame, largest: float) -> pd.DataFrame:
    """Return the ends of lines of known growth, from the first time and the smallest value: columns text, t, shown.

    Each ends at the last time or the largest value: the scale would draw what is beyond at its end, with another slope.
    """
    first, last, least = float(part.loc[part["t"] > 0, "t"].min()), float(part["t"].max()), float(part["shown"].min())
    rows = []
    for text, power in _GROWTHS:
        factor = min(last / first, (largest / least) ** (1 / power))
        rows += [(text, first * stretch, least * stretch**power) for stretch in (1.0, factor)]
    return pd.DataFrame(rows, columns=["text", "t", "shown"])


def convergence(errors: pd.DataFrame, fit_ends: pd.DataFrame, scene: str) -> Any:
    """Return error against step, from `lines.errors` of a scene and `lines.fit_ends`; the fits are the bold stretches."""
    x = alt.X(**log_channel("dt", "step, s", errors["dt"]))
    y = alt.Y(**log_channel("error", "largest attitude error over the run, rad", errors["error"]))
    channels = look(families_of(errors), "shape", title="method (observed order)", orient="right", symbolOpacity=1)
    title, subtitle = (
        f"{scene}: convergence",
        "bold: the stretch of the fit, and the fit; dashed: whole orders",
    )
    base = _large(errors, title, subtitle).encode(x=x, y=y, color=channels["color"])
    marks = base.mark_point(filled=True, size=48, opacity=1).encode(shape=channels["shape"])
    bold = alt.Chart(fit_ends).mark_line(strokeWidth=6, opacity=0.35, strokeCap="round")
    ends = order_guides(errors, fit_ends)
    guides = _guides(ends, x, y) if len(ends) else []
    bold = bold.encode(x=x, y=y, color=channels["color"])
    return apply_style(alt.layer(*guides, bold, base.mark_line(strokeWidth=1.2), marks))


def order_guides(errors: pd.DataFrame, fit_ends: pd.DataFrame) -> pd.DataFrame:
    """Return the ends of lines of the whole orders that were fitted, from the largest step and error: columns text, dt, error.

    Each ends at the smallest step or error. High orders end close together: one whose label would run into the label before it
    is left out.
    """
    dt, error = (np.log(errors.loc[errors[name] > 0, name]) for name in ("dt", "error"))
    slopes = [
        np.diff(np.log(ends["error"])).item() / np.diff(np.log(ends["dt"])).item() for _, ends in fit_ends.groupby("name")
    ]
    rows, width, height, before = [], dt.max() - dt.min(), error.max() - error.min(), (math.inf, math.inf)
    for order in sorted({round(slope) for slope in slopes if slope >= 0.5}):  # orders of 1 or more
        run = min(width, height / order)
        place = LABELS_AT * run / width, LABELS_AT * order * run / height
        if all(abs(a - b) < size for a, b, size in zip(place, before, LABEL, strict=True)):
            continue
        before = place
        rows += [(f"order {order}", dt.max() - back, error.max() - order * back) for back in (0.0, run)]
    ends = pd.DataFrame(rows, columns=["text", "dt", "error"])
    return ends.assign(dt=np.exp(ends["dt"]), error=np.exp(ends["error"])) if rows else ends


def engine_looks(names: Iterable[str]) -> Mapping[str, tuple[str, str]]:
    """Return colour and mark of each engine, sorted by name; ten colours and eight marks make 40 looks."""
    ordered = sorted(set(names), key=str.lower)
    return {name: (_ENGINE_COLOURS[i % len(_ENGINE_COLOURS)], SHAPES[i % len(SHAPES)]) for i, name in enumerate(ordered)}


def engines(points: pd.DataFrame, scene: str) -> Any:
    """Return time against error of engines, from `engines.picture_points`: at their best solid, as installed dashed."""
    data = _with_range(points)
    looks = engine_looks(data["name"])
    legend = alt.Legend(title="engine", orient="right", columns=1, symbolOpacity=1)
    colours, marks = (alt.Scale(domain=list(looks), range=[look[part] for look in looks.values()]) for part in (0, 1))
    x, y = _time_against_error(data)
    subtitle = "lower left is better; solid: at its best, dashed: as installed; runs with an error below 1 rad" + _about_bars(
        data
    )
    base = _large(data, f"{scene}: engines, time against error", subtitle).encode(
        x=x,
        y=y,
        color=alt.Color("name:N", scale=colours, sort=list(looks), legend=legend),
        shape=alt.Shape("name:N", scale=marks, sort=list(looks), legend=legend),
    )
    dash = alt.StrokeDash("kind:N", scale=scale(_KINDS), legend=None)
    lines = base.mark_line(strokeWidth=1.6).encode(detail="setting:N", order="rank:Q", strokeDash=dash)
    lines = alt.layer(*_bars(base, data, y), lines.transform_window(rank="row_number()"))
    return apply_style(lines + base.mark_point(filled=True, size=48, opacity=1))


def random_ratios(points: pd.DataFrame, bodies: int, seed: int) -> Any:
    """Return the fastest engine's time divided by ours against the error, a panel for each field: mean, worst and best body."""
    lowest, highest = float(points["worst"].min()), float(points["best"].max())
    low, high = min(lowest, 0.9) / 1.1, max(highest, 1.1) * 1.1
    y: dict[str, Any] = {
        "scale": alt.Scale(type="log", domain=[low, high], nice=False),
        "axis": power_axis("engine / ours", low, high),
    }
    blue = PALETTE["blue"]
    titles = {"error": "attitude error, rad", "mean": "engine / ours, mean", "worst": "worst body", "best": "best body"}
    shown = [alt.Tooltip(f"{name}:Q", format=".3g", title=title) for name, title in titles.items()]
    even = alt.Chart(pd.DataFrame({"even": [1.0]})).mark_rule(color=PALETTE["grey"], strokeDash=[5, 3])
    panels = []
    for field, part in points.groupby("field", sort=False):
        x = alt.X(**log_channel("error", "largest attitude error, rad", part["error"]))
        base = alt.Chart(part, width=WIDTH - 60, height=HEIGHT - 60, title=str(field)).encode(x=x)
        band = base.mark_area(color=blue, opacity=0.18).encode(y=alt.Y("worst:Q", **y), y2="best:Q")
        mark = base.mark_line(color=blue, strokeWidth=2, point=alt.OverlayMarkDef(color=blue, size=40))
        panels.append(band + even.encode(y=alt.Y("even:Q", **y)) + mark.encode(y=alt.Y("mean:Q", **y), tooltip=shown))
    title = alt.Title(
        f"Random bodies: the fastest engine's time divided by ours ({bodies} in each field, seed {seed})",
        subtitle="line: geometric mean; band: from the worst body to the best; above the dashed line ours is faster",
    )
    return apply_style(alt.concat(*panels, columns=2, title=title))


def body_costs(points: pd.DataFrame) -> Any:
    """Return the time per body against the number of bodies; columns of panels are errors, rows kinds of bodies."""
    channels = look(families_of(points), "strokeDash", title="method", orient="bottom", columns=2, symbolSize=300)
    shown = [alt.Tooltip("name:N"), alt.Tooltip("size:Q"), alt.Tooltip("time:Q", format=".3g")]
    x = alt.X(**log_channel("size", "number of bodies", points["size"]))
    points = _with_range(points, name="time")
    y = alt.Y(**log_channel("time", "µs a body and simulated second", pd.concat([points["low"], points["high"]])))

    def panel(part: pd.DataFrame, kind: str, error: Any) -> Any:
        title = f"{kind.replace('_', ' ')}, {tolerance(error)} rad"
        base = alt.Chart(part, width=WIDTH - 130, height=HEIGHT - 20, title=title).encode(x=x, y=y, **channels)
        marks = alt.Chart(part).mark_point(filled=True, size=30, opacity=1)
        marks = marks.encode(x=x, y=y, color=channels["color"].legend(None), tooltip=shown)
        bars = _bars(alt.Chart(part).encode(x=x), part, y, color=channels["color"].legend(None))
        return alt.layer(*bars, base.mark_line(strokeWidth=1.6).encode(tooltip=shown), marks)

    rows = [
        alt.hconcat(*(panel(part, str(kind), error) for error, part in here.groupby("error", sort=False)))
        for kind, here in points.groupby("kind", sort=False)
    ]
    subtitle = "at equal error (median of the bodies); lower is better"
    return apply_style(alt.vconcat(*rows, title=alt.Title("Many bodies: the cost of one of them", subtitle=subtitle)))
