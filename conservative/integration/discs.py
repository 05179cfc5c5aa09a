"""Discs that show where a body axis points: the sphere of directions about their mean. Altair is imported when asked for.

Source: J. H. Lambert's equal-area projection (1772), so that equal areas of the disc are equal parts of the sphere.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..attitude import Array
from .distributions import project

if TYPE_CHECKING:
    import pandas

BLUE = "#0072B2"
MOST_POINTS = 1000
"""Bodies up to which each is a point; more are counted in cells."""
_CELLS, _SIDE = 41, 230
_RINGS = (*(m * 10.0**k for k in range(-9, 1) for m in (1, 2, 5)), 10.0, 20.0, 30.0, 45.0, 60.0, 90.0)
"""Angles between rings, degrees."""
_LEAST_EXTENT = 1e-7
"""Half the side of a disc at least, rad: what is nearer is one point."""


def draw_pointing(directions_W: Array, title: str) -> Any:
    """Return where n bodies point, unit vectors (n, 3), world axes: as points, or counted in cells of a disc, with rings."""
    import altair as alt

    points, mean = project(directions_W)
    extent = _extent(points)
    shown = f"mean ({', '.join(f'{each:.3f}' for each in mean)}), world axes"
    scale = alt.Scale(domain=[-extent, extent], nice=False)
    x, y = alt.X("x:Q", axis=None, scale=scale), alt.Y("y:Q", axis=None, scale=scale)
    layers = [_points(points) if len(points) <= MOST_POINTS else _cells(points, extent), *_rings(extent)]
    drawn = alt.layer(*(layer.encode(x=x, y=y) for layer in layers))
    return drawn.properties(width=_SIDE, height=_SIDE, title=alt.Title(title, subtitle=shown))


def _extent(points: Array) -> float:
    """Return half the side of the square that is drawn: all points (n, 2) are in it."""
    return max(float(np.linalg.norm(points, axis=1).max(initial=0.0)) * 1.06, _LEAST_EXTENT)


def _points(points: Array) -> Any:
    import altair as alt

    return alt.Chart(frame(x=points[:, 0], y=points[:, 1])).mark_point(filled=True, size=14, opacity=0.6, color=BLUE)


def _cells(points: Array, extent: float) -> Any:
    """Return the numbers of bodies in the cells of a square; empty ones are not drawn."""
    import altair as alt

    counts, edges, _ = np.histogram2d(points[:, 0], points[:, 1], bins=_CELLS, range=[[-extent, extent]] * 2)
    middle = (edges[1:] + edges[:-1]) / 2
    i, j = np.nonzero(counts)
    data = frame(x=middle[i], y=middle[j], bodies=counts[i, j].astype(int))
    colour = alt.Color("bodies:Q", scale=alt.Scale(scheme="yellowgreenblue"), legend=None)
    cells = alt.Chart(data).mark_square(size=(_SIDE / _CELLS + 0.6) ** 2, opacity=1)
    return cells.encode(color=colour, tooltip="bodies:Q")


def _rings(extent: float) -> list[Any]:
    """Return circles about the centre at round angles, and their labels in degrees."""
    import altair as alt

    reach = math.degrees(2 * math.asin(min(extent / 2, 1.0)))
    step = next((angle for angle in _RINGS if reach / angle < 4), _RINGS[-1])
    angles = np.arange(1, math.floor(reach / step) + 1) * step
    turn = np.linspace(0, 2 * math.pi, 61)
    radii = 2 * np.sin(np.radians(angles) / 2)
    n, many = len(turn), len(radii)
    lines = frame(
        x=np.outer(radii, np.sin(turn)).ravel(),
        y=np.outer(radii, np.cos(turn)).ravel(),
        order=np.tile(np.arange(n), many),
        ring=np.repeat(angles, n),
    )
    apart = np.append(np.diff(radii) > 0.15 * extent, True)[:many]
    angles, radii = angles[apart], radii[apart]
    labels = frame(x=0 * radii, y=radii, label=[f"{angle:g}°" for angle in angles])
    halo, text = ({"stroke": "white", "strokeWidth": 3}, {"color": "#404040"})
    return [
        alt.Chart(lines).mark_line(color="#7F7F7F", strokeWidth=0.7).encode(order="order:Q", detail="ring:N"),
        *(alt.Chart(labels).mark_text(dy=-5, fontSize=10, **look).encode(text="label:N") for look in (halo, text)),
    ]


def frame(**columns: Any) -> pandas.DataFrame:
    """Return a table with the columns given."""
    import pandas as pd

    return pd.DataFrame(columns)
