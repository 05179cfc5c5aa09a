"""Whether two values differ, and the change that is reported if they do: of the gate, of two versions, and of engines.

One rule, `direction`, decides everywhere. What may differ without meaning (round-off, noise of times, one step more) is in the
ranges of the values, and a factor or a margin is how much of a difference matters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True)
class Range:
    """A value, and its smallest and largest value under changes that should not matter."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Range:
        """Return the range of values; the first is the measured value, and NaN are ignored."""
        first, *rest = values
        measured = [value for value in (first, *rest) if not math.isnan(value)] or [math.nan]
        return Range(first, min(measured), max(measured))

    @property
    def size(self) -> Range:
        """The range of the absolute value."""
        ends = sorted((abs(self.low), abs(self.high)))
        return Range(abs(self.value), 0.0 if self.low < 0 < self.high else ends[0], ends[1])


NOTHING = Range(math.nan, math.nan, math.nan)
"""The range of a value that could not be measured."""


def exact(value: float) -> Range:
    """Return the range of a value that nothing changes."""
    return Range(value, value, value)


def direction(was: Range, now: Range, factor: float = 1.0, margin: float = 0.0) -> int:
    """Return 1 if all of `now` is above all of `was` by more than a factor and a margin, -1 if it is below, otherwise 0.

    It is 0 if a value is not known. Factors are for ranges of positive values.
    """
    return int(now.low > factor * was.high + margin) - int(was.low > factor * now.high + margin)


class RowName(NamedTuple):
    """The row that a change is in: a measure of a method on a scene, and the invariant of a drift."""

    scene: str
    method: str
    measure: str
    quantity: str = ""


@dataclass(frozen=True)
class Change:
    """A value of a row that differs between two versions.

    Attributes
    ----------
    row
        The row.
    was, now
        Both values: numbers, ranges, orders and outcomes, and texts for other things, such as a definition.
    allowed
        Limit, in words; may be empty.
    lost
        True if the later version is worse.
    """

    row: RowName
    was: object
    now: object
    allowed: str = ""
    lost: bool = True

    @property
    def texts(self) -> dict[str, str]:
        """The change by columns of text."""
        texts = {"was": value_text(self.was), "now": value_text(self.now), "allowed": self.allowed}
        return {"measure": self.row.measure, "scene": self.row.scene, "method": self.row.method, **texts}

    @property
    def finding(self) -> str:
        """The change in one line."""
        limit = f", allowed {self.allowed}" * bool(self.allowed)
        return "{measure}, {scene}, {method}: was {was}, is {now}".format(**self.texts) + limit


def value_text(value: object) -> str:
    """Return a value as text."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
