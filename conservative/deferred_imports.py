"""Modules that are imported when they are first used: kernels and registered entry points.

Importing numba takes a second, and importing every engine several seconds. Commands without an integration need neither.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from .errors import REINSTALL, BadInput, MissingEngine, NotLoadable, nearest
from .posix import unstoppable
from .programs import list_programs

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

METHODS, SCENES, BODY_FILES = "conservative.methods", "conservative.scenes", "conservative.body_files"
ENGINES = "conservative.engines"
"""Groups of entry points; see `conservative.registry`."""
PACKAGES = "conservative.packages"
"""Group of the objects that the core uses from the packages above it, which it must not import."""
DEFAULT_METHOD = "reduced"
"""Name of the method of `integrate` for a given step, `Reduced()`."""
_LISTS = {SCENES: "conservative list", METHODS: "conservative list", ENGINES: "conservative engines list"}
"""Commands that list the names of a group."""


@lru_cache(maxsize=32)
def kernels(name: str) -> Any:
    """Return the module `conservative.kernels.<name>`. Calls after the first are 20 times as fast as an import statement."""
    with unstoppable():
        return import_module(f"{__package__}.kernels.{name}")


@lru_cache(maxsize=8)
def list_entries(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group such as `SCENES` by name, sorted; nothing is imported. Programs are engines too."""
    from importlib.metadata import EntryPoint, entry_points  # here: it takes 20 ms, often unneeded

    entries = list(entry_points(group=group))
    if group == ENGINES and (programs := list_programs()):
        module = find_entry(PACKAGES, PACKAGES, "programs").value  # its attributes are the classes of programs, by name
        for name in programs.keys() & {*list_entries(METHODS), *(entry.name for entry in entries)}:
            raise BadInput(str(programs[name].file), f"{name!r}, the name of a method or an engine", "another name")
        entries += [EntryPoint(name, f"{module}:{name}", group) for name in programs]
    return {entry.name: entry for entry in sorted(entries, key=lambda entry: entry.name)}


def find_entry(group: str, argument: str, name: str) -> EntryPoint:
    """Return the entry point of a name in a group. `argument` is the name of the argument in messages. Raise `BadInput`."""
    entries = list_entries(group)
    if name in entries:
        return entries[name]
    if group == PACKAGES:
        raise BadInput(argument, f"no entry point {name!r}", REINSTALL)
    files = "; or give a file whose name ends with .toml" if group == SCENES else ""
    raise BadInput(argument, repr(name), nearest(name, entries, _LISTS.get(group, "")) + files)


def load_entry(group: str, argument: str, name: str) -> Any:
    """Return the object that is registered under a name in a group. `argument` is the name of the argument in messages.

    Raise `BadInput` for an unknown name, `NotLoadable` if the import of the object fails, and `MissingEngine` if it needs an
    engine that is not installed.
    """
    entry = find_entry(group, argument, name)
    try:
        with unstoppable():
            import_module(entry.module)
        return entry.load()
    except MissingEngine:
        raise
    except Exception as error:
        raise NotLoadable(argument, name, entry.value, error) from error
