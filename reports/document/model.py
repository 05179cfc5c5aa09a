"""The model of a document: sections of paragraphs, lists, tables and figures, which every renderer understands.

Text is plain. Words between backticks are code. Everything else that a renderer shows (status, notes, intervals) is a field.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypeVar

from ..numbers import DASH

if TYPE_CHECKING:
    from conservative.trajectory import Trajectory


class Grade(StrEnum):
    """How a cell looks: a colour on the page, and a symbol in the text. Outcomes, verdicts and standings are elsewhere."""

    GOOD = "good"
    FAIR = "fair"
    BAD = "bad"
    NONE = "none"

    def mark(self, text: str) -> str:
        """Return a text with the symbol."""
        return f"{_SYMBOLS[self]} {text}"


_SYMBOLS = {Grade.GOOD: "✓", Grade.FAIR: "≈", Grade.BAD: "✗", Grade.NONE: DASH}


@dataclass(frozen=True)
class Interval:
    """A ratio with the ends of its interval, which the page draws on a logarithmic axis around 1, with a dashed `limit`."""

    value: float
    low: float
    high: float
    limit: float


@dataclass(frozen=True)
class Cell:
    """A cell of a table.

    Attributes
    ----------
    text, note
        The text, and a less important one.
    grade
        Its grade, if it has one.
    value
        The number that the page sorts the column by; NaN comes last.
    interval
        An interval to draw.
    parts
        The two halves of a cell in a `GRID`.
    """

    text: str
    grade: Grade | None = None
    note: str = ""
    value: float | None = None
    interval: Interval | None = None
    parts: tuple[Cell, ...] = ()

    def __str__(self) -> str:
        return f"{self.text} ({self.note})" if self.note else self.text


Row = Sequence[str | Cell]


class Style(StrEnum):
    """Form of a table on the page."""

    SORTED = "sorted"
    FILTERED = "filtered"  # sorted, in small print, and with a search field, which any table of more than ten rows has
    GRID = "grid"  # a matrix of small cells in two halves, whose text appears below the table


@dataclass(frozen=True)
class Table:
    """A table."""

    header: Sequence[str]
    rows: Sequence[Row]
    caption: str = ""
    style: Style = Style.SORTED


class Emphasis(StrEnum):
    """Emphasis of a paragraph."""

    BODY = ""
    LEAD = "lead"
    NOTE = "note"
    FAILED = "failed"  # stands for a part that could not be made


@dataclass(frozen=True)
class Paragraph:
    """A paragraph."""

    text: str
    role: Emphasis = Emphasis.BODY


@dataclass(frozen=True)
class Item:
    """An item of a list: an optional subject in bold, the text, and whether the page marks it with a cross."""

    text: str
    subject: str = ""
    marked: bool = False


@dataclass(frozen=True)
class Items:
    """A list."""

    items: Sequence[Item]

    @classmethod
    def of(cls, texts: Iterable[str]) -> Items:
        """Return a list of plain texts."""
        return cls([Item(text) for text in texts])


@dataclass(frozen=True)
class Links:
    """Links to files in the folder of the document: texts with names of files. The terminal does not show them."""

    links: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Facts:
    """Names with their values."""

    facts: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class LegendEntry:
    """A button of a legend: the line, its colour, and its mark as an SVG outline or its dash."""

    name: str
    colour: str
    path: str
    dash: str


AT_FIRST = 8
"""Largest number of lines that a figure on the page shows until a reader adds others."""


class Layout(StrEnum):
    """Arrangement of the panels of a figure on the page."""

    SINGLE = ""
    PANELS = "panels"
    PAIRS = "pairs"
    SPHERES = "sphere"


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure.

    Attributes
    ----------
    name
        Name of the file of the picture, and anchor on the page.
    title, summary
        The caption; the summary states what the figure shows.
    picture
        The Altair chart that Markdown shows as a file; None for a figure of the page alone.
    panels
        The Vega-Lite specifications that the page draws; None for a figure of Markdown alone.
    legend, layout
        Buttons below the panels, the first `AT_FIRST` of which are on at first, and the arrangement of the panels.
    """

    name: str
    title: str
    summary: str = ""
    picture: Any = None
    panels: Sequence[dict[str, Any]] | None = None
    legend: Sequence[LegendEntry] = ()
    layout: Layout = Layout.SINGLE


@dataclass(frozen=True, eq=False)
class Motion:
    """An animation, on the page alone: trajectories, their labels, the index of the exact one, and the numbers of each panel.

    See `animation.element`.
    """

    trajectories: Sequence[Trajectory]
    labels: Sequence[str]
    truth: int | None = None
    values: Sequence[Mapping[str, Any] | None] | None = None


@dataclass(frozen=True)
class Section:
    """A heading with blocks. The page links sections with an anchor in its header, under the title or the shorter `menu`."""

    title: str
    blocks: Sequence[Block]
    anchor: str = ""
    menu: str = ""
    folded: bool = False
    """True if the page shows only the title until a reader opens it."""
    source: Mapping[str, str | Sequence[str]] = field(default_factory=dict)
    """Columns and values that select the rows of its tables in `measurements.csv`, within the rows of the section around it."""


Block = Paragraph | Items | Links | Facts | Table | Figure | Motion | Section


@dataclass(frozen=True)
class Check:
    """A test case for continuous integration: group, name, output, and why it failed or was skipped, empty if it was not."""

    group: str
    name: str
    output: str = ""
    failure: str = ""
    skipped: str = ""


@dataclass(frozen=True, eq=False)
class Document:
    """A document.

    Attributes
    ----------
    command
        The command that writes it, such as `conservative track`.
    title
        The main heading.
    blocks
        The content; a section with its heading is a block.
    brief
        Blocks that the terminal shows instead of all blocks; None for all.
    data
        The content for programs: dictionaries, lists, dataclasses, enums, numbers (JSON writes NaN and infinity as null).
    checks
        The test cases of a gate or a comparison.
    failures
        Reasons why the command fails; empty if it succeeds.
    pages
        Documents next to this one, by the names of their files without an ending.
    comment
        Blocks that Markdown shows instead of title and blocks, for a pull request; None for all.
    for_paper
        A table that is also a file of its own, in LaTeX, or None.
    """

    command: str
    title: str
    blocks: Sequence[Block]
    brief: Sequence[Block] | None = None
    data: Mapping[str, Any] | Sequence[Any] = field(default_factory=dict)
    checks: Sequence[Check] = ()
    failures: Sequence[str] = ()
    pages: Mapping[str, Document] = field(default_factory=dict)
    comment: Sequence[Block] | None = None
    for_paper: Table | None = None

    @property
    def figures(self) -> list[Figure]:
        """All figures, in their order."""
        return [block for block in walk(self.blocks) if isinstance(block, Figure)]


def walk(blocks: Iterable[Block]) -> Iterator[Block]:
    """Yield blocks and the blocks of their sections, in reading order."""
    for block in blocks:
        yield block
        if isinstance(block, Section):
            yield from walk(block.blocks)


def without_figures(blocks: Iterable[Block]) -> list[Block]:
    """Return blocks and the blocks of their sections without figures, for a document without a folder for pictures."""
    kept = [block for block in blocks if not isinstance(block, Figure)]
    return [replace(block, blocks=without_figures(block.blocks)) if isinstance(block, Section) else block for block in kept]


AnyBlock = TypeVar("AnyBlock", bound=Block)


def filled(*blocks: AnyBlock | None) -> list[AnyBlock]:
    """Return blocks without those that are None, and without tables, lists and sections that are empty."""
    return [block for block in blocks if block is not None and _has_content(block)]


def _has_content(block: Block) -> bool:
    match block:
        case Table():
            return bool(block.rows)
        case Items():
            return bool(block.items)
        case Section():
            return bool(block.blocks)
    return True
