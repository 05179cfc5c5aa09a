"""Numbers in prose: where they stand, what they say, and how exactly.

Prose is what is left of a page without code and addresses of links. A name such as `RK4` is no number; `7.13.2` is one, and so
is a word that counts, such as `half` or `hundreds`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

_COUNTS = (
    "two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen nineteen"
)
WORDS = {word: (float(count), float(count)) for count, word in enumerate(_COUNTS.split(), start=2)} | {
    "half": (0.45, 0.55),
    "twice": (1.9, 2.15),
    "dozens": (12.0, 100.0),
    "hundreds": (100.0, 1e3),
    "thousands": (1e3, 1e4),
    "millions": (1e6, 1e7),
    **{sign: (share - 0.01, share + 0.01) for sign, share in zip("½⅓⅔¼¾", (1 / 2, 1 / 3, 2 / 3, 1 / 4, 3 / 4), strict=True)},
}
"""What a word, or a sign, stands for: the least and the largest value."""
_DIGITS = r"(?<![\w.])(?:\d{4}-\d\d-\d\d|[-+−]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)*(?:e[-+−]?\d+)?)"
NUMBER = re.compile(rf"{_DIGITS}|(?i:\b(?:{'|'.join(name for name in WORDS if name.isalpha())})(?:fold)?\b)|[½⅓⅔¼¾]")
NO_PROSE = re.compile(
    r"^```.*?^```|^(?: {4}[^\n]*\n?)+"  # code
    r"|(?<=\])\([^)\s]*\)|https?://\S+"  # addresses
    r"|`[^`]+`",  # code within a line
    re.MULTILINE | re.DOTALL,
)
"""What of Markdown is not prose; but a number in code within a line is one."""
_NUMBER_AS_CODE = re.compile(r"`\d")
_START = re.compile(r"[.:;] |\n\n|\n[|*-] |\| ")
_END = re.compile(r"[.;]\s|:\n|\n\n|\n[|*-] | \|")
AROUND = 60
"""Most characters that are shown before a number, and after it."""

Value = float | str
"""What a number has to say: an int exactly, another number as people round it, a text by itself."""


@dataclass(frozen=True)
class Number:
    """A number in a text, and where it stands."""

    start: int
    end: int
    text: str

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the largest value that are rounded to what is written; raises `ValueError` for a date or a version."""
        word = self.text.lower().removesuffix("fold")
        return WORDS[word] if word in WORDS else _rounded(self.text.replace(",", "").replace("−", "-"))

    def agrees(self, value: Value) -> bool:
        """Return whether a value is written so."""
        if isinstance(value, str):
            return self.text == value
        return self._compare(lambda low, high: value == (low + high) / 2 if isinstance(value, int) else low <= value <= high)

    def lies_above(self, value: Value) -> bool:
        """Return whether a value is at most what is written."""
        return self._compare(lambda _, high: float(value) <= high)

    def lies_below(self, value: Value) -> bool:
        """Return whether a value is at least what is written."""
        return self._compare(lambda low, _: float(value) >= low)

    def _compare(self, holds: Callable[[float, float], bool]) -> bool:
        try:
            return holds(*self.bounds)
        except ValueError:
            return False


def _rounded(text: str) -> tuple[float, float]:
    """Return what is rounded to a text: half a unit of its last digit to either side; zeros beyond two digits are no digits."""
    mantissa, _, exponent = text.partition("e")
    whole, _, decimals = mantissa.partition(".")
    zeros = min(len(whole) - len(whole.rstrip("0")), max(len(whole.lstrip("+-")) - 2, 0)) if not (decimals or exponent) else 0
    value, half = float(mantissa), 0.5 * 10.0 ** (zeros - len(decimals)) * (1 + 1e-9)
    scale = 10.0 ** int(exponent or 0)
    return (value - half) * scale, (value + half) * scale


def without_code(text: str) -> str:
    """Return Markdown with spaces in place of what is not prose."""
    return NO_PROSE.sub(lambda found: found[0] if _NUMBER_AS_CODE.match(found[0]) else re.sub(r"\S", " ", found[0]), text)


@dataclass(frozen=True)
class Page:
    """A page in Markdown: its name, and its text."""

    name: str
    text: str

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """All numbers in its prose."""
        return tuple(Number(*found.span(), found[0]) for found in NUMBER.finditer(without_code(self.text)))

    def describe(self, number: Number) -> str:
        """Return file and line, a number, and the words around it."""
        line = self.text.count("\n", 0, number.start) + 1
        before, after = self.text[: number.start], self.text[number.end :]
        first = max((found.end() for found in _START.finditer(before)), default=0)
        last = _END.search(after)
        words = before[max(first, len(before) - AROUND) :] + number.text + after[: last.start() if last else None][:AROUND]
        return f'{self.name}:{line}: "{number.text}" in "{" ".join(words.split())}"'
