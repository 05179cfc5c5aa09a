"""Times of two versions against each other: sampled in turn, in several processes of each, with an interval for their ratio.

Three things besides the code change a time:

* Other processes interrupt. Samples are therefore short and many, both versions take turns, and the shortest sample counts.
* The place of machine code and data in memory can make a loop several percent slower for the life of a process. Both versions
  are therefore started repeatedly, data is placed several times in each process, and the faster half of the processes counts.
* The machine can be slow for seconds. A slower row is therefore measured again.

The interval (`measures.interval`) is over whole processes, in pairs that ran at the same time: samples of one process contain
no information about other processes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from conservative import registry
from conservative.attitude import Array
from conservative.errors import IntegrationFailed
from conservative.grid import grid_for

from ..measures.change import Range, direction, exact
from ..measures.interval import interval
from ..studies.study import Progress
from .comparison import TIMING

SLOWER = 0.05
"""Fraction by which a row may become slower."""
CONFIDENCE = 0.99
"""Probability that the true ratio is above the lower end of an interval, and probability that it is below the upper end."""
PROCESSES = 7
"""Processes of each version in a measurement."""
ROUNDS, FEWEST = 50, 8
"""Samples of each run in a process, and of a run that takes much longer than `LONGEST`."""
LAYOUTS = 3
"""Runs of each version in a process, each with its data elsewhere."""
MOST_TURNS = 6
"""Largest number of measurements for a row whose interval contains the limit."""
SAMPLE = 0.0004
"""Duration of a sample of short runs, s: most fit between two interruptions."""
LONGEST = 0.002
"""Duration of a call, s, above which it has the first steps of the scene only. A shorter one is the scene's motion."""
MOST_CALLS = 10_000
"""Largest number of calls in a sample."""


class Process(Protocol):
    """The process of a version: starts again after `close`, and prepares runs of n_steps steps of a scene, to be timed."""

    def close(self) -> None: ...

    def timed(self, scene: str, method: str, n_steps: int) -> Any: ...


@dataclass(frozen=True)
class Ratio(Range):
    """Time of the later version divided by the time of the earlier one, its interval, and the number of processes."""

    processes: int

    def direction(self, factor: float = 1 + SLOWER) -> int:
        """Return 1 if the whole interval is slower by more than a factor, -1 if it is faster, otherwise 0."""
        return direction(exact(1.0), self, factor)

    @property
    def slower(self) -> bool:
        """True if the whole interval is above the limit."""
        return self.direction() > 0

    @property
    def open(self) -> bool:
        """True if the interval contains the limit, so that more processes are needed."""
        return not self.slower and self.high > 1 + SLOWER

    def __str__(self) -> str:
        return f"{self.value:.3f} times as long ({self.low:.3f} to {self.high:.3f})"


@dataclass(frozen=True)
class TimeRow:
    """Times of one row: of a step in both versions, s, their ratio, and the ratio of a repetition, if there was one."""

    was: float
    now: float
    first: Ratio
    again: Ratio | None = None
    reason: str = ""

    @property
    def failed(self) -> bool:
        """True if the row was slower both times, or could not be timed."""
        return bool(self.reason) or (self.first.slower and self.again is not None and self.again.slower)


Timed = tuple[str, str]
"""A timed setting: registered names of the scene and of the method."""
Times = dict[Timed, list[tuple[float, float]]]
"""Shortest times of a step, s, in both versions, for each pair of processes."""


def compare_times(
    base: Process,
    head: Process,
    rows: Sequence[Timed],
    processes: int = PROCESSES,
    tell: Progress = lambda share, what: None,
) -> dict[Timed, TimeRow]:
    """Return the times of two versions; rows that are slower are measured again."""
    clock = Clock(base, head, tell)
    first = settle(clock, rows, processes)
    ratios = {row: ratio_of(first[row]) for row in rows}
    slower = [row for row in rows if ratios[row].slower]
    again = settle(clock, slower, processes)
    repeated = {row: ratio_of(again[row]) for row in slower}
    time_rows = {}
    for row in rows:
        times = [*first[row], *again.get(row, [])]
        was, now = np.min(times, axis=0) if times else (math.nan, math.nan)
        time_rows[row] = TimeRow(float(was), float(now), ratios[row], repeated.get(row), clock.failures.get(row, ""))
    return time_rows


def settle(clock: Clock, rows: Sequence[Timed], processes: int) -> Times:
    """Return the times of rows from a number of processes, and from more for rows whose interval contains the limit."""
    measured: Times = {row: [] for row in rows}
    for _ in range(MOST_TURNS):
        for row, times in clock.measure(rows, processes).items():
            measured[row] += times
        rows = [row for row in rows if ratio_of(measured[row]).open]
    return measured


class Clock:
    """Measures rows in new processes each time. `failures` has the reasons of rows without times."""

    def __init__(self, base: Process, head: Process, tell: Progress = lambda share, what: None) -> None:
        self._sides, self._tell = (base, head), tell
        self._work: dict[Timed, tuple[int, int, int]] = {}
        self.failures: dict[Timed, str] = {}

    def measure(self, rows: Sequence[Timed], processes: int) -> Times:
        """Return the times of rows from a number of processes."""
        measured: Times = {row: [] for row in rows}
        for turn in range(processes if rows else 0):
            for side in self._sides:
                side.close()
            for number, row in enumerate(rows):
                share = (turn + number / len(rows)) / processes
                self._tell(TIMING + (1 - TIMING) * share, f"times of {row[1]}, process {turn + 1} of {processes}")
                if row in self.failures:
                    continue
                try:
                    measured[row].append(self._shortest(row, turn))
                except IntegrationFailed as failure:
                    self.failures[row] = str(failure.outcome)
        return measured

    def _shortest(self, row: Timed, turn: int) -> tuple[float, float]:
        """Return the shortest time of a step, s, in each version."""
        if row not in self._work:
            scene, n, spent = registry.scene(row[0]), 16, 0.0
            most = grid_for(scene, scene.dt).n_steps
            while True:  # until the run has all steps of the scene, or takes `LONGEST`
                run = self._sides[0].timed(*row, min(n, most))
                run.wall_time(1)
                spent = max(min(run.wall_time(1) for _ in range(5)), 1e-9)
                if spent >= LONGEST or n >= most:
                    break
                n = max(n + 1, math.ceil(n * min(8.0, 1.2 * LONGEST / spent)))
            n = min(n, most)
            calls = min(MOST_CALLS, max(1, math.ceil(SAMPLE / spent / 2)))
            self._work[row] = n, calls, max(FEWEST, round(ROUNDS * min(1.0, 2 * LONGEST / spent)))
        steps, calls, rounds = self._work[row]
        runs = [[side.timed(*row, steps) for _ in range(LAYOUTS)] for side in self._sides]
        was, now = _sample(runs, calls, turn, rounds)
        return was / steps, now / steps


def _sample(runs: Sequence[Sequence[Any]], calls: int, turn: int, rounds: int) -> tuple[float, float]:
    """Return the shortest time, s, of a call in each version; the version that begins changes from round to round."""
    shortest = [math.inf, math.inf]
    for layouts in runs:
        for run in layouts:
            run.wall_time(calls)
    for k in range(turn, turn + rounds):
        for layout in range(LAYOUTS):
            for side in ((0, 1), (1, 0))[(k + layout) % 2]:
                shortest[side] = min(shortest[side], runs[side][layout].wall_time(calls) / calls)
    return shortest[0], shortest[1]


def ratio_of(times: Sequence[tuple[float, float]]) -> Ratio:
    """Return the ratio of times (n, 2), s, of n processes, with its interval; NaN for fewer than two, or without a time."""
    if len(times) < 2 or not np.isfinite(times).all():
        return Ratio(math.nan, math.nan, math.nan, len(times))
    logs = np.log(np.array(times)).T
    low, high = interval(logs, 2 * CONFIDENCE - 1, _difference)  # `CONFIDENCE` is the confidence of one end
    return Ratio(math.exp(_difference(logs)), math.exp(low), math.exp(high), len(times))


def _difference(logs: Array) -> Array:
    """Return the difference of the means of the faster halves, of logarithms of times (..., 2, n)."""
    half = (logs.shape[-1] + 1) // 2
    return np.asarray(np.diff(np.sort(logs)[..., :half].mean(axis=-1))[..., 0])
