"""The table of one scene that sets classes against each other: at each decade, and where each of the scene's steps is kept."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pandas as pd

from conservative.benchmarks.studies.each_step import ERROR

from . import work_precision
from .cells import DASH, Row, Table, factor, tolerance
from .classes import OF_ENGINES, MethodClass, with_classes
from .each_step import EachStep
from .work_precision import CheapestLine, Contest

_COSTS = "µs per s", "µs a sample"
HEADER = (
    *("error, rad", "cheapest general integrator of ours", *_COSTS, "cheapest engine", *_COSTS, "ours is faster, times"),
    *("our solution of integrable motions", *_COSTS, "it is faster, times"),
)
NOTHING = EachStep(math.nan, pd.DataFrame(), pd.DataFrame())
"""No study of samples at each step."""


def contests(points: pd.DataFrame, interval: float, each: EachStep = NOTHING) -> Table:
    """Return the cheapest of each class of ours and of the engines, and how many times as fast ours is.

    A row for each decade, then two with the samples of `each`. `points` are those of one scene (see `work_precision.points`),
    whose samples are `interval` s apart.
    """
    decades = _rows(with_classes(points), interval, work_precision.DECADES)
    body = [[tolerance(error), *row] for error, row in decades]
    for label, found in zip(each.labels, (each.kept, each.alone), strict=True):
        if len(found):
            body += [[label, *row] for _, row in _rows(found, each.interval, (ERROR,))]
    return HEADER, body


def _rows(points: pd.DataFrame, interval: float, errors: tuple[float, ...]) -> Iterator[tuple[float, Row]]:
    """Yield each error that anybody gets to, large ones first, and what it costs in each class."""
    solution = points["class"] == MethodClass.SOLUTION
    theirs = points["class"].isin(OF_ENGINES)
    general, solutions = (
        {contest.error: contest for contest in work_precision.contests(points[members], errors)}
        for members in (~solution, solution | theirs)
    )
    for error in errors:
        found = general.get(error), solutions.get(error)
        if any(found):
            yield error, _row(*found, interval)


def _row(general: Contest | None, solution: Contest | None, interval: float) -> Row:
    theirs = next((contest.theirs for contest in (general, solution) if contest), None)
    ours, solved = (_costs(contest.ours if contest else None, interval) for contest in (general, solution))
    ratios = [factor(contest.ratio, 3) if contest else DASH for contest in (general, solution)]
    return [*ours, *_costs(theirs, interval), ratios[0], *solved, ratios[1]]


def _costs(line: CheapestLine | None, interval: float) -> tuple[str, str, str]:
    if line is None:
        return "none gets there", DASH, DASH
    return line.name, factor(line.time * 1e6, 3), factor(line.time * interval * 1e6, 3)
