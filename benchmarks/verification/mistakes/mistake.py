"""What all mistakes have: a key, a sentence, and numbers that are fitted."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple


class Number(NamedTuple):
    """A fitted number: its name, its value without the mistake, and its unit, "1", "s", "1/s" or "rad/s"."""

    name: str
    start: float = 0.0
    unit: str = "1"

    def size(self, rate: float) -> float:
        """Return the size of the unit, SI, for motions at a rate, rad/s."""
        return {"1": 1.0, "s": 1 / rate}.get(self.unit, rate)


@dataclass(frozen=True)
class Mistake:
    """A mistake of a simulator, or of the file that it wrote.

    Attributes
    ----------
    key
        Short name, the same everywhere.
    sentence
        What is wrong, without a full stop. It is a format of the fitted numbers.
    numbers
        Numbers that are fitted.
    remedy
        What an author of a program changes; "" if the sentence says it.
    option
        What a reader of a file changes in the command; "" if there is nothing.
    kind
        Name of the kind, which is the name of the module, except for rows (`habits`).
    """

    kind: ClassVar[str] = ""
    key: str
    sentence: str
    numbers: tuple[Number, ...] = field(default=(), kw_only=True)
    remedy: str = field(default="", kw_only=True)
    option: str = field(default="", kw_only=True)
