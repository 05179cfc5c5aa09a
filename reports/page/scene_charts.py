"""The charts of a scene that report.md and the page share, each built once."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..charts import figures
from ..view import SceneView


class SceneCharts(NamedTuple):
    """The charts of a scene; the fields begin the names of their files."""

    work_precision: Any
    drift: Any
    convergence: Any


def build(scene: SceneView) -> SceneCharts:
    """Return the charts of a scene."""
    return SceneCharts(
        figures.work_precision(scene.points, scene.front, scene.name),
        figures.drift(scene.drifts, scene.name),
        figures.convergence(scene.errors, scene.fit_ends, scene.name),
    )
