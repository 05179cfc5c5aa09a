"""Blocks of bodies: one block is run from start to checked samples, many of them side by side on an executor.

The size of a block follows from the number of its samples alone, so that numbers do not depend on threads, on the order in
which blocks end, or on where they run. Source: our own.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import closing, contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from ..attitude import Array
from ..errors import BadInput, IntegrationFailed, NotRun
from ..method import Grid, Method
from ..methods.many import Block, Bodies, pause, watch
from ..outcome import ProgressOfMany
from ..trajectory import Bounds
from .drifts import find_drifts, list_drifts

MOST_BODIES, MOST_BYTES = 1024, 2**24
"""Bodies of a block at most, and about how many bytes its samples take at most."""
SAMPLE_BYTES = 96
"""Bytes of the attitude and the rates of a sample."""
LONGEST_WAIT = 0.1
"""Time, s, between two looks at what has ended: in between, some systems do not let Ctrl-C in."""


@dataclass(frozen=True, eq=False)
class BlockResult:
    """What a block of n bodies gives, of m samples each. It can be sent to another process.

    Attributes
    ----------
    R_WB, w_WB_B
        Attitudes (n, m, 3, 3), body to world, and angular velocities (n, m, 3), rad/s, body axes; nan after a failure.
    drifts
        Largest drifts (n, k), dimensionless, by the names that `conservative.integration.drifts.list_drifts` has of the bodies.
    failures
        What ended the runs of those that did not reach their end, by their indices in the block.
    """

    R_WB: Array
    w_WB_B: Array
    drifts: Array
    failures: dict[int, IntegrationFailed]

    def __len__(self) -> int:
        return len(self.R_WB)


def count_bodies(grid: Grid) -> int:
    """Return how many bodies a block has."""
    return max(1, min(MOST_BODIES, MOST_BYTES // (SAMPLE_BYTES * grid.n_samples)))


def list_blocks(n: int, grid: Grid) -> range:
    """Return the first index of each block of n bodies."""
    return range(0, n, count_bodies(grid))


def count_left(n: int, grid: Grid, done: Collection[int]) -> int:
    """Return how many of n bodies are in blocks whose first indices are not in `done`."""
    return sum(min(count_bodies(grid), n - first) for first in list_blocks(n, grid) if first not in done)


def run_block(method: Method, bodies: Bodies, grid: Grid) -> BlockResult:
    """Return the samples of bodies, whose outcomes are those of `Method.solve` for each of them alone."""
    run = method.prepare_many(bodies, grid)
    n, m = len(bodies), grid.n_samples
    block = run() if run else Block(np.full((n, m, 3, 3), np.nan), np.full((n, m, 3), np.nan), np.zeros(n, dtype=bool))
    found = find_drifts(bodies, grid.t, block.R_WB, block.w_WB_B) if run else None
    good = np.zeros(n, dtype=bool) if found is None else block.finished & is_kept(method, bodies, grid, found.bounded)
    failures = {}
    for i in np.flatnonzero(~good).tolist():
        pause()
        failure = run_alone(method, bodies, grid, i, block)
        if failure is not None:
            failures[i] = failure
    if found is None or not good.all():
        found = find_drifts(bodies, grid.t, block.R_WB, block.w_WB_B)
    return BlockResult(block.R_WB, block.w_WB_B, found.values, failures)


def is_kept(method: Method, bodies: Bodies, grid: Grid, bounded: Array) -> Any:
    """Return which of n bodies (n,) are within the bounds of a method, by their drifts (n, k), dimensionless.

    Bounds grow with the ratio of a body's moments. So those of the body with the smallest ratio hold for all, and only who is
    beyond them is asked for its own.
    """
    names, kept = list_drifts(bodies), method.conserves
    own = {each.name for each in bodies.scene.extra_invariants}
    columns = [column for column, name in enumerate(names) if column > 0 and name in kept and name not in own]
    skew, drift = bounded[:, 0], np.nan_to_num(bounded[:, columns], nan=np.inf).max(axis=1, initial=0.0)
    roundest = (
        0 if bodies.inertia is None else int(np.argmin(bodies.principal[0].max(axis=1) / bodies.principal[0].min(axis=1)))
    )
    good = _within(method.bounds(bodies.take(roundest), grid), drift, skew)
    if bodies.inertia is not None:
        for i in np.flatnonzero(~good).tolist():
            good[i] = _within(method.bounds(bodies.take(i), grid), drift[i], skew[i])
    return good


def _within(bounds: Bounds, drift: Any, skew: Any) -> Any:
    return (drift <= bounds.drift) & (skew <= bounds.orthonormality)


def run_alone(method: Method, bodies: Bodies, grid: Grid, i: int, block: Block) -> IntegrationFailed | None:
    """Put the samples of body i, run alone, into the block, and return what ended its run early, None if nothing did."""
    block.R_WB[i], block.w_WB_B[i] = np.nan, np.nan
    scene = bodies.take(i)
    try:
        reason = method.unsupported(scene)
        if reason:
            return NotRun(f"{method.name}: {reason}")
        found = method.solve(scene, grid)
    except BadInput as refusal:
        return NotRun(str(refusal))
    block.R_WB[i, : len(found)], block.w_WB_B[i, : len(found)] = found.R_WB, found.w_WB_B
    return found.failure


@contextmanager
def start_threads(threads: int) -> Iterator[Executor]:
    """Give an executor of so many threads; when it is left, be it by Ctrl-C, blocks that still run are given up."""
    if threads == 1:
        yield Inline()
        return
    given_up = threading.Event()
    executor = ThreadPoolExecutor(threads, initializer=watch, initargs=(given_up,))
    try:
        yield executor
    finally:
        given_up.set()
        executor.shutdown(cancel_futures=True)


class Inline(Executor):
    """Runs what it is given at once, in the thread that gives it: there, Ctrl-C ends a run at any moment."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a call that is over already."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def run_blocks(
    method: Method, bodies: Bodies, grid: Grid, executor: Executor, in_flight: int, done: Collection[int] = ()
) -> Generator[tuple[int, BlockResult], None, None]:
    """Run all blocks, and yield the first index of each with its result, in the order in which they end.

    Parameters
    ----------
    method, bodies, grid
        What is run. `grid` has steps in s.
    executor, in_flight
        What runs blocks, and how many it has at a time: those that run, and those that wait or have not been taken yet.
    done
        First indices of blocks that are left out.
    """
    size = count_bodies(grid)
    left = (first for first in list_blocks(len(bodies), grid) if first not in done)
    pending: dict[Future[BlockResult], int] = {}
    try:
        while True:
            while len(pending) < in_flight and (first := next(left, None)) is not None:
                pending[executor.submit(run_block, method, bodies[first : first + size], grid)] = first
            if not pending:
                return
            ended, _ = wait(pending, LONGEST_WAIT, FIRST_COMPLETED)
            for future in [each for each in pending if each in ended]:  # in the order in which they were handed over
                yield pending.pop(future), future.result()
    finally:
        for future in pending:
            future.cancel()


Tell = Callable[[ProgressOfMany], object]


class Sink(Protocol):
    """What keeps the results of blocks, in the order in which they come."""

    @property
    def done(self) -> Collection[int]:
        """First indices of the blocks that it has already."""

    def write(self, first: int, result: BlockResult) -> None:
        """Keep the result of the block that begins with body number `first`."""


def fill(
    sink: Sink, results: Generator[tuple[int, BlockResult], None, None], counts: tuple[int, int], progress: Tell | None
) -> None:
    """Hand all results to a sink, and tell after each of them how many bodies are done; counts are those left, and all."""
    begun, (left, total) = perf_counter(), counts
    done = total - left
    with closing(results):
        for first, result in results:
            sink.write(first, result)
            done += len(result)
            if progress is not None:
                progress(ProgressOfMany(perf_counter() - begun, done, total, total - counts[0]))
