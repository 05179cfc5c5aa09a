"""When two values are the same: a digest of all that their behaviour depends on, the same in every process.

A frozen dataclass is represented by its fields, without those that are declared with `NOT_OF_MOTION`. A function is represented
by its code and the values and functions that it uses, because pickle's bytes of equal functions differ between processes.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache, partial
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

_LIBRARIES = sys.stdlib_module_names | {"conservative", "numpy", "scipy"}
"""Packages whose classes are represented by their names."""
NOT_OF_MOTION = {"of motion": False}
"""Metadata of a field that does not change the motion, such as a name."""


def digest(value: object) -> str:
    """Return a text that is equal for values with the same behaviour."""
    return hashlib.sha256(repr(_list_parts(value, [])).encode()).hexdigest()


@cache
def fields_of_motion(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass that its digest contains."""
    return tuple(field.name for field in fields(kind) if field.metadata.get("of motion", True))


def _list_parts(value: Any, above: list[object]) -> Any:  # noqa: PLR0912  # a branch for each kind of value
    """Return nested lists with the same `repr` in every process. `above` are the values around this one: cycles end."""
    value = getattr(value, "py_func", value)  # a function that numba has compiled
    kind, inner = f"{type(value).__module__}.{type(value).__qualname__}", [*above, value]
    if value is None or value is ... or isinstance(value, bool | int | float | complex | str | bytes):
        return [kind, repr(value)]
    if isinstance(value, np.ndarray | np.generic) and value.dtype != object:
        return [kind, value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    if any(each is value for each in above):
        return [kind]
    if isinstance(value, CodeType):
        parts: list[Any] = [value.co_code, value.co_names, value.co_varnames, value.co_consts]
    elif isinstance(value, FunctionType):
        known = value.__globals__
        used = {name: known[name] for name in sorted({*_names(value.__code__)}) if name in known}
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        parts = [value.__code__, value.__defaults__, value.__kwdefaults__, used, cells]
    elif isinstance(value, type) and value.__module__.partition(".")[0] not in _LIBRARIES:
        own = {name: each for name, each in vars(value).items() if not name.startswith("__") or name == "__call__"}
        parts = [value.__qualname__, value.__bases__, own]
    elif isinstance(value, ModuleType | type | BuiltinFunctionType | np.ufunc):
        parts = [getattr(value, "__module__", ""), getattr(value, "__qualname__", value.__name__)]
    elif isinstance(value, MethodType):
        parts = [value.__func__, value.__self__]
    elif isinstance(value, partial):
        parts = [value.func, value.args, value.keywords]
    elif isinstance(value, Mapping):
        parts = [[key, value[key]] for key in sorted(value, key=repr)]
    elif isinstance(value, set | frozenset):
        parts = sorted(value, key=repr)
    elif isinstance(value, list | tuple | np.ndarray):
        parts = list(value)
    elif is_dataclass(value):
        kind_of: Any = type(value)
        named = [(repr(name), getattr(value, name)) for name in fields_of_motion(kind_of)]
        return [kind, [["builtins.list", [["builtins.str", name], _list_parts(part, inner)]] for name, part in named]]
    else:  # an object: its class and attributes; one of C, without attributes, equals itself only
        slots = {name: getattr(value, name, None) for base in type(value).__mro__ for name in getattr(base, "__slots__", ())}
        parts = [type(value), slots | value.__dict__ if hasattr(value, "__dict__") else slots or id(value)]
    return [kind, [_list_parts(part, inner) for part in parts]]


def _names(code: CodeType) -> Iterator[str]:
    """Yield the names that a function and the functions in it use."""
    yield from code.co_names
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from _names(each)
