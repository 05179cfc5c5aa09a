"""Make and remove environments. One that is being made lies elsewhere, and gets its name when it is whole."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput, nearest
from conservative.files import remove as remove_tree
from conservative.files import remove_leftovers, temporary

from ..worker.client import EngineCrashed, EngineTimeout
from .environment import (
    LOCK,
    Distribution,
    Environment,
    MissingEnvironment,
    close_environment,
    distribution_of,
    find_environment,
    folder_of_all,
    folder_of_projects,
    interpreter_of,
    list_environments,
    read_environment,
    temporary_folder,
    worker_of,
)
from .lock import Lock, Source, find_python, resolve, split_requirement
from .uv_command import UvFailed, run_uv


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


def install(requirement: str, source: Source | None = None, force: bool = False) -> Installation:
    """Return the environment of `NAME` or `NAME==VERSION`, made if it is not there.

    With `force` an environment that is there is made again with the same packages, from its lock. It is replaced when the new
    one is complete.

    Raises
    ------
    BadInput
        The engine or the version is unknown, has no wheel for a Python of this machine, or cannot be had here and now.
    """
    source = source or Source()
    engine, version = split_requirement(requirement)
    distribution = distribution_of(engine)
    clear_leftovers()
    try:
        there = find_environment(engine, version) if force else None
    except MissingEnvironment:
        there = None
    if there is not None:
        lock = Lock(there.version, find_python(there.python), (there.folder / LOCK).read_text(encoding="utf-8"))
    else:
        lock = resolve(distribution, version, source)
    folder = folder_of_all() / engine / lock.version
    found = None if force else read_environment(folder)
    environment = found or make(engine, lock, folder, source)
    return Installation(environment, found is None, import_trouble(environment, distribution))


def check(requirement: str) -> None:
    """Check that a requirement can be read and its engine is known. Raise `BadInput` if not."""
    distribution_of(split_requirement(requirement)[0])


def make(engine: str, lock: Lock, folder: Path, source: Source) -> Environment:
    """Return a new environment in a folder, in place of what is there.

    Raises
    ------
    BadInput
        A package cannot be had, or there is no room on the disk.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with temporary(folder, _make_folder) as (scratch, _):
            _fill(scratch, lock, source)
            packages = tuple(run_uv("pip", "freeze", "--quiet", "--python", interpreter_of(scratch)).splitlines())
            Environment(engine, lock.version, scratch, _python_of(scratch), packages).write()
            _replace(folder, scratch)
    except UvFailed as failure:
        raise BadInput("engine", f"{engine}=={lock.version}", f"a package that uv can install ({failure.summary})") from None
    except OSError as error:
        raise BadInput("engines", f"{folder}: {error.strerror}", "a cache folder that can be written, with room") from None
    found = read_environment(folder)
    assert found is not None
    return found


def _make_folder(path: Path) -> int:
    path.mkdir()
    return os.open(path, os.O_RDONLY)


def _fill(folder: Path, lock: Lock, source: Source) -> None:
    (folder / LOCK).write_text(lock.text, encoding="utf-8")
    run_uv("venv", "--quiet", "--relocatable", "--allow-existing", "--python", lock.python, folder)
    options = ("--quiet", "--require-hashes", "--python", interpreter_of(folder))
    run_uv("pip", "sync", *options, *source.options, folder / LOCK)


def _python_of(folder: Path) -> str:
    ask = [str(interpreter_of(folder)), "-I", "-c", "import platform; print(platform.python_version())"]
    return subprocess.run(ask, capture_output=True, text=True, check=True, timeout=60).stdout.strip()


def _replace(folder: Path, scratch: Path) -> None:
    """Give a folder its name; what has that name goes."""
    close_environment(folder)
    with _removed(folder) if folder.exists() else nullcontext():
        try:
            scratch.rename(folder)
        except OSError:  # another process was faster
            if read_environment(folder) is None:
                raise


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
        The requirement cannot be read, or there is no such environment.
    """
    engine, version = split_requirement(requirement)
    there = {f"{each.engine}=={each.version}": each for each in list_environments()}
    found = tuple(each for each in there.values() if each.engine == engine and version in ("", each.version))
    if not found:
        raise BadInput(
            "engine",
            repr(requirement),
            f"an installed engine: {nearest(requirement, there)}" if there else "an installed engine (none is installed)",
        )
    for environment in found:
        close_environment(environment.folder)
        drop(environment.folder)
    return found


def drop(folder: Path) -> None:
    """Remove a folder: under another name first, so that nothing half removed is ever used."""
    with _removed(folder):
        pass


@contextmanager
def _removed(folder: Path) -> Iterator[None]:
    """Rename a folder away, and remove it at the end of the block; it gets its name back if the block raises."""
    away = Path(tempfile.mkdtemp(prefix=f"removed-{os.getpid()}-", dir=temporary_folder()))
    folder.rename(away / folder.name)
    try:
        yield
    except BaseException:
        (away / folder.name).rename(folder)
        raise
    finally:
        remove_tree(away)


def clear_leftovers() -> None:
    """Remove what processes have left that were ended in the middle."""
    for path in (*folder_of_all().glob("*/.*-*"), *folder_of_projects().glob("*/.*-*")):
        remove_leftovers(path.with_name(path.name[1:].rpartition("-")[0]))
    for path in temporary_folder().iterdir():
        if not _alive(path.name):
            remove_tree(path)


def _alive(name: str) -> bool:
    """Return whether the process is there whose number a name such as `work-123-abc` has."""
    number = name.split("-")[1] if name.count("-") >= 2 else ""
    try:
        os.kill(int(number), 0)
    except (ProcessLookupError, ValueError):
        return False
    except PermissionError:  # somebody else's process
        return True
    return True
