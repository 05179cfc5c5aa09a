"""The README's tables, from a report: `python -m conservative.reports.documentation.readme_table report` prints that of costs.

With `--engines` it prints that of engines, from a report with this option; with `--random` that of random bodies, whose rows
are in a report or in what `conservative study random --out FOLDER` leaves.
Each cell is the cheapest way of a group of methods to an attitude error, in µs per simulated second, with its setting. Exact
steps are a group of their own: they exist for few scenes, and have no truncation error that a shorter step would lower.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from conservative import registry
from conservative.benchmarks.studies.selection import takes_exact_steps
from conservative.method import Role

from ..labels import with_names
from ..tables.engine_rows import ONE_STEP, EngineRow, engine_rows, points_of
from ..tables.random_contests import Contest, contests
from ..tables.random_ratios import by_engine
from ..tables.work_precision import cost, points

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad."""
OURS, EXACT = "ours", "ours, exact step"


def groups(found: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return the measured points of ours, of our exact steps, and of each engine under its name with its version."""
    ours = found[found["role"] == Role.OURS.value]
    exact = ours["method"].map(lambda name: takes_exact_steps(registry.method(name))).astype(bool)
    engines = found[found["role"] == Role.ENGINE.value]
    members = {" ".join(map(str, key)): rows for key, rows in engines.groupby(["family", "version"], sort=False)}
    return {OURS: ours[~exact], EXACT: ours[exact], **members}


def rows(found: pd.DataFrame) -> Iterator[list[str]]:
    """Yield the header, and a row for each scene and error: the cheapest is bold, and a dash says that no point gets there."""
    members = groups(found)
    yield ["scene", "error, rad", *members]
    for scene in found["scene"].unique():
        for error in ERRORS:
            costs = {name: cheapest(lines[lines["scene"] == scene], error) for name, lines in members.items()}
            yield [str(scene), f"{error:.0e}", *cells(costs)]


def cheapest(lines: pd.DataFrame, error: float) -> tuple[float, str]:
    """Return the time, s per simulated second, and the setting of the cheapest line at an error, rad; else inf."""
    found = [(cost(line, error), _setting(line.iloc[0])) for _, line in lines.groupby("name", sort=False)]
    return min((entry for entry in found if not math.isnan(entry[0])), default=(math.inf, ""))


def _setting(point: pd.Series[str]) -> str:
    """Return what to call the line of a point: an engine's name heads the column."""
    return point["setting"] if point["role"] == Role.ENGINE.value else point["name"]


def cells(costs: Mapping[str, tuple[float, str]]) -> list[str]:
    """Return the costs of a row as text: µs to three digits, and the setting."""
    least = min(time for time, _ in costs.values())
    return [cell(time, setting, time == least) for time, setting in costs.values()]


def cell(time: float, setting: str, bold: bool) -> str:
    """Return one cell."""
    if math.isinf(time):
        return "–"
    digits = f"{float(f'{1e6 * time:.3g}'):,g}"
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
    lines = random_bodies(contests(found)) if options.random else engines(found) if options.engines else rows(points(found))
    print("\n".join(markdown(lines)))


def rows_in(folder: Path) -> Path:
    """Return the file of measurements in the folder of a report, or of a study."""
    names = ("measurements.csv", "study.csv")
    return next((folder / name for name in names if (folder / name).exists()), folder / names[0])


if __name__ == "__main__":
    main()
