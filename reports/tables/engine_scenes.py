"""What a report shows of engines on each scene, as frozen values: tables, and the points of the picture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.studies.engines_at_one_step import AS_INSTALLED
from conservative.scene import Scene

from .cells import Table
from .engine_rows import EngineRow, engine_rows, points_of
from .engine_tables import AT_ITS_BEST, beside, every_setting


@dataclass(frozen=True, eq=False)
class EngineScene:
    """What a report shows of engines on one scene.

    Attributes
    ----------
    name, dt, t_end
        As the scene has them; times, s, as text.
    count
        Number of engines that do the scene.
    beside, settings
        Each engine as installed beside its best setting, and every setting.
    points
        Of the picture, coarse to fine: columns name (engine with version), kind (as installed, or at its best), setting,
        dt (s), error (rad), time (s per simulated second).
    """

    name: str
    dt: str
    t_end: str
    count: int
    beside: Table
    settings: Table
    points: pd.DataFrame


def engine_scenes(table: pd.DataFrame, scenes: Iterable[Scene]) -> tuple[EngineScene, ...]:
    """Return what a report shows of engines; `table` has the rows of their studies, with names (see `labels.with_names`)."""
    points = points_of(table)
    return tuple(_scene(engine_rows(table, scene.name, points), points, scene) for scene in scenes)


def _scene(rows: Sequence[EngineRow], points: pd.DataFrame, scene: Scene) -> EngineScene:
    dt = f"{scene.dt:g}"
    return EngineScene(
        name=scene.name,
        dt=dt,
        t_end=f"{scene.t_end:g}",
        count=len({row.engine for row in rows if row.outcome.ok}),
        beside=beside(rows),
        settings=every_setting(rows, dt),
        points=_picture(rows, points[points["scene"] == scene.name]),
    )


_COLUMNS = ["name", "kind", "setting", "dt", "error", "time"]


def _picture(rows: Sequence[EngineRow], points: pd.DataFrame) -> pd.DataFrame:
    """Return the points of each engine's best setting, and as installed where that is another one: two lines an engine."""
    parts = [
        points[points["series"] == row.series].assign(name=row.engine, kind=AT_ITS_BEST if row.best else AS_INSTALLED)
        for row in rows
        if row.best or row.as_installed
    ]
    found = pd.concat(parts, ignore_index=True) if parts else points.assign(kind="")
    return found[_COLUMNS].sort_values(["name", "kind"], kind="stable", ignore_index=True)
