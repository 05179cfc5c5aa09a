"""A finished report as blocks of prose: paragraphs and entries of lists of report.md and of index.html, each under its heading.

Tables are left out, which are made of rows, as are code, scripts, pictures, and the end that says how the report was made.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser

from .text import Page, without_code

MADE = "How this was made"
"""Heading of the end, which is about versions and machine."""
_INLINE = {"b", "strong", "span", "a", "em", "i", "small", "sub", "sup"}
_LEFT_OUT = {"script", "style", "table", "code", "svg", "footer", "button"}
_HEADINGS = {f"h{level}" for level in range(1, 7)}


@dataclass(frozen=True)
class Block:
    """Prose on one line or more: where it begins, under which heading, and its page, whose lines are those of the file."""

    heading: str
    page: Page

    @property
    def lead(self) -> str:
        """What an entry of a list is about, in front of its first colon; "" without one."""
        head, colon, _ = self.page.text.strip().removeprefix("- ").partition(": ")
        return head if colon else ""


def _block(name: str, line: int, heading: str, text: str) -> Block:
    return Block(heading, Page(name, "\n" * (line - 1) + text))


def of_markdown(name: str, text: str) -> Iterator[Block]:
    """Yield the blocks of a page in Markdown, without its emphasis."""
    heading = ""
    for found in re.finditer(r"(?:^(?![|\n]).+\n?)+?(?=^[-|#\n]|\Z)", without_code(text), re.MULTILINE):
        if found[0].startswith("#"):
            heading = found[0].strip("# \n")
        if heading != MADE:
            yield _block(name, text.count("\n", 0, found.start()) + 1, heading, found[0].replace("**", ""))


def of_html(name: str, text: str) -> Iterator[Block]:
    """Yield the blocks of the page."""
    reader = _Reader()
    reader.feed(text)
    reader.end_block()
    yield from (_block(name, *found) for found in reader.found)


@dataclass
class _Reader(HTMLParser):
    """Collects line, heading and text of each block."""

    found: list[tuple[int, str, str]] = field(default_factory=list)
    heading: str = ""
    _text: str = ""
    _line: int = 1
    _outside: list[str] = field(default_factory=list)
    _in_heading: bool = False

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """End a block, unless the tag is within a line."""
        if tag in _LEFT_OUT:
            self._outside.append(tag)
        if tag not in _INLINE and tag != "code":
            self.end_block()
            self._in_heading = tag in _HEADINGS

    def handle_endtag(self, tag: str) -> None:
        """Do the same."""
        if self._outside and tag == self._outside[-1]:
            self._outside.pop()
        if tag not in _INLINE and tag != "code":
            self.end_block()

    def handle_data(self, data: str) -> None:
        """Collect text."""
        if not self._outside:
            if not self._text.strip():
                self._text, self._line = "", self.getpos()[0]
            self._text += data

    def end_block(self) -> None:
        """Keep what was collected."""
        if self._text.strip():
            self.heading = self._text.strip() if self._in_heading else self.heading
            self.found.append((self._line, self.heading, self._text))
        self._text, self._in_heading = "", False
