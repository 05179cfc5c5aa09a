"""Environments that are there: where they lie, what was recorded of each, and which one a name means.

    FOLDER/exudyn/1.13.6/         a virtual environment
    FOLDER/exudyn/1.13.6/record.json, lock.txt
    FOLDER/temporary/             what is being made, and what engines write; `clear_leftovers` removes it

FOLDER is `engines` in the user's cache folder of this package, as platformdirs knows it.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path

from conservative import registry
from conservative.errors import require_extra
from conservative.files import write_text

from .failures import MissingEnvironment


@dataclass(frozen=True)
class Distribution:
    """What is installed for an engine.

    Attributes
    ----------
    package
        Its name where packages come from, with extras where it needs some.
    module
        What is imported of it.
    requirements
        What it needs beside NumPy, such as `numpy<2`.
    oldest
        Oldest version that its adapter is meant for; where no version is asked for, none below it is taken.
    """

    package: str
    module: str
    requirements: tuple[str, ...] = ()
    oldest: str = ""


def distribution_of(engine: str) -> Distribution:
    """Return what is installed for an engine.

    Raises
    ------
    BadInput
        The engine is unknown.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    found: Distribution = registry.engine(engine).distribution
    return found


Key = tuple[tuple[int, int, str], ...]


def version_key(version: str) -> Key:
    """Return what sorts versions: numbers by value, and 4.0.0rc1 before 4.0.0."""
    parts = re.findall(r"\d+|[a-z]+", version.lower().partition("+")[0])
    keys = [(1, int(part), "") if part.isdigit() else (2 if part == "post" else -1, 0, part) for part in parts]
    return (*keys, (0, 0, ""))


def describe_versions(version: str, known: list[str]) -> str:
    """Return what to say is allowed instead of a version that does not exist: the nearest one first."""
    if not known:
        return "a version that exists"
    newest = sorted(known, key=version_key, reverse=True)
    nearest = next((each for each in newest if version_key(each) <= version_key(version)), newest[-1])
    return f"{nearest} (nearest), or one of {', '.join(newest)}"


RECORD, LOCK = "record.json", "lock.txt"
"""What is written last into an environment, and the versions of all that is in it, with their hashes."""
BUILD = "build."
"""What the local part of a version has where an environment is that of a build, such as 4.0.1+build.1a2b3c4d."""


@dataclass(frozen=True)
class Environment:
    """An environment of an engine.

    Attributes
    ----------
    engine, version
        Its name here, such as `bsk`, and its version.
    folder
        Where it lies.
    python
        Version of its Python.
    packages
        All that is installed in it, as `name==version`.
    """

    engine: str
    version: str
    folder: Path
    python: str
    packages: tuple[str, ...]

    @property
    def is_build(self) -> bool:
        """Whether its engine is no release, but somebody's own build."""
        return BUILD in self.version.partition("+")[2]

    @property
    def interpreter(self) -> Path:
        """Its Python."""
        return interpreter_of(self.folder)

    def write(self) -> None:
        """Write the record, which makes a folder an environment."""
        record = {name: value for name, value in asdict(self).items() if name != "folder"}
        write_text(self.folder / RECORD, json.dumps(record, indent=2), "engines")


def interpreter_of(folder: Path) -> Path:
    """Return the Python of a virtual environment."""
    return folder / "bin" / "python"


def folder_of_all() -> Path:
    """Return the folder of all environments; it need not be there.

    Raises
    ------
    MissingExtra
        platformdirs, of the extra `environments`, is not installed.
    """
    require_extra("engines in environments", "environments", "platformdirs")
    from platformdirs import user_cache_path

    return user_cache_path("conservative-rotation") / "engines"


def folder_of_projects() -> Path:
    """Return the folder of the environments of projects (`projects`); it need not be there. Raises `MissingExtra` as above."""
    return folder_of_all().parent / "projects"


def temporary_folder() -> Path:
    """Return the folder of what does not last; it is made where it is not there."""
    folder = folder_of_all() / "temporary"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def read_environment(folder: Path) -> Environment | None:
    """Return the environment in a folder; None where there is none, or none that is whole."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        found = Environment(record["engine"], record["version"], folder, record["python"], tuple(record["packages"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return found if (found.engine, found.version) == (folder.parent.name, folder.name) else None


def list_environments(engine: str | None = None) -> tuple[Environment, ...]:
    """Return the environments of an engine, or all, that are whole: by name, older versions first."""
    folders = folder_of_all().glob("*/[!.]*")
    found = [environment for folder in folders if (environment := read_environment(folder))]
    mine = [environment for environment in found if engine in (None, environment.engine)]
    return tuple(sorted(mine, key=lambda each: (each.engine, version_key(each.version))))


def find_environment(engine: str, version: str = "") -> Environment:
    """Return the environment of a version of an engine, by default of the newest release that is installed.

    Raises
    ------
    MissingEnvironment
        There is none.
    """
    found = list_environments(engine)
    matching = [each for each in found if each.version == version or (not version and not each.is_build)]
    if not matching:
        raise MissingEnvironment(engine, version, tuple(environment.version for environment in found))
    return matching[-1]
