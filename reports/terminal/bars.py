"""The bar of `progress`. It has its own file, because importing rich takes longer than showing a --help."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, RenderableType
from rich.constrain import Constrain
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Column

ECHO = len("^C") + 1
"""Free columns at the end of a line for the ^C of a terminal. If the line wrapped, the bar could not be removed."""


class Bar(Progress):
    """A bar on stderr with share, elapsed time, remaining time and current work. It is removed when it stops."""

    def __init__(self) -> None:
        # On a narrow terminal, numbers keep their width, and bar and text share the remaining columns.
        columns = (
            BarColumn(None, table_column=Column(ratio=1)),
            TaskProgressColumn(table_column=Column(min_width=4, no_wrap=True)),
            TimeElapsedColumn(table_column=Column(min_width=7, no_wrap=True)),
            TextColumn("left"),
            TimeRemainingColumn(table_column=Column(min_width=7, no_wrap=True)),
            TextColumn("{task.description}", table_column=Column(ratio=2, no_wrap=True, overflow="ellipsis")),
        )
        self._terminal = Console(stderr=True)
        super().__init__(*columns, console=self._terminal, transient=True, expand=True)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Yield the table of the bar, a little narrower than the terminal."""
        for renderable in super().get_renderables():
            yield Constrain(renderable, max(1, self._terminal.width - ECHO))
