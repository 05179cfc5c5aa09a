"""Ensembles on disk: a Zarr group whose chunks are the blocks of bodies, each written as soon as it is run.

    R_WB, w_WB_B         samples (n, m, 3, 3), body to world, and (n, m, 3), rad/s, body axes; nan after a failure
    t                    times (m,), s
    drifts               largest drifts (n, k), dimensionless; of what, the attribute `names` says
    outcome              kinds of outcomes (n,), numbers of the attribute `kinds`; 255 for bodies that have not been run
    failures/NAME        what is known of those that failed (n,): step, time, s, residual, drift, bound, quantity, reason
    start/NAME           R_WB0, w_WB_B0, inertia, where they differ from body to body, as in `Bodies`
    parameters/NAME      numbers of the potential that differ from body to body

Numbers are as in memory, uncompressed: random digits do not compress. The attributes of the group say what is run, with a
digest of all that the numbers follow from. The outcomes of a block are written last, and no body's is 255: a block is done
exactly if its outcomes are there. Zarr writes a chunk under another name, which it then changes: a process that is killed, or a
disk that is full, leaves whole blocks, and no part that is taken for one. Chunks are not forced to the disk one by one: with
its power a machine can lose some that were written last.

Source: Zarr's specification, version 3; the layout is our own.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import files
from ..attitude import Array
from ..errors import BadInput, NotWritten, require_extra
from ..method import Grid
from ..methods.many import Bodies
from .blocks import MOST_BYTES, SAMPLE_BYTES, BlockResult
from .drifts import list_drifts
from .failure_columns import COLUMNS, KINDS, NOT_DONE, list_columns, list_kinds
from .run_record import NEW_FOLDER, describe_run, list_differences, open_group, read_record

if TYPE_CHECKING:
    import zarr

_ROOM = "a disk with room for it; blocks that are done are kept, and resume=True goes on from there"


@dataclass(frozen=True, eq=False)
class Store:
    """The group of a run that is being written, in a folder, with blocks of so many bodies."""

    place: Path
    group: zarr.Group
    block: int

    @cached_property
    def done(self) -> frozenset[int]:
        """First indices of the blocks that were here when it was opened."""
        kinds = np.asarray(_array(self.group, "outcome")[:])
        return frozenset(first for first in range(0, len(kinds), self.block) if kinds[first] != NOT_DONE)

    def write(self, first: int, result: BlockResult) -> None:
        """Write the result of the block that begins with body number `first`.

        Raises
        ------
        NotWritten
            The disk is full, or the folder cannot be written any more. Blocks that are done stay done.
        """
        n, failures = len(result.R_WB), result.failures
        columns = {"R_WB": result.R_WB, "w_WB_B": result.w_WB_B, "drifts": result.drifts}
        columns |= {f"failures/{name}": values for name, values in list_columns(n, failures).items()}
        try:
            _write_columns(self.group, first, columns)
            _write_columns(self.group, first, {"outcome": list_kinds(n, failures)})
        except OSError as error:
            raise NotWritten("path", self.place, error, _ROOM) from None


@contextmanager
def open_store(path: str | Path, label: str, bodies: Bodies, grid: Grid, resume: bool = False) -> Iterator[Store]:
    """Yield the group of a run to write to, which no other process writes to in the block; a new one unless it is there.

    Parameters
    ----------
    path
        Its folder.
    label, bodies, grid
        What is run: the label of the method, n bodies, and steps in s.
    resume
        Whether the folder may be there, with some blocks of the same run.

    Raises
    ------
    BadInput
        The folder is there and `resume` is False, or it is something else or of another run, or another process writes to it.
    NotWritten
        The folder cannot be made or written.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed.
    """
    require_extra("path", "ensembles")
    place, attributes = Path(path).absolute(), describe_run(label, bodies, grid)
    if _is_new(place):
        _create(place, attributes, bodies, grid)
    else:
        _require_same(place, attributes, resume)
    with _hold(place):
        for leftover in place.rglob("*.partial"):  # what a kill has left of a chunk
            files.remove(leftover)
        yield Store(place, open_group(place, "r+"), attributes["block"])


def _is_new(place: Path) -> bool:
    """Whether there is nothing, or an empty folder. Raise `BadInput` where there is a file."""
    try:
        there = os.listdir(place)  # noqa: PTH208  # which says whether it is a folder, too
    except FileNotFoundError:
        return True
    except NotADirectoryError:
        raise BadInput("path", f"{str(place)!r}, a file", NEW_FOLDER) from None
    except (OSError, ValueError) as error:
        raise NotWritten("path", place, error, NEW_FOLDER) from None
    return not there


def _require_same(place: Path, attributes: Mapping[str, Any], resume: bool) -> None:
    """Raise `BadInput` unless a folder has an ensemble of the run with these attributes, and may be gone on with."""
    there = read_record(place)
    if not resume:
        raise BadInput("path", f"{str(place)!r}, where an ensemble is", "a new folder, or resume=True to go on with this one")
    if differing := list_differences(there, attributes):
        raise BadInput("path", f"{str(place)!r}, an ensemble of another run: {'; '.join(differing)}", "one of the same run")


def _create(place: Path, attributes: Mapping[str, Any], bodies: Bodies, grid: Grid) -> None:
    """Make the group, which is there whole or not at all, with no block in it."""
    try:
        with files.temporary(place, _make_folder) as (fresh, _):
            _fill(fresh, attributes, bodies, grid)
            fresh.rename(place)
    except OSError as error:
        raise NotWritten("path", place, error, NEW_FOLDER) from None


def _make_folder(fresh: Path) -> int:
    fresh.mkdir()
    return os.open(fresh, os.O_RDONLY)


def _fill(folder: Path, attributes: Mapping[str, Any], bodies: Bodies, grid: Grid) -> None:
    import zarr

    group, names = zarr.create_group(folder, attributes=dict(attributes)), list_drifts(bodies)
    n, m, block = len(bodies), grid.n_samples, attributes["block"]
    samples = min(m, max(1, MOST_BYTES // (SAMPLE_BYTES * block)))
    _add(group, "t", (m,), (m,), ("sample",))[:] = grid.t
    _add(group, "R_WB", (n, m, 3, 3), (block, samples, 3, 3), ("body", "sample", "world", "axis"))
    _add(group, "w_WB_B", (n, m, 3), (block, samples, 3), ("body", "sample", "axis"))
    _add(group, "drifts", (n, len(names)), (block, len(names)), ("body", "name")).update_attributes({"names": list(names)})
    for name, kind in COLUMNS.items():
        _add(group, f"failures/{name}", (n,), (block,), ("body",), kind)
    _add(group, "outcome", (n,), (block,), ("body",), ("uint8", NOT_DONE)).update_attributes({"kinds": list(KINDS)})
    for name, values in list_inputs(bodies).items():
        axes = ("body", *(f"{name} {k}" for k in range(1, values.ndim)))
        _add(group, name, values.shape, (block, *values.shape[1:]), axes)[:] = values


def list_inputs(bodies: Bodies) -> dict[str, Array]:
    """Return what differs from body to body, by the name of its array.

    Attitudes are (n, 3, 3), body to world, rates (n, 3), rad/s, inertia (n, 3, 3), kg m^2, parameters (n, ...) in SI units.
    """
    start = {"R_WB0": bodies.R_WB0, "w_WB_B0": bodies.w_WB_B0, "inertia": bodies.inertia}
    found = {f"start/{name}": values for name, values in start.items() if values is not None and values.strides[0] != 0}
    return found | {f"parameters/{name}": values for name, values in bodies.parameters.items()}


def _add(
    group: zarr.Group,
    name: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    axes: tuple[str, ...],
    kind: tuple[str, Any] = ("float64", np.nan),
) -> Any:
    """Add an array to a group and return it; `kind` is its type, and what stands where nothing was written."""
    options: Any = {"compressors": None, "dimension_names": axes}
    return group.create_array(name, shape=shape, chunks=chunks, dtype=kind[0], fill_value=kind[1], **options)


@contextmanager
def _hold(place: Path) -> Iterator[None]:
    """Keep other processes from writing to a folder in the block, where the file system has locks."""
    handle = os.open(place, os.O_RDONLY)
    try:
        if files.fcntl is not None:
            _lock(place, handle)
        yield
    finally:
        files.release(handle)


def _lock(place: Path, handle: int) -> None:
    try:
        files.fcntl.flock(handle, files.fcntl.LOCK_EX | files.fcntl.LOCK_NB)
    except BlockingIOError:
        raise BadInput("path", f"{str(place)!r}, which another process writes to", "a folder of its own") from None
    except OSError:
        return  # a file system without locks


def _write_columns(group: zarr.Group, first: int, columns: Mapping[str, Any]) -> None:
    for name, values in columns.items():
        _array(group, name)[first : first + len(values)] = values


def _array(group: zarr.Group, name: str) -> Any:
    return group[name]
