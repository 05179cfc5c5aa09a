"""The environments of engines: their folders, their records, and their workers.

    FOLDER/exudyn/1.13.6/         a virtual environment
    FOLDER/exudyn/1.13.6/record.json, pylock.toml, home/
    FOLDER/temporary/             unfinished environments and working directories; `clear_leftovers` removes them

FOLDER is `engines` in the cache folder that platformdirs returns for this package.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from conservative import registry
from conservative.errors import BadInput, MissingEngine
from conservative.files import write_text
from conservative.posix import physical_memory
from conservative.programs import list_programs

from ..worker.client import Worker
from .apt import Apt
from .folders import folder_of_all, temporary_folder
from .kind import Distribution, EnvironmentKind, version_key
from .npm import Npm
from .pip import Pip


class MissingEnvironment(MissingEngine):
    """An engine, or a version of it, has no environment. The message contains the command that creates one."""

    def __init__(self, engine: str, version: str = "", installed: tuple[str, ...] = ()) -> None:
        self.engine, self.package = engine, engine
        wanted = f"{engine}@{version}" if version else engine
        has = f" (installed: {', '.join(installed)})" if installed else ""
        ImportError.__init__(self, f"{wanted} is not installed{has}. Run: conservative engines install {wanted}")


def distribution_of(engine: str) -> Distribution:
    """Return the package of an engine. Raise as `conservative.registry.engine`, or `BadInput` for a registered program."""
    if engine in (programs := list_programs()):
        raise BadInput("engine", f"{engine!r}, a program of {programs[engine].file}", "an engine with a package")
    distribution: Distribution = registry.engine(engine).data
    return distribution


KINDS: Mapping[str, EnvironmentKind] = {kind.name: kind for kind in (Pip(), Npm(), Apt())}
"""The kinds of environments that are installed, by their names."""
RECORD = "record.json"
"""File that is written last into an environment."""
BUILD = "build."
"""Mark of builds in the local part of a version, such as 4.0.1+build.1a2b3c4d."""


@dataclass(frozen=True)
class Environment:
    """An environment of an engine.

    Attributes
    ----------
    engine, version
        Name of the engine, such as `bsk`, and its version.
    folder
        The virtual environment, the folder of `node_modules`, or the folder of the compiled program.
    runtime
        Name and version of the program that runs the engine, such as `Python 3.11.4` or `Node 20.20.2`.
    packages
        All installed packages, as `name==version`.
    kind
        The kind of the environment, or `OwnProgram`.
    """

    engine: str
    version: str
    folder: Path
    runtime: str
    packages: tuple[str, ...]
    kind: EnvironmentKind = KINDS["python"]

    @property
    def name(self) -> str:
        """Engine and version as in the name of a method, such as `exudyn@1.13.6`."""
        return f"{self.engine}@{self.version}"

    @property
    def is_build(self) -> bool:
        """True if the engine is a user's own build, not a release."""
        return BUILD in self.version.partition("+")[2]

    def start_worker(self, variables: Mapping[str, str] | None = None, memory: int = 0) -> Worker:
        """Return a new worker with its own home directory, where engines keep compiled code, and three quarters of the memory.

        Parameters
        ----------
        variables
            Additional environment variables, for environments that do not have all of this process.
        memory
            Another memory limit in bytes. Only Linux limits memory.
        """
        memory, own = memory or physical_memory() // 4 * 3, self.kind.variables(self.folder)
        environment = None if own is None else {**own, **(variables or {})}
        return Worker(self.kind.command(self.folder), temporary_folder(), environment, memory)

    def write(self) -> None:
        """Write the record, which turns a folder into an environment."""
        record = {
            "engine": self.engine,
            "version": self.version,
            "runtime": self.runtime,
            "packages": self.packages,
            "kind": self.kind.name,
        }
        write_text(self.folder / RECORD, json.dumps(record, indent=2), "engines")


_workers: dict[tuple[Path, str, int], Worker] = {}


def worker_of(environment: Environment, precision: str = "f64") -> Worker:
    """Return the worker of an environment, one for each precision, because JAX and Genesis have one precision per process.

    A forked process gets other workers, because two processes cannot share a pipe.
    """
    key = environment.folder, precision, os.getpid()
    if key not in _workers:
        _workers.setdefault(key, new_worker(environment, precision))  # another thread may have been faster
    return _workers[key]


def new_worker(environment: Environment, precision: str = "f64") -> Worker:
    """Return a new worker of an environment, which the caller closes."""
    cache = environment.folder / "home" / ".cache" / "jax"
    jax = {"JAX_PLATFORMS": "cpu", "JAX_ENABLE_X64": str(int(precision == "f64")), "JAX_COMPILATION_CACHE_DIR": str(cache)}
    return environment.start_worker(jax)


def close_environment(folder: Path) -> None:
    """End the processes that run in an environment. Each starts again with its next request."""
    for (place, _, process), worker in list(_workers.items()):
        if place == folder and process == os.getpid():
            worker.close()


def read_environment(folder: Path) -> Environment | None:
    """Return the environment in a folder; None if there is no complete one."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        if python := record.pop("python", ""):  # written by older versions
            record["runtime"] = f"Python {python}"
        fixed = {"folder": folder, "packages": tuple(record["packages"]), "kind": KINDS[record.get("kind", "python")]}
        environment = Environment(**{**record, **fixed})
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return environment if (environment.engine, environment.version) == (folder.parent.name, folder.name) else None


def list_environments(engine: str | None = None) -> tuple[Environment, ...]:
    """Return the complete environments of an engine, or of all: by name, older versions first."""
    folders = folder_of_all().glob("*/[!.]*")
    environments = [environment for folder in folders if (environment := read_environment(folder))]
    chosen = [environment for environment in environments if engine in (None, environment.engine)]
    return tuple(sorted(chosen, key=lambda environment: (environment.engine, version_key(environment.version))))


def find_environment(engine: str, version: str = "") -> Environment:
    """Return the environment of a version, by default of the newest installed release. Raise `MissingEnvironment`."""
    environments = list_environments(engine)
    matching = [
        environment
        for environment in environments
        if environment.version == version or (not version and not environment.is_build)
    ]
    if not matching:
        raise MissingEnvironment(engine, version, tuple(environment.version for environment in environments))
    return matching[-1]
