"""Tables and texts on a terminal, as wide as that is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table


@dataclass(frozen=True)
class TerminalTable:
    """A table with a title; `wrap_names` says whether the first column, too, may go on in the next line."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    wrap_names: bool = False


def print_tables(tables: Iterable[TerminalTable]) -> None:
    """Print tables one below the other; what is too long for its column goes on in the next line."""
    console = Console(soft_wrap=False)
    for table in tables:
        console.print(_as_rich(table))


def print_text(text: str, style: str = "") -> None:
    """Print a text as it is."""
    Console(soft_wrap=False).print(text, style=style, markup=False, highlight=False)


def _as_rich(content: TerminalTable) -> Table:
    table = Table(title=escape(content.title), box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for position, name in enumerate(content.header):
        table.add_column(name, overflow="fold", no_wrap=position == 0 and not content.wrap_names)
    for row in content.rows:
        table.add_row(*(escape(cell) for cell in row))
    return table
