"""Locks of the environments that engines of a report run in: all packages, with versions."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod


@dataclass(frozen=True)
class Lock:
    """What an engine's environment has: `name`, as `exudyn==1.13.6`, its `python`, and all `packages`, as `name==version`."""

    name: str
    python: str
    packages: tuple[str, ...]


def locks_of(methods: Iterable[Method]) -> tuple[Lock, ...]:
    """Return the locks of the environments that some methods run in, each once, by name."""
    found = {method.environment.folder: method.environment for method in methods if isinstance(method, EngineMethod)}
    locks = (Lock(f"{each.engine}=={each.version}", each.python, each.packages) for each in found.values())
    return tuple(sorted(locks, key=lambda lock: lock.name))
