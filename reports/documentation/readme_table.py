"""The README's table of costs, from a report: `python -m conservative.reports.documentation.readme_table report` prints it.

Each cell is the cheapest way of a group of methods to an attitude error, in µs per simulated second, with its setting. Exact
steps are a group of their own: they exist for few scenes, and have no truncation error that a shorter step would lower.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd

from conservative import registry
from conservative.method import Role

from ..tables.work_precision import cost, points

ERRORS = (1e-3, 1e-6, 1e-9)
"""Attitude errors, rad."""
OURS, EXACT = "ours", "ours, exact step"


def groups(found: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return the measured points of ours, of our exact steps, and of each engine under its name with its version."""
    ours = found[found["role"] == Role.OURS.value]
    exact = ours["method"].map(lambda name: registry.method(name).order is None).astype(bool)
    engines = found[found["role"] == Role.ENGINE.value]
    names = engines["series"].str.split(" ").str[:2].str.join(" ")
    return {OURS: ours[~exact], EXACT: ours[exact], **{str(name): rows for name, rows in engines.groupby(names, sort=False)}}


def rows(found: pd.DataFrame) -> Iterator[list[str]]:
    """Yield the header, and a row for each scene and error: the cheapest is bold, and a dash says that no point gets there."""
    members = groups(found)
    yield ["scene", "error, rad", *members]
    for scene in found["scene"].unique():
        for error in ERRORS:
            costs = {name: cheapest(lines[lines["scene"] == scene], error) for name, lines in members.items()}
            yield [str(scene), f"{error:.0e}", *cells(costs)]


def cheapest(lines: pd.DataFrame, error: float) -> tuple[float, str]:
    """Return the time, s per simulated second, and the name of the cheapest line at an error, rad; else inf."""
    found = [(cost(line, error), str(name)) for name, line in lines.groupby("series", sort=False)]
    return min((entry for entry in found if not math.isnan(entry[0])), default=(math.inf, ""))


def cells(costs: Mapping[str, tuple[float, str]]) -> list[str]:
    """Return the costs of a row as text: µs to three digits, and the setting without the name that heads the column."""
    least = min(time for time, _ in costs.values())
    return [cell(time, series.removeprefix(name).strip(), time == least) for name, (time, series) in costs.items()]


def cell(time: float, setting: str, bold: bool) -> str:
    """Return one cell."""
    if math.isinf(time):
        return "–"
    digits = f"{float(f'{1e6 * time:.3g}'):,g}"
    return f"**{digits}** {setting}" if bold else f"{digits} {setting}"


def main() -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.readme_table", description=__doc__)
    parser.add_argument("report", nargs="?", type=Path, default=Path("report"), help="a report's folder [default: report]")
    table = pd.read_csv(parser.parse_args().report / "measurements.csv")
    header, *body = rows(points(table))
    for row in (header, ["---"] * len(header), *body):
        print("|", " | ".join(row), "|")


if __name__ == "__main__":
    main()
