"""What is imported when it is first used: kernels, and what installed packages register, which their metadata name.

Importing numba takes a second, and importing every engine several: a command without an integration need not wait.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import BadInput, MissingEngine, NotLoadable, nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from .shapes import MassDistribution

METHODS, SCENES, BODY_FILES = "conservative.methods", "conservative.scenes", "conservative.body_files"
"""Groups of entry points; `conservative.registry` says what stands in each."""
DEFAULT_METHOD = "reduced"
"""Name of the method where nobody names one: that of `Reduced()`, which is the default of `integrate`."""


@lru_cache(maxsize=32)
def kernels(name: str) -> Any:
    """Return the module `conservative.kernels.<name>`. Calls after the first are 20 times faster than an import statement."""
    return import_module(f"{__package__}.kernels.{name}")


@lru_cache(maxsize=8)
def list_entries(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group such as `SCENES` by name, in order of their names; nothing is imported."""
    from importlib.metadata import entry_points  # here, as it takes 20 ms, and an integration with a given method needs none

    return {entry.name: entry for entry in sorted(entry_points(group=group), key=lambda entry: entry.name)}


def load_entry(group: str, argument: str, name: str) -> Any:
    """Return what is registered under a name; `argument` is what messages call the name.

    Raises
    ------
    BadInput
        The name is unknown.
    NotLoadable
        It is registered, but importing what is registered fails.
    MissingEngine
        It needs an engine that is not installed.
    """
    known = list_entries(group)
    if name not in known:
        files = ", or a file whose name ends with .toml" if group == SCENES else ""
        raise BadInput(argument, repr(name), nearest(name, known) + files)
    try:
        return known[name].load()
    except MissingEngine:
        raise
    except Exception as error:
        raise NotLoadable(argument, name, known[name].value, error) from error


def load_body_reader(kind: str) -> Callable[[Path, str], MassDistribution]:
    """Return the function that reads a named body out of a file of a kind such as `mjcf` or `urdf`.

    Raises
    ------
    BadInput
        The kind is unknown.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    reader: Callable[[Path, str], MassDistribution] = load_entry(BODY_FILES, "kind of file", kind)
    return reader
