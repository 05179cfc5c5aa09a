"""Ways of running many bodies: at once or one at a time, on one thread or on several."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from conservative.batch import Batch
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.methods.many import Block, RunMany
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.worker.client import time_limit

from ..measures.timing import Preparation, wall_time
from .case import outcome_of_error
from .selection import takes_exact_steps

BLOCK = 1024
"""Bodies that are prepared and run at a time."""
COMPILED = 1.0
"""Time, s, above which a preparation is repeated, because it may have compiled."""


@dataclass(frozen=True)
class Way:
    """A method, and how it runs many bodies: `together` by `Method.prepare_many`, or each body in a run of its own.

    `threads` is the number of our threads for blocks of bodies; the threads of an engine are one of its settings.
    """

    method: Method
    together: bool = True
    threads: int = 1

    @property
    def text(self) -> str:
        """Text of the way, "" for bodies at once on one thread."""
        alone = [] if self.together else ["one at a time"]
        return ", ".join([*alone, *([f"{self.threads} threads"] if self.threads > 1 else [])])


def list_ways(method: Method) -> tuple[Way, ...]:
    """Return the compared ways of a method; for our methods also one body at a time, and two threads."""
    if not method.method_info.many:  # it runs one body at a time
        return (Way(method, together=False),)
    return (Way(method), Way(method, together=False), Way(method, threads=2)) if method.role == Role.OURS else (Way(method),)


class RunBlocks:
    """A run of many bodies, prepared and made block by block, which returns the result of the last block."""

    def __init__(self, way: Way, bodies: Batch, grid: Grid) -> None:
        self._runs: list[RunMany] = []
        for first in range(0, len(bodies), BLOCK):
            block = bodies[first : first + BLOCK]
            together = way.method.prepare_many(block, grid) if way.together else None
            alone = (way.method.prepare(block.take(i), grid) for i in range(len(block)))
            self._runs.append(_Loop(list(alone), grid) if together is None else together)
        self._pool = ThreadPoolExecutor(way.threads) if way.threads > 1 else None

    def __call__(self) -> Block:
        for block in (self._pool.map if self._pool else map)(lambda run: run(), self._runs):
            last = block
        return last

    def wall_time(self, calls: int) -> float:
        """Return the wall time of calls, s, without the communication with engines in other processes."""
        if self._pool is None:
            return sum(wall_time(run, calls) for run in self._runs)
        return wall_time(self.__call__, calls)


class _Loop:
    """A run for each body, in turn."""

    def __init__(self, runs: list[Callable[[], Any]], grid: Grid) -> None:
        self._runs, self._samples = runs, grid.n_samples

    def __call__(self) -> Block:
        n, samples = len(self._runs), self._samples
        R_WB, w_WB_B = np.full((n, samples, 3, 3), np.nan), np.full((n, samples, 3), np.nan)
        for i, run in enumerate(self._runs):
            trajectory = run()
            R_WB[i, : len(trajectory)], w_WB_B[i, : len(trajectory)] = trajectory.R_WB, trajectory.w_WB_B
        return Block(R_WB, w_WB_B, np.isfinite(R_WB).all(axis=(1, 2, 3)))

    def wall_time(self, calls: int) -> float:
        """Return the wall time of calls, s, without the communication with engines in other processes."""
        own = [run for run in self._runs if hasattr(run, "wall_time")]
        return sum(wall_time(run, calls) for run in own) if own else wall_time(self.__call__, calls)


ManyDone = tuple[RunBlocks, Block, Preparation]
"""A run of many bodies that can be called again, its result, and the cost of its preparation and of its second call."""


def attempt_many(way: Way, bodies: Batch, grid: Grid, limit: float, skip_missing: bool = False) -> ManyDone | Outcome:
    """Return the run of bodies after two calls, or the outcome of its failure (`outcome_of_error`)."""
    if reason := way.method.unsupported(bodies.take(0)):
        return Outcome(OutcomeKind.UNSUPPORTED, reason)
    try:
        with time_limit(limit):
            for _ in range(2):
                start = perf_counter()
                run = RunBlocks(way, bodies, grid)
                if (spent := perf_counter() - start) <= COMPILED:
                    break
            return run, run(), Preparation(spent, wall_time(run))
    except Exception as error:
        return outcome_of_error(way.method, error, skip_missing)


def family_settings(methods: Iterable[Method]) -> tuple[Method, ...]:
    """Return one setting of each family that runs many bodies: without truncation error if there is one, else the first."""
    families = {type(method): method.settings_for("many") for method in methods}.values()
    return tuple(sorted(offered, key=takes_exact_steps, reverse=True)[0] for offered in families if offered)
