"""Make and remove environments. One that is being made lies elsewhere, and gets its name when it is whole."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput

from .catalogue import Distribution, distribution_of
from .environment import (
    LOCK,
    Environment,
    find_environment,
    folder_of_all,
    interpreter_of,
    list_environments,
    read_environment,
    temporary_folder,
)
from .failures import EngineCrashed, EngineTimeout
from .lock import Lock, Source, resolve, split_requirement
from .uv_command import UvFailed, run_uv
from .workers import worker_of


@dataclass(frozen=True)
class Installation:
    """An environment after it was asked for.

    Attributes
    ----------
    environment
        The environment.
    new
        Whether it was made now.
    trouble
        Why its engine cannot be imported; empty if it can.
    """

    environment: Environment
    new: bool
    trouble: str


def install(requirement: str, source: Source | None = None) -> Installation:
    """Return the environment of `NAME` or `NAME==VERSION`, made where it is not there.

    Raises
    ------
    BadInput
        The engine or the version is unknown, has no wheel for a Python of this machine, or cannot be had here and now.
    """
    source = source or Source()
    engine, version = split_requirement(requirement)
    distribution = distribution_of(engine)
    clear_temporary()
    lock = resolve(distribution, version, source)
    folder = folder_of_all() / engine / lock.version
    there = read_environment(folder)
    environment = there or make(engine, lock, folder, source)
    return Installation(environment, there is None, import_trouble(environment, distribution))


def make(engine: str, lock: Lock, folder: Path, source: Source) -> Environment:
    """Return a new environment in a folder, in place of what is there.

    Raises
    ------
    BadInput
        A package cannot be had, or there is no room on the disk.
    """
    with _scratch(engine) as scratch:
        try:
            _fill(scratch, lock, source)
            environment = _describe(engine, lock, scratch)
        except UvFailed as failure:
            raise BadInput("engine", f"{engine}=={lock.version}", f"what uv can install ({failure.summary})") from None
        except OSError as error:
            raise BadInput("engines", f"{scratch}: {error.strerror}", "a cache folder that can be written, with room") from None
        environment.write()
        _replace(folder, scratch)
    found = read_environment(folder)
    assert found is not None
    return found


@contextmanager
def _scratch(engine: str) -> Iterator[Path]:
    """Yield a folder that goes with the block, unless it has another name by then; its own name says whose it is."""
    folder = Path(tempfile.mkdtemp(prefix=f"{engine}-{os.getpid()}-", dir=temporary_folder()))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _fill(folder: Path, lock: Lock, source: Source) -> None:
    (folder / LOCK).write_text(lock.text, encoding="utf-8")
    run_uv("venv", "--quiet", "--relocatable", "--allow-existing", "--python", lock.python, folder)
    options = ("--quiet", "--require-hashes", "--python", interpreter_of(folder))
    run_uv("pip", "sync", *options, *source.options, folder / LOCK)


def _describe(engine: str, lock: Lock, folder: Path) -> Environment:
    return Environment(engine, lock.version, folder, _python_of(folder), freeze(folder))


def freeze(folder: Path) -> tuple[str, ...]:
    """Return all that is installed in an environment, as `name==version`."""
    return tuple(run_uv("pip", "freeze", "--quiet", "--python", interpreter_of(folder)).split("\n")[:-1])


def _python_of(folder: Path) -> str:
    ask = [interpreter_of(folder), "-I", "-c", "import platform; print(platform.python_version())"]
    return subprocess.run(ask, capture_output=True, text=True, check=True, timeout=60).stdout.strip()


def _replace(folder: Path, scratch: Path) -> None:
    """Give a folder its name; what has that name goes."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    if folder.exists():
        folder.rename(scratch.with_name(f"{scratch.name}-old"))
    try:
        scratch.rename(folder)
    except OSError:  # another process was faster
        if read_environment(folder) is None:
            raise
    shutil.rmtree(scratch.with_name(f"{scratch.name}-old"), ignore_errors=True)


def import_trouble(environment: Environment, distribution: Distribution) -> str:
    """Return why an engine cannot be imported in its environment; empty if it can."""
    try:
        worker_of(environment).ask("check", module=distribution.module)
    except (EngineCrashed, EngineTimeout) as failure:
        return str(failure.outcome)
    return ""


def remove(requirement: str) -> tuple[Environment, ...]:
    """Remove the environment of `NAME==VERSION`, or of `NAME` all; return what they were.

    Raises
    ------
    BadInput
        The requirement cannot be read.
    MissingEnvironment
        There is no such environment.
    """
    engine, version = split_requirement(requirement)
    found = list_environments(engine) if not version else ()
    found = found or (find_environment(engine, version),)
    for environment in found:
        worker_of(environment).close()
        drop(environment.folder)
    return found


def drop(folder: Path) -> None:
    """Remove a folder at once: under another name first, so that nothing half removed is ever used."""
    away = Path(tempfile.mkdtemp(prefix=f"removed-{os.getpid()}-", dir=temporary_folder()))
    folder.rename(away / folder.name)
    shutil.rmtree(away, ignore_errors=True)


def clear_temporary() -> list[str]:
    """Remove what processes have left in the temporary folder that are no more; return their names."""
    left = [path for path in sorted(temporary_folder().iterdir()) if not _alive(path.name)]
    for path in left:
        shutil.rmtree(path, ignore_errors=True)
    return [path.name for path in left]


def _alive(name: str) -> bool:
    """Return whether the process is there whose number a name has before its last part."""
    number = name.removesuffix("-old").rpartition("-")[0].rpartition("-")[2]
    if not number.isdigit() or platform.system() == "Windows":
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
