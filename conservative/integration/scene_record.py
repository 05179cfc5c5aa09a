"""A scene as JSON: numbers and texts, and a digest for everything else, such as the functions of a `FunctionPotential`.

A digest shows whether two scenes are the same, but a scene cannot be restored from it. Digests of another interpreter or of an
earlier version of this package cannot be compared, nor can digests of values that cannot be followed (`conservative.identity`).
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

from ..check import build_unchecked, describe, read_only
from ..errors import BadInput, SceneNotCompared
from ..identity import fields_of_motion, identify
from ..scene import Scene

_PACKAGE = __name__.partition(".")[0]
_NOT_OF_MOTION = {field.name for field in fields(Scene)} - {*fields_of_motion(Scene)} | {"t_end"}
"""Fields of a scene that do not change the motion of its bodies on a given grid."""
_BY = f"2 {sys.implementation.cache_tag}"
"""Versions that change the digests of functions: the rules of `identity`, and the bytecode of the interpreter."""


def find_scene(record: Mapping[str, Any], scene: object) -> Scene:
    """Return `scene` if the record describes it; if it is None, restore the scene from the record.

    Warn if the record has functions that cannot be compared with the scene's (`SceneNotCompared`). Raise `BadInput` if
    the record describes another scene; or if `scene` is None, and the record contains digests or cannot be restored.
    """
    if scene is None:
        try:
            restored = _restore(record)
        except BadInput:
            raise
        except Exception:  # a damaged record can raise anything
            restored = None
        if not isinstance(restored, Scene):
            raise BadInput("path", "a scene that cannot be read", "an ensemble as `integrate_many` wrote it")
        return restored
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "None, or the Scene of the run")
    if not record["fields"]["extra_invariants"]["tuple"]:
        scene = scene.rename(scene.name, extra_invariants=())  # `integrate_many` removes the invariants of a single body
    if "flight" not in record["fields"]:  # as earlier versions wrote it
        scene = scene.rotation_only
    current = record_scene(scene)
    stored = json.loads(json.dumps(record))
    if unknown := list(_adopt(stored, current)):
        warnings.warn(SceneNotCompared(scene.name, unknown[0]), stacklevel=4)
    if different := list_differences(stored, current):
        got = f"{scene.name!r}, with another {', '.join(different)}"
        raise BadInput("scene", got, f"the scene of the run, {record['fields']['name']!r}")
    return scene


def _adopt(stored: Any, current: Any) -> Iterator[str]:
    """Replace stored digests that cannot be compared by the given ones, and yield the reasons."""
    if not (isinstance(stored, dict) and isinstance(current, dict)):
        if isinstance(stored, list) and isinstance(current, list):
            for pair in zip(stored, current, strict=False):
                yield from _adopt(*pair)
    elif "digest" in stored and "digest" in current:
        unknown = stored.get("unknown") or current.get("unknown")
        if unknown or stored.get("by") != current["by"]:
            yield unknown or "functions that another version of Python or of this package wrote"
            stored.clear()
            stored.update(current)
    else:
        for name in stored.keys() & current.keys():
            yield from _adopt(stored[name], current[name])


def list_differences(record: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Return the fields in which two records differ; without one, their bodies have the same motion on the same grid."""
    a, b = (json.loads(json.dumps(entry["fields"])) for entry in (record, other))
    return [name for name in a | b if name not in _NOT_OF_MOTION and a.get(name) != b.get(name)]


def record_scene(value: Any) -> Any:
    """Return a scene, or a value in it, as JSON."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return {"array": value.tolist()}
    if isinstance(value, tuple):
        return {"tuple": [record_scene(item) for item in value]}
    kind = type(value)
    if is_dataclass(value) and kind.__module__.partition(".")[0] == _PACKAGE and "<" not in kind.__qualname__:
        # Fields without a value are left out, so that records of versions without these fields are the same.
        values = ((field, getattr(value, field.name)) for field in fields(value))
        named = {field.name: record_scene(item) for field, item in values if item is not None or field.default is not None}
        return {"type": f"{kind.__module__}:{kind.__qualname__}", "fields": named}
    identity = identify(value)
    return {"digest": identity.text[:16], "by": _BY} | ({"unknown": identity.unknown} if identity.unknown else {})


def _restore(record: Any) -> Any:
    if not isinstance(record, dict):
        return record
    if "array" in record:
        return read_only(np.array(record["array"], dtype=float))
    if "tuple" in record:
        return tuple(_restore(item) for item in record["tuple"])
    if "digest" in record:
        raise BadInput("scene", "None", "the scene of the run, by scene=, because its functions are not stored")
    module, _, name = record["type"].partition(":")
    kind = getattr(import_module(module), name) if module.partition(".")[0] == _PACKAGE else None
    if not (isinstance(kind, type) and is_dataclass(kind)):
        raise TypeError(f"no value of {record['type']}")
    names, optional = ({field.name for field in fields(kind) if some or field.default is None} for some in (True, False))
    if not names - optional <= record["fields"].keys() <= names:
        raise TypeError(f"not the fields of {record['type']}")
    return build_unchecked(kind, **{field: _restore(value) for field, value in record["fields"].items()})
