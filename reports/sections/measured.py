"""What the sections of a report are made from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from conservative.benchmarks.studies.studies import ENGINES, RANDOM, THROUGHPUT

from ..labels import with_names
from ..run.measure import Measurements
from ..run.plan import Plan
from ..run.provenance import Provenance
from ..tables import overview, work_precision
from . import random_bodies


@dataclass(frozen=True, eq=False)
class Measured:
    """The plan of a report, its measurements, and where they come from."""

    plan: Plan
    measurements: Measurements
    source: Provenance

    @cached_property
    def rows(self) -> pd.DataFrame:
        """All rows with the names of their methods (see `labels.with_names`)."""
        return with_names(self.measurements.table)

    @cached_property
    def samples(self) -> pd.DataFrame:
        """All samples with the names of their methods."""
        return with_names(self.measurements.samples)

    @cached_property
    def scene_rows(self) -> pd.DataFrame:
        """The rows of the studies that compare methods on scenes."""
        return self.rows[~self.rows["study"].isin((*ENGINES, RANDOM, THROUGHPUT))].reset_index(drop=True)

    @cached_property
    def points(self) -> pd.DataFrame:
        """Errors and times on the scenes (see `work_precision.points`)."""
        return work_precision.all_points(self.rows)

    @cached_property
    def long_drifts(self) -> pd.DataFrame:
        """The largest drifts of long runs (see `overview.long_run_drifts`)."""
        return overview.long_run_drifts(self.scene_rows)

    @cached_property
    def ratios(self) -> tuple[random_bodies.RandomRatios, ...]:
        """The ratios on random bodies; empty without that study."""
        return random_bodies.ratios(self.rows) if RANDOM in self.plan.names else ()


def of_scene(rows: pd.DataFrame, scene: str) -> pd.DataFrame:
    """Return the rows of one scene, numbered from 0."""
    return rows[rows["scene"] == scene].reset_index(drop=True)
