"""Markdown of a document, with pictures in files next to it. Words in backticks are code, other texts appear as they are."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

from .model import Block, Document, Emphasis, Facts, Figure, Items, Links, Paragraph, Section, Table

Draw = Callable[[Figure], str]
"""Draws the picture of a figure into a file and returns the name of the file."""


def _refuse(figure: Figure) -> str:
    raise ValueError(f"{figure.name}: this document has no folder for pictures")


def escape(value: object) -> str:
    """Return a text without the characters that Markdown would not show, such as HTML in a name."""
    return re.sub(r"`[^`]+`|[<*\[\]\\]|&(?=#?\w+;)|(?<!\w)_|_(?!\w)|^[#>+-](?= )", _escape_match, str(value))


def _escape_match(match: re.Match[str]) -> str:
    return match[0] if match[0].startswith("`") else f"\\{match[0]}"


def render(document: Document, draw: Draw = _refuse) -> str:
    """Return a document as Markdown."""
    if document.comment is not None:
        return "\n\n".join(_blocks(document.comment, 2, draw, folds=True)) + "\n"
    return "\n\n".join([f"# {escape(document.title)}", *_blocks(document.blocks, 2, draw)]) + "\n"


def _blocks(blocks: Iterable[Block], level: int, draw: Draw, folds: bool = False) -> Iterator[str]:
    """Yield the text of each block. With `folds`, folded sections are HTML, which GitHub and GitLab show in comments."""
    for block in blocks:
        match block:
            case Links():
                yield ", ".join(f"[{escape(text)}]({file})" for text, file in block.links)
            case Section():
                if content := list(_blocks(block.blocks, level + 1, draw, folds)):  # a section of the page alone has none
                    folded = folds and block.folded
                    title = escape(block.title)
                    yield f"<details><summary>{title}</summary>" if folded else f"{'#' * level} {title}"
                    yield from content
                    if folded:
                        yield "</details>"
            case Paragraph():
                text = escape(block.text)
                yield f"**{text}**" if block.role is Emphasis.LEAD else text
            case Items():
                subjects = (f"**{escape(item.subject)}**: " * bool(item.subject) for item in block.items)
                yield "\n".join(f"- {subject}{escape(item.text)}" for subject, item in zip(subjects, block.items, strict=True))
            case Facts():
                yield table(Table(("", ""), block.facts))
            case Table():
                yield from filter(None, [escape(block.caption)])
                yield table(block)
            case Figure() if block.picture is not None:
                yield f"![{escape(block.title)}]({draw(block)})"


def table(content: Table) -> str:
    """Return a table as Markdown, without padding."""
    lines = [content.header, ["---", *["---:"] * (len(content.header) - 1)], *content.rows]
    return "\n".join("| " + " | ".join(escape(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
