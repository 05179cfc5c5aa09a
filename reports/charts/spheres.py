"""What a motion looks like: the polhode of a free body on the momentum sphere, the trace of a top's axis on the unit sphere."""

from __future__ import annotations

import numpy as np
import pandas as pd

from .style import GREY, colours
from .vega_embed import Spec, as_csv

TURN, TILT = 35, 25
"""Where the spheres are looked at from at first, degrees."""


def chart(curve: pd.DataFrame) -> Spec:
    """Return one sphere, from one curve of `lines.curves`, as a Vega-Lite specification; its far side is faint.

    The samples are dots, as a line between them would cut corners: a turn of the brick has but few. The sphere has parameters
    `turn` and `tilt`, degrees.
    """
    name, family = curve[["name", "family"]].iloc[0]
    points = [{"x": x, "y": y, "z": z} for x, y, z in curve[["x", "y", "z"]].round(3).to_numpy().tolist()]
    return {
        "usermeta": {"name": name},
        "width": 190,
        "height": 190,
        "params": [{"name": "turn", "value": TURN}, {"name": "tilt", "value": TILT}],
        "layer": [
            {"data": _grid(), "transform": _project(), "mark": _line(GREY, 0.6, 0.5), "encoding": _encoding() | _order("part")},
            {
                "data": as_csv(points, ("x", "y", "z")),
                "transform": _project(),
                "mark": {"type": "circle", "color": colours({name: family})[name], "size": 7},
                "encoding": _encoding() | {"opacity": _fade()},
            },
        ],
        "config": {"view": {"stroke": None}},
    }


def _line(colour: str, width: float, opacity: float) -> Spec:
    return {"type": "line", "color": colour, "strokeWidth": width, "opacity": opacity, "strokeJoin": "round"}


def _grid() -> Spec:
    """Return the outline-like circles of a unit sphere: three great circles."""
    angles = np.linspace(0, 2 * np.pi, 61)
    c, s, zero = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    circles = [(c, s, zero), (c, zero, s), (zero, c, s)]
    rows = [
        {"part": f"p{number}", "k": k, "x": round(float(x), 3), "y": round(float(y), 3), "z": round(float(z), 3)}
        for number, circle in enumerate(circles)
        for k, (x, y, z) in enumerate(zip(*circle, strict=True))
    ]
    return as_csv(rows, ("part", "k", "x", "y", "z"))


def _project() -> list[Spec]:
    """Return the parallel projection: across and up on the paper, and towards the eye."""
    a, e = "(turn * PI / 180)", "(tilt * PI / 180)"
    ahead = f"(cos{a} * datum.x + sin{a} * datum.y)"
    return [
        {"calculate": f"cos{a} * datum.y - sin{a} * datum.x", "as": "across"},
        {"calculate": f"cos{e} * datum.z - sin{e} * {ahead}", "as": "up"},
        {"calculate": f"cos{e} * {ahead} + sin{e} * datum.z", "as": "near"},
    ]


def _encoding() -> Spec:
    scale = {"domain": [-1.15, 1.15], "nice": False, "clamp": False}
    hidden: Spec = {"type": "quantitative", "axis": None, "scale": scale}
    return {"x": hidden | {"field": "across"}, "y": hidden | {"field": "up"}}


def _order(detail: str) -> Spec:
    return {"order": {"field": "k", "type": "quantitative"}, "detail": {"field": detail}}


def _fade() -> Spec:
    return {"condition": {"test": "datum.near < 0", "value": 0.3}, "value": 1}
