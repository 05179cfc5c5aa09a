"""Scenes as numbers and texts that JSON takes, and back: what is made of the values of this package has no code in it.

Source: our own.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

from ..check import build_unchecked, read_only
from ..errors import BadInput
from ..scene import Scene

PACKAGE = __name__.partition(".")[0]
SCENE = "the scene of the run, by scene=: it has functions of its own, which are not kept on the disk"


def record_scene(scene: Scene) -> Any:
    """Return a scene as JSON takes it; None where it has parts that are no numbers, texts or values of this package."""
    try:
        return _record(scene)
    except TypeError:
        return None


def restore_scene(record: Any) -> Scene:
    """Return the scene that was recorded. Raise `BadInput` for None, and for what is no record of a scene."""
    if record is None:
        raise BadInput("scene", "None", SCENE)
    try:
        found = _restore(record)
    except Exception:  # whatever is wrong with it
        found = None
    if not isinstance(found, Scene):
        raise BadInput("path", "a scene that cannot be read", "an ensemble that nobody has edited")
    return found


def _record(value: Any) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return {"array": value.tolist()}
    if isinstance(value, tuple):
        return {"tuple": [_record(each) for each in value]}
    kind = type(value)
    if is_dataclass(value) and kind.__module__.partition(".")[0] == PACKAGE and "<" not in kind.__qualname__:
        named = {field.name: _record(getattr(value, field.name)) for field in fields(value)}
        return {"type": f"{kind.__module__}:{kind.__qualname__}", "fields": named}
    raise TypeError(f"no record of a {kind.__qualname__}")


def _restore(record: Any) -> Any:
    if not isinstance(record, dict):
        return record
    if "array" in record:
        return read_only(np.array(record["array"], dtype=float))
    if "tuple" in record:
        return tuple(_restore(each) for each in record["tuple"])
    module, _, name = record["type"].partition(":")
    kind = getattr(import_module(module), name) if module.partition(".")[0] == PACKAGE else None
    if not (isinstance(kind, type) and is_dataclass(kind)):
        raise TypeError(f"no value of {record['type']}")
    if record["fields"].keys() != {field.name for field in fields(kind)}:
        raise TypeError(f"not the fields of {record['type']}")
    return build_unchecked(kind, **{field: _restore(value) for field, value in record["fields"].items()})
