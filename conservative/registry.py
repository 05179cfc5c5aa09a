"""Scenes and methods by name. Everybody registers the same way, we too: an entry point in the package's pyproject.

    [project.entry-points."conservative.methods"]
    my_method = "my_package.my_file:MyMethod"           # a class derived from conservative.Method

    [project.entry-points."conservative.scenes"]
    my_scene = "my_package.my_scenes:my_scene"          # a function whose parameters all have defaults, returning a Scene

    [project.entry-points."conservative.body_files"]
    my_format = "my_package.my_file:body_from_my_format"    # a function of a path and a name, returning a MassDistribution

A method is named with its settings, `reduced`, `mujoco:RK4`, `heyoka:1e-9` or `heyoka:tol=1e-9,frame=non_spinning`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import BadInput, MissingEngine, NotLoadable, nearest
from .method import Method
from .scene import Scene

if TYPE_CHECKING:
    from .shapes import MassDistribution

METHODS, SCENES, BODY_FILES = "conservative.methods", "conservative.scenes", "conservative.body_files"


@cache
def registered(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group such as `SCENES` by name, in order of their names; nothing is imported."""
    return {entry.name: entry for entry in sorted(entry_points(group=group), key=lambda entry: entry.name)}


def _load(group: str, argument: str, name: str) -> Any:
    known = registered(group)
    if name not in known:
        files = ", or a file whose name ends with .toml" if group == SCENES else ""
        raise BadInput(argument, repr(name), nearest(name, known) + files)
    entry = known[name]
    try:
        return entry.load()
    except MissingEngine:
        raise
    except Exception as error:
        raise NotLoadable(argument, name, entry.value, error) from error


def scene(text: str) -> Scene:
    """Return a scene from its name with parameters, such as `brick_flip:disturbance=1e-6`, or from a file, `my_body.toml`.

    Raises
    ------
    BadInput
        The name or a parameter is unknown, a value cannot be used, or the file (see `conservative.scene_files.scene_file`) cannot.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    if text.endswith(".toml"):
        from .scene_files.scene_file import load

        return load(text)
    name, settings = _split(text)
    builder: Callable[..., Scene] = _load(SCENES, "scene", name)
    return builder(**_arguments(f"scene {name}", builder, settings))


def method(text: str) -> Method:
    """Return a method from its name with settings, such as `reduced`, `mujoco:RK4` or `heyoka:tol=1e-9,frame=non_spinning`.

    Raises
    ------
    BadInput
        The name or a setting is unknown, a value cannot be used, or the class has another name than it is registered with.
    NotLoadable
        It is registered, but importing what is registered fails.
    MissingEngine
        The engine is not installed.
    """
    name, settings = _split(text)
    family: type[Method] = _load(METHODS, "method", name)
    if getattr(family, "family", None) != name:
        got = f"{name!r}, whose class {family.__name__} has family = {getattr(family, 'family', None)!r}"
        raise BadInput("method", got, f"family = {name!r}: the name that is registered")
    return family(**_arguments(f"method {name}", family, settings))


def families() -> dict[str, type[Method]]:
    """Return the registered classes of methods by name; what cannot be loaded, or is no method of that name, is left out."""
    found = {name: _load_or_none(name) for name in registered(METHODS)}
    return {name: family for name, family in found.items() if getattr(family, "family", None) == name}


def _load_or_none(name: str) -> type[Method] | None:
    try:
        family = _load(METHODS, "method", name)
    except (MissingEngine, NotLoadable):
        return None
    return family if isinstance(family, type) and issubclass(family, Method) else None


def body_file(kind: str) -> Callable[[Path, str], MassDistribution]:
    """Return the function that reads a named body out of a file of a kind such as `mjcf` or `urdf`.

    Raises
    ------
    BadInput
        The kind is unknown.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    loader: Callable[[Path, str], MassDistribution] = _load(BODY_FILES, "kind of file", kind)
    return loader


def _split(text: str) -> tuple[str, list[str]]:
    name, _, rest = text.partition(":")
    return name, [item.strip() for item in rest.split(",") if item.strip()]


def _arguments(argument: str, target: Callable[..., object], settings: list[str]) -> dict[str, Any]:
    """Return keyword arguments from `key=value` items; items without a key go to the parameters in their order."""
    parameters = list(inspect.signature(target).parameters)
    found: dict[str, Any] = {}
    for position, item in enumerate(settings):
        key, equals, value = item.partition("=")
        if not equals:
            key, value = parameters[position] if position < len(parameters) else item, item
        if key not in parameters:
            raise BadInput(argument, repr(item), f"settings {nearest(key, parameters)}" if parameters else "no settings")
        found[key] = _value(value)
        default = inspect.signature(target).parameters[key].default
        if isinstance(default, int | float) and isinstance(found[key], str):
            raise BadInput(argument, repr(item), f"{key}=a number, such as {default!r}, its default")
    return found


def _value(text: str) -> object:
    for convert in (int, float):
        try:
            return convert(text)
        except ValueError:
            continue
    return {"true": True, "false": False, "none": None}.get(text.lower(), text)
