"""Parts of a document that cannot be made: a sentence in their place, so that nothing else is lost."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TypeVar

from conservative.errors import BadInput, NotWritten, shorten

from .model import Block, Document, Emphasis, Paragraph, Section, walk

T = TypeVar("T")


def attempt(what: str, make: Callable[[], T], then: str = "") -> T | Paragraph:
    """Return the result of a function, or the sentence that it failed, followed by the sentence `then`.

    Files that cannot be written raise `NotWritten`.
    """
    try:
        return make()
    except NotWritten:
        raise
    except Exception as error:  # a mistake in one drawing must not cost an hour of measurements
        kind = "" if isinstance(error, BadInput | ImportError) else f"{type(error).__name__}: "
        reason = " ".join(shorten(error).split())  # in one line
        return Paragraph(f"{what} could not be made ({kind}{reason}). {then}".strip(), Emphasis.FAILED)


def failed_parts(blocks: Iterable[Block]) -> list[str]:
    """Return the sentences of the parts that could not be made."""
    return [block.text for block in walk(blocks) if isinstance(block, Paragraph) and block.role is Emphasis.FAILED]


def render_all(document: Document, render: Callable[[Document], str], then: str = "") -> tuple[Document, str]:
    """Return a document as a text, with a sentence in place of each block that cannot be rendered, and that document."""
    text = attempt("The page", lambda: render(document))
    if isinstance(text, str):
        return document, text

    def mend(block: Block) -> Block:
        name = f"The section {block.title!r}" if isinstance(block, Section) else f"A part of the page, {type(block).__name__},"
        alone = attempt(name, lambda: render(replace(document, blocks=[block], pages={})), then)
        if isinstance(alone, str):
            return block
        return replace(block, blocks=list(map(mend, block.blocks))) if isinstance(block, Section) and block.blocks else alone

    mended = replace(document, blocks=list(map(mend, document.blocks)))
    return mended, render(mended)
