"""Cost at an error on a line of settings, coarse to fine; isolated good results are ignored.

Errors of single settings scatter: a coarse one can be right by accident. A setting is therefore credited with the largest error
of itself and of all finer settings of its line. Where that falls from one setting to the next, errors in between cost what the
log-log interpolation gives, which is exact for a method with an order. Nothing is extrapolated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate

SMALLEST = 1e-17
"""Stands for an error of 0."""


def credit(errors: Sequence[float]) -> list[float]:
    """Return for each error, coarse to fine, the largest of it and of all that come after it."""
    return list(accumulate((max(error, SMALLEST) for error in reversed(errors)), max))[::-1]


def first_within(credited: Sequence[float], error: float) -> int | None:
    """Return which is the coarsest setting that is credited with an error or less; None where none is."""
    return next((i for i, found in enumerate(credited) if found <= error), None)


def cost(errors: Sequence[float], times: Sequence[float], error: float) -> float:
    """Return the time at which a line of settings, coarse to fine, gets to an error; nan where it does not.

    A time of nan stands for a setting that was not timed: its error counts, and it is no way to get there itself.
    """
    credited = credit(errors)
    first = first_within(credited, error)
    if first is None:
        return math.nan
    found = [time for time in times[first:] if not math.isnan(time)]
    if first > 0 and not (math.isnan(times[first]) or math.isnan(times[first - 1])):
        found.append(_between(error, credited[first - 1 : first + 1], times[first - 1 : first + 1]))
    return min(found, default=math.nan)


def _between(error: float, errors: Sequence[float], times: Sequence[float]) -> float:
    share = math.log(error / errors[0]) / math.log(errors[1] / errors[0])
    return times[0] * (times[1] / times[0]) ** share
