"""A document on a terminal, as wide as that is. Only tables need rich."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence

import click

from .model import Block, Document, Emphasis, Facts, Items, Paragraph, Section, Table

IN_CI = 100
"""Columns of a log of continuous integration, which sets `CI`."""


def show(document: Document) -> None:
    """Print the part of a document for the terminal."""
    print_blocks(document.blocks if document.brief is None else document.brief)


def print_blocks(blocks: Iterable[Block]) -> None:
    """Print blocks one below the other; figures are left out."""
    for block in blocks:
        match block:
            case Section():
                click.echo(f"{block.title}")
                print_blocks(block.blocks)
                click.echo()
            case Paragraph():
                click.secho(_wrapped(block.text), bold=block.role is Emphasis.LEAD)
            case Items():
                for item in block.items:
                    click.echo(f"  {f'{item.subject}: ' * bool(item.subject)}{item.text}")
            case Facts():
                width = max((len(name) for name, _ in block.facts), default=0)
                for name, value in block.facts:
                    click.echo(f"{name:<{width}}  {value}".rstrip())
            case Table():
                print_table(block)


def _wrapped(text: str) -> str:
    """Return a text in lines of the width of the terminal; a file or a pipe gets long lines."""
    if not sys.stdout.isatty() and not {"COLUMNS", "CI"} & os.environ.keys():
        return text
    width = shutil.get_terminal_size((IN_CI, 1)).columns
    lines = (textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False) for line in text.splitlines())
    return "\n".join("\n".join(wrapped) for wrapped in lines) + "\n" * text.endswith("\n")


def print_table(content: Table) -> None:
    """Print a table. Cells continue in the next line between words. Columns on the right without room are left out."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table as RichTable

    console = Console(soft_wrap=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console = Console(width=IN_CI if "CI" in os.environ else 10_000)  # a file or a pipe has room for every column
    rows = [list(map(str, row)) for row in content.rows]
    widths = fit_columns([content.header, *rows], console.width)
    table = RichTable(title=escape(content.caption), box=box.SIMPLE_HEAD, title_justify="left", title_style="bold")
    for name, width in zip(content.header, widths, strict=False):
        table.add_column(name, overflow="fold", width=width)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row[: len(widths)]))
    sys.stdout.flush()
    console.print(table)
    if hidden := content.header[len(widths) :]:
        console.print(f"Columns without room: {', '.join(hidden)}\n", markup=False, highlight=False)


def fit_columns(rows: Sequence[Sequence[str]], width: int) -> list[int]:
    """Return the widths of the columns, from the left, that a terminal has room for without a break inside a word."""
    from rich.cells import cell_len

    columns = list(zip(*rows, strict=True))
    least = [max(cell_len(word) for cell in column for word in cell.split() or [""]) for column in columns]
    whole = [max(map(cell_len, column)) for column in columns]
    shown = len(columns)
    while shown > 1 and sum(least[:shown]) + _borders(shown) > width:
        shown -= 1
    widths = least[:shown]
    for _ in range(max(0, width - _borders(shown) - sum(widths))):  # remaining room goes to the narrowest column that is cut
        cut = [j for j in range(shown) if widths[j] < whole[j]]
        if cut:
            widths[min(cut, key=widths.__getitem__)] += 1
    return widths


def _borders(columns: int) -> int:
    """Return the characters of a line of a table that belong to no cell."""
    return 3 * columns + 1
