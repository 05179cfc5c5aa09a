"""Look whether environments are what was recorded of them, and make those anew that are not, from their locks."""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput

from .catalogue import distribution_of
from .environment import LOCK, Environment, folder_of_all, folders, read_environment
from .install import clear_leftovers, drop, freeze, import_trouble, install, make
from .lock import Lock, Source
from .uv_command import UvFailed


@dataclass(frozen=True)
class Finding:
    """What the doctor found of an environment.

    Attributes
    ----------
    name
        The environment, as `exudyn==1.13.6`, or what was left of one that was being made.
    trouble
        What is wrong; empty where nothing is.
    remedy
        What was done about it; empty where nothing was.
    """

    name: str
    trouble: str
    remedy: str = ""


def examine(mend: bool = True, source: Source | None = None) -> Iterator[Finding]:
    """Yield a finding for each environment. With `mend`, those in trouble are made anew, or removed where they cannot be."""
    for name in clear_leftovers():
        yield Finding(name, "left by a process that ended in the middle", "removed")
    for folder in folders():
        name = f"{folder.parent.name}=={folder.name}"
        trouble = trouble_of(folder)
        yield Finding(name, trouble, _mend(folder, source or Source()) if trouble and mend else "")


def trouble_of(folder: Path) -> str:
    """Return what is wrong with the environment in a folder; empty where nothing is."""
    environment = read_environment(folder)
    if environment is None:
        return "it has no record that can be read"
    checks = (_python_trouble, _package_trouble, _file_trouble, _import_trouble)
    return next(filter(None, (check(environment) for check in checks)), "")


def _python_trouble(environment: Environment) -> str:
    try:
        subprocess.run([environment.interpreter, "-I", "-c", "import numpy"], check=True, capture_output=True, timeout=120)
    except (OSError, subprocess.SubprocessError) as error:
        return f"its Python does not run, or has no NumPy ({type(error).__name__})"
    return ""


def _package_trouble(environment: Environment) -> str:
    try:
        found = set(freeze(environment.folder))
    except UvFailed as failure:
        return failure.summary
    missing, foreign = set(environment.packages) - found, found - set(environment.packages)
    texts = [f"without {', '.join(sorted(missing))}"] * bool(missing) + [f"with {', '.join(sorted(foreign))}"] * bool(foreign)
    return " and ".join(texts)


def _file_trouble(environment: Environment) -> str:
    """Return which file is gone, or has another size than the list of its package says."""
    for listing in environment.folder.glob("lib/python*/site-packages/*.dist-info/RECORD"):
        with listing.open(encoding="utf-8", newline="") as file:
            for name, _, size in csv.reader(file):
                path = listing.parent.parent / name
                if size and (not path.is_file() or path.stat().st_size != int(size)):
                    return f"{name} is gone, or changed"
    return ""


def _import_trouble(environment: Environment) -> str:
    try:
        return import_trouble(environment, distribution_of(environment.engine))
    except BadInput as error:
        return str(error)


def _mend(folder: Path, source: Source) -> str:
    """Return what was done: made anew from its lock, or from its name and version, else removed."""
    engine, version = folder.parent.name, folder.name
    try:
        if (folder / LOCK).is_file():
            lock = Lock(version, _python_for(folder), (folder / LOCK).read_text(encoding="utf-8"))
            make(engine, lock, folder_of_all() / engine / version, source)
        else:
            drop(folder)
            install(f"{engine}=={version}", source)
    except (BadInput, OSError) as error:
        if folder.exists():
            drop(folder)
        return f"removed, as it cannot be made anew: {error}"
    return _import_trouble_after(folder) or "made anew"


def _python_for(folder: Path) -> str:
    """Return the Python that an environment was made with, from its configuration; ours where that is gone."""
    try:
        found = dict(re.findall(r"^(\w+) = (.*)$", (folder / "pyvenv.cfg").read_text(encoding="utf-8"), re.MULTILINE))
    except OSError:
        found = {}
    path = Path(found.get("home", ""), "python" + ".".join(found.get("version_info", "").split(".")[:2]))
    return str(path) if path.is_file() else sys.executable


def _import_trouble_after(folder: Path) -> str:
    trouble = trouble_of(folder)
    return f"made anew, which did not help: {trouble}" if trouble else ""
