"""Accuracy as columns beside the times at the end of `pytest --benchmark`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

TIMES = ("min", "median")


def lines(benchmarks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a text table of pytest-benchmark's flat rows: name, times in s, and every number in `extra_info`."""
    names: dict[str, None] = {}
    for row in benchmarks:
        names.update({key: None for key, value in row["extra_info"].items() if isinstance(value, int | float)})
    header = ["benchmark", *(f"{time}, s" for time in TIMES), *names]
    body = [_cells(row, names) for row in sorted(benchmarks, key=lambda row: (row["group"] or "", row["min"]))]
    widths = [max(len(cells[column]) for cells in [header, *body]) for column in range(len(header))]
    return [_line(cells, widths) for cells in [header, *body]]


def _cells(row: Mapping[str, Any], names: Iterable[str]) -> list[str]:
    values = [*(row[time] for time in TIMES), *(row["extra_info"].get(name) for name in names)]
    return [row["param"] or row["name"], *("" if value is None else f"{value:.3g}" for value in values)]


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *rest = (
        cell.ljust(width) if column == 0 else cell.rjust(width)
        for column, (cell, width) in enumerate(zip(cells, widths, strict=True))
    )
    return "  ".join([first, *rest]).rstrip()
