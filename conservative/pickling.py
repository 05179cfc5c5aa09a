"""Convert values to bytes for another process, including functions and classes of scripts and notebooks.

Cached properties are omitted, because compiled code and addresses are valid in one process only. A read-only array stays
read-only, because compiled code for it is different.
"""

from __future__ import annotations

import io
import pickle
import sys
import threading
from collections.abc import Sequence
from contextlib import ExitStack
from functools import cache, cached_property
from typing import Any

import numpy as np

from .check import PickledByFields, read_only
from .errors import require_extra, restore

LOCK = threading.Lock()
"""Held by `dump`, because the list of modules that are pickled by value belongs to the whole process."""


class NotTransferable(TypeError):
    """A value has parts that exist in one process only, such as an open file."""


def dump(value: object, shared: Sequence[object] = (), by_value: Sequence[str] = ()) -> bytes:
    """Return a value as bytes.

    The bytes contain the indices of `shared` objects, which the other process also has, instead of the objects. They contain
    the functions and classes that the value uses of the modules `by_value`, which the other process cannot import.

    Raise `NotTransferable` if a part cannot be pickled, and `MissingExtra` if cloudpickle (extra `report`) is missing.
    """
    stream, pickler = io.BytesIO(), _pickler()  # before the import: it reports a missing package
    import cloudpickle

    with LOCK, ExitStack() as stack:
        registered = cloudpickle.list_registry_pickle_by_value() if by_value else ()
        for module in (sys.modules[name] for name in by_value if name not in registered):
            cloudpickle.register_pickle_by_value(module)
            stack.callback(cloudpickle.unregister_pickle_by_value, module)
        try:
            pickler(stream, shared).dump(value)
        except (pickle.PicklingError, TypeError, AttributeError, RecursionError, ValueError) as error:
            raise NotTransferable(f"{type(error).__name__}: {error}") from error
    return stream.getvalue()


def load(content: bytes, shared: Sequence[object] = ()) -> Any:
    """Return the value of bytes that `dump` returned, with the objects `shared` in their places."""
    return _Unpickler(io.BytesIO(content), shared).load()


class _Unpickler(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, shared: Sequence[object]) -> None:
        super().__init__(stream)
        self.shared = shared

    def persistent_load(self, place: int) -> object:
        return self.shared[place]


@cache
def _pickler() -> Any:
    """Return the pickler; cloudpickle is imported when it is first needed."""
    require_extra("a limit on the time of a run", "report", "cloudpickle")
    from cloudpickle import CloudPickler

    class Pickler(CloudPickler):  # type: ignore[misc]  # cloudpickle has no types
        """Writes the places of `shared` objects instead of the objects."""

        def __init__(self, stream: io.BytesIO, shared: Sequence[object]) -> None:
            super().__init__(stream)
            self.places = {id(value): place for place, value in enumerate(shared)}

        def persistent_id(self, value: object) -> int | None:
            return self.places.get(id(value))

        def reducer_override(self, value: Any) -> Any:
            """Return how pickle restores a value."""
            if type(value) is np.ndarray and not value.flags.writeable and not value.dtype.hasobject:
                # A copy is writeable. The array itself would be passed to this function again, without end.
                return read_only, (value.copy(order="K"),)
            if isinstance(value, BaseException):  # without its constructor, whose arguments may differ from `args`
                return restore, (type(value), value.args, vars(value))
            kind: Any = type(value)
            cached = _cached_names(kind)
            # `PickledByFields` leaves out caches itself.
            if not isinstance(value, PickledByFields) and not cached.isdisjoint(getattr(value, "__dict__", ())):
                return restore, (kind, (), {name: part for name, part in vars(value).items() if name not in cached})
            return super().reducer_override(value)

    return Pickler


@cache
def _cached_names(kind: Any) -> frozenset[str]:
    """Return the names of the cached properties of a class."""
    return frozenset(name for base in kind.__mro__ for name, what in vars(base).items() if isinstance(what, cached_property))
