"""The provenance of measurements: command, machine, versions, commit, date."""

from __future__ import annotations

import platform
import shlex
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import distributions
from pathlib import Path

from conservative.benchmarks.measures.origin import commit, git, machine

COMPARED = ("conservative-rotation", "mujoco", "pin", "heyoka", "scipy", "numpy", "numba", "mpmath", "pandas", "altair")
"""Packages whose versions can change measurements. A report lists them first."""


@dataclass(frozen=True)
class LockedEngine:
    """Contents of an engine's environment: `name`, as `exudyn==1.13.6`, `runtime`, and all `packages`, as `name==version`."""

    name: str
    runtime: str
    packages: tuple[str, ...]


@dataclass(frozen=True)
class Provenance:
    """Everything that is needed to repeat a report.

    `resumed` has a sentence for each earlier process that measured a part. `environments` are the locks of the engines'
    environments. `commit` is the commit of the source, with "+changes" if files differ from it, or "unknown" outside git.
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
    def facts(self) -> dict[str, str]:
        """Command, date, commit, machine and the versions that can change measurements, by name."""
        origin = {"command": self.command, "date": self.date, "commit": self.commit}
        return {**origin, **self.machine, "python": self.python, **self.compared}


def provenance(arguments: list[str] | None = None) -> Provenance:
    """Return the provenance of this process; `arguments` are the command's, by default this process's.

    Commands call it before any work: files and the commit can change meanwhile.
    """
    command = sys.argv[1:] if arguments is None else arguments
    here = Path(__file__)
    tracked = git(here.parent, "ls-files", "--error-unmatch", here.name)  # False inside another project's working tree
    return Provenance(
        shlex.join(["conservative", *command]),
        machine(),
        f"{platform.python_implementation()} {platform.python_version()}",
        dict(_packages()),
        (commit(here.parent, mark_changes=True) if tracked else "") or "unknown",
        datetime.now(UTC).isoformat(timespec="seconds"),
    )


@cache  # parsing the metadata of 200 packages takes 0.1 s; a process runs what it has imported, whatever is installed later
def _packages() -> tuple[tuple[str, str], ...]:
    """Return name and version of every installed package, by name."""
    descriptions = [package.metadata for package in distributions()]  # `package.version` would parse the metadata again
    versions = {description["Name"]: description["Version"] for description in descriptions}
    return tuple(sorted(versions.items(), key=lambda item: item[0].lower()))
