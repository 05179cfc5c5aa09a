"""The polhode of a free body on the momentum sphere, or the trace of a top's axis on the unit sphere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from conservative.attitude import Array
from conservative.scene import Scene

from .style import PALETTE, colours
from .vega_embed import Spec, as_csv

TURN, TILT = np.deg2rad(35.0), np.deg2rad(25.0)
"""Direction of the view of the spheres, rad: about the vertical axis, and above the horizontal plane."""
BEHIND = 0.3
"""Opacity of points behind the sphere."""
_ANGLES = np.linspace(0, 2 * np.pi, 241)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0 * _ANGLES], axis=1)
_CIRCLES = [np.roll(_CIRCLE[::4], shift, axis=1) for shift in range(3)]
"""Great circles of the unit sphere."""


def polhode(scene: Scene) -> Array | None:
    """Return the polhode of a free body, closed (n, 3), in principal axes, in units of the momentum's length.

    The sphere of the momentum meets the ellipsoid of the energy there. Seen along the axis that the polhode surrounds, the
    polhode is an ellipse. None for another scene than a free body without a rotor.
    """
    if not scene.free or scene.body.rotor_momentum is not None:
        return None
    moments, axes = np.linalg.eigh(scene.body.inertia)
    momentum = scene.body.momentum(scene.w_WB_B0) @ axes
    start, inverse = momentum / np.linalg.norm(momentum), 1 / moments
    energy = float(inverse @ start**2)
    around = 2 if energy < inverse[1] else 0  # the axis of the largest moment, or of the smallest
    others = [axis for axis in range(3) if axis != around]
    gaps = np.abs(inverse[others] - inverse[around])
    if not gaps.all():  # the momentum rests in a body of revolution that turns across its axis, or in a sphere
        return np.stack([start, start])
    ellipse = _CIRCLE[:, :2] * np.sqrt(np.abs(energy - inverse[around]) / gaps)
    along = np.sqrt(np.maximum(1 - (ellipse**2).sum(axis=1), 0)) * (np.sign(start[around]) or 1.0)
    return np.insert(ellipse, around, along, axis=1)


def chart(curve: pd.DataFrame, exact: Array | None = None) -> Spec:
    """Return one sphere, from one curve of `lines.curves`, as a Vega-Lite specification; its far side is faint.

    The samples are dots, as a line between them would cut corners: a turn of the scene `brick_flip` has only a few samples. The
    exact curve (n, 3) below them, such as a polhode, is a line.
    """
    name, family = curve[["name", "family"]].iloc[0]
    colour = colours({name: family})[name]
    across, up, near = _project(curve[["x", "y", "z"]].to_numpy())
    sides = ((near < 0, BEHIND), (near >= 0, 1.0))
    layers = [_lines(_CIRCLES, PALETTE["grey"], 0.6, 0.5)]
    if exact is not None:
        parts = _split(exact)
        for side, opacity in ((False, BEHIND), (True, 1.0)):
            layers.append(_lines([part for part, near in parts if near == side], PALETTE["black"], 1.2, opacity))
    layers += [_dots(across[side], up[side], colour, opacity) for side, opacity in sides]
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
    """Return points as dots of one line: it breaks before each of them, and its caps are round.

    One line is smaller in an SVG file than a mark per point.
    """
    points = [{"across": x, "up": y} for x, y in zip(across.tolist(), up.tolist(), strict=True)]
    breaks = [{"calculate": "[null, datum.across]", "as": "across"}, {"flatten": ["across"]}]
    return {
        "data": as_csv(points, ("across", "up")),
        "transform": breaks,
        "mark": _line(colour, 2.4, opacity) | {"strokeCap": "round", "invalid": "break-paths-show-domains"},
        "encoding": _encoding(),
    }


def _line(colour: str, width: float, opacity: float) -> Spec:
    # Points keep their own order.
    return {"type": "line", "color": colour, "strokeWidth": width, "opacity": opacity, "order": False}


def _split(curve: Array) -> list[tuple[Array, bool]]:
    """Return the parts of a curve (n, 3) behind the sphere and before it, and which of both; neighbours share a point."""
    near = _project(curve)[2] >= 0
    starts = [0, *(np.flatnonzero(np.diff(near)) + 1).tolist()]
    return [(curve[start : end + 1], bool(near[start])) for start, end in zip(starts, [*starts[1:], len(curve)], strict=True)]


def _lines(curves: Sequence[Array], colour: str, width: float, opacity: float) -> Spec:
    rows = [
        {"part": f"p{number}", "k": k, "across": x, "up": y}  # no encoding uses k
        for number, curve in enumerate(curves)
        for k, (x, y, _) in enumerate(_project(curve).T.tolist())
    ]
    return {
        "data": as_csv(rows, ("part", "k", "across", "up")),
        "mark": _line(colour, width, opacity),
        "encoding": _encoding() | {"detail": {"field": "part"}},
    }


def _encoding() -> Spec:
    scale = {"domain": [-1.15, 1.15], "nice": False, "clamp": False}
    hidden: Spec = {"type": "quantitative", "axis": None, "scale": scale}
    return {"x": hidden | {"field": "across"}, "y": hidden | {"field": "up"}}
