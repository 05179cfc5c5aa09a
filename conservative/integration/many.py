"""`integrate_many`: thousands of starts, and of bodies, of one kind of scene."""

from __future__ import annotations

import os
from collections.abc import Collection, Generator, Mapping
from contextlib import closing
from typing import Protocol, TypedDict, Unpack

from numpy.typing import ArrayLike

from ..check import describe, positive_integer
from ..errors import BadInput
from ..method import Grid, Method, grid_for
from ..methods.many import Bodies
from ..scene import Scene
from .blocks import BlockResult, list_blocks, run_blocks, start_threads
from .drifts import list_drifts
from .ensemble import Ensemble, Memory
from .inputs import read_bodies
from .one import DEFAULT_DT, interrupt_of, read_method, require_support


class Details(TypedDict, total=False):
    """What `integrate_many` can be given by keyword only, and seldom is."""

    method: Method | str | None
    sample_every: int
    threads: int | None


def integrate_many(
    scene: Scene,
    R_WB0: ArrayLike | None = None,
    w_WB_B0: ArrayLike | None = None,
    *,
    inertia: ArrayLike | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    dt: float | None = None,
    t_end: float | None = None,
    **details: Unpack[Details],
) -> Ensemble:
    """Integrate n bodies, each by itself, from n starts.

    Parameters
    ----------
    scene
        What all of them share: all that is not given here.
    R_WB0
        Attitudes at t = 0 (n, 3, 3), body to world, or n rotations of SciPy.
    w_WB_B0
        Angular velocities at t = 0 (n, 3), rad/s, body axes.
    inertia
        Principal moments (n, 3) or tensors (n, 3, 3) about the fixed point, body axes, kg m^2.
    parameters
        Numbers (n, ...) of the scene's potential by the names of its fields, such as {"weight": ..., "com_B": ...}.
    dt, t_end
        Step and duration, s, as `integrate` has them. All bodies have the same steps.
    method
        By keyword, as all that follow: a method, or its name, as `integrate` has it.
    sample_every
        Keep every so many steps (and the first and last state).
    threads
        How many blocks of bodies run side by side; default: as many as there are processors for this process. Numbers do not
        depend on it.

    Raises
    ------
    BadInput
        An argument cannot be used: shapes do not match, or a body cannot be; the message has its number.
    MissingEngine
        A method of that name needs an engine that is not installed.
    Unsupported
        The method cannot do the scene.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    unknown = sorted(set(details) - set(Details.__annotations__))
    if unknown:
        raise TypeError(f"integrate_many() got an unexpected keyword argument {unknown[0]!r}")
    bodies = read_bodies(scene, R_WB0, w_WB_B0, inertia, parameters)
    threads = _read_threads(details.get("threads"))
    method = read_method(details.get("method"), bodies.take(0))
    grid = grid_for(scene, DEFAULT_DT if dt is None else dt, t_end, details.get("sample_every", 1))
    require_support(method, bodies.take(0))
    try:
        return run_all(method, bodies, grid, threads)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # where it is the failure itself, its own reasons stay


def _read_threads(value: object) -> int:
    if value is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return positive_integer("threads", value, "a number of threads, 1 or more, or None for one a processor")


def run_all(method: Method, bodies: Bodies, grid: Grid, threads: int) -> Ensemble:
    """Return what all blocks give, in memory."""
    sink = Memory(bodies, grid, list_drifts(bodies))
    threads = min(threads, len(list_blocks(len(bodies), grid)))
    with start_threads(threads) as executor:
        fill(sink, run_blocks(method, bodies, grid, executor, 2 * threads, sink.done))
    return Ensemble(bodies, grid, sink.R_WB, sink.w_WB_B, sink.drifts_by_name, method.label, sink.failures)


class Sink(Protocol):
    """What keeps the results of blocks, in the order in which they come."""

    @property
    def done(self) -> Collection[int]:
        """First indices of the blocks that it has already."""

    def write(self, first: int, result: BlockResult) -> None:
        """Keep the result of the block that begins with body number `first`."""


def fill(sink: Sink, results: Generator[tuple[int, BlockResult], None, None]) -> None:
    """Hand all results to a sink."""
    with closing(results):
        for first, result in results:
            sink.write(first, result)
