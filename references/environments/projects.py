"""Environments of versions of a project, such as one that registers a method: of a commit, a folder of sources, or a wheel.

    FOLDER/wheels/KEY/      the wheel of a version; KEY is what tells it from all others, its commit or its hash
    FOLDER/NAME/KEY/        its environment, as `environment` has them; NAME is that of the package

FOLDER is `projects` beside the folder of engines. Both are kept, so that the base of many comparisons is made once, and of an
environment's packages the versions are those of now: where these have changed, it is made anew.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from conservative.errors import BadInput
from conservative.files import make_folder, write_bytes

from .builds import build_wheel
from .environment import (
    LOCK,
    RECORD,
    Distribution,
    Environment,
    close_environment,
    folder_of_projects,
    read_environment,
    temporary_folder,
)
from .install import clear_leftovers, drop, import_trouble, make
from .lock import Source, normal_name, resolve_wheel

KEPT = 8
"""Environments of a project that are kept: those used last."""
US = "conservative"
_WHEEL = re.compile(r"([A-Za-z0-9_.]+)-[0-9][^-]*(-[^-]+){3,4}\.whl")


def environment_of(wheel: Path, requirements: Sequence[str], source: Source) -> Environment:
    """Return the environment of a wheel that `keep_wheel` gave, made where it is not there.

    Parameters
    ----------
    wheel
        The wheel.
    requirements
        What it is to have beside what the wheel asks for.
    source
        Where packages come from.

    Raises
    ------
    BadInput
        What it needs cannot be had, or `conservative` is not among it or cannot be imported.
    """
    clear_leftovers()
    name, key = normal_name(wheel.name.partition("-")[0]), wheel.parent.name
    distribution, folder = Distribution(name, US, tuple(requirements)), folder_of_projects() / name / key
    try:
        lock = resolve_wheel(distribution, wheel, key, source)
        there = read_environment(folder)
        same = there is not None and (folder / LOCK).read_text(encoding="utf-8") == lock.text
        found = there if there is not None and same else make(name, lock, folder, source)
    except BadInput as error:
        raise BadInput("against", error.got, error.allowed) from None
    trouble = import_trouble(found, distribution)
    close_environment(found.folder)
    if trouble:
        raise BadInput("against", f"{wheel.name}, in whose environment {trouble}", f"a version that needs {US}, which imports")
    os.utime(folder / RECORD)
    _drop_oldest(folder.parent)
    return found


def _drop_oldest(folder: Path) -> None:
    """Drop all but the environments of a project that were used last."""
    records = sorted(folder.glob(f"*/{RECORD}"), key=lambda path: path.stat().st_mtime)
    for record in records[:-KEPT]:
        drop(record.parent)


def keep_wheel(key: str, make_wheel: Callable[[Path], Path]) -> Path:
    """Return the wheel that is kept under a key, or what `make_wheel` puts into a folder; without a key its hash is the key.

    Raises
    ------
    BadInput
        What was made is not called as a wheel is, or cannot be kept.
    """
    kept = folder_of_projects() / "wheels"
    if key and (there := sorted((kept / key).glob("*.whl"))):
        return there[0]
    make_folder(kept, "against")
    with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"build-{os.getpid()}-") as folder:
        wheel = make_wheel(Path(folder))
        if not _WHEEL.fullmatch(wheel.name):
            raise BadInput("against", repr(wheel.name), "a wheel with its original file name")
        content = wheel.read_bytes()
    place = kept / (key or hashlib.sha256(content).hexdigest()[:16])
    return _keep(place / wheel.name, content)


def _keep(place: Path, content: bytes) -> Path:
    make_folder(place.parent, "against")
    if not place.is_file():
        write_bytes(place, content, "against")
    return place


def build_project(path: Path, source: Source, **variables: str) -> Callable[[Path], Path]:
    """Return what puts the wheel of a folder of sources into a folder; its build runs code of the project, as its use does.

    Raises
    ------
    BadInput
        There is nothing to build.
    """
    if not any((path / name).is_file() for name in ("pyproject.toml", "setup.py")):
        raise BadInput("against", repr(str(path)), "a git ref, a wheel, or a folder with pyproject.toml or setup.py")
    building = replace(source, allow_build=True)
    return lambda folder: build_wheel(path, folder, building, **variables)
