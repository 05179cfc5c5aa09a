"""Environments of versions of a project, such as a package that registers a method: of a commit, a folder or a wheel.

    FOLDER/wheels/KEY/      the wheel of a version; KEY is its commit or its hash
    FOLDER/NAME/KEY/        its environment (see `environment`); NAME is the name of the package

FOLDER is `projects` next to the folder of engines. Wheels and environments stay there, so that the base of many comparisons is
built once. The other packages of an environment have their current versions: if these have changed, it is created again.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import conservative
from conservative.errors import BadInput
from conservative.files import make_folder, write_bytes
from conservative.version import VERSION

from .environment import RECORD, Environment, close_environment, read_environment
from .folders import folder_of_projects, temporary_folder
from .install import build_wheel, clear_leftovers, drop, import_trouble, make
from .kind import Distribution, Source
from .pip import Pip, normal_name, resolve_wheel, versions_in

KEPT = 8
"""Largest number of environments of a project. The least recently used ones are removed."""
US, PACKAGE = "conservative", "conservative-rotation"
"""The names by which this package is imported and installed."""
_WHEEL = re.compile(r"([A-Za-z0-9_.]+)-[0-9][^-]*(-[^-]+){3,4}\.whl")


def environment_of(wheel: Path, requirements: Sequence[str], source: Source) -> Environment:
    """Return the environment of a wheel from `keep_wheel`, created if it does not exist.

    The requirements are additional ones. If the wheel does not require this package, or a version that the source does not
    have, the running version is added. Raise `BadInput` if a package is not available, or `conservative` cannot be imported.
    """
    clear_leftovers()
    try:
        environment = _make_environment(wheel, requirements, source)
    except BadInput as first:
        try:
            environment = _make_environment(wheel, (*requirements, _running_version(source)), source)
        except BadInput:
            raise first from None
    os.utime(environment.folder / RECORD)
    records = sorted(environment.folder.parent.glob(f"*/{RECORD}"), key=lambda path: path.stat().st_mtime)
    for record in records[:-KEPT]:
        drop(record.parent)
    return environment


def _make_environment(wheel: Path, requirements: Sequence[str], source: Source) -> Environment:
    name, key = normal_name(wheel.name.partition("-")[0]), wheel.parent.name
    distribution, folder = Distribution(name, US, tuple(requirements)), folder_of_projects() / name / key
    try:
        lock = resolve_wheel(distribution, wheel, key, source)
        with zipfile.ZipFile(wheel) as archive:
            ours = any(re.match(rf"{US}[./]", member) for member in archive.namelist())
        if not ours and PACKAGE not in versions_in(lock.text):
            raise BadInput("against", f"{wheel.name}, without {PACKAGE}", f"a version that needs {PACKAGE}")
        environment, stored_lock = read_environment(folder), folder / Pip.lock_file  # older versions wrote another file
        if environment is None or not stored_lock.is_file() or stored_lock.read_text(encoding="utf-8") != lock.text:
            environment = make(name, lock, folder, source)
    except BadInput as error:
        raise BadInput("against", error.got, error.allowed) from None
    trouble = import_trouble(environment, distribution)
    close_environment(environment.folder)
    if trouble:
        raise BadInput("against", f"{wheel.name}, in whose environment {trouble}", f"a version that needs {US}, which imports")
    return environment


def _running_version(source: Source) -> str:
    """Return the requirement of this package in the running version: a wheel of its sources, if it runs from a checkout."""
    sources = Path(conservative.__file__).parents[1]
    if not (sources / "pyproject.toml").is_file():
        return f"{PACKAGE}=={VERSION}"
    return f"{PACKAGE} @ {keep_wheel('', build_project(sources, source)).as_uri()}"


def keep_wheel(key: str, make_wheel: Callable[[Path], Path]) -> Path:
    """Return the wheel with a key, or the wheel that `make_wheel` creates in a folder; by default its hash is the key.

    Raise `BadInput` if the file does not have the name of a wheel, or cannot be kept.
    """
    kept = folder_of_projects() / "wheels"
    if key and (existing := sorted((kept / key).glob("*.whl"))):
        return existing[0]
    make_folder(kept, "against")
    with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"build-{os.getpid()}-") as folder:
        wheel = make_wheel(Path(folder))
        if not _WHEEL.fullmatch(wheel.name):
            raise BadInput("against", repr(wheel.name), "a wheel with its original file name")
        content = wheel.read_bytes()
    place = kept / (key or hashlib.sha256(content).hexdigest()[:16]) / wheel.name
    make_folder(place.parent, "against")
    if not place.is_file():
        write_bytes(place, content, "against")
    return place


def build_project(path: Path, source: Source, **variables: str) -> Callable[[Path], Path]:
    """Return a function that builds a folder of sources into a wheel in another folder, which runs code of the project.

    Raise `BadInput` if there is nothing to build.
    """
    if not any((path / name).is_file() for name in ("pyproject.toml", "setup.py")):
        raise BadInput("against", repr(str(path)), "a git ref, a wheel, or a folder with pyproject.toml or setup.py")
    building = replace(source, allow_build=True)
    return lambda folder: build_wheel(path, folder, building, **variables)
