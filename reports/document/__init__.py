"""One model of a document (`model`) and a renderer for each format: Markdown, HTML, JSON, JUnit and the terminal."""

from __future__ import annotations

from .model import Document

SVG_MARK = "<!-- Written by conservative -->"
"""The first line of pictures in files of their own."""


def text(document: Document, kind: str) -> str:
    """Return a document as "markdown" or "md", "html", "junit" or "json" (its data); renderers are imported when used."""
    if kind in ("markdown", "md"):
        from . import markdown

        return markdown.render(document)
    if kind == "html":
        from . import html

        return html.render(document)
    if kind == "junit":
        from . import junit

        return junit.render(document)
    from . import json

    return json.render(document.data)
