"""Ensembles on disk: a Zarr group to which each block of bodies is written as soon as it is integrated.

    R_WB, w_WB_B     samples (n, m, 3, 3), body to world, and (n, m, 3), rad/s, body axes; nan after a failure
    t                times (m,), s
    supplied         work and impulse of loads (n, m, 4), J and N m s, as in `Trajectory`; in scenes with loads only
    drifts           largest drifts (n, k), dimensionless; the attribute `names` lists the quantities
    outcome          kinds of outcomes (n,), as indices into the attribute `kinds`
    failure          the exceptions of bodies that failed (n,), as JSON; otherwise empty
    start/NAME       R_WB0, w_WB_B0, inertia, if they differ from body to body, as in `Batch`
    parameters/NAME  numbers of the potential that differ from body to body
    checksums        digests of the blocks, which contain the checksums of their chunks

Numbers are not compressed, because random digits do not compress. Every chunk ends in a CRC-32C checksum, which all readers of
Zarr verify. Chunks that contain only fill values are written too. A block is therefore done if all its chunks are there and
their checksums match, and a resumed run computes every other block: blocks that were not reached, lost or damaged.
Zarr writes a chunk under another name and renames it, so a kill or a full disk leaves no partial chunk. Chunks are not forced
to the disk one by one; a power failure can lose some, which a resumed run then computes again.

The attributes of the group describe the run, including the scene (`scene_record`) and digests of the numbers that differ from
body to body. The attribute `checksum` is a digest of all metadata and of the times. Zarr gives a chunk that is edited a new
checksum; the digest of its block then differs. Folders of version 0.3 and earlier have neither.

Source: Zarr's specification, version 3.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from .. import files, posix
from ..attitude import Array
from ..batch import Batch
from ..check import positive_integer, read_only
from ..drifts import list_drifts
from ..errors import (
    BadInput,
    Diverged,
    IntegrationFailed,
    InvalidResult,
    NotConserved,
    NotConverged,
    NotRun,
    NotWritten,
    WrongBranch,
    require_extra,
)
from ..grid import Grid
from ..outcome import Outcome, OutcomeKind
from ..potentials.turning import static_part
from ..scene import Scene
from ..version import VERSION
from .blocks import MOST_BYTES, SAMPLE_BYTES, BlockResult, list_blocks
from .inputs import list_parameters
from .scene_record import find_scene, list_differences, record_scene

FORMAT, FORMAT_VERSION = "conservative ensemble", 1
NEW_FOLDER = "a new folder, in a folder that can be written, on a disk with enough space"
_ROOM = "a disk with enough space; finished blocks stay there, and resume=True computes the others (--resume)"
_WHOLE = "a complete one: integrate_many with the same arguments and resume=True computes the rest (--resume)"
_RESULTS = ("R_WB", "w_WB_B", "drifts", "outcome", "failure")
_CHECKSUM_BYTES = 4
"""Length of the checksum at the end of a chunk."""
_CHECKSUM, _CHECKSUMS = "checksum", "checksums"
"""Names of the attribute with the digest of the metadata, and of the array with the digests of the blocks."""
_KINDS = tuple(str(kind) for kind in OutcomeKind)
_FAILURES = {kind.__name__: kind for kind in (NotConverged, WrongBranch, Diverged, NotConserved, InvalidResult, NotRun)}


@dataclass(frozen=True, eq=False)
class Store:
    """An open ensemble in a folder.

    Attributes
    ----------
    place, record
        The folder, and the attributes of its group (`describe_run`).
    arrays
        The arrays of Zarr with a row for each body, by name.
    checksums
        The array of Zarr with a digest for each block, None in folders of earlier versions.
    """

    place: Path
    record: Mapping[str, Any]
    arrays: Mapping[str, Any]
    checksums: Any = None

    @property
    def blocks(self) -> range:
        """The first index of each block."""
        return range(0, self.record["bodies"], self.record["block"])

    def is_there(self, first: int) -> bool:
        """Return whether no chunk of the block that begins with body number `first` is missing, truncated or edited."""
        for array in self.arrays.values():
            whole = 0 if array.dtype.kind not in "fu" else math.prod(array.chunks) * array.dtype.itemsize + _CHECKSUM_BYTES
            for file in self._chunks_of(array, first):
                try:
                    size = file.stat().st_size
                except OSError:
                    return False
                if size < _CHECKSUM_BYTES or size != (whole or size):
                    return False
        try:
            return self.checksums is None or int(self.checksums[first // self.record["block"]]) == self._find_checksum(first)
        except Exception:  # Zarr cannot decode a chunk
            return False

    def _chunks_of(self, array: Any, first: int) -> Iterator[Path]:
        for others in product(*map(range, array.cdata_shape[1:])):
            yield self.place / array.path / array.metadata.encode_chunk_key((first // self.record["block"], *others))

    def _find_checksum(self, first: int) -> int:
        """Return the digest of the checksums at the ends of the chunks of a block."""
        digest = hashlib.sha256()
        for name, array in sorted(self.arrays.items()):
            for file in self._chunks_of(array, first):
                with file.open("rb") as stream:
                    stream.seek(-_CHECKSUM_BYTES, 2)
                    digest.update(name.encode() + stream.read())
        return int.from_bytes(digest.digest()[:8], "little")

    def is_whole(self, first: int) -> bool:
        """Return whether all chunks of the block are there and have the right checksums."""
        if not self.is_there(first):
            return False
        try:
            for array in self.arrays.values():
                array[first : first + self.record["block"]]
        except Exception:  # Zarr raises exceptions of several kinds for a chunk that it cannot decode
            return False
        return True

    def write(self, first: int, bodies: Batch, result: BlockResult) -> None:
        """Write the result for `bodies`, the block that begins with body number `first`.

        Raise `NotWritten` if the disk is full, or the folder cannot be written any more. Finished blocks stay there.
        """
        kinds, failures = np.full(len(result), _KINDS.index(OutcomeKind.OK), np.uint8), np.full(len(result), "", object)
        for i, failure in result.failures.items():
            # The arguments of its class, or the outcome of a class of the user's.
            name, importable = type(failure).__name__, _FAILURES.get(type(failure).__name__) is type(failure)
            values = {key: value for key, value in vars(failure if importable else failure.outcome).items() if key != "outcome"}
            text = json.dumps({"type": name if importable else "", **values}, default=lambda number: number.item())
            kinds[i], failures[i] = _KINDS.index(failure.outcome.kind), text
        columns = {"R_WB": result.R_WB, "w_WB_B": result.w_WB_B, "drifts": result.drifts, "outcome": kinds, "failure": failures}
        columns |= {} if result.supplied is None else {"supplied": result.supplied}
        try:
            for name, column in (columns | list_inputs(bodies)).items():
                self.arrays[name][first : first + len(result)] = column
            if self.checksums is not None:
                self.checksums[first // self.record["block"]] = self._find_checksum(first)
        except OSError as error:
            raise NotWritten("path", self.place, error, _ROOM) from None

    def read_results(self) -> tuple[dict[str, Array], dict[int, IntegrationFailed]]:
        """Return the drifts (n,) by name, and the failures by number of body. Raise `BadInput` if a block is damaged."""
        try:
            drifts, kinds = self.arrays["drifts"][:], self.arrays["outcome"][:]
            failed = np.flatnonzero(kinds != _KINDS.index(OutcomeKind.OK)).tolist()
            texts = self.arrays["failure"][:] if failed else ()
            failures = {i: _restore_failure(texts[i], _KINDS[kinds[i]]) for i in failed}
            return dict(zip(self.arrays["drifts"].attrs["names"], drifts.T, strict=True)), failures
        except Exception as error:  # a checksum; or any other one, for values that no run has
            got = f"{str(self.place)!r}, an ensemble that is damaged ({type(error).__name__}: {error})"
            raise BadInput("path", got, _WHOLE) from None

    def read_bodies(self, scene: Scene | None, compare: bool = True) -> Batch:
        """Return the bodies. Their initial states and parameters stay on the disk.

        The scene is not compared if the caller has just written it. Raise `BadInput` if the scene is missing, or another one
        (`open_ensemble`), or does not have the parameters.
        """
        inputs: dict[str, dict[str, Any]] = {"start": {}, "parameters": {}}
        for name in self.record["digests"]:
            group, _, own = name.partition("/")
            inputs[group][own] = _OnDisk(self.arrays[name])
        scene = find_scene(self.record["scene"], scene) if compare or scene is None else scene
        start, n = inputs["start"], self.record["bodies"]
        shapes = list_parameters(static_part(scene.potential))
        for name, values in inputs["parameters"].items():
            if shapes.get(name) != values.shape[1:]:
                got = f"{str(self.place)!r}, with the parameter {name!r} of shape {values.shape}"
                raise BadInput("path", got, f"parameters of its scene, {shapes}")
        R_WB0 = start.get("R_WB0", np.broadcast_to(scene.R_WB0, (n, 3, 3)))
        w_WB_B0 = start.get("w_WB_B0", np.broadcast_to(scene.w_WB_B0, (n, 3)))
        return Batch(scene, R_WB0, w_WB_B0, start.get("inertia"), inputs["parameters"])


def _restore_failure(text: str, outcome_kind: str) -> IntegrationFailed:
    """Return a stored failure. Raise an exception of any kind if it is none, or has another kind of outcome."""
    values = json.loads(text)
    if kind := _FAILURES.get(values.pop("type")):
        failure: IntegrationFailed = kind(**values)
    else:
        outcome = Outcome(**values | {"kind": OutcomeKind(values["kind"])})
        failure = IntegrationFailed(str(outcome))
        failure.outcome = outcome
    if failure.outcome.kind != outcome_kind:
        raise ValueError(f"the failure is {failure.outcome}, the outcome {outcome_kind}")
    return failure


@contextmanager
def write_store(path: str | Path, label: str, bodies: Batch, grid: Grid, resume: bool = False) -> Iterator[Store]:
    """Yield the store of a run, which no other process can write to in the block.

    The folder is created or, with `resume`, may contain some blocks of the same run. `label` is the label of the method.

    Raise `BadInput` if the folder contains another run or, except on Windows, another process writes to it; for other errors
    see `find_ensemble`.
    """
    place, record, stored = Path(path).absolute(), describe_run(label, bodies, grid), find_ensemble(path, resume)
    if stored is None:
        try:
            with files.temporary(place, Path.mkdir) as fresh:
                _create(fresh, record, bodies, grid)
                fresh.rename(place)
        except OSError as error:
            raise NotWritten("path", place, error, NEW_FOLDER) from None
    else:
        plain = ("version", "method", "dt", "n_steps", "sample_every", "bodies", "block")
        values = ((name, stored.get(name), record[name]) for name in plain)
        differences = [f"{name} {before!r} there, {now!r} here" for name, before, now in values if before != now]
        if fields := list_differences(stored["scene"], record["scene"]):
            differences.append(f"another scene ({', '.join(fields)})")
        before, now = stored["digests"], record["digests"]
        differences += [f"another {name.partition('/')[2]}" for name in before | now if before.get(name) != now.get(name)]
        if differences:
            got = f"{str(place)!r}, an ensemble of another run: {'; '.join(differences)}"
            raise BadInput("path", got, "an ensemble of the same run")
    handle = posix.lock(place)
    if handle is None:
        raise BadInput("path", f"{str(place)!r}, which another process writes to", "a folder of its own")
    try:
        for leftover in place.rglob("*.partial"):  # a kill leaves a part of a chunk
            files.remove(leftover)
        yield _open(place, record, "r+")
    finally:
        posix.release(handle)


def find_ensemble(path: str | Path, resume: bool) -> dict[str, Any] | None:
    """Return the attributes of the ensemble in a folder to write to; None if the folder is empty or does not exist.

    Raise `BadInput` if it contains something else, or an ensemble although `resume` is False; `NotWritten` if it cannot be
    created; and `MissingExtra` without Zarr, of the extra `ensembles`.
    """
    require_extra("path", "ensembles", "zarr")
    place = Path(path).absolute()
    try:
        if not any(place.iterdir()):
            return None
    except FileNotFoundError as error:
        if not place.parent.is_dir():
            raise NotWritten("path", place, error, NEW_FOLDER) from None
        return None
    except NotADirectoryError:
        raise BadInput("path", f"{str(place)!r}, a file", NEW_FOLDER) from None
    except (OSError, ValueError) as error:
        raise NotWritten("path", place, error, NEW_FOLDER) from None
    record = read_record(place)
    if not resume:
        raise BadInput(
            "path", f"{str(place)!r}, where an ensemble is", "a new folder, or resume=True (--resume), which goes on"
        )
    return record


def _create(folder: Path, record: Mapping[str, Any], bodies: Batch, grid: Grid) -> None:
    """Create the group, without blocks."""
    import zarr
    from zarr.codecs import Crc32cCodec

    n, m, block, names = len(bodies), grid.n_samples, record["block"], list_drifts(bodies)
    group = zarr.create_group(folder, attributes=dict(record))
    options: Any = {"compressors": (Crc32cCodec(),)}

    def add(name: str, shape: tuple[int, ...], axes: tuple[str, ...], kind: str = "float64", fill: Any = np.nan) -> Any:
        # A chunk has one block of bodies, and at most as many samples as fit in the size of a block.
        samples = (min(m, max(1, MOST_BYTES // (SAMPLE_BYTES * block))),) if axes[1:2] == ("sample",) else ()
        chunks = (block, *samples, *shape[1 + len(samples) :])
        return group.create_array(
            name, shape=shape, chunks=chunks, dtype=kind, fill_value=fill, dimension_names=axes, **options
        )

    group.create_array("t", data=grid.t, dimension_names=("sample",), **options)
    add("R_WB", (n, m, 3, 3), ("body", "sample", "world", "axis"))
    add("w_WB_B", (n, m, 3), ("body", "sample", "axis"))
    if "supplied" in record:
        add("supplied", (n, m, 4), ("body", "sample", "quantity"))
    add("drifts", (n, len(names)), ("body", "name")).update_attributes({"names": list(names)})
    add("outcome", (n,), ("body",), "uint8", 255).update_attributes({"kinds": list(_KINDS)})
    add("failure", (n,), ("body",), "string", "")
    for name, values in list_inputs(bodies).items():
        add(name, values.shape, ("body", *(f"{name} {k}" for k in range(1, len(values.shape)))))
    count = len(range(0, n, block))
    group.create_array(_CHECKSUMS, shape=(count,), chunks=(1,), dtype="uint64", dimension_names=("block",), **options)
    group.update_attributes({_CHECKSUM: _digest_metadata(folder)})


def _digest_metadata(folder: Path) -> str:
    """Return a digest of the attributes and other metadata of the group and its arrays, and of the times."""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("zarr.json")):
        content = json.loads(file.read_text(encoding="utf-8"))
        if file.parent == folder:
            content["attributes"].pop(_CHECKSUM, None)
        digest.update(f"{file.relative_to(folder).as_posix()}\n{json.dumps(content, sort_keys=True)}\n".encode())
    for file in sorted((folder / "t" / "c").rglob("*")):
        digest.update(f"{file.name}\n".encode() + (file.read_bytes() if file.is_file() else b""))
    return digest.hexdigest()


def list_inputs(bodies: Batch) -> dict[str, Array]:
    """Return the initial values and parameters (n, ...) that differ from body to body, by the names of their arrays."""
    start = {"R_WB0": bodies.R_WB0, "w_WB_B0": bodies.w_WB_B0, "inertia": bodies.inertia}
    own = {
        f"start/{name}": values
        for name, values in start.items()
        if isinstance(values, _OnDisk) or (values is not None and values.strides[0] != 0)
    }
    return own | {f"parameters/{name}": values for name, values in bodies.parameters.items()}


def describe_run(label: str, bodies: Batch, grid: Grid) -> dict[str, Any]:
    """Return the attributes of the group of a run."""
    inputs = {name: np.ascontiguousarray(values) for name, values in list_inputs(bodies).items()}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "version": VERSION,
        "method": label,
        "dt": grid.dt,
        "n_steps": grid.n_steps,
        "sample_every": grid.every,
        "bodies": len(bodies),
        "block": min(list_blocks(len(bodies), grid).step, len(bodies)),
        "scene": record_scene(bodies.scene),
        "digests": {name: hashlib.sha256(values.data).hexdigest()[:16] for name, values in inputs.items()},
    } | ({"supplied": True} if bodies.scene.loaded else {})


def read_record(place: Path, allowed: str = NEW_FOLDER) -> dict[str, Any]:
    """Return the attributes of a stored ensemble. Raise `BadInput` for another folder, or another version of the format."""
    import zarr

    try:
        record = zarr.open_group(place, mode="r", zarr_format=3).attrs.asdict()
    except Exception:  # not a Zarr group, or one that cannot be read
        record = {}
    if record.get("format") != FORMAT:
        raise BadInput("path", f"{str(place)!r}, which is not an ensemble", allowed)
    if record.get("format_version") != FORMAT_VERSION:
        got = f"{str(place)!r}, an ensemble in version {record.get('format_version')} of its format"
        raise BadInput("path", got, f"version {FORMAT_VERSION}")
    try:
        _grid_of(record), [positive_integer(name, record[name]) for name in ("bodies", "block")]
        kinds = {record["scene"]["fields"].__class__, record["digests"].__class__, record["method"].__class__}
        if kinds != {dict, str} or not all(name.startswith(("start/", "parameters/")) for name in record["digests"]):
            raise TypeError("values of other types")
    except Exception as error:  # KeyError, BadInput of another argument, or any other one
        got = f"{str(place)!r}, an ensemble that is damaged ({type(error).__name__}: {error})"
        raise BadInput("path", got, "an ensemble as `integrate_many` wrote it") from None
    return record


def _grid_of(record: Mapping[str, Any]) -> Grid:
    return Grid(record["dt"], record["n_steps"], record["sample_every"])


def _open(place: Path, record: Mapping[str, Any], mode: Any) -> Store:
    import zarr

    try:
        with zarr.config.set({"array.write_empty_chunks": True}):
            group = zarr.open_group(place, mode=mode, zarr_format=3)
            names = (*_RESULTS, *(["supplied"] if "supplied" in record else ()), *record["digests"])
            arrays = {name: group[name] for name in names}
            checksums = group[_CHECKSUMS] if _CHECKSUM in group.attrs else None
        _require_shapes(record, arrays)
        if checksums is not None and group.attrs[_CHECKSUM] != _digest_metadata(place):
            raise ValueError("its attributes, other metadata or times were edited")
        return Store(place, record, arrays, checksums)
    except Exception as error:  # KeyError for a missing array, and anything for damaged metadata
        allowed = "an ensemble that can be read, or a new folder"
        raise BadInput("path", f"{str(place)!r}, an ensemble that is damaged ({error})", allowed) from None


def _require_shapes(record: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    """Raise an exception of any kind unless the arrays have the shapes of the record, and the drifts have names."""
    n, m, block = record["bodies"], _grid_of(record).n_samples, record["block"]
    names: list[str] = arrays["drifts"].attrs["names"]
    shapes = {"R_WB": (n, m, 3, 3), "w_WB_B": (n, m, 3), "supplied": (n, m, 4), "drifts": (n, len(names))}
    shapes |= {"outcome": (n,), "failure": (n,)}
    shapes |= {"start/R_WB0": (n, 3, 3), "start/w_WB_B0": (n, 3), "start/inertia": (n, 3, 3)}
    for name, array in arrays.items():
        shape = shapes.get(name, (n, *array.shape[1:]) if name.startswith("parameters/") else None)
        if (array.shape, array.chunks[0]) != (shape, block):
            raise ValueError(f"{name} has shape {array.shape} in blocks of {array.chunks[0]}, not {shape} and {block}")
    ", ".join(names)


def open_store(path: str | Path) -> Store:
    """Return a complete store for reading. Raise `BadInput` or `MissingExtra` as `open_ensemble` does."""
    require_extra("open_ensemble", "ensembles", "zarr")
    place = Path(path).absolute()
    record = read_record(place, "the folder of an ensemble that integrate_many has written")
    store, n = _open(place, record, "r"), record["bodies"]
    # Only present files are listed, because there may be any number of blocks.
    there = {int(file.name) * record["block"] for file in (place / "outcome" / "c").glob("[0-9]*")}
    left = n - sum(min(record["block"], n - first) for first in there if first < n and store.is_there(first))
    if left > 0:
        got = (
            f"{str(place)!r}, an ensemble of {n} bodies of which {left} were not integrated, or are missing, damaged or edited"
        )
        raise BadInput("path", got, _WHOLE)
    return store


class _OnDisk:
    """An array of Zarr. Its parts are read-only NumPy arrays or numbers."""

    def __init__(self, array: Any) -> None:
        self._array, self.shape = array, array.shape

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, part: Any) -> Any:
        values = np.asarray(self._array[part])
        return read_only(values) if values.ndim else values[()]

    def __array__(self, *options: Any, **more: Any) -> Array:
        return np.asarray(self._array[:])
