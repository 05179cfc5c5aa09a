"""Times of two versions against each other: sampled in turn, in several processes of each, with an interval for their ratio.

Three things move a time that is not the code. Other processes come in between: samples are short and many, both versions take
theirs in turn, and the shortest of each counts. Where machine code and data happen to lie makes a loop some per cent slower for
as long as a process lives: both versions are started anew again and again, data is laid out several times in each process, and
of the processes the faster half counts. And the machine has slow spells of seconds: what is found slower is measured again.

The interval is a bootstrap of whole processes, those of one time together (Efron and Tibshirani, An Introduction to the
Bootstrap, 1993, chapter 13); samples of one process would say nothing of where another one lies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from conservative.attitude import Array
from conservative.errors import IntegrationFailed

from ..gate.yardstick import SAMPLE, last_a_sample
from ..measures.timing import wall_time
from .rows import Place
from .side import Side, TimedRun

SLOWER = 0.05
"""Part by which a row may become slower."""
CONFIDENCE = 0.99
"""That of each end of an interval: so sure it is that a ratio above it, or below it, is none by chance."""
PROCESSES = 7
"""Processes of each version in a measurement."""
ROUNDS = 50
"""Samples of each run in a process."""
LAYOUTS = 3
"""Runs of each version in a process, each with its data elsewhere."""
MOST_TURNS = 6
"""How often at most so many processes are measured until it is no longer open whether a row is slower."""
RESAMPLES = 4999
MOST_CALLS = 10_000


@dataclass(frozen=True)
class Timed:
    """What is timed: a method on a scene."""

    place: Place
    method: str

    @property
    def id(self) -> str:
        """Of its row."""
        return self.place.row_id(self.method)


@dataclass(frozen=True)
class Ratio:
    """Time of the later version in times of the earlier one: value, ends of the interval, and from how many processes."""

    value: float
    low: float
    high: float
    processes: int

    @property
    def slower(self) -> bool:
        """Whether it is slower than allowed beyond doubt."""
        return self.low > 1 + SLOWER

    @property
    def open(self) -> bool:
        """Whether it may be slower than allowed, or not: the interval holds the limit."""
        return self.low <= 1 + SLOWER < self.high


@dataclass(frozen=True)
class TimeRow:
    """What was found of one row: time of a step, s, in both versions, the ratio, and that of a repetition, if there was one."""

    was: float
    now: float
    first: Ratio
    again: Ratio | None = None
    reason: str = ""

    @property
    def failed(self) -> bool:
        """Whether the row is slower, each time that it was measured, or could not be timed."""
        return bool(self.reason) or (self.first.slower and self.again is not None and self.again.slower)


Times = dict[str, list[tuple[float, float]]]
"""Shortest times of a step, s, of both versions, of each process of a row, by the row's id; no more where it failed."""


def compare_times(base: Side, head: Side, rows: Sequence[Timed], processes: int = PROCESSES) -> dict[str, TimeRow]:
    """Return what the times of two versions say, by the id of each row; what is slower beyond doubt is measured again."""
    clock = Clock(base, head)
    first = settle(clock, rows, processes)
    found = {row.id: ratio_of(first[row.id]) for row in rows}
    slower = [row for row in rows if found[row.id].slower]
    again = settle(clock, slower, processes)
    repeated = {row.id: ratio_of(again[row.id]) for row in slower}
    every = {row.id: [*first[row.id], *again.get(row.id, [])] for row in rows}
    return {id: _row(every[id], found[id], repeated.get(id), clock.failures.get(id, "")) for id in every}


def settle(clock: Clock, rows: Sequence[Timed], processes: int) -> Times:
    """Return the times of rows from so many processes, and of rows of which it is open whether they are slower from more."""
    found: Times = {row.id: [] for row in rows}
    for _ in range(MOST_TURNS):
        for id, times in clock.measure(rows, processes).items():
            found[id] += times
        rows = [row for row in rows if ratio_of(found[row.id]).open]
    return found


def _row(times: Sequence[tuple[float, float]], first: Ratio, again: Ratio | None, reason: str) -> TimeRow:
    was, now = np.min(times, axis=0) if times else (math.nan, math.nan)
    return TimeRow(float(was), float(now), first, again, reason)


class Clock:
    """Measures rows in processes that it starts anew each time. Attribute: `failures`, why rows have no times, by their id."""

    def __init__(self, base: Side, head: Side) -> None:
        self._sides = base, head
        self._work: dict[str, tuple[int, int]] = {}
        self.failures: dict[str, str] = {}

    def measure(self, rows: Sequence[Timed], processes: int) -> Times:
        """Return the times of rows from so many processes."""
        found: Times = {row.id: [] for row in rows}
        for turn in range(processes if rows else 0):
            for side in self._sides:
                side.close()
            for row in rows:
                if row.id not in self.failures:
                    self._measure(row, turn, found[row.id])
        return found

    def _measure(self, row: Timed, turn: int, found: list[tuple[float, float]]) -> None:
        try:
            found.append(self._shortest(row, turn))
        except IntegrationFailed as failure:
            self.failures[row.id] = str(failure.outcome)

    def _shortest(self, row: Timed, turn: int) -> tuple[float, float]:
        """Return the shortest time of a step, s, in each version."""
        scene, dt = row.place.name, row.place.scene.dt
        if row.id not in self._work:
            self._work[row.id] = _plan(self._sides[0], row)
        steps, calls = self._work[row.id]
        runs = [[side.timed(scene, row.method, dt, steps) for _ in range(LAYOUTS)] for side in self._sides]
        was, now = _sample(runs, calls, turn)
        return was / steps, now / steps


def _plan(side: Side, row: Timed) -> tuple[int, int]:
    """Return the steps of a run, and the calls of it, that make a sample."""
    steps, run = last_a_sample(lambda n: side.timed(row.place.name, row.method, row.place.scene.dt, n))
    spent = min(wall_time(run) for _ in range(5))
    return steps, min(MOST_CALLS, max(1, math.ceil(SAMPLE / max(spent, 1e-9) / 2)))


def _sample(runs: Sequence[Sequence[TimedRun]], calls: int, turn: int) -> tuple[float, float]:
    """Return the shortest time, s, of a call in each version; who begins changes from round to round."""
    shortest = [math.inf, math.inf]
    for each in runs:
        for run in each:
            run.wall_time(calls)
    for k in range(turn, turn + ROUNDS):
        for layout in range(LAYOUTS):
            for side in ((0, 1), (1, 0))[(k + layout) % 2]:
                shortest[side] = min(shortest[side], runs[side][layout].wall_time(calls) / calls)
    return shortest[0], shortest[1]


def ratio_of(times: Sequence[tuple[float, float]], seed: int = 0) -> Ratio:
    """Return the ratio that times (n, 2), s, of n processes say, with its interval; nan where there are fewer than two."""
    from scipy.stats import bootstrap

    if len(times) < 2:
        return Ratio(math.nan, math.nan, math.nan, len(times))
    was, now = np.log(np.array(times)).T
    found = bootstrap(
        (was, now),
        _difference,
        n_resamples=RESAMPLES,
        paired=True,
        vectorized=True,
        confidence_level=2 * CONFIDENCE - 1,
        method="percentile",
        rng=seed,
    ).confidence_interval
    value = float(_difference(was, now))
    return Ratio(math.exp(value), math.exp(float(found.low)), math.exp(float(found.high)), len(times))


def _difference(was: Array, now: Array, axis: int = -1) -> Array:
    """Return the difference of the mean logarithms of the faster halves."""
    half = (was.shape[axis] + 1) // 2
    means = [np.sort(times, axis=axis).take(range(half), axis=axis).mean(axis=axis) for times in (was, now)]
    return np.asarray(means[1] - means[0])
