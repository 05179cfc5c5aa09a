"""One model of a document (`model`), and a file with a renderer for each format."""

from __future__ import annotations

from importlib import import_module

from .model import Document

MARK = "Written by conservative"
SVG_MARK = f"<!-- {MARK} -->"
"""The first line of pictures in files of their own."""
PICTURES = (".svg", ".png")
"""Endings of files that contain a picture."""


def text(document: Document, kind: str) -> str:
    """Return a document as "markdown" or "md", "html", "junit", or "json" (its data).

    Renderers are imported when used.
    """
    renderer = import_module(f".{ {'md': 'markdown'}.get(kind, kind) }", __package__)
    return str(renderer.render(document.data if kind == "json" else document))
