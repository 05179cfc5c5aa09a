"""Ensembles on disk: a Zarr group to which each block of bodies is written as soon as it is integrated.

    R_WB, w_WB_B     samples (n, m, 3, 3), body to world, and (n, m, 3), rad/s, body axes; nan after a failure
    t                times (m,), s
    drifts           largest drifts (n, k), dimensionless; the attribute `names` lists the quantities
    outcome          kinds of outcomes (n,), as indices into the attribute `kinds`
    failure          the exceptions of bodies that failed (n,), as JSON; otherwise empty
    start/NAME       R_WB0, w_WB_B0, inertia, if they differ from body to body, as in `Batch`
    parameters/NAME  numbers of the potential that differ from body to body

Numbers are not compressed, because random digits do not compress. Every chunk ends in a CRC-32C checksum, which all readers of
Zarr verify. Chunks of nothing but fill values are written too. A block is therefore done if all its chunks are there and their
checksums match, and a run that is resumed computes every other block: those it has not reached, and those that were lost or
damaged since. Zarr writes a chunk under another name and renames it, so a kill or a full disk leaves no partial chunk. Chunks
are not forced to the disk one by one; a power failure can lose some, which a resumed run then computes again.

The attributes of the group describe the run, with a digest of the numbers that differ from body to body. The scene is stored as
numbers and texts. Functions in it, such as those of `FunctionPotential`, cannot be stored: a digest of their code shows whether
a scene is the same.

Source: Zarr's specification, version 3.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from functools import partial
from importlib import import_module
from itertools import product
from pathlib import Path
from types import CodeType, FunctionType, MethodType
from typing import Any

import numpy as np

from .. import files
from ..attitude import Array
from ..batch import Batch
from ..check import build_unchecked, describe, read_only
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
from ..scene import Scene
from ..version import VERSION
from .blocks import MOST_BYTES, SAMPLE_BYTES, BlockResult, count_bodies

FORMAT, FORMAT_VERSION = "conservative ensemble", 1
NEW_FOLDER = "a folder that is not there yet, in one that can be written, on a disk with room for it"
_ROOM = "a disk with room for it; blocks that are done are kept, and resume=True goes on from there"
_WHOLE = "one that is whole: integrate_many with the same arguments and resume=True computes the rest"
_UNREADABLE = "an ensemble that can be read, or a new folder"
_RESULTS = ("R_WB", "w_WB_B", "drifts", "outcome", "failure")
_CHECKSUM_BYTES = 4
_KINDS = tuple(str(kind) for kind in OutcomeKind)
_FAILURES = {kind.__name__: kind for kind in (NotConverged, WrongBranch, Diverged, NotConserved, InvalidResult, NotRun)}


@dataclass(frozen=True, eq=False)
class Store:
    """An ensemble in a folder, open for reading and perhaps for writing.

    Attributes
    ----------
    place, record
        The folder, and the attributes of its group, as `describe_run` returns them.
    arrays
        The arrays of Zarr that have a row for each body, by their names.
    """

    place: Path
    record: Mapping[str, Any]
    arrays: Mapping[str, Any]

    @property
    def blocks(self) -> range:
        """The first index of each block."""
        return range(0, self.record["bodies"], self.record["block"])

    def is_there(self, first: int) -> bool:
        """Return whether no chunk of the block that begins with body number `first` is missing or truncated."""
        for array in self.arrays.values():
            whole = 0 if array.dtype.kind not in "fu" else math.prod(array.chunks) * array.dtype.itemsize + _CHECKSUM_BYTES
            for others in product(*map(range, array.cdata_shape[1:])):
                file = self.place / array.path / array.metadata.encode_chunk_key((first // self.record["block"], *others))
                try:
                    size = file.stat().st_size
                except OSError:
                    return False
                if size < _CHECKSUM_BYTES or size != (whole or size):
                    return False
        return True

    def is_whole(self, first: int) -> bool:
        """Return whether all chunks of the block are there and have the checksums that they were written with."""
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

        Raises
        ------
        NotWritten
            The disk is full, or the folder cannot be written any more. Blocks that are done stay done.
        """
        kinds, failures = np.full(len(result), _KINDS.index(OutcomeKind.OK), np.uint8), np.full(len(result), "", object)
        for i, failure in result.failures.items():
            kinds[i], failures[i] = _KINDS.index(failure.outcome.kind), _record_failure(failure)
        columns = {"R_WB": result.R_WB, "w_WB_B": result.w_WB_B, "drifts": result.drifts, "outcome": kinds, "failure": failures}
        try:
            for name, values in (columns | list_inputs(bodies)).items():
                self.arrays[name][first : first + len(result)] = values
        except OSError as error:
            raise NotWritten("path", self.place, error, _ROOM) from None

    def read_failures(self) -> dict[int, IntegrationFailed]:
        """Return the failures by the numbers of the bodies."""
        failed = np.flatnonzero(self.arrays["outcome"][:] != _KINDS.index(OutcomeKind.OK)).tolist()
        texts = self.arrays["failure"][:] if failed else ()
        return {i: _restore_failure(texts[i]) for i in failed}


def _record_failure(failure: IntegrationFailed) -> str:
    name = type(failure).__name__
    known = _FAILURES.get(name) is type(failure)
    values = vars(failure if known else failure.outcome)
    kept = {key: value for key, value in values.items() if key != "outcome"}
    return json.dumps({"type": name if known else "", **kept}, default=lambda number: number.item())


def _restore_failure(text: str) -> IntegrationFailed:
    values = json.loads(text)
    if kind := _FAILURES.get(values.pop("type")):
        return kind(**values)
    outcome = Outcome(**values | {"kind": OutcomeKind(values["kind"])})
    failure = IntegrationFailed(str(outcome))
    failure.outcome = outcome
    return failure


@contextmanager
def write_store(path: str | Path, label: str, bodies: Batch, grid: Grid, resume: bool = False) -> Iterator[Store]:
    """Yield the store of a run, a new one unless it is there. No other process can write to it in the block.

    Parameters
    ----------
    path
        Its folder.
    label, bodies, grid
        The label of the method, the n bodies, and the steps in s.
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
    place, record, there = Path(path).absolute(), describe_run(label, bodies, grid), find_ensemble(path, resume)
    if there is None:
        try:
            with files.temporary(place, _make_folder) as (fresh, _):
                _create(fresh, record, bodies, grid)
                fresh.rename(place)
        except OSError as error:
            raise NotWritten("path", place, error, NEW_FOLDER) from None
    elif differing := _list_differences(there, record):
        got = f"{str(place)!r}, an ensemble of another run: {'; '.join(differing)}"
        raise BadInput("path", got, "an ensemble of the same run")
    handle = os.open(place, os.O_RDONLY)
    try:
        if not files.try_lock(handle):
            raise BadInput("path", f"{str(place)!r}, which another process writes to", "a folder of its own")
        for leftover in place.rglob("*.partial"):  # what a kill has left of a chunk
            files.remove(leftover)
        yield _open(place, record, "r+")
    finally:
        files.release(handle)


def find_ensemble(path: str | Path, resume: bool) -> dict[str, Any] | None:
    """Return the attributes of the ensemble in a folder to write to, None for a folder that is empty or not there yet.

    Raises
    ------
    BadInput
        There is an ensemble and `resume` is False, or something else.
    NotWritten
        The folder cannot be made.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed.
    """
    require_extra("path", "ensembles")
    place = Path(path).absolute()
    try:
        there = os.listdir(place)  # noqa: PTH208  # which says whether it is a folder, too
    except FileNotFoundError as error:
        if not place.parent.is_dir():
            raise NotWritten("path", place, error, NEW_FOLDER) from None
        return None
    except NotADirectoryError:
        raise BadInput("path", f"{str(place)!r}, a file", NEW_FOLDER) from None
    except (OSError, ValueError) as error:
        raise NotWritten("path", place, error, NEW_FOLDER) from None
    if not there:
        return None
    found = read_record(place)
    if not resume:
        got = f"{str(place)!r}, where an ensemble is"
        raise BadInput("path", got, "a new folder, or resume=True to go on with this one")
    return found


def _make_folder(fresh: Path) -> int:
    fresh.mkdir()
    return os.open(fresh, os.O_RDONLY)


def _create(folder: Path, record: Mapping[str, Any], bodies: Batch, grid: Grid) -> None:
    """Make the group with no block in it."""
    import zarr
    from zarr.codecs import Crc32cCodec

    n, m, block, names = len(bodies), grid.n_samples, record["block"], list_drifts(bodies)
    group = zarr.create_group(folder, attributes=dict(record))
    options: Any = {"compressors": (Crc32cCodec(),)}

    def add(name: str, shape: tuple[int, ...], axes: tuple[str, ...], kind: str = "float64", fill: Any = np.nan) -> Any:
        # one block of bodies, and of a run with many samples so many that a chunk is not larger than a block is otherwise
        samples = (min(m, max(1, MOST_BYTES // (SAMPLE_BYTES * block))),) if axes[1:2] == ("sample",) else ()
        chunks = (block, *samples, *shape[1 + len(samples) :])
        return group.create_array(
            name, shape=shape, chunks=chunks, dtype=kind, fill_value=fill, dimension_names=axes, **options
        )

    group.create_array("t", data=grid.t, dimension_names=("sample",), **options)
    add("R_WB", (n, m, 3, 3), ("body", "sample", "world", "axis"))
    add("w_WB_B", (n, m, 3), ("body", "sample", "axis"))
    add("drifts", (n, len(names)), ("body", "name")).update_attributes({"names": list(names)})
    add("outcome", (n,), ("body",), "uint8", 255).update_attributes({"kinds": list(_KINDS)})
    add("failure", (n,), ("body",), "string", "")
    for name, values in list_inputs(bodies).items():
        add(name, values.shape, ("body", *(f"{name} {k}" for k in range(1, values.ndim))))


def list_inputs(bodies: Batch) -> dict[str, Array]:
    """Return what differs from body to body, by the name of its array.

    Attitudes are (n, 3, 3), body to world, rates (n, 3), rad/s, inertia (n, 3, 3), kg m^2, parameters (n, ...) in SI units.
    """
    start = {"R_WB0": bodies.R_WB0, "w_WB_B0": bodies.w_WB_B0, "inertia": bodies.inertia}
    found = {f"start/{name}": values for name, values in start.items() if values is not None and values.strides[0] != 0}
    return found | {f"parameters/{name}": values for name, values in bodies.parameters.items()}


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
        "block": min(count_bodies(grid), len(bodies)),
        "scene": _record(bodies.scene),
        "digests": {name: hashlib.sha256(values.data).hexdigest()[:16] for name, values in inputs.items()},
    }


def _list_differences(there: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Return how the attributes of an ensemble on the disk differ from those of a run, in words."""
    plain = ("version", "method", "dt", "n_steps", "sample_every", "bodies", "block")
    found = [f"{name} {there.get(name)!r} there, {wanted[name]!r} here" for name in plain if there.get(name) != wanted[name]]
    if not _is_same_scene(there["scene"], wanted["scene"]):
        found.append("another scene")
    before, now = there["digests"], wanted["digests"]
    return found + [f"another {name.partition('/')[2]}" for name in before | now if before.get(name) != now.get(name)]


def read_record(place: Path, allowed: str = NEW_FOLDER) -> dict[str, Any]:
    """Return the attributes of a stored ensemble.

    Raises
    ------
    BadInput
        There is no ensemble in this folder, or one of another version of the format.
    """
    import zarr

    try:
        found = zarr.open_group(place, mode="r", zarr_format=3).attrs.asdict()
    except Exception:  # not a Zarr group, or one that cannot be read
        found = {}
    if found.get("format") != FORMAT:
        raise BadInput("path", f"{str(place)!r}, which is not an ensemble", allowed)
    if found.get("format_version") != FORMAT_VERSION:
        got = f"{str(place)!r}, an ensemble in version {found.get('format_version')} of its format"
        raise BadInput("path", got, f"version {FORMAT_VERSION}")
    return found


def _open(place: Path, record: Mapping[str, Any], mode: Any) -> Store:
    import zarr

    try:
        with zarr.config.set({"array.write_empty_chunks": True}):
            group = zarr.open_group(place, mode=mode, zarr_format=3)
            return Store(place, record, {name: group[name] for name in (*_RESULTS, *record["digests"])})
    except Exception as error:  # KeyError where one is missing, and whatever else Zarr raises for metadata
        raise BadInput("path", f"{str(place)!r}, an ensemble that is damaged ({error})", _UNREADABLE) from None


def read_store(path: str | Path, scene: Scene | None = None) -> dict[str, Any]:
    """Return the fields of the `Ensemble` in a folder; samples, starts and parameters stay on the disk.

    The scene is the one of the run, needed only if it has functions of its own.

    Raises
    ------
    BadInput
        The folder is not an ensemble, or some of its blocks are missing or damaged; or the scene is missing, or another one.
    MissingExtra
        Zarr, of the extra `ensembles`, is not installed.
    """
    require_extra("open_ensemble", "ensembles")
    place = Path(path).absolute()
    record = read_record(place, "the folder of an ensemble that integrate_many has written")
    store, n = _open(place, record, "r"), record["bodies"]
    left = sum(min(record["block"], n - first) for first in store.blocks if not store.is_there(first))
    if left > 0:
        got = f"{str(place)!r}, an ensemble of {n} bodies of which {left} were not integrated, or are missing or damaged"
        raise BadInput("path", got, _WHOLE)
    try:
        drifts, failures = store.arrays["drifts"][:], store.read_failures()
    except ValueError as error:  # a checksum
        raise BadInput("path", f"{str(place)!r}, an ensemble that is damaged ({error})", _WHOLE) from None
    start: dict[str, Any] = {}
    parameters: dict[str, Any] = {}
    for name in record["digests"]:
        group, _, own = name.partition("/")
        (start if group == "start" else parameters)[own] = _OnDisk(store.arrays[name])
    scene = _find_scene(record["scene"], scene)
    return {
        "bodies": Batch(
            scene,
            start.get("R_WB0", np.broadcast_to(scene.R_WB0, (n, 3, 3))),
            start.get("w_WB_B0", np.broadcast_to(scene.w_WB_B0, (n, 3))),
            start.get("inertia"),
            parameters,
        ),
        "grid": Grid(record["dt"], record["n_steps"], record["sample_every"]),
        "R_WB": store.arrays["R_WB"],
        "w_WB_B": store.arrays["w_WB_B"],
        "drifts": dict(zip(store.arrays["drifts"].attrs["names"], drifts.T, strict=True)),
        "label": record["method"],
        "failures": failures,
    }


class _OnDisk:
    """An array of Zarr whose parts are read-only NumPy arrays; of a row of numbers, numbers."""

    def __init__(self, array: Any) -> None:
        self._array, self.shape = array, array.shape

    def __len__(self) -> int:
        return int(self.shape[0])

    def __getitem__(self, part: Any) -> Any:
        found = np.asarray(self._array[part])
        return read_only(found) if found.ndim else found[()]

    def __array__(self, *options: Any, **more: Any) -> Array:
        return np.asarray(self._array[:])


_PACKAGE = __name__.partition(".")[0]
_NOT_OF_MOTION = ("t_end", "dt", "group", "source")
"""Fields of a scene that do not change the motion of its bodies on a given grid."""


def _find_scene(record: Mapping[str, Any], scene: object) -> Scene:
    """Return the scene of an ensemble, which is the one that is given, if one is."""
    if scene is None:
        try:
            found = _restore(record)
        except BadInput:
            raise
        except Exception:  # whatever is wrong with it
            found = None
        if not isinstance(found, Scene):
            raise BadInput("path", "a scene that cannot be read", "an ensemble as `integrate_many` wrote it")
        return found
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "None, or the Scene of the run")
    if not record["fields"]["extra_invariants"]["tuple"]:
        scene = scene.rename(scene.name, extra_invariants=())  # as they are of one body, integrate_many drops them for many
    if not _is_same_scene(record, _record(scene)):
        raise BadInput("scene", repr(scene.name), f"the scene of the run, {record['fields']['name']!r}")
    return scene


def _is_same_scene(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    a, b = (json.loads(json.dumps({**each["fields"], **dict.fromkeys(_NOT_OF_MOTION)})) for each in (one, other))
    return bool(a == b)


def _record(value: Any) -> Any:
    """Return a value of this package as JSON, with a digest in place of functions and other objects."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return {"array": value.tolist()}
    if isinstance(value, tuple):
        return {"tuple": [_record(each) for each in value]}
    kind = type(value)
    if is_dataclass(value) and kind.__module__.partition(".")[0] == _PACKAGE and "<" not in kind.__qualname__:
        named = {field.name: _record(getattr(value, field.name)) for field in fields(value)}
        return {"type": f"{kind.__module__}:{kind.__qualname__}", "fields": named}
    return {"digest": hashlib.sha256(repr(_list_parts(value, [])).encode()).hexdigest()[:16]}


def _restore(record: Any) -> Any:
    if not isinstance(record, dict):
        return record
    if "array" in record:
        return read_only(np.array(record["array"], dtype=float))
    if "tuple" in record:
        return tuple(_restore(each) for each in record["tuple"])
    if "digest" in record:
        raise BadInput("scene", "None", "the scene of the run, by scene=: it has functions of its own, which are not stored")
    module, _, name = record["type"].partition(":")
    kind = getattr(import_module(module), name) if module.partition(".")[0] == _PACKAGE else None
    if not (isinstance(kind, type) and is_dataclass(kind)):
        raise TypeError(f"no value of {record['type']}")
    if record["fields"].keys() != {field.name for field in fields(kind)}:
        raise TypeError(f"not the fields of {record['type']}")
    return build_unchecked(kind, **{field: _restore(value) for field, value in record["fields"].items()})


def _list_parts(value: Any, above: list[object]) -> Any:
    """Return nested lists whose `repr` is the same in every process for a value that does the same.

    A function is taken apart into its code and the values that it uses, because pickle's bytes of equal functions can differ
    from one process to the next. `above` are the values that this one is a part of, and which may be parts of it.
    """
    value = getattr(value, "py_func", value)  # a function that numba has compiled
    kind, inner = f"{type(value).__module__}.{type(value).__qualname__}", [*above, value]
    if value is None or isinstance(value, bool | int | float | complex | str | bytes):
        return [kind, repr(value)]
    if isinstance(value, np.ndarray | np.generic):
        return [kind, value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    if any(each is value for each in above):
        return [kind]
    if isinstance(value, CodeType):
        parts: list[Any] = [value.co_code, value.co_names, value.co_varnames, value.co_consts]
    elif isinstance(value, FunctionType):
        plain, known = (bool, int, float, complex, str, bytes, np.ndarray), value.__globals__
        used = {name: known[name] for name in value.__code__.co_names if isinstance(known.get(name), plain)}
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        parts = [value.__code__, value.__defaults__, value.__kwdefaults__, used, cells]
    elif isinstance(value, MethodType):
        parts = [value.__func__, value.__self__]
    elif isinstance(value, partial):
        parts = [value.func, value.args, value.keywords]
    elif isinstance(value, Mapping):
        parts = [[key, value[key]] for key in sorted(value, key=repr)]
    elif isinstance(value, set | frozenset):
        parts = sorted(value, key=repr)
    elif isinstance(value, list | tuple):
        parts = list(value)
    elif is_dataclass(value) and not isinstance(value, type):
        parts = [[field.name, getattr(value, field.name)] for field in fields(value)]
    else:  # a class, a function of C, or an object
        parts = [getattr(value, "__qualname__", ""), {} if isinstance(value, type) else dict(getattr(value, "__dict__", {}))]
    return [kind, [_list_parts(part, inner) for part in parts]]
