"""The machine and the commit of a measurement."""

from __future__ import annotations

import os
import platform
import subprocess
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path


@dataclass(frozen=True)
class Machine:
    """Description of a computer.

    Attributes
    ----------
    processor, model
        Name, and family and model numbers of Linux (empty on other systems).
    architecture, system
        Such as `x86_64`, and name and release of the operating system.
    cores
        Number of cores that this process may use.
    memory
        Total memory, as Linux reports it; "unknown" elsewhere.
    """

    processor: str
    model: str
    architecture: str
    cores: str
    memory: str
    system: str

    @property
    def title(self) -> str:
        """Processor, architecture and numba's version, on which round-off depends."""
        processor = " ".join(filter(None, (self.processor, self.model)))
        return ", ".join((processor, self.architecture, f"numba {metadata.version('numba')}"))

    def as_dict(self) -> dict[str, str]:
        """Return the fields that reports show: all except `model`."""
        return {name: value for name, value in vars(self).items() if name != "model"}


def machine() -> Machine:
    """Return the computer that this runs on."""
    processor = first_values("/proc/cpuinfo")
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return Machine(
        processor=processor.get("model name", "") or platform.processor() or platform.machine(),
        model=" ".join(f"{key} {processor[key]}" for key in ("cpu family", "model") if key in processor),
        architecture=platform.machine(),
        cores=str(usable),
        memory=first_values("/proc/meminfo").get("MemTotal", "unknown"),
        system=f"{platform.system()} {platform.release()}",
    )


def first_values(path: str) -> dict[str, str]:
    """Return the first value of every key in a Linux file of lines `key: value`; empty if there is no such file."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    pairs = ((key.strip(), value.strip()) for key, _, value in (line.partition(":") for line in reversed(lines)))
    return dict(pairs)


def git(folder: Path, *arguments: str) -> str:
    """Return the output of git for a folder; "" if git fails or is not installed."""
    try:
        done = subprocess.run(["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()


def commit(folder: Path, mark_changes: bool = False) -> str:
    """Return the commit of a folder, with "+changes" if `mark_changes` and files differ from it; "" outside git."""
    head = git(folder, "rev-parse", "HEAD")
    changed = head and mark_changes and git(folder, "status", "--porcelain", "--untracked-files=no")
    return f"{head}+changes" if changed else head
