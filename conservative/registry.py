"""Scenes, methods and engines by name. All are registered as entry points in the pyproject.toml of a package, also ours.

    [project.entry-points."conservative.methods"]
    my_method = "my_package.my_file:MyMethod"           # a class derived from conservative.Method

    [project.entry-points."conservative.scenes"]
    my_scene = "my_package.my_scenes:my_scene"          # a function whose parameters all have defaults, returning a Scene

    [project.entry-points."conservative.body_files"]
    my_format = "my_package.my_file:body_from_my_format"    # a function of a path and a name, returning a MassDistribution

    [project.entry-points."conservative.engines"]
    my_engine = "my_package.engines:MyEngine"           # a class made by engine_class of conservative.references

A method is named with its settings, `reduced`, `mujoco:RK4`, `heyoka:1e-9` or `heyoka:tol=1e-9,frame=non_spinning`. An engine
that runs in an environment of its own is named the same way, with a version if needed: `exudyn:RK44`, `mujoco@3.6.0:RK4`.
"""

from __future__ import annotations

import re
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
    """Return the names of all registered scenes, sorted; none is imported."""
    return tuple(list_entries(SCENES))


def list_methods() -> tuple[str, ...]:
    """Return the names of all registered methods, sorted; none is imported."""
    return tuple(list_entries(METHODS))


def list_engines() -> tuple[str, ...]:
    """Return the names of all engines that run in environments of their own, sorted; none is imported."""
    return tuple(list_entries(ENGINES))


VERSION = re.compile(r"[0-9]+(?:[.!+a-z0-9_-]*[a-z0-9])?")
"""Pattern of the version of an engine."""


def partition_version(name: str) -> tuple[str, str, str]:
    """Return the parts of the name of an engine, `mujoco@3.6.0` or `mujoco==3.6.0`, as `str.partition("@")` returns them."""
    return name.replace("==", "@", 1).partition("@")


def engine(name: str) -> Any:
    """Return the class of an engine that runs in an environment of its own.

    Raise `BadInput` for an unknown name, and `NotLoadable` if the import of the engine fails.
    """
    return load_entry(ENGINES, "engine", name)


def scene(text: str) -> Scene:
    """Return a scene from its name with parameters, such as `brick_flip:disturbance=1e-6`, or from a file, `my_body.toml`.

    A scene with parameters has them in its name, so that rows of the same scene with other parameters are apart.

    Raises
    ------
    BadInput
        The name or a parameter is unknown, or a value or the file cannot be used; see `conservative.scene_files.scene_file`.
    NotLoadable
        The import of the scene fails.
    """
    if printable_text("scene", text, _NAME).endswith(".toml"):
        from .scene_files.scene_file import load

        return load(text)
    name, _, settings = text.partition(":")
    builder: Callable[..., Scene] = load_entry(SCENES, "scene", name)
    built = call_with_settings(builder, f"scene {name}", settings)
    return built.rename(f"{name}:{settings}") if settings and built.name == name else built


def method(text: str) -> Method:
    """Return a method from its name with settings, such as `reduced`, `mujoco:RK4` or `heyoka:tol=1e-9,frame=non_spinning`.

    Raises
    ------
    BadInput
        The name or a setting is unknown, a value cannot be used, or the class is registered under another name.
    NotLoadable
        The import of the method fails.
    MissingEngine
        The engine is not installed.
    """
    given, _, settings = printable_text("method", text, _NAME).partition(":")
    base, at, version = partition_version(given)
    name = base + at + version
    methods, engines = list_entries(METHODS), list_entries(ENGINES)
    known = set(engines) if at else {*engines, *methods}
    if base not in known or (at and not VERSION.fullmatch(version)):
        allowed = nearest(base, known, "conservative list, and conservative engines list")
        raise BadInput("method", repr(given), allowed + (", with @ and a version such as 3.6.0" if at else ""))
    # The class that runs in this process, or in an environment if a version is named or there is no other.
    family: type[Method] = (
        engine(base).at_version(version) if at else load_entry(METHODS if name in methods else ENGINES, "method", name)
    )
    if getattr(family, "family", None) != name:
        got = f"{name!r}, whose class {family.__name__} has family = {getattr(family, 'family', None)!r}"
        raise BadInput("method", got, f"family = {name!r}: the name that is registered")
    return family.configure(settings)


def list_families() -> dict[str, type[Method]]:
    """Return the registered classes of methods by name, without those that cannot be loaded or have another name."""
    families = {}
    for name in list_methods():
        try:
            family = load_entry(METHODS, "method", name)
        except (MissingEngine, NotLoadable):
            continue
        if isinstance(family, type) and issubclass(family, Method) and getattr(family, "family", None) == name:
            families[name] = family
    return families
