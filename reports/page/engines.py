"""The section of engines: its pictures, for the page and beside report.md."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ..charts import engines, vega_embed
from ..charts.vega_embed import PATHS, Entry, PageFigure
from ..tables.engine_scenes import EngineScene

HOVER = [
    ("name", "N", "engine"),
    ("kind", "N", "taken"),
    ("setting", "N", "setting"),
    ("error", "Q", "attitude error, rad"),
    ("microseconds", "Q", "µs per simulated second"),
    ("dt", "Q", "step, s"),
]
"""What hovering over a point shows: field, kind, title."""


def charts(scenes: Iterable[EngineScene]) -> dict[str, Any]:
    """Return the picture of each scene by its name; a scene on which nothing was timed has none."""
    return {scene.name: engines.work_precision(scene.points, scene.name) for scene in scenes if len(scene.points)}


def figures(scenes: Iterable[EngineScene], pictures: Mapping[str, Any]) -> dict[str, PageFigure]:
    """Return the figures of the page by scene, made of the same pictures."""
    return {scene.name: _figure(scene, pictures[scene.name]) for scene in scenes if scene.name in pictures}


def _figure(scene: EngineScene, picture: Any) -> PageFigure:
    count = scene.points["name"].nunique()
    summary = f"{len(scene.points)} measured runs of {count} engines; solid lines at their best, dashed ones as installed."
    title = f"{scene.name}: engines, wall time against attitude error"
    embedded = tuple(vega_embed.embed(picture, HOVER, 520))
    entries = (Entry(name, colour, PATHS[mark], "") for name, (colour, mark) in engines.looks(scene.points["name"]).items())
    return PageFigure(f"engines_{scene.name}", title, summary, embedded, tuple(entries))
