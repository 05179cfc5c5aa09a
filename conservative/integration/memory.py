"""Ensembles in memory: blocks are written to arrays as `store` writes them to a folder."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ..batch import Batch
from ..drifts import list_drifts
from ..errors import BadInput, LargeEnsemble
from ..grid import SAMPLE_BYTES, Grid, most_samples
from .blocks import LOAD_BYTES, BlockResult
from .blocks import SAMPLE_BYTES as STORED_BYTES
from .ensemble import Ensemble

LARGE = 10**9
"""Size of samples in memory, bytes, above which a run warns before it starts."""


@dataclass(frozen=True, eq=False)
class Memory:
    """The arrays of a run of many bodies, with the interface of `store.Store`."""

    label: str
    bodies: Batch
    grid: Grid
    whole: BlockResult

    def is_whole(self, first: int) -> bool:
        """Return False: no block is there before it was integrated."""
        return False

    def write(self, first: int, bodies: Batch, part: BlockResult) -> None:
        """Insert the result of the bodies that begin with number `first`."""
        rows, whole = slice(first, first + len(part)), self.whole
        whole.R_WB[rows], whole.w_WB_B[rows], whole.drifts[rows] = part.R_WB, part.w_WB_B, part.drifts
        if whole.supplied is not None:
            whole.supplied[rows] = part.supplied
        whole.failures.update((first + i, failure) for i, failure in part.failures.items())

    def ensemble(self) -> Ensemble:
        """Return the ensemble of all blocks."""
        drifts = dict(zip(list_drifts(self.bodies), self.whole.drifts.T, strict=True))
        parts = self.whole.R_WB, self.whole.w_WB_B, drifts, self.label, self.whole.failures, None, self.whole.supplied
        return Ensemble(self.bodies, self.grid, *parts)


@contextmanager
def write_memory(label: str, bodies: Batch, grid: Grid) -> Iterator[Memory]:
    """Yield empty arrays for the blocks of bodies. Raise `BadInput` if they do not fit in memory."""
    n, m, loaded = len(bodies), grid.n_samples, bodies.scene.loaded
    size = STORED_BYTES + LOAD_BYTES * loaded
    if n * m > (most := most_samples() * SAMPLE_BYTES // size):
        allowed = f"fewer samples or bodies, or a path (--out): {most:.3g} samples of {size} bytes fit in memory"
        raise BadInput("sample_every", f"{n * m} samples of {n} bodies", allowed)
    if n * m * size > LARGE:
        warnings.warn(LargeEnsemble(n * m * size, n, m), stacklevel=4)
    drifts, supplied = np.empty((n, len(list_drifts(bodies)))), np.empty((n, m, 4)) if loaded else None
    yield Memory(label, bodies, grid, BlockResult(np.empty((n, m, 3, 3)), np.empty((n, m, 3)), drifts, {}, supplied))
