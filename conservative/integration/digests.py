"""Digests of what a run is made from: the same numbers have the same digest in every process, others another one.

Values are taken apart by their fields, and functions by their code: what pickle makes of equal values can differ from one
process to the next. Source: our own.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from types import CodeType, FunctionType, MethodType
from typing import Any

import numpy as np

from ..attitude import Array

ROWS = 2**16
"""Rows of an array that are copied at a time, where its numbers do not lie side by side."""
_PLAIN = (bool, int, float, complex, str, bytes, type(None))


def find_digest(value: object) -> str:
    """Return the digest of a value, 16 hexadecimal digits."""
    found = hashlib.sha256()
    for part in _parts(value, []):
        found.update(len(part).to_bytes(8, "little") + part if isinstance(part, bytes) else part)
    return found.hexdigest()[:16]


def _parts(value: Any, above: list[object]) -> Iterator[Any]:
    """Yield a value as bytes and arrays side by side; `above` are those that it is a part of, which may be parts of it."""
    kind = type(value)
    yield f"{kind.__module__}.{kind.__qualname__}".encode()
    if isinstance(value, _PLAIN):
        yield repr(value).encode()
    elif isinstance(value, np.ndarray | np.generic):
        yield from _numbers(np.asarray(value))
    elif not any(each is value for each in above):
        for part in _children(value):
            yield from _parts(part, [*above, value])


def _numbers(array: Array) -> Iterator[Any]:
    yield f"{array.dtype.str}{array.shape}".encode()
    rows = array.reshape(1) if array.ndim == 0 else array
    for first in range(0, len(rows), ROWS):
        yield np.ascontiguousarray(rows[first : first + ROWS])


def _children(value: Any) -> Iterator[Any]:
    """Yield the parts of a value that is no number, text or array."""
    value = getattr(value, "py_func", value)  # a function that numba has compiled
    if isinstance(value, FunctionType):
        yield from _code(value.__code__)
        yield from (value.__defaults__, value.__kwdefaults__, _names_used(value))
        yield [cell.cell_contents for cell in value.__closure__ or ()]
    elif isinstance(value, MethodType):
        yield from (value.__func__, value.__self__)
    elif isinstance(value, partial):
        yield from (value.func, value.args, value.keywords)
    elif isinstance(value, Mapping):
        yield from ((key, value[key]) for key in sorted(value, key=repr))
    elif isinstance(value, list | tuple):
        yield from value
    elif isinstance(value, set | frozenset):
        yield from sorted(value, key=repr)
    elif is_dataclass(value):
        yield from ((field.name, getattr(value, field.name)) for field in fields(value))
    else:
        yield getattr(value, "__qualname__", "")  # a class, or a function of C
        if not isinstance(value, type):
            yield dict(getattr(value, "__dict__", {}))


def _code(code: CodeType) -> Iterator[Any]:
    yield from (code.co_code, code.co_names, code.co_varnames)
    for constant in code.co_consts:
        yield list(_code(constant)) if isinstance(constant, CodeType) else constant


def _names_used(function: FunctionType) -> dict[str, Any]:
    """Return the numbers and arrays of a function's module that it takes by their names."""
    known = function.__globals__
    return {name: known[name] for name in function.__code__.co_names if isinstance(known.get(name), (*_PLAIN, np.ndarray))}
