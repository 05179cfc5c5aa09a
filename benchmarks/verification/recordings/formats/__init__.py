"""Formats of recordings, one file for each family. To add one, write a file with a `read` function, and add it to `FORMATS`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from . import delimited, json_lines, messages, parquet
from .table import Start, Table

FORMATS: dict[str, Callable[[Start], Table | None]] = {
    "Parquet (.parquet)": parquet.read,
    "JSON lines (.jsonl)": json_lines.read,
    "STK attitudes (.a)": messages.read,
    "CSV": delimited.read,
}
"""For each family the function that returns the table of a file, or None for a file of another family; the first one counts."""


def open_table(path: Path) -> Table:
    """Return the table of a file. Raises `BadInput` for a file without one."""
    start = Start(path, ", ".join(FORMATS))
    for read in FORMATS.values():
        if (table := read(start)) is not None:
            return table
    raise start.fail("it has no row of numbers" if any(line.strip() for line in start.lines) else "it is empty")
