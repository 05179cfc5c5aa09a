"""Contests of classes on one scene: at each decade of error, and where each of the scene's own steps is stored."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pandas as pd

from conservative.benchmarks.contest import Cheapest, Contest, contests, costs
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.each_step import ERROR

from ..document.cells import DASH, Row, Table, factor, tolerance
from ..rows.names import OF_ENGINES, MethodClass, of_classes
from ..rows.points import DECADES, points

STUDY = "each_step"
"""Name of the study with every step stored."""
_COSTS = "µs per s", "µs a sample"
HEADER = (
    *("error, rad", "cheapest general integrator of ours", *_COSTS, "cheapest engine", *_COSTS, "ours is faster, times"),
    *("our solution of integrable motions", *_COSTS, "it is faster, times"),
)


@dataclass(frozen=True, eq=False)
class EachStep:
    """Methods that keep a scene's own steps within `ERROR`, each at its coarsest setting.

    Attributes
    ----------
    interval
        Time between two samples, s; NaN without the study.
    kept, alone
        Costs (see `contest.costs`) at `ERROR` of runs with every step stored, and of runs with the final state only.
    """

    interval: float
    kept: pd.DataFrame
    alone: pd.DataFrame

    @property
    def labels(self) -> tuple[str, str]:
        """Names of both kinds of runs in tables."""
        each = f"{tolerance(ERROR)}, each {self.interval:.3g} s"
        return f"{each} kept", f"{each}, the end kept"


NO_STEPS = EachStep(math.nan, pd.DataFrame(), pd.DataFrame())
"""Without the study."""


def each_step(table: pd.DataFrame, scene: str) -> EachStep:
    """Return the costs with every step stored on a scene."""
    rows = table[(table["study"] == STUDY) & (table["scene"] == scene)]
    kept, alone = (costs(points(rows, STUDY, time), [ERROR]) for time in (Measure.TIME_SAMPLED, Measure.TIME))
    return EachStep(float(rows["dt"].max()) if len(rows) else math.nan, kept, alone)


def sides(reached: pd.DataFrame, kind: MethodClass, errors: Sequence[float] = DECADES) -> list[Contest]:
    """Return the contests of one class of ours against all engines, on each scene, at each error that either side reaches."""
    scenes = reached["scene"].unique()
    found = contests(of_classes(reached, kind), of_classes(reached, *OF_ENGINES), scenes, errors)
    return [each for each in found if each.ours or each.theirs]


def as_table(points: pd.DataFrame, interval: float, each: EachStep = NO_STEPS) -> Table:
    """Return the cheapest method of each class of ours and of the engines, and how many times as fast ours is.

    A row for each decade, then two with the samples of `each`. `points` are those of one scene (see `rows.points`),
    whose samples are `interval` s apart.
    """
    body = [[tolerance(error), *row] for error, row in _rows(costs(points, DECADES), interval, DECADES)]
    for label, found in zip(each.labels, (each.kept, each.alone), strict=True):
        if len(found):
            body += [[label, *row] for _, row in _rows(found, each.interval, (ERROR,))]
    return Table(HEADER, body)


def _rows(reached: pd.DataFrame, interval: float, errors: tuple[float, ...]) -> Iterator[tuple[float, Row]]:
    """Yield each error that any method reaches, large ones first, and its cost in each class."""
    general, solutions = (
        {contest.error: contest for contest in sides(reached, kind, errors)}
        for kind in (MethodClass.GENERAL, MethodClass.SOLUTION)
    )
    for error in errors:
        if error in general or error in solutions:
            yield error, _row(general.get(error), solutions.get(error), interval)


def _row(general: Contest | None, solution: Contest | None, interval: float) -> Row:
    theirs = next((contest.theirs for contest in (general, solution) if contest), None)
    ours, solved = (_cells(contest.ours if contest else None, interval) for contest in (general, solution))
    ratios = [factor(contest.ratio, 3) if contest else DASH for contest in (general, solution)]
    return [*ours, *_cells(theirs, interval), ratios[0], *solved, ratios[1]]


def _cells(line: Cheapest | None, interval: float) -> tuple[str, str, str]:
    if line is None:
        return "none gets there", DASH, DASH
    return line.name, factor(line.time * 1e6, 3), factor(line.time * interval * 1e6, 3)
