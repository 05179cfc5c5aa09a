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
`read_name` reads such a name, for every command and option. `mujoco==3.6.0:RK4` is the same name.

A name without settings stands for one setting, the default, where a name makes one run (`method` here), and for all settings
that tables show (`Method.settings_in_tables`) where a table is made. A version changes neither.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

from .check import printable_text
from .deferred_imports import ENGINES, METHODS, SCENES, list_entries, load_entry
from .errors import BadInput, MissingEngine, NotLoadable, nearest
from .method import Method
from .method_info import call_with_settings
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


_VERSION = re.compile(r"[0-9]+(?:[.!+a-z0-9_-]*[a-z0-9])?")


class Name(NamedTuple):
    """The parts of the name of a method or an engine: `mujoco`, `3.6.0` and `RK4` of `mujoco@3.6.0:RK4`.

    Attributes
    ----------
    base
        The registered name, which can be unknown.
    version
        Version of the engine; empty without one.
    settings
        Text after the colon; None without a colon.
    """

    base: str
    version: str = ""
    settings: str | None = None

    @property
    def family(self) -> str:
        """Registered name and version, such as `mujoco@3.6.0`."""
        return f"{self.base}@{self.version}" if self.version else self.base

    def __str__(self) -> str:
        return self.family if self.settings is None else f"{self.family}:{self.settings}"


def read_name(text: str, argument: str = "method", settings: bool = True) -> Name:
    """Return the parts of `NAME`, `NAME@VERSION` or `NAME==VERSION`, followed by `:SETTINGS` unless `settings` is False.

    `argument` is the name of the argument in messages. The registered name is not looked up. Raise `BadInput` for a text of
    another form.
    """
    printable_text(argument, text, _NAME)
    name, colon, rest = text.replace("==", "@").partition(":")
    base, at, version = name.partition("@")
    version = version.lower()  # versions of packages have no case
    if not base or "=" in name or bool(at) != bool(_VERSION.fullmatch(version)) or (colon and not settings):
        form = "NAME, NAME@VERSION or NAME==VERSION, such as mujoco@3.6.0"
        raise BadInput(argument, repr(text), form + (", and settings after a colon" if settings else ", without settings"))
    return Name(base, version, rest if colon else None)


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
    name = read_name(text)
    base, version, settings = name
    methods, engines = list_entries(METHODS), list_entries(ENGINES)
    names = set(engines) if version else {*engines, *methods}
    if base not in names:
        allowed = nearest(base, names, "conservative list, and conservative engines list")
        without = f"{base!r} without a version, or an engine: " if base in methods else ""
        raise BadInput("method", repr(name.family), without + allowed)
    # The class that runs in this process, or in an environment if a version is named or there is no other.
    family: type[Method] = (
        engine(base).at_version(version) if version else load_entry(METHODS if base in methods else ENGINES, "method", base)
    )
    if getattr(family, "family", None) != name.family:
        got = f"{name.family!r}, whose class {family.__name__} has family = {getattr(family, 'family', None)!r}"
        raise BadInput("method", got, f"family = {name.family!r}: the name that is registered")
    return family.configure(settings or "")


def list_families() -> dict[str, type[Method]]:
    """Return the registered classes of methods by name, without those that cannot be loaded or have another name."""
    entries, families = list_entries(METHODS), {}
    if _loaded[0] is not entries:
        _loaded[:] = entries, {}
    known = _loaded[1]
    for name in entries:
        if name not in known:
            try:
                known[name] = load_entry(METHODS, "method", name)
            except (MissingEngine, NotLoadable):
                continue
        family = known[name]
        if isinstance(family, type) and issubclass(family, Method) and getattr(family, "family", None) == name:
            families[name] = family
    return families


_loaded: list[Any] = [None, {}]
"""The entry points of methods, and the objects that they name: loading all of them again takes 0.7 ms."""
