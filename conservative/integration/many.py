"""`integrate_many`: thousands of initial states, and of bodies, of one kind of scene."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..batch import Batch
from ..check import describe, positive_integer, positive_number
from ..drifts import list_drifts
from ..errors import BadInput, IntegrationFailed
from ..grid import SAMPLE_BYTES, Grid, grid_for, most_samples
from ..method import Method
from ..methods.between import Samples
from ..outcome import ChoiceForMany, ProgressOfMany
from ..scene import Scene
from .blocks import SAMPLE_BYTES as KEPT_BYTES
from .blocks import BlockResult, list_blocks, run_blocks, start_threads
from .cluster import start_executor
from .ensemble import Ensemble, ensemble_of_one, open_ensemble
from .inputs import read_bodies
from .one import DEFAULT_DT, interrupt_of, read_method, require_support
from .shared_choice import choose_for_all, pick_hardest
from .store import Store, write_store

if TYPE_CHECKING:
    from distributed import Client

MOST_WAITING = 16
"""Blocks at most that wait for a worker of a cluster, or for being written, beside those that run."""


def integrate_many(
    scene: Scene,
    R_WB0: ArrayLike | None = None,
    w_WB_B0: ArrayLike | None = None,
    *,
    inertia: ArrayLike | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    method: Method | str | None = None,
    sample_every: int = 1,
    error: float | None = None,
    threads: int | None = None,
    progress: Callable[[ProgressOfMany], object] | None = None,
    path: str | Path | None = None,
    resume: bool = False,
    client: Client | None = None,
) -> Ensemble:
    """Integrate n bodies, each by itself, from n initial states.

    Parameters
    ----------
    scene
        The scene of all bodies: it provides everything that is not given here.
    R_WB0
        Attitudes at t = 0 (n, 3, 3), body to world, or n rotations of SciPy.
    w_WB_B0
        Angular velocities at t = 0 (n, 3), rad/s, body axes.
    inertia
        Principal moments (n, 3) or tensors (n, 3, 3) about the fixed point, body axes, kg m^2.
    parameters
        Numbers (n, ...) of the scene's potential by the names of its fields, such as {"weight": ..., "com_B": ...}.
    dt, t_end
        Step size and duration, s, as in `integrate`. All bodies have the same steps.
    method
        A method, or its name, as in `integrate`.
    sample_every
        Keep every so many steps (and the first and last state).
    error
        Attitude error of every body over the run, rad, instead of a method and a step size; dt then is the distance of samples.
        `conservative.integration.shared_choice` chooses both for the bodies that turn fastest and for some others, and verifies
        them on further ones: `ensemble.choice` has them, the largest estimated error, and on how many bodies it was estimated.
        A warning `AccuracyNotReached` says that one of these is not accurate enough. Errors of the other bodies may be larger,
        for example near a separatrix, which amplifies errors.
    threads
        How many blocks of bodies run side by side; default: the number of processors of this process. Numbers do not depend on
        it.
    progress
        Called with a `ProgressOfMany`, whose text is a line, after each block, for example `print`.
    path
        A new folder, to which samples are written block by block (see `conservative.integration.store`), so that they need no
        memory. The ensemble that is returned reads them from there, as `open_ensemble(path)` does later.
    resume
        Whether the folder may have some blocks of the same run. Blocks that are missing or damaged are computed. The folder is
        then the same, byte for byte, as after a run without a break.
    client
        A `dask.distributed.Client`: blocks run on its workers, instead of threads of this process.

    Raises
    ------
    BadInput
        An argument cannot be used: shapes do not match, or a body is not possible (the message has its number). Or the folder
        is there without `resume`, or is something else or of another run. Or the cluster has no workers, or some of another
        version.
    NotWritten
        The folder cannot be written, or the disk is full; blocks that are done are kept.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed, or Dask, of the extra `cluster`.
    MissingEngine
        A method of that name needs an engine that is not installed.
    Unsupported
        The method cannot do the scene.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    for name, value, good, allowed in (
        (
            "progress",
            progress,
            progress is None or callable(progress),
            "a function of a ProgressOfMany, such as print, or None",
        ),
        ("path", path, path is None or isinstance(path, str | Path), "the path of a folder, or None"),
        ("resume", resume, isinstance(resume, bool), "True or False"),
        ("resume", resume, path is not None or not resume, "False without a path, as there is nothing to go on from"),
    ):
        if not good:
            raise BadInput(name, describe(value), allowed)
    if threads is not None:
        positive_integer("threads", threads, "a number of threads, 1 or more, or None for one a processor")
    alone = R_WB0 is None and w_WB_B0 is None and inertia is None and parameters is None
    bodies = scene.derive(Batch.of) if alone else read_bodies(scene, R_WB0, w_WB_B0, inertia, parameters)
    choice: ChoiceForMany | None = None
    try:
        if error is not None:
            choice = _choose(bodies, error, method, dt, t_end, sample_every)
            made, grid = choice.method, choice.grid
        else:
            made = read_method(method, bodies.first)
            grid = grid_for(bodies.first, DEFAULT_DT if dt is None else dt, t_end, sample_every)
            require_support(made, bodies.first)
            if len(bodies) > 1:  # a single body's run reports it itself
                _require_steps(made, bodies, grid)
        if len(bodies) == 1 and path is None and client is None:
            ensemble = ensemble_of_one(bodies, grid, made.solve(bodies.first, grid), choice)
            if progress is not None:
                progress(ProgressOfMany(0.0, 1, 1))
            return ensemble
        start = _start(client, threads, len(list_blocks(len(bodies), grid)))
        if path is not None:
            with start as (executor, in_flight), write_store(path, made.label, bodies, grid, resume) as store:
                _run_all(made, bodies, grid, executor, in_flight, store, progress)
            return replace(open_ensemble(path, bodies.scene), choice=choice)
        memory = Memory(bodies, grid)
        with start as (executor, in_flight):
            _run_all(made, bodies, grid, executor, in_flight, memory, progress)
        drifts = dict(zip(list_drifts(bodies), memory.drifts.T, strict=True))
        return Ensemble(bodies, grid, memory.R_WB, memory.w_WB_B, drifts, made.label, memory.failures, choice)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # where it is the failure itself, its own reasons stay


def _choose(bodies: Batch, error: object, method: object, dt: Any, t_end: Any, sample_every: int) -> ChoiceForMany:
    wanted = positive_number("error", error, "a finite attitude error above 0, rad")
    if method is not None:
        raise BadInput("method", describe(method), "None together with error, which chooses the method")
    end = bodies.first.t_end if t_end is None else positive_number("t_end", t_end, "a finite duration above 0, s")
    spacing = None if dt is None else grid_for(bodies.first, dt, end).dt
    return choose_for_all(bodies, wanted, end, Samples(spacing, positive_integer("sample_every", sample_every)))


def _require_steps(method: Method, bodies: Batch, grid: Grid) -> None:
    """Raise `BadInput` if the method has no step of that length for one of the bodies that turn fastest.

    Other bodies for which the step is too long become `NotRun` when they are integrated.
    """
    for i in pick_hardest(bodies):
        scene = bodies.take(i)
        try:
            if method.unsupported(scene) is None:
                method.prepare(scene, grid)
        except BadInput as refusal:
            raise BadInput(refusal.argument, f"{refusal.got} (body {i})", refusal.allowed) from None


class Memory:
    """Keeps the results of blocks in memory."""

    def __init__(self, bodies: Batch, grid: Grid) -> None:
        n, m = len(bodies), grid.n_samples
        most = most_samples() * SAMPLE_BYTES // KEPT_BYTES
        if n * m > most:
            allowed = f"more steps between samples, or a path: {most:.3g} samples of {KEPT_BYTES} bytes fit in memory"
            raise BadInput("sample_every", f"{n * m} samples of {n} bodies", allowed)
        self.R_WB, self.w_WB_B = np.empty((n, m, 3, 3)), np.empty((n, m, 3))
        self.drifts = np.empty((n, len(list_drifts(bodies))))
        self.failures: dict[int, IntegrationFailed] = {}

    def is_whole(self, first: int) -> bool:
        """Return False, as a run in memory begins with no block."""
        return False

    def write(self, first: int, bodies: Batch, result: BlockResult) -> None:
        """Keep the result for `bodies`, the block that begins with body number `first`."""
        part = slice(first, first + len(bodies))
        self.R_WB[part], self.w_WB_B[part], self.drifts[part] = result.R_WB, result.w_WB_B, result.drifts
        self.failures.update((first + i, failure) for i, failure in result.failures.items())


@contextmanager
def _start(client: Client | None, threads: int | None, blocks: int) -> Iterator[tuple[Executor, int]]:
    """Yield an executor for so many blocks, and how many to submit to it at a time."""
    if client is not None:
        with start_executor(client) as cluster:
            yield cluster, cluster.places + min(cluster.places, MOST_WAITING)
        return
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = min(threads, blocks)
    with start_threads(threads) as executor:
        yield executor, 2 * threads


def _run_all(
    method: Method,
    bodies: Batch,
    grid: Grid,
    executor: Executor,
    in_flight: int,
    sink: Memory | Store,
    progress: Callable[[ProgressOfMany], object] | None,
) -> None:
    """Integrate the blocks that the sink does not have yet, and write each of them to it as soon as it is done."""
    total, blocks = len(bodies), list_blocks(len(bodies), grid)
    left = [first for first in blocks if not sink.is_whole(first)]
    done = found = total - sum(min(blocks.step, total - first) for first in left)
    begun = perf_counter()
    with closing(run_blocks(method, bodies, grid, executor, in_flight, left)) as results:
        for first, result in results:
            sink.write(first, bodies[first : first + blocks.step], result)
            done += len(result)
            if progress is not None:
                progress(ProgressOfMany(perf_counter() - begun, done, total, found))
