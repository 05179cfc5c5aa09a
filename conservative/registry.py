"""Scenes and methods by name. Everybody registers the same way, we too: an entry point in the package's pyproject.

    [project.entry-points."conservative.methods"]
    my_method = "my_package.my_file:MyMethod"           # a class derived from conservative.Method

    [project.entry-points."conservative.scenes"]
    my_scene = "my_package.my_scenes:my_scene"          # a function whose parameters all have defaults, returning a Scene

    [project.entry-points."conservative.body_files"]
    my_format = "my_package.my_file:body_from_my_format"    # a function of a path and a name, returning a MassDistribution

    [project.entry-points."conservative.engines"]
    my_engine = "my_package.engines:MyEngine"           # a class made by engine_class of conservative.references

A method is named with its settings, `reduced`, `mujoco:RK4`, `heyoka:1e-9` or `heyoka:tol=1e-9,frame=non_spinning`. An engine
that runs in an environment of its own is named alike, `exudyn:RK44`, with its version if need be: `mujoco@3.6.0:RK4`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .card import call_with_settings
from .check import printable_text
from .deferred_imports import ENGINES, METHODS, SCENES, list_entries, load_entry
from .errors import BadInput, MissingEngine, NotLoadable, nearest
from .method import Method
from .scene import Scene

_NAME = "a name with its settings, a text"


def list_scenes() -> tuple[str, ...]:
    """Return the names of all registered scenes, in their order; none is imported."""
    return tuple(list_entries(SCENES))


def list_methods() -> tuple[str, ...]:
    """Return the names of all registered methods, in their order; none is imported."""
    return tuple(list_entries(METHODS))


def list_engines() -> tuple[str, ...]:
    """Return the names of all engines that run in environments of their own, in their order; none is imported."""
    return tuple(list_entries(ENGINES))


def engine(name: str) -> Any:
    """Return the class of an engine that runs in an environment of its own.

    Raises
    ------
    BadInput
        The name is unknown.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    return load_entry(ENGINES, "engine", name)


def scene(text: str) -> Scene:
    """Return a scene from its name with parameters, such as `brick_flip:disturbance=1e-6`, or from a file, `my_body.toml`.

    Raises
    ------
    BadInput
        The name or a parameter is unknown, a value cannot be used, or the file cannot: see
        `conservative.scene_files.scene_file`.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    if printable_text("scene", text, _NAME).endswith(".toml"):
        from .scene_files.scene_file import load

        return load(text)
    name, _, settings = text.partition(":")
    builder: Callable[..., Scene] = load_entry(SCENES, "scene", name)
    return call_with_settings(builder, f"scene {name}", settings)


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
    name, _, settings = printable_text("method", text, _NAME).partition(":")
    family = _load_method(name)
    if getattr(family, "family", None) != name:
        got = f"{name!r}, whose class {family.__name__} has family = {getattr(family, 'family', None)!r}"
        raise BadInput("method", got, f"family = {name!r}: the name that is registered")
    return family.configure(settings)


def _load_method(name: str) -> type[Method]:
    """Return the class that runs in this process, or in an environment: where a version is named, or there is no other."""
    base, at, version = name.partition("@")
    engines = list_entries(ENGINES)
    known = set(engines) if at else {*engines, *list_entries(METHODS)}
    if base not in known or bool(at) != bool(version):
        raise BadInput("method", repr(name), nearest(base, known) + (", with @ and a version" if at else ""))
    found: type[Method]
    if at:
        found = engine(base).at_version(version)
    else:
        found = load_entry(METHODS if name in list_entries(METHODS) else ENGINES, "method", name)
    return found


def list_families() -> dict[str, type[Method]]:
    """Return the registered classes of methods by name; what cannot be loaded, or is no method of that name, is left out."""
    found = {name: _load_family(name) for name in list_methods()}
    return {name: family for name, family in found.items() if family is not None}


def _load_family(name: str) -> type[Method] | None:
    try:
        family = load_entry(METHODS, "method", name)
    except (MissingEngine, NotLoadable):
        return None
    whole = isinstance(family, type) and issubclass(family, Method) and getattr(family, "family", None) == name
    return family if whole else None
