"""The plan, measurements and origin of a report, and selections of rows that its sections share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from conservative.benchmarks.studies import random
from conservative.benchmarks.studies.step_ladder import SAMPLES
from conservative.benchmarks.studies.studies import STUDIES
from conservative.scene import Scene

from ..rows import points
from ..rows.names import with_names
from ..run.measure import Measurements
from ..run.plan import Plan
from ..run.provenance import Provenance
from . import random_bodies
from .scene_ratios import EachStep, each_step


@dataclass(frozen=True, eq=False)
class Measured:
    """The plan of a report, its measurements, and where they come from."""

    plan: Plan
    measurements: Measurements
    source: Provenance

    @property
    def main_scene(self) -> Scene:
        """The brick if the report has it, otherwise its first scene."""
        return min(self.plan.scenes, key=lambda scene: scene.name != "brick_flip")

    @cached_property
    def rows(self) -> pd.DataFrame:
        """All rows with the names of their methods (see `names.with_names`)."""
        return with_names(self.measurements.table)

    @cached_property
    def samples(self) -> pd.DataFrame:
        """All samples with the names of their methods."""
        return with_names(self.measurements.samples)

    @cached_property
    def together(self) -> pd.DataFrame:
        """The rows of the studies that compare methods on scenes, without those that have a section of their own."""
        names = [name for name, study in STUDIES.items() if not study.apart]
        return self.rows[self.rows["study"].isin(names)].reset_index(drop=True)

    @cached_property
    def scene_rows(self) -> pd.DataFrame:
        """The rows of `together` without the engines that only the section of engines compares."""
        engines = {method.name for method in self.plan.engines} - {method.name for method in self.plan.methods}
        return self.together[~self.together["method"].isin(engines)].reset_index(drop=True)

    @cached_property
    def engine_rows(self) -> pd.DataFrame:
        """The rows of `together` of the engines that the report names."""
        return self.together[self.together["method"].isin([method.name for method in self.plan.engines])]

    @cached_property
    def points(self) -> pd.DataFrame:
        """Errors and times on the scenes (see `rows.points`), and the time per `sample`, s."""
        all_points = points.points(self.rows)
        intervals = {scene.name: scene.t_end / SAMPLES for scene in self.plan.scenes}
        return all_points.assign(sample=all_points["time"] * all_points["scene"].map(intervals).astype(float))

    @cached_property
    def every_step(self) -> dict[str, EachStep | None]:
        """Costs with every step stored on each scene; None without the study."""
        return {scene.name: each_step(self.scene_rows, scene.name) for scene in self.plan.scenes}

    @cached_property
    def ratios(self) -> tuple[random_bodies.RandomRatios, ...]:
        """The ratios on random bodies; empty without that study."""
        return random_bodies.ratios(self.rows) if random.STUDY.name in self.plan.names else ()


def of_scene(rows: pd.DataFrame, scene: str) -> pd.DataFrame:
    """Return the rows of one scene, numbered from 0."""
    return rows[rows["scene"] == scene].reset_index(drop=True)
