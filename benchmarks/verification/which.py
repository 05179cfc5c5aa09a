"""Which of two is wrong, in a sentence: two recordings of a scene, or two back ends of a product."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from conservative.number_text import number

from .finding import Verdict

UNITS = "rad", "of the largest rate"


@dataclass(frozen=True)
class Difference:
    """The largest difference between two motions, `error`: of attitudes in rad, and of rates relative to the largest rate.

    A quantity that one of them does not have is nan. Of two recordings, digits, noise and the interpolation between rows decide
    what is `allowed`, of two back ends the tolerances of both. `time` is the time of the difference, s, and `case` the motion.
    `rows` is the number of rows that were compared, `common` is True if both have rows at these times, and `missing` is
    the reason if nothing was compared.
    """

    error: tuple[float, float] = (math.nan, math.nan)
    allowed: tuple[float, float] = (math.nan, math.nan)
    time: float = math.nan
    rows: int = 0
    common: bool = False
    missing: str = ""
    case: str = ""

    @property
    def worse(self) -> int:
        """The quantity with the larger ratio of difference and allowed difference: 0 for attitudes, 1 for rates."""
        return int(np.nanargmax(np.divide(self.error, self.allowed)))

    @property
    def agrees(self) -> bool:
        """True if the difference is allowed."""
        return not self.missing and self.error[self.worse] <= self.allowed[self.worse]

    @property
    def size(self) -> str:
        """The difference as a number with its unit; "" if nothing was compared."""
        return "" if self.missing else f"{number(self.error[self.worse])} {UNITS[self.worse]}"


@dataclass(frozen=True)
class Side:
    """One of two: its name, the verdict on it with the reason, and the mistake that explains it, by its key and sentence.

    Without a single mistake, key and sentence are "".
    """

    subject: str
    verdict: Verdict
    reason: str
    mistake: str = ""
    sentence: str = ""


def which(
    a: Side,
    b: Side,
    difference: Difference,
    differ: str = "",
    check: str = "",
    shared: Collection[str] = (),
) -> str:
    """Return which of two is wrong, and by which mistake.

    Parameters
    ----------
    a, b
        The two.
    difference
        The difference between them.
    differ
        The sentence on two that are right and differ. By default the one on two that are right.
    check
        The sentence if both have the same motion and are wrong, and no mistake, or one in `shared`, explains it.
    shared
        Keys of mistakes that may be mistakes of the question, such as another body.
    """
    both = (a.verdict, b.verdict)
    if both == (Verdict.RIGHT, Verdict.RIGHT):
        if difference.missing:
            return f"both are right; they are not compared with each other: {difference.missing}"
        if differ and not difference.agrees:
            return differ
        return f"both are right and differ by at most {difference.size}" + f" ({difference.case})" * bool(difference.case)
    if both == (Verdict.WRONG, Verdict.WRONG):
        same = bool(a.mistake) and a.mistake == b.mistake
        if difference.agrees and (not same or a.mistake in shared):
            return check
        if same:
            agree = f"they agree with each other ({difference.size}), and " * difference.agrees
            numbers = "" if a.sentence == b.sentence else f" ({b.subject}: {b.sentence})"
            return f"{agree}both are wrong by the same mistake: {a.sentence}{numbers}"
        if a.mistake and b.mistake:
            return f"both are wrong by different mistakes. {a.subject}: {a.reason}. {b.subject}: {b.reason}"
    return ". ".join(
        f"{side.subject} is {side.verdict}" + f": {side.reason}" * bool(side.reason) for side in sorted((a, b), key=_order)
    )


def _order(side: Side) -> bool:
    """Sort wrong ones before others."""
    return side.verdict is not Verdict.WRONG
