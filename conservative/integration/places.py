"""Where blocks run, and where their results go: threads or a cluster, memory or a folder. Source: our own."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..check import describe
from ..errors import BadInput
from ..method import Grid
from ..methods.many import Bodies
from .blocks import start_threads
from .cluster import start_executor
from .drifts import list_drifts
from .ensemble import Ensemble, Memory
from .reading import open_ensemble
from .store import Store, open_store

MOST_WAITING = 16
"""Blocks at most that wait for a worker of a cluster, or for being written, beside those that run."""


@dataclass(frozen=True)
class Place:
    """Where a run is made, as `integrate_many` has it: on so many threads, or by a client of a cluster; and to which path.

    Raises
    ------
    BadInput
        The path is none, or `resume` is no truth value, or is asked for without a path.
    """

    threads: int
    client: Any = None
    path: str | Path | None = None
    resume: bool = False

    def __post_init__(self) -> None:
        if self.path is not None and not isinstance(self.path, str | Path):
            raise BadInput("path", describe(self.path), "the path of a folder, or None")
        if not isinstance(self.resume, bool):
            raise BadInput("resume", describe(self.resume), "True or False")
        if self.resume and self.path is None:
            raise BadInput("resume", "True", "False without a path, as there is nothing to go on from")

    @property
    def here(self) -> bool:
        """Whether samples stay in the memory of this process, which runs all blocks."""
        return self.client is None and self.path is None

    @contextmanager
    def start(self, blocks: int) -> Iterator[tuple[Executor, int]]:
        """Give what runs so many blocks, and how many to hand to it at a time."""
        if self.client is None:
            threads = min(self.threads, blocks)
            with start_threads(threads) as executor:
                yield executor, 2 * threads
            return
        with start_executor(self.client) as cluster:
            yield cluster, cluster.places + min(cluster.places, MOST_WAITING)

    def open_sink(self, label: str, bodies: Bodies, grid: Grid) -> AbstractContextManager[Memory | Store]:
        """Give what keeps the results of blocks of n bodies, of steps in s; `label` is that of the method."""
        if self.path is None:
            return nullcontext(Memory(bodies, grid, list_drifts(bodies)))
        return open_store(self.path, label, bodies, grid, self.resume)

    def read(self, sink: Memory | Store, label: str, bodies: Bodies, grid: Grid) -> Ensemble:
        """Return what a sink has that has all blocks; arguments as those of `open_sink`."""
        if isinstance(sink, Store):
            return open_ensemble(sink.place, bodies.scene)
        return Ensemble(bodies, grid, sink.R_WB, sink.w_WB_B, sink.drifts_by_name, label, sink.failures)
