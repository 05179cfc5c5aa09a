"""Markdown of a document, with pictures in files next to it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from .model import Block, Document, Emphasis, Facts, Figure, Items, Links, Paragraph, Section, Table

Draw = Callable[[Figure], str]
"""Draws the picture of a figure into a file and returns the name of the file."""


def _refuse(figure: Figure) -> str:
    raise ValueError(f"{figure.name}: this document has no folder for pictures")


def render(document: Document, draw: Draw = _refuse) -> str:
    """Return a document as Markdown."""
    return "\n\n".join([f"# {document.title}", *_blocks(document.blocks, 2, draw)]) + "\n"


def _blocks(blocks: Iterable[Block], level: int, draw: Draw) -> Iterator[str]:
    for block in blocks:
        match block:
            case Links():
                yield ", ".join(f"[{text}]({file})" for text, file in block.links)
            case Section():
                if content := list(_blocks(block.blocks, level + 1, draw)):  # a section of the page alone has none
                    yield f"{'#' * level} {block.title}"
                    yield from content
            case Paragraph():
                yield f"**{block.text}**" if block.role is Emphasis.LEAD else block.text
            case Items():
                yield "\n".join(f"- {f'**{item.subject}**: ' * bool(item.subject)}{item.text}" for item in block.items)
            case Facts():
                yield table(Table(("", ""), block.facts))
            case Table():
                yield from filter(None, [block.caption])
                yield table(block)
            case Figure() if block.picture is not None:
                yield f"![{block.title}]({draw(block)})"


def table(content: Table) -> str:
    """Return a table as Markdown, without padding."""
    lines = [content.header, ["---", *["---:"] * (len(content.header) - 1)], *content.rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)
