"""Tables and texts on a terminal, as wide as that is."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table


@dataclass(frozen=True)
class TerminalTable:
    """A table with a title. A terminal that is too narrow shows the columns on the left."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


def print_tables(tables: Iterable[TerminalTable]) -> None:
    """Print tables one below the other. Cells go on in the next line between words; columns without room are left out."""
    console = Console(soft_wrap=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console = Console(width=10_000)  # a file or a pipe has room for every column
    for table in tables:
        widths = fit_columns([table.header, *table.rows], console.width)
        console.print(_as_rich(table, widths))
        if hidden := table.header[len(widths) :]:
            console.print(f"Columns without room: {', '.join(hidden)}\n", markup=False, highlight=False)


def print_text(text: str, style: str = "") -> None:
    """Print a text as it is."""
    Console(soft_wrap=False).print(text, style=style, markup=False, highlight=False)


def fit_columns(rows: Sequence[Sequence[str]], width: int) -> list[int]:
    """Return the widths of the columns, from the left, that a terminal has room for without a break inside a word."""
    columns = list(zip(*rows, strict=True))
    least = [max(cell_len(word) for cell in column for word in cell.split() or [""]) for column in columns]
    whole = [max(map(cell_len, column)) for column in columns]
    shown = len(columns)
    while shown > 1 and sum(least[:shown]) + _borders(shown) > width:
        shown -= 1
    widths = least[:shown]
    for _ in range(max(0, width - _borders(shown) - sum(widths))):  # room that is left: to the narrowest that is cut
        cut = [j for j in range(shown) if widths[j] < whole[j]]
        if cut:
            widths[min(cut, key=widths.__getitem__)] += 1
    return widths


def _borders(columns: int) -> int:
    """Return the characters of a line of a table that belong to no cell."""
    return 3 * columns + 1


def _as_rich(content: TerminalTable, widths: Sequence[int]) -> Table:
    table = Table(title=escape(content.title), box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for name, width in zip(content.header, widths, strict=False):
        table.add_column(name, overflow="fold", width=width)
    for row in content.rows:
        table.add_row(*(escape(cell) for cell in row[: len(widths)]))
    return table
