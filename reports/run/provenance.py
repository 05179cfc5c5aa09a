"""Where numbers come from: command, machine, versions, commit, date."""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import distributions
from pathlib import Path

COMPARED = ("conservative-rotation", "mujoco", "pin", "heyoka", "scipy", "numpy", "numba", "mpmath", "pandas", "altair")
"""Packages whose versions can change a number; a report names them first."""


@dataclass(frozen=True)
class Provenance:
    """What it takes to make a report again.

    `resumed` says what earlier processes measured, one sentence each, where this one did not measure everything.
    """

    command: str
    machine: dict[str, str]
    python: str
    packages: dict[str, str]
    commit: str
    date: str
    resumed: tuple[str, ...] = ()

    @property
    def compared(self) -> dict[str, str]:
        """Versions of what can change a number, by package."""
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
        machine(),
        f"{platform.python_implementation()} {platform.python_version()}",
        packages(),
        commit(),
        datetime.now(UTC).isoformat(timespec="seconds"),
    )


def machine() -> dict[str, str]:
    """Return what the computer is: processor, cores this process may use, memory, system."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "processor": _line_of("/proc/cpuinfo", "model name") or platform.processor() or platform.machine(),
        "architecture": platform.machine(),
        "cores": str(usable),
        "memory": _line_of("/proc/meminfo", "MemTotal") or "unknown",
        "system": f"{platform.system()} {platform.release()}",
    }


def _line_of(path: str, key: str) -> str:
    """Return the value of the first `key: value` line of a file of the Linux kernel; "" elsewhere."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(key)), "")


def packages() -> dict[str, str]:
    """Return the version of every installed package, by name."""
    found = {found.metadata["Name"]: found.version for found in distributions()}
    return dict(sorted(found.items(), key=lambda item: item[0].lower()))


def commit() -> str:
    """Return the commit of the source this runs from, with "+changes" where files differ from it; "unknown" outside git."""
    here = Path(__file__).parent
    if not _git(here, "ls-files", "--error-unmatch", Path(__file__).name):
        return "unknown"  # installed into some other project's working tree
    head = _git(here, "rev-parse", "HEAD")
    changed = _git(here, "status", "--porcelain", "--untracked-files=no")
    return (head + ("+changes" if changed else "")) or "unknown"


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
