"""The fastest side at an error.

Errors of single settings scatter: a coarse setting can be accurate by accident. A setting is therefore credited with the
largest error of itself and of all finer settings of its line. The cost of an error between two settings is interpolated
(log-log), which is exact for a method with an order. Nothing is extrapolated.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

SMALLEST = 1e-17
"""Replaces an error of 0."""
LINE = ("scene", "name", "family", "class")
"""Columns of points that identify a line of settings."""
CONFIDENCE = 0.95
"""Confidence of the interval of a geometric mean."""


def credit(errors: Sequence[float]) -> list[float]:
    """Return for each error, coarse to fine, the largest of it and of all finer ones."""
    return list(accumulate((max(error, SMALLEST) for error in reversed(errors)), max))[::-1]


def first_within(credited: Sequence[float], error: float) -> int | None:
    """Return the index of the coarsest setting that is credited with at most `error`, or None."""
    return next((i for i, each in enumerate(credited) if each <= error), None)


def list_deciding(errors: Sequence[float], error: float) -> list[int]:
    """Return the indices of the settings, coarse to fine, that determine the cost of an error.

    They are the coarsest setting that is credited with it and the one before; none if no setting reaches the error.
    """
    first = first_within(credit(errors), error)
    return [] if first is None else [i for i in (first - 1, first) if i >= 0]


def cost(errors: Sequence[float], times: Sequence[float], error: float) -> float:
    """Return the time in which a line of settings, coarse to fine, reaches an error; NaN if it does not.

    A time of NaN belongs to a setting that was not timed: its error counts, but it does not reach an error itself.
    """
    credited = credit(errors)
    first = first_within(credited, error)
    if first is None:
        return math.nan
    known = [time for time in times[first:] if not math.isnan(time)]
    if first > 0 and not (math.isnan(times[first]) or math.isnan(times[first - 1])):
        share = math.log(error / credited[first - 1]) / math.log(credited[first] / credited[first - 1])
        known.append(times[first - 1] * (times[first] / times[first - 1]) ** share)
    return min(known, default=math.nan)


def costs(points: pd.DataFrame, errors: Iterable[float], line: Sequence[str] = LINE) -> pd.DataFrame:
    """Return the cost of each error on each line that reaches it.

    Parameters
    ----------
    points
        Columns of `line`, `error` and `time`; the settings of each line coarse to fine. A time of NaN was not measured.
    errors
        Errors, in the unit of the column `error`.
    line
        Columns that identify a line.

    Returns
    -------
    pd.DataFrame
        Columns of `line`, then `error` and `time`, in the order of the points, each line at the errors in their order.
    """
    import pandas as pd  # here, so that studies can use this module without it

    rows = [
        (*key, error, time)
        for key, settings in points.groupby(list(line), sort=False)
        for measured, times in [(settings["error"].tolist(), settings["time"].tolist())]
        for error in errors
        if not math.isnan(time := cost(measured, times, error))
    ]
    return pd.DataFrame(rows, columns=[*line, "error", "time"])


@dataclass(frozen=True)
class Cheapest:
    """The cheapest line of a side at an error: its time, s per simulated second, and its name."""

    time: float
    name: str


def cheapest(reached: pd.DataFrame) -> Cheapest | None:
    """Return the cheapest of some rows of `costs`, which are at one error; None if there are none."""
    if reached.empty:
        return None
    first = reached.iloc[int(reached["time"].argmin())]
    return Cheapest(float(first["time"]), str(first["name"]))


@dataclass(frozen=True)
class Contest:
    """An error on a scene, and the cheapest line of either side; None if a side does not reach the error."""

    scene: str
    error: float
    ours: Cheapest | None
    theirs: Cheapest | None

    @property
    def ratio(self) -> float:
        """Their time divided by ours, above 1 if ours is faster; NaN if a side does not reach the error."""
        return self.theirs.time / self.ours.time if self.ours and self.theirs else math.nan

    @property
    def lost(self) -> bool:
        """True if theirs is faster, or is the only side that reaches the error."""
        return self.theirs is not None and (self.ours is None or self.ratio < 1)


def contests(ours: pd.DataFrame, theirs: pd.DataFrame, scenes: Iterable[str], errors: Sequence[float]) -> tuple[Contest, ...]:
    """Return the contest of two sides, given by rows of `costs`, at each error on each scene, even if no side reaches it."""
    best = [_cheapest_of_each(side) for side in (ours, theirs)]
    return tuple(Contest(scene, error, *(side.get((scene, error)) for side in best)) for scene in scenes for error in errors)


def _cheapest_of_each(reached: pd.DataFrame) -> dict[tuple[str, float], Cheapest]:
    rows = reached.loc[reached.groupby(["scene", "error"], sort=False)["time"].idxmin()] if len(reached) else reached
    keys = zip(rows["scene"], rows["error"], strict=True)
    return dict(zip(keys, map(Cheapest, rows["time"], rows["name"]), strict=True))


@dataclass(frozen=True)
class Ratios:
    """The ratios of contests at one error on several bodies; bodies on which a side does not reach the error are counted."""

    contests: tuple[Contest, ...]

    @cached_property
    def both(self) -> list[Contest]:
        """Contests in which both sides reach the error, smallest ratio first."""
        return sorted((each for each in self.contests if each.ours and each.theirs), key=lambda each: each.ratio)

    @property
    def only_ours(self) -> int:
        """Number of bodies on which only our side reaches the error."""
        return sum(each.theirs is None and each.ours is not None for each in self.contests)

    @property
    def only_theirs(self) -> int:
        """Number of bodies on which only the other side reaches the error."""
        return sum(each.ours is None and each.theirs is not None for each in self.contests)

    @property
    def mean(self) -> float:
        """Geometric mean; NaN without a ratio."""
        return math.exp(math.fsum(self._logs) / len(self._logs)) if self.both else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Interval of the geometric mean over bodies like these, from Student's t; NaN for fewer than two ratios."""
        n = len(self.both)
        if n < 2:
            return math.nan, math.nan
        from scipy.stats import t  # here, as importing it takes as long as everything else of a command

        center = math.log(self.mean)
        variance = math.fsum((log - center) ** 2 for log in self._logs) / (n - 1)
        half = float(t.ppf((1 + CONFIDENCE) / 2, n - 1)) * math.sqrt(variance / n)
        return math.exp(center - half), math.exp(center + half)

    @property
    def worst(self) -> float:
        """Smallest ratio; NaN without any."""
        return self.both[0].ratio if self.both else math.nan

    @property
    def best(self) -> float:
        """Largest ratio; NaN without any."""
        return self.both[-1].ratio if self.both else math.nan

    @property
    def _logs(self) -> list[float]:
        return [math.log(each.ratio) for each in self.both]
