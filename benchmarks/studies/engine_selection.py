"""Engines that are named for a report or a study, and their settings."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from conservative import registry
from conservative.errors import BadInput, MissingEngine, nearest
from conservative.method import Method, Role
from conservative.programs import list_programs
from conservative.references.environments.environment import list_environments

from .selection import Missing

ALL = "all"
"""The name of all installed engines: in this environment, and the newest version of each in an environment of its own."""


def select_engines(names: Iterable[str], skip_missing: bool = False) -> tuple[Method, ...]:
    """Return the settings of engines by name (`Method.settings_in_tables`).

    Parameters
    ----------
    names
        `NAME` for the engine in this environment, or else the newest installed version; `NAME@VERSION`; or `ALL`.
    skip_missing
        A `Missing` method for each name that is not installed, instead of an error.

    Raises
    ------
    BadInput
        A name is unknown or malformed, or `ALL` is given and no engine is installed.
    MissingEngine
        An engine is not installed, and `skip_missing` is False.
    """
    all_names = [engine for name in names for engine in (list_installed() if name == ALL else (name,))]
    methods: list[Method] = []
    for name in dict.fromkeys(registry.read_name(name, "engines", settings=False) for name in all_names):
        try:
            methods += _family(name.base, name.version).settings_in_tables()
        except MissingEngine as error:
            if not skip_missing:
                raise
            methods.append(Missing(str(name), error=error))
    if not methods:
        raise BadInput("engines", repr(ALL), "engines that are installed: conservative engines install NAME")
    # Of equal labels, the last position remains, with the first method.
    return tuple({method.label: method for method in reversed(methods)}.values())[::-1]


def list_installed() -> tuple[str, ...]:
    """Return the installed engines: in this environment, the newest version of each in its own environment, and programs.

    If the versions are equal, only the engine in this environment is listed, because the results are the same.
    """
    here = {}
    for name, family in registry.list_families().items():
        if family.role == Role.ENGINE:
            with suppress(MissingEngine):
                here[name] = family().maker.version
    known = registry.list_engines()
    # Older versions come first, so that the newest one remains.
    newest = {environment.engine: environment for environment in list_environments() if environment.engine in known}
    apart = [environment.name for name, environment in newest.items() if here.get(name) != environment.version]
    return (*here, *apart, *list_programs())


def _family(engine: str, version: str) -> type[Method]:
    """Return the class of an engine: in an environment if there is a version, otherwise in this environment."""
    here = {name for name, family in registry.list_families().items() if family.role == Role.ENGINE}
    known = {*registry.list_engines(), *(() if version else here)}
    if engine not in known:
        raise BadInput("engines", repr(engine), f"{ALL!r}, or {nearest(engine, known)}")
    if engine in here and not version:
        return registry.list_families()[engine]
    engine_class: Any = registry.engine(engine)
    return engine_class.at_version(version) if version else engine_class
