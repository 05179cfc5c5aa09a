"""The polhode of a free body on the momentum sphere, or the trace of a top's axis on the unit sphere."""

from __future__ import annotations

import numpy as np
import pandas as pd

from conservative.attitude import Array

from .style import PALETTE, colours
from .vega_embed import Spec, as_csv

TURN, TILT = np.deg2rad(35.0), np.deg2rad(25.0)
"""Direction of the view of the spheres, rad: about the vertical axis, and above the horizontal plane."""
BEHIND = 0.3
"""Opacity of points behind the sphere."""


def chart(curve: pd.DataFrame) -> Spec:
    """Return one sphere, from one curve of `lines.curves`, as a Vega-Lite specification; its far side is faint.

    The samples are dots, as a line between them would cut corners: a turn of the brick has only a few samples.
    """
    name, family = curve[["name", "family"]].iloc[0]
    colour = colours({name: family})[name]
    across, up, near = _project(curve[["x", "y", "z"]].to_numpy())
    sides = ((near < 0, BEHIND), (near >= 0, 1.0))
    layers = [_great_circles(), *(_dots(across[side], up[side], colour, opacity) for side, opacity in sides)]
    return {
        "usermeta": {"name": name},
        "width": 190,
        "height": 190,
        "layer": layers,
        "config": {"view": {"stroke": None}},
    }


def _project(points: Array) -> Array:
    """Return the parallel projection (3, n) of points (n, 3): across and up on the paper, and towards the eye."""
    x, y, z = points.T
    ahead = np.cos(TURN) * x + np.sin(TURN) * y
    return np.stack(
        [
            np.cos(TURN) * y - np.sin(TURN) * x,
            np.cos(TILT) * z - np.sin(TILT) * ahead,
            np.cos(TILT) * ahead + np.sin(TILT) * z,
        ]
    ).round(3)


def _dots(across: Array, up: Array, colour: str, opacity: float) -> Spec:
    """Return points as dots of one line: it breaks before each of them, and its caps are round."""
    points = [{"across": x, "up": y} for x, y in zip(across.tolist(), up.tolist(), strict=True)]
    breaks = [{"calculate": "[null, datum.across]", "as": "across"}, {"flatten": ["across"]}]
    return {
        "data": as_csv(points, ("across", "up")),
        "transform": breaks,
        "mark": _line(colour, 2.4, opacity) | {"strokeCap": "round", "invalid": "break-paths-show-domains"},
        "encoding": _encoding(),
    }


def _line(colour: str, width: float, opacity: float) -> Spec:
    return {"type": "line", "color": colour, "strokeWidth": width, "opacity": opacity, "order": False}  # of points: their own


def _great_circles() -> Spec:
    """Return three great circles of the unit sphere."""
    angles = np.linspace(0, 2 * np.pi, 61)
    c, s, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    circles = [np.stack(circle, axis=1) for circle in ((c, s, zero), (c, zero, s), (zero, c, s))]
    rows = [
        {"part": f"p{number}", "k": k, "across": x, "up": y}
        for number, circle in enumerate(circles)
        for k, (x, y, _) in enumerate(_project(circle).T.tolist())
    ]
    return {
        "data": as_csv(rows, ("part", "k", "across", "up")),
        "mark": _line(PALETTE["grey"], 0.6, 0.5),
        "encoding": _encoding() | {"detail": {"field": "part"}},
    }


def _encoding() -> Spec:
    scale = {"domain": [-1.15, 1.15], "nice": False, "clamp": False}
    hidden: Spec = {"type": "quantitative", "axis": None, "scale": scale}
    return {"x": hidden | {"field": "across"}, "y": hidden | {"field": "up"}}
