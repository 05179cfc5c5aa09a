"""Which rows of a report and of a study of random bodies README's numbers follow from; the rest is left out.

Of every cell the line that decides it stays, with all its settings. That nothing else decides is checked: README's tables, made
of the rows that stay, have to be those made of all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pandas as pd

from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies.paper import APPROXIMATE
from conservative.errors import BadInput

from ...labels import with_names
from ...tables import each_step
from ...tables.random_contests import ANY, contests
from ...tables.random_ratios import MILESTONES
from ..readme_table import cheapest, entries, random_bodies, rows

Lines = set[tuple[str, str]]
"""Scene and series of lines."""


def of_costs(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a report that README's table of costs, its drifts and errors follow from.

    Raises
    ------
    BadInput
        They do not give the table that the whole report gives.
    """
    compared = table["study"].isin(("work_precision", each_step.STUDY)) & _among(table, set(_lines(with_names(table))))
    energy = (table["measure"] == Measure.DRIFT_MAX.text) & (table["quantity"] == "energy")
    of_paper = (table["study"] == "paper") & (energy | (table["measure"] == Measure.ATTITUDE_MAX.text))
    truths = (table["measure"] == Measure.AGREEMENT.text) & (table["detail"] == APPROXIMATE)
    return _checked(table, compared | of_paper | truths, lambda some: list(rows(entries(with_names(some)))))


def _lines(table: pd.DataFrame) -> Iterator[tuple[str, str]]:
    """Yield the cheapest line of each cell; where none gets there one in any case, so that the column stays."""
    for scene, _, columns, error in entries(table):
        for members in columns.values():
            lines = [points for _, points in members.groupby("name", sort=False)]
            yield from ((scene, str(best["series"].iloc[0])) for best in _cheapest(lines, error))


def _cheapest(lines: list[pd.DataFrame], error: float) -> list[pd.DataFrame]:
    return sorted(lines, key=lambda line: cheapest(line, error)[0])[:1]


def of_random_bodies(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a study of random bodies that README's table of them follows from.

    Raises
    ------
    BadInput
        They do not give the table that the whole study gives.
    """
    found = [contest for contest in contests(with_names(table)) if contest.engine != ANY and contest.error in MILESTONES]
    sides = ((pair.scene, side) for contest in found for pair in contest.pairs for side in (pair.ours, pair.engine))
    lines = {(scene, side.line) for scene, side in sides if side}
    return _checked(table, _among(table, lines), lambda some: list(random_bodies(contests(with_names(some)))))


def _among(table: pd.DataFrame, lines: Lines) -> pd.Series[bool]:
    found = [line in lines for line in zip(table["scene"], table["series"], strict=True)]
    return pd.Series(found, index=table.index, dtype=bool)


def _checked(table: pd.DataFrame, kept: pd.Series[bool], tables: Callable[[pd.DataFrame], object]) -> pd.DataFrame:
    """Return the rows that are kept, if what README shows of them is what it shows of all."""
    extract = table[kept].reset_index(drop=True)
    if extract.empty or tables(extract) != tables(table):
        raise BadInput("folder", f"{len(table)} rows, of which {len(extract)} decide", "rows that README's tables follow from")
    return extract
