"""The environments of engines: their folders, their records, and their workers.

    FOLDER/exudyn/1.13.6/         a virtual environment
    FOLDER/exudyn/1.13.6/record.json, lock.txt, home/
    FOLDER/temporary/             unfinished environments and working directories; `clear_leftovers` removes them

FOLDER is `engines` in the cache folder that platformdirs returns for this package.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from conservative import registry
from conservative.errors import BadInput, MissingEngine, require_extra
from conservative.files import write_text
from conservative.posix import physical_memory
from conservative.programs import list_programs

from ..worker import program
from ..worker.client import Worker


class MissingEnvironment(MissingEngine):
    """An engine, or a version of it, has no environment. The message contains the command that creates one."""

    def __init__(self, engine: str, version: str = "", installed: tuple[str, ...] = ()) -> None:
        self.engine, self.package = engine, engine
        wanted = f"{engine}@{version}" if version else engine
        has = f" (installed: {', '.join(installed)})" if installed else ""
        ImportError.__init__(self, f"{wanted} is not installed{has}. Run: conservative engines install {wanted}")


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
        Kind of its environments, a key of `COMMANDS`.
    """

    package: str
    module: str
    requirements: tuple[str, ...] = ()
    oldest: str = ""
    kind: str = "python"


def distribution_of(engine: str) -> Distribution:
    """Return the package of an engine. Raise as `conservative.registry.engine`, or `BadInput` for a registered program."""
    if engine in (programs := list_programs()):
        raise BadInput("engine", f"{engine!r}, a program of {programs[engine].file}", "an engine with a package")
    distribution: Distribution = registry.engine(engine).data
    return distribution


def version_key(version: str) -> tuple[tuple[int, int, str], ...]:
    """Return a key that sorts versions: numbers by value, and 4.0.0rc1 before 4.0.0."""
    parts = re.findall(r"\d+|[a-z]+", version.lower().partition("+")[0])
    keys = [(1, int(part), "") if part.isdigit() else (2 if part == "post" else -1, 0, part) for part in parts]
    return (*keys, (0, 0, ""))


RECORD, LOCK = "record.json", "lock.txt"
"""File that is written last into an environment, and file with the versions and hashes of all packages."""
NODE = "Node 20 or later with npm, from https://nodejs.org or the system's packages"
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
        The virtual environment, the folder of `node_modules`, or that of the compiled program.
    runtime
        Name and version of what runs the engine, such as `Python 3.11.4` or `Node 20.20.2`.
    packages
        All installed packages, as `name==version`.
    kind, words
        A key of `COMMANDS`, or the command line of a user's program, which has the variables of this process.
    """

    engine: str
    version: str
    folder: Path
    runtime: str
    packages: tuple[str, ...]
    kind: str = "python"
    words: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Engine and version as in the name of a method, such as `exudyn@1.13.6`."""
        return f"{self.engine}@{self.version}"

    @property
    def is_build(self) -> bool:
        """True if the engine is a user's own build, not a release."""
        return BUILD in self.version.partition("+")[2]

    @property
    def command(self) -> tuple[str | Path, ...]:
        """Command line of the program that runs the engine."""
        return COMMANDS[self.kind](self.folder)

    def start_worker(self, variables: Mapping[str, str] | None = None, memory: int = 0) -> Worker:
        """Return a new worker with its own home directory, where engines keep compiled code, and three quarters of the memory.

        Parameters
        ----------
        variables
            Additional environment variables.
        memory
            Another memory limit in bytes. Only Linux limits memory.
        """
        memory = memory or physical_memory() // 4 * 3
        if self.words:
            return Worker(self.words, temporary_folder(), memory=memory)
        home = self.folder / "home"
        home.mkdir(parents=True, exist_ok=True)
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "XDG_"))}
        own = {"HOME": str(home), "USERPROFILE": str(home), **(variables or {})}
        return Worker(self.command, temporary_folder(), kept | own, memory)

    def write(self) -> None:
        """Write the record, which turns a folder into an environment."""
        record = {name: value for name, value in asdict(self).items() if name not in ("folder", "words")}
        write_text(self.folder / RECORD, json.dumps(record, indent=2), "engines")


COMMANDS: dict[str, Callable[[Path], tuple[str | Path, ...]]] = {
    "python": lambda folder: (interpreter_of(folder), "-I", program.__file__),
    "npm": lambda folder: (find_node("node"), Path(program.__file__).with_suffix(".mjs"), folder),
    "apt": lambda folder: (build(folder),),
}
"""Kinds of environments, and the command line of the program that runs the engine in a folder of each kind."""
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


def interpreter_of(folder: Path) -> Path:
    """Return the Python of a virtual environment."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def find_node(name: str) -> str:
    """Return the path of `node` or `npm`. Raise `BadInput` if it is not installed."""
    if path := shutil.which(name):
        return path
    raise BadInput("engine", f"an engine in JavaScript, but no {name} on this machine", NODE)


def build(folder: Path) -> Path:
    """Return the program of an engine in C++, compiled again if its sources have changed. Raise `BadInput` if that fails."""
    sources = Path(__file__).parents[1] / "engines" / f"{folder.parent.name}.cpp", Path(program.__file__).with_suffix(".hpp")
    done = folder / f"program-{hashlib.sha256(b''.join(each.read_bytes() for each in sources)).hexdigest()[:16]}"
    if not done.is_file():
        new, lock = done.with_suffix(f".{os.getpid()}"), (folder / LOCK).read_text(encoding="utf-8")
        libraries = run_tool("pkg-config", "--cflags", "--libs", *re.findall(r"^[^=]+", lock, re.MULTILINE)).split()
        run_tool("g++", "-O2", sources[0], "-o", new, *libraries, "-std=c++17")
        new.replace(done)
    return done


def run_tool(*command: str | Path, advice: str = "packages as in `conservative engines install`, which checks them") -> str:
    """Return the output of a command. Raise `BadInput` if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BadInput("engine", f"{command[0]}, which failed ({' '.join(done.stderr.split())[:300]})", advice)
    return done.stdout.strip()


def folder_of_all() -> Path:
    """Return the folder of all environments, which may not exist. Raise `MissingExtra` if platformdirs is not installed."""
    require_extra("engines in environments", "environments", "platformdirs")
    from platformdirs import user_cache_path

    return user_cache_path("conservative-rotation") / "engines"


def folder_of_projects() -> Path:
    """Return the folder of the environments of projects (see `projects`), which may not exist."""
    return folder_of_all().parent / "projects"


def temporary_folder() -> Path:
    """Return the folder of temporary files, created if it does not exist."""
    folder = folder_of_all() / "temporary"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def read_environment(folder: Path) -> Environment | None:
    """Return the environment in a folder; None if there is no complete one."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        if python := record.pop("python", ""):  # written by older versions
            record["runtime"] = f"Python {python}"
        fixed = {"folder": folder, "packages": tuple(record["packages"])}
        environment = Environment(**{**record, **fixed})
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return environment if (environment.engine, environment.version) == (folder.parent.name, folder.name) else None


def list_environments(engine: str | None = None) -> tuple[Environment, ...]:
    """Return the complete environments of an engine, or of all: by name, older versions first."""
    folders = folder_of_all().glob("*/[!.]*")
    environments = [environment for folder in folders if (environment := read_environment(folder))]
    chosen = [environment for environment in environments if engine in (None, environment.engine)]
    return tuple(sorted(chosen, key=lambda each: (each.engine, version_key(each.version))))


def find_environment(engine: str, version: str = "") -> Environment:
    """Return the environment of a version, by default of the newest installed release. Raise `MissingEnvironment`."""
    environments = list_environments(engine)
    matching = [each for each in environments if each.version == version or (not version and not each.is_build)]
    if not matching:
        raise MissingEnvironment(engine, version, tuple(environment.version for environment in environments))
    return matching[-1]
