"""The report as one frozen value, computed from the measurements in one pass; what renders it neither measures nor fits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.studies.studies import ENGINES, RANDOM, THROUGHPUT

from .labels import with_names
from .run.measure import Measurements
from .run.plan import Plan
from .run.provenance import Provenance
from .tables import (
    closing,
    engine_scenes,
    engine_tables,
    hard_cases,
    headline,
    lines,
    paper,
    random_bodies,
    runs,
    scene_contests,
    throughput,
    work_precision,
)
from .tables.cells import Table
from .tables.scene_views import SceneView as SceneView
from .tables.scene_views import SceneViews
from .tables.summary import Summary


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
    first, about
        The summary that the report begins with, and what it is about: random bodies where there are some, else a scene.
    random
        What was found on random bodies; None where the report has no such study.
    throughput
        What many bodies cost; None where the report has no such study.
    headline
        Where an engine beats us on the scenes, and where it does not.
    failed
        What of ours failed at the steps of the paper, one line each.
    hard_cases, stability
        None where the report has no such study.
    closing, verdict
        The end of the command on the terminal: a table per scene, by name, and one sentence about the scenes.
    engines, versions
        What the studies of engines found on each scene, empty without them, and the version of each engine in them.
    """

    source: Provenance
    quick: bool
    table: pd.DataFrame
    first: Summary
    about: str
    random: random_bodies.RandomView | None
    throughput: throughput.ThroughputView | None
    headline: tuple[headline.Statement, ...]
    failed: tuple[str, ...]
    scenes: tuple[SceneView, ...]
    paper: PaperView
    hard_cases: hard_cases.HardCases | None
    stability: Table | None
    truths: Table
    failures: Table
    unsupported: Table
    engines: tuple[engine_scenes.EngineScene, ...]
    versions: Table
    closing: tuple[tuple[str, Table], ...]
    verdict: str


def build(plan: Plan, measurements: Measurements, source: Provenance) -> View:
    """Return the view of measurements; every number that a report shows is computed here, and once."""
    every, samples = with_names(measurements.table), with_names(measurements.samples)
    of_engines = every["study"].isin(ENGINES)
    table = every[~every["study"].isin((*ENGINES, RANDOM, THROUGHPUT))].reset_index(drop=True)
    builder = SceneViews.of(table, samples, plan.methods, work_precision.all_points(every))
    scenes = tuple(builder.scene(value) for value in plan.scenes)
    contests = random_bodies.ratios(every) if RANDOM in plan.names else ()
    first, about = _first(scenes, every, contests, builder.long_drifts)
    return View(
        source=source,
        quick=plan.quick,
        table=measurements.table,
        first=first,
        about=about,
        random=random_bodies.view(contests, plan.bodies, plan.seed) if RANDOM in plan.names else None,
        throughput=throughput.view(every) if THROUGHPUT in plan.names else None,
        headline=headline.first_lost(
            [*headline.of_random_bodies(contests), *headline.of_points(builder.points), *_each_step(plan, table)]
        ),
        failed=tuple(runs.failures_of_ours(table)),
        scenes=scenes,
        paper=_paper(table, samples),
        hard_cases=hard_cases.hard_cases(table),
        stability=hard_cases.stability(table),
        truths=runs.truths(table),
        failures=runs.failures(table),
        unsupported=runs.unsupported(table),
        engines=engine_scenes.engine_scenes(every[of_engines], plan.scenes) if plan.engines else (),
        versions=_versions(plan, source),
        closing=tuple((scene.name, closing.scene_table(every, scene.points, scene.name)) for scene in scenes),
        verdict=closing.verdict(builder.points, [scene.name for scene in scenes]),
    )


def _each_step(plan: Plan, table: pd.DataFrame) -> Iterator[headline.Statement]:
    for scene in plan.scenes:
        yield from headline.of_each_step(scene.name, scene_contests.each_step(table, scene.name))


def _first(
    scenes: Sequence[SceneView],
    every: pd.DataFrame,
    contests: Sequence[random_bodies.RandomRatios],
    drifts: pd.DataFrame,
) -> tuple[Summary, str]:
    """Return the summary of random bodies; without any that of a scene, of one without a closed form if there is one."""
    if contests:
        return random_bodies.summary(every, contests, drifts), "Random bodies"
    scene = min(scenes, key=lambda scene: scene.integrable)
    return scene.summary, scene.name


def _versions(plan: Plan, source: Provenance) -> Table:
    """Return the versions of the engines that are named for their own studies: in environments, and beside us."""
    apart = {lock.name for lock in source.environments}
    makers = dict.fromkeys(str(method.maker) for method in plan.engines if not isinstance(method, Missing))
    locks = [(lock.name, lock.python, len(lock.packages)) for lock in source.environments if lock.name in makers]
    return engine_tables.versions(locks, [name for name in makers if name not in apart])


def _paper(table: pd.DataFrame, samples: pd.DataFrame) -> PaperView:
    return PaperView(
        lines.body_rates(samples),
        lines.conservation_errors(samples),
        lines.centre_of_mass(samples),
        paper.position_errors(table),
    )
