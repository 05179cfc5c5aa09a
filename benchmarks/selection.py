"""Which scenes and methods a study takes: by name, or everything that is registered."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

from conservative import registry
from conservative.method import Method
from conservative.scene import Scene

DEFAULT_SCENES = ("brick_flip", "lagrange_top")
ROOMS = ("ours", "engine", "truth")
TOLERANCES = ("tol", "rtol")
"""Settings that adaptive methods trade accuracy with, in place of dt."""


def scenes(names: Iterable[str] = DEFAULT_SCENES) -> tuple[Scene, ...]:
    """Return scenes by name, with parameters where a name has them.

    Raises
    ------
    BadInput
        A name or a parameter is unknown, or a value cannot be used.
    """
    return tuple(registry.scene(name) for name in names)


def methods(names: Iterable[str] | None = None) -> tuple[Method, ...]:
    """Return methods by name, ours first; a family's bare name, such as `mujoco`, stands for all its variants.

    Parameters
    ----------
    names
        Default: every registered family.

    Raises
    ------
    BadInput
        A name or a setting is unknown, or a value cannot be used.
    """
    wanted = registry.registered(registry.METHODS) if names is None else names
    found: dict[Method, None] = {}
    for name in wanted:
        method = registry.method(name)
        found.update(dict.fromkeys((method,) if ":" in name else method.variants()))
    return tuple(sorted(found, key=lambda method: ROOMS.index(method.room)))


def tolerance_setting(method: Method) -> str | None:
    """Return the name of the setting that an adaptive method trades accuracy with; None where it has none."""
    if method.order is not None:
        return None
    return next((field.name for field in fields(_value(method)) if field.name in TOLERANCES), None)


def at_tolerance(method: Method, setting: str, tolerance: float) -> Method:
    """Return the method with another tolerance."""
    changed: Method = replace(_value(method), **{setting: tolerance})
    return changed


def series(method: Method) -> str:
    """Return what one line of a picture is called: the method's name without its tolerance."""
    setting = tolerance_setting(method)
    if setting is None:
        return method.name
    default = next(field.default for field in fields(_value(method)) if field.name == setting)
    return at_tolerance(method, setting, default).name if isinstance(default, float) else method.name


def identifier(scene: Scene, method: Method, dt: float) -> str:
    """Return the id of a benchmark, such as `brick_flip-reduced_o4-dt0.01`: letters, digits, `_`, `.`, `+` and `-` only."""
    settings = [(field.name, getattr(method, field.name), field.default) for field in fields(_value(method))]
    parts = [_short(name, setting) for name, setting, default in settings if setting != default]
    return f"{scene.name}-{'_'.join([method.family, *parts])}-dt{dt:g}"


def _short(name: str, setting: object) -> str:
    """Return a setting as part of an id: texts speak for themselves, numbers say what they are of."""
    if isinstance(setting, str):
        return setting.lower()
    return {"order": "o", "stages": "s"}.get(name, name) + str(setting)


def _value(method: Method) -> Any:
    """Methods are frozen dataclasses, which the type of their abstract base cannot say."""
    return method
