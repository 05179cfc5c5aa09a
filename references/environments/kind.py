"""A kind of environments: what installs an engine and runs it. Each kind is one class in its own file: `Pip`, `Npm` and `Apt`.

`environment.KINDS` lists them. `programs.OwnProgram`, a program of the user, is a kind without an installation.
"""

from __future__ import annotations

import os
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from conservative.errors import BadInput


@dataclass(frozen=True)
class Distribution:
    """The package of an engine.

    Attributes
    ----------
    package
        Name in the package index, with extras.
    module
        Module to import.
    requirements
        Requirements other than NumPy, such as `numpy<2`.
    oldest
        Oldest version that is installed unless another one is named.
    kind
        Kind of its environments, a key of `environment.KINDS`.
    """

    package: str
    module: str
    requirements: tuple[str, ...] = ()
    oldest: str = ""
    kind: str = "python"


@dataclass(frozen=True)
class Source:
    """Source of packages.

    Attributes
    ----------
    find_links
        A folder of wheels that replaces the index.
    allow_build
        True if a package without a wheel may be built, which runs its code.
    """

    find_links: Path | None = None
    allow_build: bool = False

    @property
    def options(self) -> tuple[str, ...]:
        """Command line options of uv."""
        folder = () if self.find_links is None else ("--no-index", "--find-links", str(self.find_links))
        return (*folder, *(() if self.allow_build else ("--only-binary", ":all:")))


@dataclass(frozen=True)
class Lock:
    """The version of an engine, the text of the lock file of its environment, and for Python the path of the interpreter."""

    version: str
    text: str
    python: str = ""


class EnvironmentKind(ABC):
    """A kind of environments.

    Attributes
    ----------
    name
        The name in records, and of `Distribution.kind`.
    lock_file
        The file with the versions of all packages, which `fill` reads.
    suffix
        Suffix of the adapters of its engines.
    """

    name: ClassVar[str]
    lock_file: ClassVar[str] = ""
    suffix: ClassVar[str] = ""

    @abstractmethod
    def command(self, folder: Path) -> tuple[str | Path, ...]:
        """Return the command line of the program that runs the engine in a folder."""

    def resolve(self, distribution: Distribution, version: str, source: Source) -> Lock:
        """Return the lock of a version of an engine, by default the newest. Raise `BadInput` if it is not available."""
        raise NotImplementedError

    def fill(self, folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
        """Install the packages of the lock in a folder.

        Return the runtime of the engine, such as `Python 3.11.4`, and all packages as `name==version`.
        """
        raise NotImplementedError

    def list_versions(self, package: str, source: Source) -> list[str]:
        """Return the versions of a package, newest first; empty if the source does not list them."""
        return []

    def read_lock(self, folder: Path, version: str, runtime: str) -> Lock:
        """Return the lock of an environment. Raise `BadInput` if it has none."""
        try:
            return Lock(version, (folder / self.lock_file).read_text(encoding="utf-8"))
        except OSError:
            name = f"{folder.parent.name}@{version}"
            advice = f"{self.lock_file}, which new environments have. Run: conservative engines remove {name}, then install it"
            raise BadInput("engine", f"{name} without a lock", advice) from None

    def variables(self, folder: Path) -> Mapping[str, str] | None:
        """Return the environment variables of the program, in which the engine has a home of its own; None for all of ours."""
        home = folder / "home"
        home.mkdir(parents=True, exist_ok=True)
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "XDG_"))}
        return kept | {"HOME": str(home), "USERPROFILE": str(home)}


def version_key(version: str) -> tuple[tuple[int, int, str], ...]:
    """Return a key that sorts versions: numbers by value, and 4.0.0rc1 before 4.0.0."""
    parts = re.findall(r"\d+|[a-z]+", version.lower().partition("+")[0])
    keys = [(1, int(part), "") if part.isdigit() else (2 if part == "post" else -1, 0, part) for part in parts]
    return (*keys, (0, 0, ""))
