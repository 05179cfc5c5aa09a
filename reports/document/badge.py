"""A badge: a small picture with a name and a value, as a file of its own. It needs no service."""

from __future__ import annotations

from html import escape

COLOURS = {"good": "#1a7f37", "fair": "#8a6100", "": "#0a58a8"}
WIDTH = 6.6
"""Width of a character, px; the text is stretched to it, because fonts differ."""


def badge(name: str, value: str, grade: str = "") -> str:
    """Return a badge as SVG; the grade is a colour of `COLOURS`."""
    left, right = (round(WIDTH * len(text)) + 12 for text in (name, value))
    texts = "".join(
        f'<text x="{x + width / 2:g}" y="14" textLength="{width - 12}" text-anchor="middle">{escape(text)}</text>'
        for x, width, text in ((0, left, name), (left, right, value))
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" role="img" aria-label="{escape(name)}: '
        f'{escape(value)}"><rect width="{left}" height="20" fill="#444c56"/><rect x="{left}" width="{right}" height="20" '
        f'fill="{COLOURS[grade]}"/><g fill="#fff" font-family="Verdana,Arial,sans-serif" font-size="11">{texts}</g></svg>\n'
    )
