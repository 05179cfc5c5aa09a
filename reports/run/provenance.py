"""The provenance of measurements: command, machine, versions, commit, date."""

from __future__ import annotations

import platform
import shlex
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path

from conservative.benchmarks.measures.origin import commit, git, machine
from conservative.method import Method
from conservative.references.environments.engine_method import EngineMethod

COMPARED = ("conservative-rotation", "mujoco", "pin", "heyoka", "scipy", "numpy", "numba", "mpmath", "pandas", "altair")
"""Packages whose versions can change measurements. A report lists them first."""


@dataclass(frozen=True)
class LockedEngine:
    """Contents of an engine's environment: `name`, as `exudyn==1.13.6`, `python`, and all `packages`, as `name==version`."""

    name: str
    python: str
    packages: tuple[str, ...]


def locks_of(methods: Iterable[Method]) -> tuple[LockedEngine, ...]:
    """Return the locks of the environments that some methods run in, each once, by name."""
    found = {method.environment.folder: method.environment for method in methods if isinstance(method, EngineMethod)}
    locks = (LockedEngine(f"{each.engine}=={each.version}", each.python, each.packages) for each in found.values())
    return tuple(sorted(locks, key=lambda lock: lock.name))


@dataclass(frozen=True)
class Provenance:
    """Everything that is needed to repeat a report.

    `resumed` has a sentence for each earlier process that measured a part. `environments` are the locks of the engines'
    environments.
    """

    command: str
    machine: dict[str, str]
    python: str
    packages: dict[str, str]
    commit: str
    date: str
    resumed: tuple[str, ...] = ()
    environments: tuple[LockedEngine, ...] = ()

    @property
    def compared(self) -> dict[str, str]:
        """Versions of the packages that can change measurements, by package."""
        return {name: self.packages.get(name, "not installed") for name in COMPARED}

    @property
    def others(self) -> list[str]:
        """Name and version of every other package."""
        return [f"{name} {version}" for name, version in self.packages.items() if name not in COMPARED]


def provenance(arguments: list[str] | None = None) -> Provenance:
    """Return the provenance of this process; `arguments` are those of the command, default this process's."""
    words = sys.argv[1:] if arguments is None else arguments
    return Provenance(
        shlex.join(["conservative", *words]),
        machine().as_dict(),
        f"{platform.python_implementation()} {platform.python_version()}",
        packages(),
        source_commit(),
        datetime.now(UTC).isoformat(timespec="seconds"),
    )


def describe_origin() -> dict[str, str]:
    """Return command, machine, versions and commit, before any work: files and the commit can change meanwhile."""
    source = provenance()
    return {"command": source.command, "date": source.date, "commit": source.commit, **source.machine}


def packages() -> dict[str, str]:
    """Return the version of every installed package, by name."""
    found = {found.metadata["Name"]: found.version for found in distributions()}
    return dict(sorted(found.items(), key=lambda item: item[0].lower()))


def source_commit() -> str:
    """Return the commit of the source this runs from, with "+changes" where files differ from it; "unknown" outside git."""
    here = Path(__file__).parent
    if not git(here, "ls-files", "--error-unmatch", Path(__file__).name):
        return "unknown"  # installed into some other project's working tree
    return commit(here, mark_changes=True) or "unknown"
