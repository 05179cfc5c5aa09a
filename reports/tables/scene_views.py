"""What a report shows of each scene, as frozen values: tables, data of pictures, and what a reader is told first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import sphere_curves, step_ladder
from conservative.method import Method
from conservative.scene import Scene

from . import lines, orders, overview, scene, scene_contests, work_precision
from .cells import Table
from .classes import without_solutions
from .summary import Summary, of_scene


@dataclass(frozen=True, eq=False)
class SceneView:
    """What a report shows of one scene.

    Attributes
    ----------
    name, source, t_end, dt
        As the scene has them; times, s, as text.
    free, integrable
        Whether the body is free, so that its curve is a polhode, and whether its motion has a known closed form.
    summary
        What is told first.
    points, drifts, errors, curves
        Data of its charts: see `work_precision.points`, here with `sample`, s per sample, `lines.drifts`, `orders.errors`,
        named by `orders.with_slopes`, and `lines.curves`.
    front, line_count
        What nothing beats among the points but those of solutions (see `work_precision.front`), and the number of lines.
    thin_drifts
        Fewer samples of the drifts, for the page.
    fit_ends
        The ends of the lines that are fitted to the errors: see `orders.fit_ends`.
    without_curve
        Names of the methods whose curve should be drawn and could not.
    """

    name: str
    source: str
    t_end: str
    dt: str
    free: bool
    integrable: bool
    summary: Summary
    points: pd.DataFrame
    front: pd.DataFrame
    line_count: int
    drifts: pd.DataFrame
    thin_drifts: pd.DataFrame
    errors: pd.DataFrame
    fit_ends: pd.DataFrame
    curves: pd.DataFrame
    without_curve: tuple[str, ...]
    contests: Table
    drift: Table
    conservation: Table
    accuracy: Table
    order: Table
    time: Table
    costs_paid_once: Table


@dataclass(frozen=True, eq=False)
class SceneViews:
    """What the views of all scenes are made from: rows, points, drifts, fits and curves of every scene."""

    table: pd.DataFrame
    points: pd.DataFrame
    long_drifts: pd.DataFrame
    troubles: pd.DataFrame
    drifts: pd.DataFrame
    errors: pd.DataFrame
    fits: pd.DataFrame
    rate_fits: pd.DataFrame
    curves: pd.DataFrame
    pictures: tuple[Method, ...]

    @classmethod
    def of(cls, table: pd.DataFrame, samples: pd.DataFrame, methods: Sequence[Method], points: pd.DataFrame) -> SceneViews:
        """Return what all scenes share."""
        errors = orders.errors(table, Measure.ATTITUDE_MAX)
        return cls(
            table,
            points,
            overview.long_run_drifts(table),
            overview.scenes_in_trouble(table),
            lines.drifts(samples),
            errors,
            orders.fits(errors),
            orders.fits(orders.errors(table, Measure.RATES_MAX)),
            lines.curves(samples),
            tuple(sphere_curves.select_methods(methods)),
        )

    def scene(self, value: Scene) -> SceneView:
        """Return the view of one scene."""
        name, table = value.name, self.table
        points, drifts, each = _of(self.points, name), _of(self.drifts, name), scene_contests.each_step(table, name)
        interval = value.t_end / step_ladder.SAMPLES
        points = points.assign(sample=points["time"] * interval)
        fits, curves = _of(self.fits, name), _of(self.curves, name)
        return SceneView(
            name=name,
            source=value.source,
            t_end=f"{value.t_end:g}",
            dt=f"{value.dt:g}",
            free=value.free,
            integrable=value.integrable,
            summary=of_scene(points, _of(self.long_drifts, name), _of(self.troubles, name), value.integrable, each),
            points=points,
            front=work_precision.front(without_solutions(points)),
            line_count=points["name"].nunique(),
            drifts=drifts,
            thin_drifts=lines.thin(drifts),
            errors=orders.with_slopes(_of(self.errors, name), fits),
            fit_ends=orders.fit_ends(orders.with_slopes(fits, fits)),
            curves=curves,
            without_curve=tuple(method.name for method in self.pictures if method.name not in set(curves["method"])),
            contests=scene_contests.as_table(points, interval, each),
            drift=scene.drift(table, name),
            conservation=overview.conservation(table, name),
            accuracy=scene.accuracy(table, name),
            order=scene.order(fits, _of(self.rate_fits, name)),
            time=scene.time(table, name),
            costs_paid_once=scene.costs_paid_once(table, name),
        )


def _of(rows: pd.DataFrame, scene_name: str) -> pd.DataFrame:
    return rows[rows["scene"] == scene_name].reset_index(drop=True)
