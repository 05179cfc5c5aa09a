"""Charts of an ensemble: the directions of a body axis, the spread of attitudes over time, and the drifts.

Charts have at most a few thousand rows for any number of bodies: counts and quantiles, computed block by block. Directions are
drawn on a disc in J. H. Lambert's equal-area projection (1772).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import altair as alt
import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ..attitude import Array
from ..check import unit_vector
from ..number_text import short_power
from ..presentation import LEAST_DRAWN, time_unit
from .distributions import angle_quantiles, directions, mean_attitudes, project

BLUE = "#0072B2"
MOST_POINTS = 1000
"""Largest number of bodies that are drawn as points; more are drawn as counts in cells."""
_CELLS, _SIDE = 41, 230
"""Number of cells along a side of a disc, and length of the side in pixels."""
_RINGS = (*(m * 10.0**k for k in range(-9, 1) for m in (1, 2, 5)), 10.0, 20.0, 30.0, 45.0, 60.0, 90.0)
"""Angles between rings, degrees."""
_LEAST_EXTENT = 1e-7
"""Smallest half side of a disc, rad."""
MOST_TIMES = 200
"""Largest number of samples of a line over time."""
_PER_DECADE = 4
"""Bars of a histogram in a decade."""
_WIDTH, _HEIGHT = 560, 170
_COLOURS = (BLUE, "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9")
"""Okabe and Ito's colours, which colour-blind readers can distinguish."""


def draw_ensemble(ensemble: Any, axis_B: ArrayLike | None = None) -> alt.VConcatChart:
    """Return the chart of an `Ensemble`; see `Ensemble.plot`."""
    if axis_B is not None:
        axis = unit_vector("axis_B", axis_B, "a direction of three finite numbers (3,), body axes, not all 0")
    elif (axis := ensemble.bodies.take(0).symmetry_axis_B) is None:
        axis = np.array([0.0, 0.0, 1.0])
    along, m = np.flatnonzero(axis == 1), len(ensemble.t)
    unit, length = time_unit(float(ensemble.t[-1]))
    named = f"{along[0] + 1}" if len(along) else f"({', '.join(f'{component:.3g}' for component in axis)})"
    ends, shown = sorted({0, m - 1}), np.unique(np.linspace(0, m - 1, MOST_TIMES).astype(int)).tolist()
    discs = [
        draw_pointing(directions_W, f"Body axis {named} at t = {ensemble.t[sample] / length:.6g} {unit}")
        for sample, directions_W in zip(ends, directions(ensemble.R_WB, axis, ends), strict=True)
    ]
    quantiles = angle_quantiles(ensemble.R_WB, mean_attitudes(ensemble.R_WB, shown), shown)
    first_row = alt.hconcat(*discs, spacing=40).resolve_scale(color="independent")
    rows = [first_row, draw_spread(ensemble.t[shown], quantiles), draw_drifts(ensemble.drifts)]
    failed = f", {len(ensemble.failures):,} failed" if ensemble.failures else ""
    title = alt.Title(ensemble.bodies.scene.name, subtitle=[f"{len(ensemble):,} bodies{failed}", ensemble.label])
    return alt.vconcat(*rows, title=title, spacing=24).resolve_scale(color="independent")


def draw_spread(t: Array, quantiles: Array) -> alt.LayerChart:
    """Return a chart of the median and the 90 % band of angles from the mean attitude, (s, 3), rad, over times (s,), s."""
    low, middle, high = np.degrees(quantiles).T
    unit, length = time_unit(float(t[-1]))
    data = pd.DataFrame({"t": t / length, "low": low, "middle": middle, "high": high})
    positive = low[low > 0]
    # Three decades or more need a logarithmic axis.
    wide = len(positive) == len(low) and high.max() > 1000 * positive.min()
    scale = alt.Scale(type="log" if wide else "linear")
    base = alt.Chart(data, width=_WIDTH, height=_HEIGHT).encode(x=alt.X("t:Q", title=f"time, {unit}"))
    y = alt.Y("low:Q", title="angle from the mean, °", scale=scale)
    band = base.mark_area(opacity=0.25, color=BLUE).encode(y=y, y2="high:Q")
    line = base.mark_line(color=BLUE, point=len(t) == 1).encode(
        y=alt.Y("middle:Q", scale=scale), tooltip=[alt.Tooltip(f"{column}:Q", format=".4g") for column in data.columns]
    )
    title = alt.Title("Spread of attitude", subtitle="line: median; band: 5 to 95 % of the bodies")
    return (band + line).properties(title=title)


def draw_drifts(drifts: Mapping[str, Array]) -> alt.Chart:
    """Return a histogram of the largest drifts (n,), relative, by the names of the invariants; both axes are logarithmic."""
    finite = {name: np.maximum(values[np.isfinite(values)], LEAST_DRAWN) for name, values in drifts.items()}
    least = min((values.min() for values in finite.values() if len(values)), default=LEAST_DRAWN)
    most = max((values.max() for values in finite.values() if len(values)), default=LEAST_DRAWN)
    first = math.floor(math.log10(least))
    last = max(math.floor(math.log10(most)) + 1, first + 1)
    edges = np.asarray(10.0 ** np.linspace(first, last, (last - first) * _PER_DECADE + 1))
    counts = {name: np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] for name, values in finite.items()}
    bodies = {name: np.maximum([*values, 0], 0.5) for name, values in counts.items()}  # half a body is below the axis
    data = pd.concat([pd.DataFrame({"of": name, "drift": edges, "bodies": values}) for name, values in bodies.items()])
    axis = _power_axis(edges[0], edges[-1], "~e")
    x = alt.X("drift:Q", title="largest drift, relative", scale=alt.Scale(type="log", nice=False), axis=axis)
    y = alt.Y("bodies:Q", scale=alt.Scale(type="log", domainMin=0.5), axis=_power_axis(1, max(10, data["bodies"].max()), "~s"))
    colour = alt.Color("of:N", title="drift of", sort=list(drifts), scale=alt.Scale(range=list(_COLOURS)))
    return (
        alt.Chart(data, width=_WIDTH, height=_HEIGHT, title="Drifts over the run")
        .mark_line(interpolate="step-after", strokeWidth=1.8)
        .encode(x=x, y=y, color=colour, tooltip=["of:N", "bodies:Q"])
    )


def _power_axis(low: float, high: float, form: str) -> Any:
    """Return a logarithmic axis with a label at each power of ten, or fewer labels on a long axis."""
    first, last = math.floor(math.log10(low) + 1e-9), math.floor(math.log10(high) + 1e-9)
    return alt.Axis(format=form, values=[10.0**k for k in range(first, last + 1, 1 + (last - first) // 12)])


def draw_pointing(directions_W: Array, title: str) -> Any:
    """Return a disc with the directions of n bodies, unit vectors (n, 3), world axes, as points or as counts in cells."""
    points, mean = project(directions_W)
    extent = max(float(np.linalg.norm(points, axis=1).max(initial=0.0)) * 1.06, _LEAST_EXTENT)  # all points are in the square
    if len(points) <= MOST_POINTS:
        data = pd.DataFrame(points, columns=["x", "y"])
        bodies = alt.Chart(data).mark_point(filled=True, size=14, opacity=0.6, color=BLUE)
    else:
        counts, edges, _ = np.histogram2d(points[:, 0], points[:, 1], bins=_CELLS, range=[[-extent, extent]] * 2)
        middle = (edges[1:] + edges[:-1]) / 2
        i, j = np.nonzero(counts)
        data = pd.DataFrame({"x": middle[i], "y": middle[j], "bodies": counts[i, j].astype(int)})
        colour = alt.Color("bodies:Q", scale=alt.Scale(scheme="yellowgreenblue"), legend=None)
        cells = alt.Chart(data).mark_square(size=(_SIDE / _CELLS + 0.6) ** 2, opacity=1)
        bodies = cells.encode(color=colour, tooltip="bodies:Q")
    shown = f"mean ({', '.join(f'{component:.3f}' for component in mean)}), world axes"
    scale = alt.Scale(domain=[-extent, extent], nice=False)
    x, y = alt.X("x:Q", axis=None, scale=scale), alt.Y("y:Q", axis=None, scale=scale)
    drawn = alt.layer(*(layer.encode(x=x, y=y) for layer in (bodies, *_rings(extent))))
    return drawn.properties(width=_SIDE, height=_SIDE, title=alt.Title(title, subtitle=shown))


def _rings(extent: float) -> list[Any]:
    """Return circles about the centre at round angles, and their labels in degrees."""
    reach = math.degrees(2 * math.asin(min(extent / 2, 1.0)))
    step = next((angle for angle in _RINGS if reach / angle < 4), _RINGS[-1])
    angles = np.arange(1, math.floor(reach / step) + 1) * step
    turn = np.linspace(0, 2 * math.pi, 61)
    radii = 2 * np.sin(np.radians(angles) / 2)
    ring, order = np.meshgrid(angles, np.arange(len(turn)), indexing="ij")
    x, y = np.outer(radii, np.sin(turn)), np.outer(radii, np.cos(turn))
    lines = pd.DataFrame({"x": x.ravel(), "y": y.ravel(), "order": order.ravel(), "ring": ring.ravel()})
    # Labels of rings that are too close would overlap.
    apart = np.append(np.diff(radii) > 0.15 * extent, True)[: len(radii)]
    angles, radii = angles[apart], radii[apart]
    labels = pd.DataFrame({"x": 0 * radii, "y": radii, "label": [f"{short_power(f'{angle:g}')}°" for angle in angles]})
    halo, text = ({"stroke": "white", "strokeWidth": 3}, {"color": "#404040"})
    return [
        alt.Chart(lines).mark_line(color="#7F7F7F", strokeWidth=0.7).encode(order="order:Q", detail="ring:N"),
        *(alt.Chart(labels).mark_text(dy=8, fontSize=10, **look).encode(text="label:N") for look in (halo, text)),
    ]
