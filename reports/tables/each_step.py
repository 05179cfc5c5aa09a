"""What a sample costs where each of a scene's own steps is kept, from the study of that name."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.each_step import ERROR

from .cells import tolerance
from .classes import with_classes
from .work_precision import points

STUDY = "each_step"
"""Name of the study."""


@dataclass(frozen=True, eq=False)
class EachStep:
    """The methods that keep a scene's own steps within `ERROR`, each at its coarsest setting.

    Attributes
    ----------
    interval
        Between two samples, s; nan where nothing was measured.
    kept, alone
        Points (see `work_precision.points`, with their class) of runs that keep all samples, and of those that keep the end.
    """

    interval: float
    kept: pd.DataFrame
    alone: pd.DataFrame

    @property
    def labels(self) -> tuple[str, str]:
        """What rows of tables are about: all samples, and the end alone."""
        each = f"{tolerance(ERROR)}, each {self.interval:.3g} s"
        return f"{each} kept", f"{each}, the end kept"


def of_scene(table: pd.DataFrame, scene: str) -> EachStep:
    """Return what was found on a scene."""
    rows = table[(table["study"] == STUDY) & (table["scene"] == scene)]
    kept, alone = (with_classes(points(rows, STUDY, time)) for time in (Measure.TIME_SAMPLED, Measure.TIME))
    return EachStep(float(rows["dt"].max()) if len(rows) else math.nan, kept, alone)
