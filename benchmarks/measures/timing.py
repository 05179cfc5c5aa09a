"""Comparable wall times: the fastest of interleaved rounds in one process."""

from __future__ import annotations

import gc
import math
import random
import statistics
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from time import perf_counter_ns
from typing import Any, TypeVar

from conservative.check import positive_integer, positive_number
from conservative.errors import IntegrationFailed
from conservative.outcome import OK, Outcome

Key = TypeVar("Key", bound=Hashable)
MIN_ROUNDS = 3
"""Smallest number of rounds, also for a run over its budget: fewer have no median."""


@dataclass(frozen=True)
class Timing:
    """Wall time of one call, s: the minimum and the median over `rounds` samples of `calls` calls each.

    Both are NaN for a run that failed during timing, such as an engine in another process; `outcome` has the failure.
    """

    minimum: float
    median: float
    rounds: int
    calls: int
    outcome: Outcome = OK

    def __str__(self) -> str:
        return f"{self.rounds} rounds x {self.calls} calls"


def wall_time(run: Callable[[], Any], calls: int = 1) -> float:
    """Return the wall time of `calls` calls, s. A run in another process measures its own time."""
    own: Callable[[int], float] | None = getattr(run, "wall_time", None)
    if own is not None:
        return own(calls)
    start = perf_counter_ns()
    for _ in range(calls):
        run()
    return (perf_counter_ns() - start) * 1e-9


def count_calls(run: Callable[[], Any], min_time: float) -> int:
    """Return the number of calls that take `min_time` s. The first call is not counted unless it takes ten times as long."""
    if wall_time(run) > 10 * min_time:
        return 1
    calls = 1
    while (spent := wall_time(run, calls)) < min_time:
        calls = max(2 * calls, math.ceil(calls * min_time / spent) if spent > min_time / 10 else 0)
    return calls


def time_interleaved(
    runs: Mapping[Key, Callable[[], Any]], rounds: int = 7, min_time: float = 0.01, budget: float = math.inf, seed: int = 0
) -> dict[Key, Timing]:
    """Time several runs against each other.

    Unmeasured calls warm up and determine the number of calls per sample. Then every round takes one sample of each run in a
    new random order, so that slow periods of the machine affect all runs equally. Ratios of minimums are reproducible.

    Parameters
    ----------
    runs
        Functions to call, by any key.
    rounds
        Samples of each.
    min_time
        Shortest sample, s; faster runs are called repeatedly within a sample.
    budget
        Time, s, for all samples of one run. Slower runs get fewer rounds, but at least three.
    seed
        Seed of the random orders.

    Raises
    ------
    BadInput
        rounds is not an integer of 1 or more, or a time is not above 0.
    """
    positive_integer("rounds", rounds)
    positive_number("min_time", min_time, "a finite duration above 0, s")
    calls: dict[Key, int] = dict.fromkeys(runs, 1)
    taken: dict[Key, list[float]] = {name: [] for name in runs}
    failed: dict[Key, Outcome] = {}
    for name, run in runs.items():
        try:
            calls[name] = count_calls(run, min_time)
        except IntegrationFailed as failure:
            failed[name] = failure.outcome
    shuffled = random.Random(seed)
    collects = gc.isenabled()
    gc.collect()
    gc.disable()  # a collection would add its time to a sample
    try:
        for _ in range(rounds):
            for name in shuffled.sample(list(runs), len(runs)):
                times = taken[name]
                affordable = len(times) < MIN_ROUNDS or sum(times) * (1 + 1 / len(times)) * calls[name] <= budget
                if affordable and name not in failed:
                    try:
                        times.append(wall_time(runs[name], calls[name]) / calls[name])
                    except IntegrationFailed as failure:
                        failed[name] = failure.outcome
    finally:
        if collects:
            gc.enable()
    measured = {name: [math.nan] if name in failed else times for name, times in taken.items()}
    return {
        name: Timing(min(times), statistics.median(times), len(taken[name]), calls[name], failed.get(name, OK))
        for name, times in measured.items()
    }


@dataclass(frozen=True)
class Preparation:
    """One-time costs, s: `prepare` (conversion, and compilation if needed) and the first call of the run."""

    prepare: float
    first_call: float


def prepare_and_run(prepare: Callable[[], Callable[[], Any]]) -> tuple[Callable[[], Any], Any, Preparation]:
    """Return the run from `prepare`, the result of its first call, and the cost of both."""
    start = perf_counter_ns()
    run = prepare()
    middle = perf_counter_ns()
    result = run()
    end = perf_counter_ns()
    return run, result, Preparation((middle - start) * 1e-9, (end - middle) * 1e-9)
