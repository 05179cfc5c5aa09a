"""Replacements for colours with too little contrast to the light or dark page.

Contrast is defined by the Web Content Accessibility Guidelines 2.2, which require 3 or more for lines and marks (1.4.11).
"""

from __future__ import annotations

import re
from collections.abc import Iterable

LIGHT_PAPER, DARK_PAPER = "#ffffff", "#14171a"
"""Background of the page, as page.css has it."""
LEAST = 3.0
"""Smallest contrast of a line."""
_COLOUR = re.compile(r"#[0-9A-Fa-f]{6}\b")


def colours_in(text: str) -> frozenset[str]:
    """Return the colours in a text, in capitals."""
    return frozenset(colour.upper() for colour in _COLOUR.findall(text))


def stand_ins(colours: Iterable[str], paper: str) -> dict[str, str]:
    """Return a replacement for each colour with too little contrast to the paper, mixed with white or black."""
    return {colour: _readable(colour, paper) for colour in sorted(colours) if contrast(colour, paper) < LEAST}


def contrast(first: str, second: str) -> float:
    """Return the contrast of two colours, 1 to 21."""
    low, high = sorted((_luminance(first), _luminance(second)))
    return (high + 0.05) / (low + 0.05)


def _readable(colour: str, paper: str) -> str:
    # White and black have the same contrast to a luminance of 0.18.
    towards = 255.0 if _luminance(paper) < 0.18 else 0.0
    for share in (k / 50 for k in range(51)):
        mixed = "#" + "".join(f"{round(channel + (towards - channel) * share):02X}" for channel in _channels(colour))
        if contrast(mixed, paper) >= LEAST:
            break
    return mixed


def _channels(colour: str) -> list[int]:
    return [int(colour[at : at + 2], 16) for at in (1, 3, 5)]


def _luminance(colour: str) -> float:
    """Return the relative luminance, 0 to 1, of a colour in sRGB."""
    parts = [channel / 255 for channel in _channels(colour)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
