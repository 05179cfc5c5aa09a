"""Formats of recordings, one file for each family. To add one, write a file with a `read` function, and add it to `FORMATS`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from conservative.errors import REMOVED, BadInput

from . import delimited, json_lines
from .table import Start, Table


class Format(NamedTuple):
    """A family of formats: its name, the usual endings of its files, and the function that reads them.

    `read` returns the table of a file, or None for a file of another family. Endings are for folders; the content decides.
    """

    name: str
    endings: tuple[str, ...]
    read: Callable[[Start], Table | None]


FORMATS = (
    Format("JSON lines", (".jsonl", ".ndjson", ".json"), json_lines.read),
    Format("CSV", (".csv", ".tsv", ".txt", ".dat"), delimited.read),
)
"""The families; the first one that returns a table counts."""
GONE = {b"PAR1": ".parquet", b"\x1f\x8b": ".gz", b"stk.v": ".a", b"CCSDS_AEM_VERS": ".aem"}
"""Beginnings of files in formats that are gone, and their endings."""
_TABLES = [ending for form in FORMATS for ending in form.endings]
ENDINGS = (*_TABLES, *(f"{ending}.gz" for ending in _TABLES), *(ending for ending in GONE.values() if ending != ".gz"))
"""Endings of recordings in folders. A file in a format that is gone is refused there, and not left out."""


def open_table(path: Path) -> Table:
    """Return the table of a file. Raises `BadInput` for a file without one."""
    start = Start(path, ", ".join(f"{form.name} ({form.endings[0]})" for form in FORMATS))
    for beginning, ending in GONE.items():
        if start.head.startswith(beginning):
            raise BadInput("run", f"{path}, of the format {ending}", REMOVED[ending])
    for form in FORMATS:
        if (table := form.read(start)) is not None:
            return table
    raise start.fail("it has no row of numbers" if any(line.strip() for line in start.lines) else "it is empty")
