"""The report as one frozen value, computed from the measurements in one pass; what renders it neither measures nor fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import sphere_curves
from conservative.benchmarks.studies.studies import ENGINES, RANDOM
from conservative.method import Method
from conservative.scene import Scene

from .labels import with_names
from .run.measure import Measurements
from .run.plan import Plan
from .run.provenance import Provenance
from .tables import (
    claims,
    engine_scenes,
    engine_tables,
    hard_cases,
    headline,
    lines,
    orders,
    overview,
    paper,
    random_ratios,
    runs,
    scene,
    work_precision,
)
from .tables.cells import Table


@dataclass(frozen=True, eq=False)
class SceneView:
    """What a report shows of one scene.

    Attributes
    ----------
    name, source, t_end, dt
        As the scene has them; times, s, as text.
    free
        Whether the body is free, so that its curve is a polhode.
    points, drifts, errors, curves
        Data of its charts: see `work_precision.points`, `lines.drifts`, `orders.errors`, named by `orders.with_slopes`, and
        `lines.curves`.
    front, line_count
        What nothing beats among the points (see `work_precision.front`), and the number of their lines.
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
class PaperView:
    """The paper's figures, drawn again: data of the charts (see `lines`), empty without the figure's scene, and a table."""

    body_rates: pd.DataFrame
    conservation_errors: pd.DataFrame
    centre_of_mass: pd.DataFrame
    position_errors: Table | None


@dataclass(frozen=True, eq=False)
class View:
    """What a report shows.

    Attributes
    ----------
    source
        Where the numbers come from.
    quick
        Whether the report is coarser than it could be.
    table
        The measurements, a row each.
    random
        What was found on random bodies; None where the report has no such study.
    headline
        Where an engine beats us on the scenes, and where it does not.
    failed
        What of ours failed at the steps of the paper, one line each.
    hard_cases, stability
        None where the report has no such study.
    engines, versions
        What the studies of engines found on each scene, empty without them, and the version of each engine in them.
    """

    source: Provenance
    quick: bool
    table: pd.DataFrame
    random: random_ratios.RandomView | None
    headline: tuple[headline.Statement, ...]
    failed: tuple[str, ...]
    verdict: Table
    scenes: tuple[SceneView, ...]
    paper: PaperView
    hard_cases: Table | None
    stability: Table | None
    claims: Table
    imports: Table
    truths: Table
    failures: Table
    unsupported: Table
    engines: tuple[engine_scenes.EngineScene, ...]
    versions: Table


def build(plan: Plan, measurements: Measurements, source: Provenance) -> View:
    """Return the view of measurements; every number that a report shows is computed here, and once."""
    every, samples = with_names(measurements.table), with_names(measurements.samples)
    of_engines = every["study"].isin(ENGINES)
    table = every[~every["study"].isin((*ENGINES, RANDOM))].reset_index(drop=True)
    builder = _Builder.of(table, samples, plan.methods)
    return View(
        source=source,
        quick=plan.quick,
        table=measurements.table,
        random=random_ratios.view(every, plan.bodies, plan.seed) if RANDOM in plan.names else None,
        headline=tuple(headline.statements(builder.contests)),
        failed=tuple(runs.failures_of_ours(table)),
        verdict=overview.verdict(table, builder.points),
        scenes=tuple(builder.scene(value) for value in plan.scenes),
        paper=_paper(table, samples),
        hard_cases=hard_cases.hard_cases(table),
        stability=hard_cases.stability(table),
        claims=claims.as_table(claims.findings(table, builder.fits, plan.scenes)),
        imports=runs.imports(table),
        truths=runs.truths(table),
        failures=runs.failures(table),
        unsupported=runs.unsupported(table),
        engines=engine_scenes.engine_scenes(every[of_engines], plan.scenes) if plan.engines else (),
        versions=_versions(plan, source),
    )


def _versions(plan: Plan, source: Provenance) -> Table:
    """Return the versions of the engines that are named for their own studies: in environments, and beside us."""
    apart = {lock.name for lock in source.environments}
    makers = dict.fromkeys(method.label.partition("/")[0] for method in plan.engines if "/" in method.label)
    locks = [(lock.name, lock.python, len(lock.packages)) for lock in source.environments if lock.name in makers]
    return engine_tables.versions(locks, [name for name in makers if name not in apart])


def _paper(table: pd.DataFrame, samples: pd.DataFrame) -> PaperView:
    return PaperView(
        lines.body_rates(samples),
        lines.conservation_errors(samples),
        lines.centre_of_mass(samples),
        paper.position_errors(table),
    )


@dataclass(frozen=True, eq=False)
class _Builder:
    """What the views of all scenes are made from."""

    table: pd.DataFrame
    points: pd.DataFrame
    contests: Sequence[work_precision.Contest]
    drifts: pd.DataFrame
    errors: pd.DataFrame
    fits: pd.DataFrame
    rate_fits: pd.DataFrame
    curves: pd.DataFrame
    pictures: tuple[Method, ...]

    @classmethod
    def of(cls, table: pd.DataFrame, samples: pd.DataFrame, methods: Sequence[Method]) -> _Builder:
        """Return what all scenes share."""
        points, errors = work_precision.points(table), orders.errors(table, Measure.ATTITUDE_MAX)
        return cls(
            table,
            points,
            work_precision.contests(points),
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
        points, drifts = _of(self.points, name), _of(self.drifts, name)
        fits, curves = _of(self.fits, name), _of(self.curves, name)
        return SceneView(
            name=name,
            source=value.source,
            t_end=f"{value.t_end:g}",
            dt=f"{value.dt:g}",
            free=value.free,
            points=points,
            front=work_precision.front(points),
            line_count=points["name"].nunique(),
            drifts=drifts,
            thin_drifts=lines.thin(drifts),
            errors=orders.with_slopes(_of(self.errors, name), fits),
            fit_ends=orders.fit_ends(orders.with_slopes(fits, fits)),
            curves=curves,
            without_curve=tuple(method.name for method in self.pictures if method.name not in set(curves["method"])),
            contests=scene.contests(contest for contest in self.contests if contest.scene == name),
            drift=scene.drift(table, name),
            conservation=overview.conservation(table, name),
            accuracy=scene.accuracy(table, name),
            order=scene.order(fits, _of(self.rate_fits, name)),
            time=scene.time(table, name),
            costs_paid_once=scene.costs_paid_once(table, name),
        )


def _of(rows: pd.DataFrame, scene_name: str) -> pd.DataFrame:
    return rows[rows["scene"] == scene_name].reset_index(drop=True)
