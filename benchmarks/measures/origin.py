"""The machine and the commit of a measurement."""

from __future__ import annotations

import os
import platform
import re
import subprocess
from importlib import metadata
from pathlib import Path

from llvmlite.binding import get_host_cpu_name

from conservative.posix import first_values, physical_memory


def machine() -> dict[str, str]:
    """Return processor, architecture, cores that this process may use, memory (if it is known) and operating system."""
    memory = physical_memory() // 1024
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "processor": first_values("/proc/cpuinfo").get("model name", "") or f"{platform.processor()} ({get_host_cpu_name()})",
        "architecture": platform.machine(),
        "cores": str(usable),
        "memory": first_values("/proc/meminfo").get("MemTotal") or (f"{memory} kB" if memory else "unknown"),
        "system": f"{platform.system()} {platform.release()}",
    }


def machine_title() -> str:
    """Return processor (on Linux with family and model), architecture and the version of numba: round-off depends on them."""
    numbers = first_values("/proc/cpuinfo")
    model = [f"{key} {numbers[key]}" for key in ("cpu family", "model") if key in numbers]
    return ", ".join((" ".join([machine()["processor"], *model]), platform.machine(), f"numba {metadata.version('numba')}"))


def git(folder: Path, *arguments: str) -> str:
    """Return the output of git for a folder; "" if git fails or is not installed."""
    try:
        done = subprocess.run(["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()


def commit_title(folder: Path, commit: str) -> str:
    """Return a short hash and the subject of a commit, as its author pushed it; "" without a commit.

    GitHub tests a pull request as a commit that merges the pushed one into the base, and names both in its subject.
    """
    head, plus, changes = commit.partition("+")
    subject = git(folder, "log", "-1", "--format=%s", head) if head else ""
    if merge := re.fullmatch("Merge ([0-9a-f]{40}) into [0-9a-f]{40}", subject):
        head, subject = merge[1], git(folder, "log", "-1", "--format=%s", merge[1])
    return f"{head[:9]}{plus}{changes} {subject}".strip()


def commit(folder: Path, mark_changes: bool = False) -> str:
    """Return the commit of a folder, with "+changes" if `mark_changes` and files differ from it; "" outside git."""
    head = git(folder, "rev-parse", "HEAD")
    changed = head and mark_changes and git(folder, "status", "--porcelain", "--untracked-files=no")
    return f"{head}+changes" if changed else head
