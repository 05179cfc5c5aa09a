"""Values as bytes for another process: functions and classes of scripts and notebooks too, and frozen values as they were.

What a cached property keeps stays behind, as compiled code and addresses mean nothing elsewhere, and an array that is closed to
writing stays closed, because compiled code for it is another one. Source: our own.
"""

from __future__ import annotations

import io
import pickle
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, cached_property
from typing import Any

import numpy as np

from ..attitude import Array
from ..errors import require_extra

LOCK = threading.Lock()
"""Held while bytes are made: which modules are taken by value is a setting of the whole process."""


class NotTransferable(TypeError):
    """A value has parts that exist in one process only, such as an open file."""


def dump(value: object, shared: Sequence[object] = (), by_value: Sequence[str] = ()) -> bytes:
    """Return a value as bytes.

    Parameters
    ----------
    value
        Anything.
    shared
        Objects that the other side has as well: of those the value refers to, only the place in this list is in the bytes.
    by_value
        Modules that the other side cannot import: what the value takes from them is in the bytes.

    Raises
    ------
    NotTransferable
        A part of the value cannot be made bytes of.
    MissingExtra
        cloudpickle, of the extra `report`, is not installed.
    """
    stream = io.BytesIO()
    with LOCK, _register_by_value(by_value):
        try:
            _pickler()(stream, shared).dump(value)
        except (pickle.PicklingError, TypeError, AttributeError, RecursionError, ValueError) as error:
            raise NotTransferable(f"{type(error).__name__}: {error}") from error
    return stream.getvalue()


def load(content: bytes, shared: Sequence[object] = ()) -> Any:
    """Return what bytes were made of, with the objects `shared` in their places."""
    return _Unpickler(io.BytesIO(content), shared).load()


class _Unpickler(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, shared: Sequence[object]) -> None:
        super().__init__(stream)
        self.shared = shared

    def persistent_load(self, place: int) -> object:
        return self.shared[place]


@cache
def _pickler() -> Any:
    """Return the class that makes bytes; its base is imported when it is first needed."""
    require_extra("a limit on the time of a run", "report", "cloudpickle")
    from cloudpickle import CloudPickler

    class Pickler(CloudPickler):  # type: ignore[misc]  # of a package without types
        def __init__(self, stream: io.BytesIO, shared: Sequence[object]) -> None:
            super().__init__(stream)
            self.places = {id(each): place for place, each in enumerate(shared)}

        def persistent_id(self, value: object) -> int | None:
            return self.places.get(id(value))

        def reducer_override(self, value: object) -> Any:
            reduced = _reduce(value)
            return super().reducer_override(value) if reduced is NotImplemented else reduced

    return Pickler


def _reduce(value: Any) -> Any:
    """Return how a value is made again, as pickle wants it told; NotImplemented where pickle's own way is right."""
    if isinstance(value, type):
        return NotImplemented
    if type(value) is np.ndarray and not value.flags.writeable and not value.dtype.hasobject:
        return _close_array, (value.copy(order="K"),)
    if isinstance(value, BaseException):
        return _make_exception, (type(value), value.args, vars(value))
    kind: Any = type(value)
    kept = _names_kept(kind)
    if not kept.isdisjoint(getattr(value, "__dict__", ())):
        return _make_value, (type(value), {name: part for name, part in vars(value).items() if name not in kept})
    return NotImplemented


@cache
def _names_kept(kind: Any) -> frozenset[str]:
    """Return the names of the cached properties of a class."""
    return frozenset(name for base in kind.__mro__ for name, what in vars(base).items() if isinstance(what, cached_property))


def _close_array(array: Array) -> Array:
    array.flags.writeable = False
    return array


def _make_value(kind: type, state: dict[str, Any]) -> Any:
    value: Any = object.__new__(kind)
    vars(value).update(state)
    return value


def _make_exception(kind: type[BaseException], args: tuple[Any, ...], state: dict[str, Any]) -> BaseException:
    """Return an exception as it was, whatever arguments its `__init__` takes."""
    error = kind.__new__(kind, *args)
    error.args = args
    vars(error).update(state)
    return error


@contextmanager
def _register_by_value(names: Sequence[str]) -> Iterator[None]:
    """Take functions and classes of modules by value within the block."""
    modules = [sys.modules[name] for name in names]
    if not modules:
        yield
        return
    import cloudpickle

    known = cloudpickle.list_registry_pickle_by_value()
    fresh = [module for module in modules if module.__name__ not in known]
    try:
        for module in fresh:
            cloudpickle.register_pickle_by_value(module)
        yield
    finally:
        for module in fresh:
            cloudpickle.unregister_pickle_by_value(module)
