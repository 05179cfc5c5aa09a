"""Cells of report.md that are checked: at each decade the cheapest of each class, and its time, by the rows.

Tables are made of rows, so that the rest of them is left to the tests of what makes them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from ...tables.cells import tolerance
from ...tables.classes import OF_ENGINES, MethodClass
from ...tables.work_precision import DECADES
from .rows import Rows
from .text import Number

ERROR, TIME = "error, rad", "µs per s"
"""Headers of the first column, and of the one behind each class."""
CLASSES: dict[str, tuple[MethodClass, ...]] = {
    "cheapest general integrator of ours": (MethodClass.GENERAL,),
    "cheapest engine": OF_ENGINES,
    "our solution of integrable motions": (MethodClass.SOLUTION,),
}
NOTHING = "none gets there"
_DECADES = {tolerance(error): error for error in DECADES}


def find(rows: Rows, name: str, text: str) -> Iterator[str]:
    """Yield the rows of tables whose cells are not what the measurements give."""
    heading, header = "", [""]
    for line, content in enumerate(text.splitlines(), start=1):
        if content.startswith("#"):
            heading = content.strip("# ").partition(":")[0]
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", content)[1:-1]]
        header = cells if cells[:1] == [ERROR] else header if cells else [""]
        if header[0] == ERROR and cells[0] in _DECADES and heading in rows.table["scene"].unique():
            yield from (f"{name}:{line}: {wrong}" for wrong in _judge(rows, heading, header, cells))


def _judge(rows: Rows, scene: str, header: Sequence[str], cells: Sequence[str]) -> Iterator[str]:
    for kind, classes in CLASSES.items():
        if kind in header and header[header.index(kind) + 1] == TIME:
            place = header.index(kind)
            best = rows.cheapest(scene, classes, _DECADES[cells[0]])
            if not _agree(cells[place], cells[place + 1], best):
                given = f"{best[0]} at {1e6 * best[1]:.4g} µs" if best else NOTHING
                yield f'"{cells[place]}" at "{cells[place + 1]}" µs on {scene} at {cells[0]} rad: the rows give {given}'


def _agree(name: str, time: str, best: tuple[str, float] | None) -> bool:
    if best is None:
        return name == NOTHING
    return name.replace("\\|", "|") == best[0] and Number(0, len(time), time).agrees(1e6 * best[1])
