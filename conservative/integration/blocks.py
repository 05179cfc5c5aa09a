"""Blocks of bodies: each is integrated and checked as one, on threads or on a cluster.

The size of a block depends only on the number of samples. So results do not depend on the number of threads, on the order in
which blocks end, or on the machine that runs them.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..attitude import Array
from ..batch import Batch
from ..drifts import arrange_drifts, find_reference, measure_drifts
from ..errors import BadInput, IntegrationFailed, NotRun
from ..grid import Grid
from ..method import Method
from ..methods.many import Block, pause, watch
from ..outcome import ProgressOfMany
from .cluster import start_executor

if TYPE_CHECKING:
    from distributed import Client

MOST_BODIES, MOST_BYTES = 1024, 2**24
"""Largest number of bodies in a block, and the approximate limit on the size of its samples, bytes."""
SAMPLE_BYTES, LOAD_BYTES = 96, 32
"""Size of a sample, attitude and rates, and of what loads supplied up to it, bytes."""
MOST_WAITING = 16
"""Largest number of blocks that wait for a worker of a cluster, in addition to those that run."""
LONGEST_WAIT = 0.1
"""Time, s, between two checks for blocks that have ended. On some systems Ctrl-C has no effect during a wait."""


@dataclass(frozen=True, eq=False)
class BlockResult:
    """Samples, drifts and failures of a block of n bodies with m samples each. It can be sent to another process.

    Attributes
    ----------
    R_WB, w_WB_B
        Attitudes (n, m, 3, 3), body to world, and angular velocities (n, m, 3), rad/s, body axes; nan after a failure.
    drifts
        Largest drifts (n, k), dimensionless, by the names of `conservative.drifts.list_drifts`.
    failures
        Failures by the index of the body in the block.
    supplied
        `Trajectory.supplied` (n, m, 4), nan without; None in scenes without loads.
    """

    R_WB: Array
    w_WB_B: Array
    drifts: Array
    failures: dict[int, IntegrationFailed]
    supplied: Array | None = None

    def __len__(self) -> int:
        return len(self.R_WB)


def list_blocks(n: int, grid: Grid) -> range:
    """Return the first index of each block of n bodies. The step of the range is the number of bodies in a block."""
    return range(0, n, max(1, min(MOST_BODIES, MOST_BYTES // (SAMPLE_BYTES * grid.n_samples))))


def run_block(method: Method, bodies: Batch, grid: Grid) -> BlockResult:
    """Return the samples of a block. The outcome of each body is the same as from `Method.solve` for the body alone."""
    n, m, loaded = len(bodies), grid.n_samples, bodies.scene.loaded
    run, reference = method.prepare_many(bodies, grid), find_reference(bodies, method.conserves)
    if run is None:
        samples = np.full((n, m, 3, 3), np.nan), np.full((n, m, 3), np.nan)
        block = Block(*samples, np.zeros(n, dtype=bool), supplied=np.full((n, m, 4), np.nan) if loaded else None)
        alone, measured = np.arange(n), np.empty((n, 5))
    else:
        block = run()
        measured = measure_drifts(bodies, reference, grid, grid.t, block.R_WB, block.w_WB_B)
        settled = block.finished & are_accepted(method, bodies, grid, measured)
        settled[list(block.failures)] = True
        alone = np.flatnonzero(~settled)
    failures = dict(block.failures)
    for i in alone.tolist():
        pause()
        failure = run_alone(method, bodies, grid, i, block)
        if failure is not None:
            failures[i] = failure
    if len(alone):
        supplied = None if block.supplied is None else block.supplied[alone]
        run = grid.t, block.R_WB[alone], block.w_WB_B[alone], supplied
        measured[alone] = measure_drifts(bodies[alone], reference[alone], grid, *run)
    drifts = arrange_drifts(bodies, measured, block.R_WB, block.w_WB_B)
    return BlockResult(block.R_WB, block.w_WB_B, drifts, failures, block.supplied)


def are_accepted(method: Method, bodies: Batch, grid: Grid, measured: Array) -> Any:
    """Return booleans (n,), true for bodies within the bounds of a method. `measured` (n, 5) is from `measure_drifts`.

    Bounds grow with the ratio of the moments. All bodies are first compared with the bounds of the smallest ratio. Only bodies
    that exceed these are compared with their own bounds.
    """

    def are_within(i: int, part: Any) -> Any:
        bounds = method.bounds(bodies.take(i), grid)
        skew, energy, conserved = measured[part, 0], measured[part, 1], measured[part, 4]
        return (conserved <= bounds.drift) & (skew <= bounds.orthonormality) & (energy <= bounds.energy)

    if bodies.inertia is None:
        return are_within(0, slice(None))
    moments = bodies.principal[0]
    good = are_within(int(np.argmin(moments.max(axis=1) / moments.min(axis=1))), slice(None))
    for i in np.flatnonzero(~good & np.isfinite(measured[:, 4])).tolist():
        good[i] = are_within(i, i)
    return good


def run_alone(method: Method, bodies: Batch, grid: Grid, i: int, block: Block) -> IntegrationFailed | None:
    """Integrate body i alone, put its samples into the block, and return its failure, or None."""
    block.R_WB[i], block.w_WB_B[i] = np.nan, np.nan
    scene = bodies.take(i)
    try:
        reason = method.unsupported(scene)
        if reason:
            return NotRun(f"{method.name}: {reason}")
        trajectory = method.solve(scene, grid)
    except BadInput as refusal:
        return NotRun(str(refusal))
    block.R_WB[i, : len(trajectory)], block.w_WB_B[i, : len(trajectory)] = trajectory.R_WB, trajectory.w_WB_B
    if block.supplied is not None and trajectory.supplied is not None:
        block.supplied[i, : len(trajectory)] = trajectory.supplied
    return trajectory.failure


@contextmanager
def start_workers(client: Client | None, threads: int | None, n_blocks: int) -> Iterator[tuple[Executor, int]]:
    """Yield an executor for blocks, and the number of blocks to submit to it at a time.

    Blocks run on the workers of a client, or on threads of this process, by default one for each processor. At the end of the
    context, for example after Ctrl-C, blocks that still run are given up.
    """
    if client is not None:
        with start_executor(client) as cluster:
            yield cluster, cluster.places + min(cluster.places, MOST_WAITING)
        return
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = min(threads, n_blocks)
    if threads == 1:
        yield Inline(), 1
        return
    given_up = threading.Event()
    executor = ThreadPoolExecutor(threads, initializer=watch, initargs=(given_up,))
    try:
        yield executor, 2 * threads
    finally:
        given_up.set()
        executor.shutdown(cancel_futures=True)


class Inline(Executor):
    """Runs each call at once in the calling thread. In the main thread, Ctrl-C can end a run at any time."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a finished call."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def run_blocks(
    method: Method,
    bodies: Batch,
    grid: Grid,
    workers: tuple[Executor, int],
    left: Sequence[int],
    write: Callable[[int, Batch, BlockResult], object],
    progress: Callable[[ProgressOfMany], object] | None,
) -> None:
    """Integrate the blocks with the first indices `left`. `workers` are an executor and how many blocks to submit at a time.

    `write` is called with the first index, the bodies and the result of each block as soon as it has ended, and then
    `progress`, unless it is None.
    """
    (executor, in_flight), total, size = workers, len(bodies), list_blocks(len(bodies), grid).step
    done = restored = total - sum(min(size, total - first) for first in left)
    begin, waiting = perf_counter(), iter(left)
    pending: dict[Future[BlockResult], int] = {}
    try:
        while True:
            while len(pending) < in_flight and (first := next(waiting, None)) is not None:
                pending[executor.submit(run_block, method, bodies[first : first + size], grid)] = first
            if not pending:
                return
            ended, _ = wait(pending, LONGEST_WAIT, FIRST_COMPLETED)
            for future in [future for future in pending if future in ended]:  # in the order of submission
                first, result = pending.pop(future), future.result()
                write(first, bodies[first : first + size], result)
                done += len(result)
                if progress is not None:
                    progress(ProgressOfMany(perf_counter() - begin, done, total, restored))
    finally:
        for future in pending:
            future.cancel()
