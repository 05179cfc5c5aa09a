"""What a motion looks like: the polhode of a free body on the momentum sphere, the trace of a top's axis on the unit sphere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from conservative.attitude import Array
from conservative.benchmarks.studies.case import Failed, attempt
from conservative.benchmarks.studies.long_runs import case_for
from conservative.method import Method, Role
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..labels import shown
from .style import GREY, colours
from .vega_embed import Spec, as_csv

KEPT = 700
"""Samples of a curve."""
PREFERRED = (
    "convected",
    "reduced",
    "mujoco:integrator=Euler",
    "mujoco",
    "mujoco:integrator=implicit",
    "pinocchio:scheme=Euler",
)
"""What is drawn where a report has it: a curve that stays, beside ones that may not."""
COLUMNS = ("scene", "method", "series", "x", "y", "z")

TURN, TILT = 35, 25
"""Where the spheres are looked at from at first, degrees."""


def chosen(methods: Sequence[Method]) -> list[Method]:
    """Return the methods that are drawn: the preferred ones, and the first of every family that has none there; no truth."""
    preferred = [method for method in methods if method.name in PREFERRED]
    firsts = {method.family: method for method in reversed(methods) if method.role != Role.TRUTH}
    return preferred + [method for family, method in reversed(firsts.items()) if family not in {m.family for m in preferred}]


def absent(found: pd.DataFrame, scene: str, methods: Sequence[Method]) -> list[str]:
    """Return the names of the methods that should be drawn on a scene and could not."""
    drawn = set(found[found["scene"] == scene]["method"])
    return [method.name for method in chosen(methods) if method.name not in drawn]


def curves(scenes: Sequence[Scene], methods: Sequence[Method]) -> pd.DataFrame:
    """Return curves: columns scene, method, series, and the point x, y, z, in units of the sphere's radius at the start.

    The run is that of the drift over time. Of a free body the point is the momentum, in principal axes; of a body in a field
    the direction of its axis, in world axes. Methods that cannot do the scene, or fail, have no curve. The first truth among
    the methods that can do the scene comes first.
    """
    found = [drawn for scene in scenes for drawn in _found(scene, [*_truth(scene, methods), *chosen(methods)])]
    return pd.concat(found, ignore_index=True) if found else pd.DataFrame(columns=list(COLUMNS))


def _truth(scene: Scene, methods: Sequence[Method]) -> list[Method]:
    return [method for method in methods if method.role == Role.TRUTH and method.unsupported(scene) is None][:1]


def _found(scene: Scene, methods: Sequence[Method]) -> Iterator[pd.DataFrame]:
    for method in methods:
        outcome = attempt(case_for(scene, method), skip_missing=True)
        if not isinstance(outcome, Failed):
            yield curve(outcome.trajectory, method.name)


def curve(trajectory: Trajectory, method: str) -> pd.DataFrame:
    """Return the curve of one run, at most `KEPT` evenly spaced samples of it."""
    kept = np.unique(np.linspace(0, len(trajectory.t) - 1, KEPT).round().astype(int))
    x, y, z = _points(trajectory)[kept].T
    names = {"scene": trajectory.scene.name, "method": method, "series": shown(method, trajectory.label)}
    values = {**names, "x": x, "y": y, "z": z}
    return pd.DataFrame(values, columns=list(COLUMNS))


def _points(trajectory: Trajectory) -> Array:
    scene = trajectory.scene
    if scene.free:
        momentum = trajectory.w_WB_B @ scene.body.inertia  # symmetric
        return np.asarray(momentum @ np.linalg.eigh(scene.body.inertia)[1] / np.linalg.norm(momentum[0]))
    return np.asarray(trajectory.R_WB @ _axis(scene))


def _axis(scene: Scene) -> Array:
    """Return the unit vector (3,) that is traced, body axes: towards the centre of mass where there is one, else the third."""
    com_B = np.asarray(scene.potential.com_B) if isinstance(scene.potential, UniformGravity) else np.zeros(3)
    length = float(np.linalg.norm(com_B))
    return com_B / length if length else np.eye(3)[2]


def chart(found: pd.DataFrame, scene: str, series: str) -> Spec:
    """Return one sphere as a Vega-Lite specification with the parameters `turn` and `tilt`, degrees; the far side is faint."""
    rows = found[(found["scene"] == scene) & (found["series"] == series)]
    points = [
        {"k": k, "x": x, "y": y, "z": z} for k, (x, y, z) in enumerate(rows[["x", "y", "z"]].round(4).to_numpy().tolist())
    ]
    return {
        "usermeta": {"name": series},
        "width": 190,
        "height": 190,
        "params": [{"name": "turn", "value": TURN}, {"name": "tilt", "value": TILT}],
        "layer": [
            {"data": _grid(), "transform": _projected(), "mark": _line(GREY, 0.6, 0.5), "encoding": _encoding("part")},
            {
                "data": as_csv(points, ("k", "x", "y", "z")),
                "transform": [*_projected(), *_sides()],
                "mark": _line(colours([series])[series], 1.3, 1.0),
                "encoding": _encoding("stretch") | {"opacity": _faint()},
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


def _projected() -> list[Spec]:
    """Return the parallel projection: across and up on the paper, and towards the eye."""
    a, e = "(turn * PI / 180)", "(tilt * PI / 180)"
    ahead = f"(cos{a} * datum.x + sin{a} * datum.y)"
    return [
        {"calculate": f"cos{a} * datum.y - sin{a} * datum.x", "as": "across"},
        {"calculate": f"cos{e} * datum.z - sin{e} * {ahead}", "as": "up"},
        {"calculate": f"cos{e} * {ahead} + sin{e} * datum.z", "as": "near"},
    ]


def _sides() -> list[Spec]:
    """Cut the curve where it passes behind the sphere, so that each stretch has one opacity."""
    frame = {"window": [{"op": "lag", "field": "near", "as": "before"}], "sort": [{"field": "k"}]}
    passes = {"calculate": "datum.before !== null && (datum.before < 0) != (datum.near < 0) ? 1 : 0", "as": "passes"}
    count = {"window": [{"op": "sum", "field": "passes", "as": "stretch"}], "sort": [{"field": "k"}]}
    return [frame, passes, count]


def _encoding(detail: str) -> Spec:
    scale = {"domain": [-1.15, 1.15], "nice": False, "clamp": False}
    hidden: Spec = {"type": "quantitative", "axis": None, "scale": scale}
    order = {"field": "k", "type": "quantitative"}
    return {"x": hidden | {"field": "across"}, "y": hidden | {"field": "up"}, "order": order, "detail": {"field": detail}}


def _faint() -> Spec:
    return {"condition": {"test": "datum.near < 0", "value": 0.3}, "value": 1}
