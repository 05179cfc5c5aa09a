"""The README's tables, from a report: `python -m conservative.reports.documentation.readme_table report` prints that of costs.

With `--engines` it prints that of engines, from a report with this option; with `--random` that of random bodies, whose rows
are in a report or in what `conservative study random --out FOLDER` leaves.
Each cell is the cheapest way of a class of methods to an attitude error, in µs per simulated second, with its setting.
Solutions of integrable motions are a class of their own: they exist for few scenes, and go from sample to sample in one step.
So the last rows of a scene take each of its own steps: with all of them kept as samples, and with the end alone.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from conservative.benchmarks.studies.each_step import ERROR
from conservative.method import Role

from ..labels import display_name, with_names
from ..tables import each_step
from ..tables.cells import DASH, factor, tolerance
from ..tables.classes import OF_ENGINES, MethodClass, with_classes
from ..tables.engine_rows import ONE_STEP, EngineRow, engine_rows, points_of
from ..tables.random_contests import Contest, contests
from ..tables.random_ratios import by_engine
from ..tables.work_precision import cost, points

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad."""
APART = (MethodClass.GENERAL, MethodClass.SOLUTION)
"""Classes with a column of their own; of engines each one has one."""


def columns(found: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return points (see `work_precision.points`) by column: our classes, and each engine under its name with its version."""
    members = with_classes(found)
    ours = {kind.value: members[members["class"] == kind] for kind in APART}
    engines = members[members["class"].isin(OF_ENGINES)]
    theirs = {" ".join(map(str, key)): rows for key, rows in engines.groupby(["family", "version"], sort=False)}
    return {**ours, **theirs}


class Entry(NamedTuple):
    """A row of the table: scene, what is compared, the points of each column, and the error, rad."""

    scene: str
    label: str
    columns: dict[str, pd.DataFrame]
    error: float


def rows(found: Iterable[Entry]) -> Iterator[list[str]]:
    """Yield the header, and rows for each scene: the cheapest is bold, and a dash says that no point gets there."""
    every = list(found)
    header = list(dict.fromkeys(name for entry in every for name in entry.columns))
    yield ["scene", "error, rad", *header]
    for scene, label, members, error in every:
        costs = [cheapest(members[name], error) if name in members else (math.inf, "") for name in header]
        yield [scene, label, *cells(costs)]


def entries(table: pd.DataFrame) -> Iterator[Entry]:
    """Yield the rows of the table, from named measurements (see `labels.with_names`)."""
    found = points(table)
    for scene in found["scene"].unique():
        here, each = found[found["scene"] == scene], each_step.of_scene(table, str(scene))
        lines = [(tolerance(error), here, error) for error in ERRORS]
        lines += [(label, kept, ERROR) for label, kept in zip(each.labels, (each.kept, each.alone), strict=True) if len(kept)]
        yield from (Entry(str(scene), label, columns(members), error) for label, members, error in lines)


def cheapest(lines: pd.DataFrame, error: float) -> tuple[float, str]:
    """Return the time, s per simulated second, and the setting of the cheapest line at an error, rad; else inf."""
    found = [(cost(line, error), _setting(line.iloc[0])) for _, line in lines.groupby("name", sort=False)]
    return min((entry for entry in found if not math.isnan(entry[0])), default=(math.inf, ""))


def _setting(point: pd.Series[str]) -> str:
    """Return what to call the line of a point: an engine's name heads the column."""
    return display_name("", "", point["setting"]) if point["role"] == Role.ENGINE.value else point["name"]


def cells(costs: Sequence[tuple[float, str]]) -> list[str]:
    """Return the costs of a row as text: µs to two digits, as reports differ in the second, and the setting."""
    least = min(time for time, _ in costs)
    return [cell(time, setting, time == least) for time, setting in costs]


def cell(time: float, setting: str, bold: bool) -> str:
    """Return one cell."""
    if math.isinf(time):
        return DASH
    digits = factor(1e6 * time)
    return f"**{digits}** {setting}" if bold else f"{digits} {setting}"


def read(path: Path) -> pd.DataFrame:
    """Return the measurements of a report; an empty text is one, not a number that is missing."""
    texts = ("family", "version", "setting", "series_setting", "quantity", "reason", "detail")
    return pd.read_csv(path, dtype=dict.fromkeys(texts, "string")).fillna(dict.fromkeys(texts, ""))


def engines(table: pd.DataFrame) -> Iterator[list[str]]:
    """Yield the header, and a row for each engine on the first scene: as installed, and at its best."""
    scene = str(table[table["study"] == ONE_STEP]["scene"].iloc[0])
    found = engine_rows(table, scene, points_of(table))
    yield ["engine", "bits", "as installed", "error, rad", "energy drift", "at its best", "error, rad", "energy drift", "order"]
    for best in (row for row in found if row.best):
        installed = next((row for row in found if row.engine == best.engine and row.as_installed), None)
        order = "–" if math.isnan(best.order) else f"{best.order:.1f}"
        yield [best.engine, f"{best.bits:.0f}", *(_run(installed) if installed else "–––"), *_run(best), order]


def _run(row: EngineRow) -> list[str]:
    """Return setting, error and energy drift of a row."""
    return [row.label.partition("/")[2], f"{row.error:.2g}", f"{row.energy.size:.1g} {row.energy.direction}".strip()]


def random_bodies(found: Iterable[Contest]) -> Iterator[Sequence[str]]:
    """Yield the header, and a row for each field and engine, which has no column if it is the only one: its time over ours."""
    header, body = by_engine(found)
    first = 1 if len({str(row[1]) for row in body}) > 1 else 2
    yield from ([str(row[0]), *map(str, row[first:])] for row in (header, *body))


def markdown(lines: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    header, *body = lines
    return [f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *body)]


def main() -> None:
    """Print a table as Markdown."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.readme_table", description=__doc__)
    parser.add_argument("report", nargs="?", type=Path, default=Path("report"), help="a report's folder [default: report]")
    parser.add_argument("--engines", action="store_true", help="the table of engines")
    parser.add_argument("--random", action="store_true", help="the table of random bodies")
    options = parser.parse_args()
    found = with_names(read(rows_in(options.report)))
    lines = random_bodies(contests(found)) if options.random else engines(found) if options.engines else rows(entries(found))
    print("\n".join(markdown(lines)))


def rows_in(folder: Path) -> Path:
    """Return the file of measurements in the folder of a report, or of a study."""
    names = ("measurements.csv", "study.csv")
    return next((folder / name for name in names if (folder / name).exists()), folder / names[0])


if __name__ == "__main__":
    main()
