"""The fastest side at an error.

Errors of single settings scatter: a coarse setting can be accurate by accident. A setting is therefore credited with the
largest error of itself and of all finer settings of its line. The cost of an error between two settings is interpolated
(log-log), which is exact for a method with an order. Nothing is extrapolated.

If several processes measured the times, the ratio of two sides has a value in each, and an interval. A body counts as won or
lost only if 1 is outside of its interval; otherwise it is open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, zip_longest
from typing import TYPE_CHECKING

from .measures.interval import interval

if TYPE_CHECKING:
    import pandas as pd

SMALLEST = 1e-17
"""Replaces an error of 0."""
LINE = ("scene", "name", "family", "class")
"""Columns of points that identify a line of settings."""
CONFIDENCE = 0.95
"""Probability that the interval of a ratio contains the true ratio."""


def credit(errors: Sequence[float]) -> list[float]:
    """Return for each error, coarse to fine, the largest of it and of all finer ones."""
    return list(accumulate((max(error, SMALLEST) for error in reversed(errors)), max))[::-1]


def first_within(credited: Sequence[float], error: float) -> int | None:
    """Return the index of the coarsest setting that is credited with at most `error`, or None."""
    return next((i for i, credit in enumerate(credited) if credit <= error), None)


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
    reaching = [time for time in times[first:] if not math.isnan(time)]
    if first > 0 and not (math.isnan(times[first]) or math.isnan(times[first - 1])):
        share = math.log(error / credited[first - 1]) / math.log(credited[first] / credited[first - 1])
        reaching.append(times[first - 1] * (times[first] / times[first - 1]) ** share)
    return min(reaching, default=math.nan)


def costs(points: pd.DataFrame, errors: Iterable[float], line: Sequence[str] = LINE) -> pd.DataFrame:
    """Return the cost of each error on each line that reaches it.

    Parameters
    ----------
    points
        Columns of `line`, `error` and `time`; the settings of each line coarse to fine. A time of NaN was not measured. An
        optional column `times` has the times of each process instead.
    errors
        Errors, in the unit of the column `error`.
    line
        Columns that identify a line.

    Returns
    -------
    pd.DataFrame
        Columns of `line`, then `error`, `time` (the geometric mean over processes) and `times` (of each process), in the order
        of the points, each line at the errors in their order.
    """
    import pandas as pd  # here, so that studies can use this module without it

    rows = []
    for key, settings in points.groupby(list(line), sort=False):
        measured = settings["error"].tolist()
        timings = settings["times" if "times" in settings else "time"]  # a setting that was not timed has NaN in both
        by_setting = (timing if isinstance(timing, tuple) else (timing,) for timing in timings)
        processes = list(zip_longest(*by_setting, fillvalue=math.nan))
        for error in errors:
            times = tuple(cost(measured, process, error) for process in processes)
            if logs := [math.log(time) for time in times if not math.isnan(time)]:
                rows.append((*key, error, math.exp(math.fsum(logs) / len(logs)), times))
    return pd.DataFrame(rows, columns=[*line, "error", "time", "times"])


@dataclass(frozen=True)
class Cheapest:
    """The cheapest line of a side at an error: its time, s per simulated second, its name, and its time in each process."""

    time: float
    name: str
    times: tuple[float, ...] = ()


def cheapest(reached: pd.DataFrame) -> Cheapest | None:
    """Return the cheapest of some rows of `costs`, which are at one error; None if there are none."""
    if reached.empty:
        return None
    first = reached.iloc[int(reached["time"].argmin())]
    return Cheapest(float(first["time"]), str(first["name"]), first["times"])


@dataclass(frozen=True)
class SpeedRatio:
    """An error on a scene, and the cheapest line of either side; None if a side does not reach the error."""

    scene: str
    error: float
    ours: Cheapest | None
    theirs: Cheapest | None

    @cached_property
    def logs(self) -> list[float]:
        """Logarithm of their time divided by ours, in each process; empty if a side does not reach the error."""
        if not (self.ours and self.theirs):
            return []
        pairs = zip(self.theirs.times, self.ours.times, strict=False)
        logs = [math.log(theirs / ours) for theirs, ours in pairs if not math.isnan(theirs + ours)]
        return logs or [math.log(self.theirs.time / self.ours.time)]

    @property
    def ratio(self) -> float:
        """Their time divided by ours, above 1 if ours is faster; NaN if a side does not reach the error."""
        return math.exp(math.fsum(self.logs) / len(self.logs)) if self.logs else math.nan

    @cached_property
    def interval(self) -> tuple[float, float]:
        """Interval of the ratio over processes; NaN for fewer than two."""
        return bootstrap([self.logs])

    @property
    def lost(self) -> bool:
        """True if theirs is faster, beyond the interval if there is one, or is the only side that reaches the error."""
        return self.theirs is not None and (self.ours is None or self._last(1) < 1)

    @property
    def won(self) -> bool:
        """True if ours is faster, beyond the interval if there is one, or is the only side that reaches the error."""
        return self.ours is not None and (self.theirs is None or self._last(0) > 1)

    def _last(self, end: int) -> float:
        return self.ratio if math.isnan(self.interval[end]) else self.interval[end]


def bootstrap(logs: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the interval of exp(mean) of logarithms of ratios: a row for each body, a column for each process.

    Means over bodies and means over processes are resampled, and the squares of both margins are added (Owen 2007, The
    pigeonhole bootstrap). With five processes, their margin is about their range. NaN for a single value.
    """
    import numpy as np

    processes = min(map(len, logs), default=0)
    values = np.array([row[:processes] for row in logs])
    if values.size < 2:
        return math.nan, math.nan
    squares = np.zeros(2)
    for means in (values.mean(axis=1), values.mean(axis=0)):
        if len(means) > 1:
            squares += (np.array(interval(means, CONFIDENCE, widened=True)) - values.mean()) ** 2
    low, high = values.mean() + np.sqrt(squares) * (-1, 1)
    return math.exp(low), math.exp(high)


def bound_share(count: int, total: int) -> float:
    """Return the largest share of a population that `count` hits among `total` random members allow, with `CONFIDENCE`.

    One-sided (Clopper & Pearson 1934). Without a hit it is about 3 / total, the rule of three. NaN for a total of 0.
    """
    from scipy.special import betaincinv

    if count >= total:
        return 1.0 if total else math.nan
    return float(betaincinv(count + 1, total - count, CONFIDENCE))


def speed_ratios(
    ours: pd.DataFrame, theirs: pd.DataFrame, scenes: Iterable[str], errors: Sequence[float]
) -> tuple[SpeedRatio, ...]:
    """Return the ratio of two sides, given by rows of `costs`, at each error on each scene, even if no side reaches it."""
    best = []
    for reached in (ours, theirs):
        rows = reached.loc[reached.groupby(["scene", "error"], sort=False)["time"].idxmin()] if len(reached) else reached
        keys = zip(rows["scene"], rows["error"], strict=True)
        best.append(dict(zip(keys, map(Cheapest, rows["time"], rows["name"], rows["times"]), strict=True)))
    return tuple(SpeedRatio(scene, error, *(side.get((scene, error)) for side in best)) for scene in scenes for error in errors)


@dataclass(frozen=True)
class Ratios:
    """The speed ratios at one error on several bodies; bodies on which a side does not reach the error are counted."""

    speed_ratios: tuple[SpeedRatio, ...]

    @cached_property
    def both(self) -> list[SpeedRatio]:
        """Cases in which both sides reach the error, smallest ratio first."""
        return sorted((pair for pair in self.speed_ratios if pair.ours and pair.theirs), key=lambda pair: pair.ratio)

    @property
    def only_ours(self) -> int:
        """Number of bodies on which only our side reaches the error."""
        return sum(pair.theirs is None and pair.ours is not None for pair in self.speed_ratios)

    @property
    def only_theirs(self) -> int:
        """Number of bodies on which only the other side reaches the error."""
        return sum(pair.ours is None and pair.theirs is not None for pair in self.speed_ratios)

    @property
    def won(self) -> int:
        """Number of bodies on which ours is faster beyond the interval of the body, or alone in reaching the error."""
        return sum(pair.won for pair in self.speed_ratios)

    @property
    def lost(self) -> int:
        """The same for theirs."""
        return sum(pair.lost for pair in self.speed_ratios)

    @property
    def open(self) -> int:
        """Number of bodies on which both sides reach the error and neither is faster beyond the interval."""
        return sum(not (pair.won or pair.lost) for pair in self.both)

    @property
    def unreached(self) -> int:
        """Number of cases in which neither side reaches the error."""
        return sum(pair.ours is None and pair.theirs is None for pair in self.speed_ratios)

    @property
    def scenes(self) -> int:
        """Number of bodies of the cases."""
        return len({pair.scene for pair in self.speed_ratios})

    @property
    def share_lost(self) -> float:
        """Largest share of bodies like these on which the other side wins a case (see `bound_share`)."""
        return bound_share(len({pair.scene for pair in self.speed_ratios if pair.lost}), self.scenes)

    @property
    def ratio(self) -> float:
        """Geometric mean; NaN without a ratio."""
        return math.exp(math.fsum(math.log(pair.ratio) for pair in self.both) / len(self.both)) if self.both else math.nan

    @cached_property
    def interval(self) -> tuple[float, float]:
        """Interval of the geometric mean over bodies and processes like these (see `bootstrap`).

        The cases of one body are not independent, so that their mean is one value.
        """
        cases: dict[str, list[list[float]]] = {}
        for pair in self.both:
            cases.setdefault(pair.scene, []).append(pair.logs)
        means = [[math.fsum(process) / len(process) for process in zip(*logs, strict=False)] for logs in cases.values()]
        return bootstrap(means)

    @property
    def worst(self) -> float:
        """Smallest ratio; NaN without any."""
        return self.both[0].ratio if self.both else math.nan

    @property
    def best(self) -> float:
        """Largest ratio; NaN without any."""
        return self.both[-1].ratio if self.both else math.nan
