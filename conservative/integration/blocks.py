"""Blocks of bodies: one block is integrated and checked at a time, many of them side by side on an executor.

The size of a block follows from the number of its samples alone, so that numbers do not depend on threads, on the order in
which blocks end, or on where they run.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..attitude import Array
from ..batch import Batch
from ..drifts import arrange_drifts, find_reference
from ..errors import BadInput, IntegrationFailed, NotRun
from ..grid import Grid
from ..method import Method
from ..methods.many import Block, pause, watch

MOST_BODIES, MOST_BYTES = 1024, 2**24
"""Bodies of a block at most, and about how many bytes its samples take at most."""
SAMPLE_BYTES = 96
"""Bytes of the attitude and the rates of a sample."""
LONGEST_WAIT = 0.1
"""Time, s, between two looks at what has ended: in between, some systems do not let Ctrl-C in."""


@dataclass(frozen=True, eq=False)
class BlockResult:
    """The result of a block of n bodies, of m samples each. It can be sent to another process.

    Attributes
    ----------
    R_WB, w_WB_B
        Attitudes (n, m, 3, 3), body to world, and angular velocities (n, m, 3), rad/s, body axes; nan after a failure.
    drifts
        Largest drifts (n, k), dimensionless, by the names that `conservative.drifts.list_drifts` has of the bodies.
    failures
        The failures of those that did not reach their end, by their indices in the block.
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


def run_block(method: Method, bodies: Batch, grid: Grid) -> BlockResult:
    """Return the samples of bodies, whose outcomes are those of `Method.solve` for each of them alone."""
    n, m, run, reference = (
        len(bodies),
        grid.n_samples,
        method.prepare_many(bodies, grid),
        find_reference(bodies, method.conserves),
    )
    if run is None:
        block, alone = Block(np.full((n, m, 3, 3), np.nan), np.full((n, m, 3), np.nan), np.zeros(n, dtype=bool)), np.arange(n)
    else:
        block = run()
        measured = reference.measure(grid, grid.t, block.R_WB, block.w_WB_B)
        alone = np.flatnonzero(~(block.finished & are_accepted(method, bodies, grid, measured)))
    failures = {}
    for i in alone.tolist():
        pause()
        failure = run_alone(method, bodies, grid, i, block)
        if failure is not None:
            failures[i] = failure
    if len(alone):
        measured = reference.measure(grid, grid.t, block.R_WB, block.w_WB_B)
    return BlockResult(block.R_WB, block.w_WB_B, arrange_drifts(bodies, measured, block.R_WB, block.w_WB_B), failures)


def are_accepted(method: Method, bodies: Batch, grid: Grid, measured: Array) -> Any:
    """Return which of n bodies (n,) are within the bounds of a method, by their drifts (n, 5) of `ReferenceValues.measure`.

    Bounds grow with the ratio of the moments. So those of the body with the smallest ratio hold for all, and only bodies beyond
    them need their own.
    """

    def are_within(i: int, part: Any) -> Any:
        bounds = method.bounds(bodies.take(i), grid)
        return (measured[part, 4] <= bounds.drift) & (measured[part, 0] <= bounds.orthonormality)

    if bodies.inertia is None:
        return are_within(0, slice(None))
    moments = bodies.principal[0]
    good = are_within(int(np.argmin(moments.max(axis=1) / moments.min(axis=1))), slice(None))
    for i in np.flatnonzero(~good).tolist():
        good[i] = are_within(i, i)
    return good


def run_alone(method: Method, bodies: Batch, grid: Grid, i: int, block: Block) -> IntegrationFailed | None:
    """Integrate body i alone, put its samples into the block, and return its failure, if there is one."""
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
    """Yield an executor of so many threads. Blocks that still run at the end, as after Ctrl-C, are given up."""
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
    """Runs each call at once, in the calling thread: in the main thread, Ctrl-C ends a run at any moment."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a call that is already over."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def run_blocks(
    method: Method, bodies: Batch, grid: Grid, executor: Executor, in_flight: int, firsts: Iterable[int]
) -> Generator[tuple[int, BlockResult], None, None]:
    """Run blocks, and yield the first index of each with its result, in the order in which they end.

    Parameters
    ----------
    method, bodies, grid
        The method, all bodies, and the steps in s.
    executor, in_flight
        The executor, and how many blocks it has at a time: those that run, and those that wait or have not been taken yet.
    firsts
        First indices of the blocks to run.
    """
    size, left = count_bodies(grid), iter(firsts)
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
