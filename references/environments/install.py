"""Create and remove environments of releases and of builds. A new environment gets its name only when it is complete."""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput, nearest
from conservative.files import remove as remove_tree
from conservative.files import remove_leftovers, temporary
from conservative.programs import Program
from conservative.registry import read_name

from ..worker.client import EngineCrashed, EngineTimeout
from .environment import (
    BUILD,
    KINDS,
    Environment,
    MissingEnvironment,
    close_environment,
    distribution_of,
    find_environment,
    list_environments,
    read_environment,
    worker_of,
)
from .folders import folder_of_all, folder_of_projects, temporary_folder
from .kind import Distribution, EnvironmentKind, Lock, Source, version_key
from .pip import normal_name, resolve_wheel
from .programs import find_program, register
from .uv_command import UvFailed, run_uv

_EPOCH = "315532800"
"""Date of files in a wheel, s: 1980, the first date in zip files. The same sources then give the same wheel."""


@dataclass(frozen=True)
class Installation:
    """An environment, whether it is new, and why its engine cannot be imported (empty if it can)."""

    environment: Environment
    new: bool
    trouble: str


def install(requirement: str, source: Source | None = None, force: bool = False) -> Installation:
    """Return the environment of an engine, named with or without a version, created if it does not exist.

    With `force` an existing environment is created again with the same packages, from its lock. The old one is replaced when
    the new one is complete. Raise `BadInput` if the engine or the version is unknown, has no wheel for a Python on this
    machine, or is not available here and now.
    """
    source = source or Source()
    engine, version, _ = read_name(requirement, "engine", settings=False)
    distribution = distribution_of(engine)
    clear_leftovers()
    try:
        old = find_environment(engine, version) if force else None
    except MissingEnvironment:
        old = None
    kind = KINDS[distribution.kind]
    lock = kind.read_lock(old.folder, old.version, old.runtime) if old else kind.resolve(distribution, version, source)
    return _install(engine, distribution, lock, source, force)


def install_build(engine: str, path: Path, source: Source) -> Installation:
    """Return the environment of a build, a wheel or a folder of sources, created if it does not exist.

    Its version is the version of the wheel with the beginning of its hash, such as 4.0.1+build.1a2b3c4d, so that a build is
    never mistaken for a release or for another build. Raise `BadInput` if the path is neither a wheel of the engine nor a
    folder of sources, must not be built, or cannot be installed. It names `--against`, the option of `conservative track`.
    """
    if path.suffix == ".whl" and path.is_file():
        distribution = distribution_of(engine)
        name, _, rest = path.name.partition("-")
        package = normal_name(distribution.package)
        if normal_name(name) != package or not re.fullmatch(r"[0-9][^-]*(-[^-]+){3,4}\.whl", rest):
            raise BadInput("against", repr(path.name), f"a wheel of {package}")
        version = rest.partition("-")[0].lower()
        # A version has one plus sign at most.
        version += f"{'.' if '+' in version else '+'}{BUILD}{hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
        if existing := read_environment(folder_of_all() / engine / version):  # needs no network
            return Installation(existing, False, import_trouble(existing, distribution))
        return _install(engine, distribution, resolve_wheel(distribution, path.resolve(), version, source), source)
    if not any((path / name).is_file() for name in ("pyproject.toml", "setup.py")):
        raise BadInput("against", repr(str(path)), "a wheel, or a folder with pyproject.toml or setup.py")
    if not source.allow_build:
        raise BadInput("against", f"{str(path)!r}, which has to be built", "a wheel, or --allow-build, which runs its code")
    with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"build-{os.getpid()}-") as folder:
        return install_build(engine, build_wheel(path, Path(folder), source), source)


def build_wheel(path: Path, folder: Path, source: Source, **variables: str) -> Path:
    """Build a folder of sources into a wheel in another folder, with additional environment variables. Raise `BadInput`."""
    options = ("--quiet", "--wheel", "--out-dir", folder)
    try:
        run_uv("build", *options, *source.options, path.resolve(), SOURCE_DATE_EPOCH=_EPOCH, **variables)
    except UvFailed as failure:
        raise BadInput("against", repr(str(path)), f"a folder that uv can build ({failure.summary})") from None
    return next(folder.glob("*.whl"))


def newest_releases(engine: str, count: int, source: Source) -> tuple[str, ...]:
    """Return the newest versions with wheels that the engine's file supports, oldest first.

    Raise `BadInput` for `--last` of `conservative track` if the engine is unknown, or the source does not list its versions.
    """
    distribution = distribution_of(engine)
    versions = KINDS[distribution.kind].list_versions(distribution.package, source)
    if not versions:
        got = f"no list of versions of {distribution.package} from the package index"
        raise BadInput("last", got, "a network, --find-links FOLDER, or versions that are installed")
    supported = [release for release in versions if version_key(release) >= version_key(distribution.oldest)]
    return tuple(sorted(supported, key=version_key)[-count:])


def install_releases(
    engine: str, versions: Iterable[str], source: Source, report: Callable[[str], None]
) -> tuple[Environment, ...]:
    """Return the environments of versions, in this order. `report` gets a line before each installation. Raise as `install`."""
    wanted = [(f"{engine}@{version}", version) for version in versions]
    for name, _ in wanted:
        check(name)  # all of them, before the first takes minutes
    environments = []
    for name, version in wanted:
        try:
            environments.append(find_environment(engine, version))
        except MissingEnvironment:
            report(f"installing {name}")
            environments.append(install(name, source).environment)
    return tuple(environments)


def check(requirement: str) -> None:
    """Raise `BadInput` if a requirement cannot be read or its engine is unknown."""
    distribution_of(read_name(requirement, "engine", settings=False).base)


def _install(engine: str, distribution: Distribution, lock: Lock, source: Source, force: bool = False) -> Installation:
    folder = folder_of_all() / engine / lock.version
    existing = None if force else read_environment(folder)
    environment = existing or make(engine, lock, folder, source, KINDS[distribution.kind])
    return Installation(environment, existing is None, import_trouble(environment, distribution))


def make(engine: str, lock: Lock, folder: Path, source: Source, kind: EnvironmentKind = KINDS["python"]) -> Environment:
    """Create an environment, in place of an old one if there is one, and return it.

    Raise `BadInput` if a package is missing or the disk is full.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with temporary(folder, Path.mkdir) as scratch:
            (scratch / kind.lock_file).write_text(lock.text, encoding="utf-8")
            runtime, packages = kind.fill(scratch, lock, source)
            Environment(engine, lock.version, scratch, runtime, packages, kind).write()
            close_environment(folder)
            with _removed(folder) if folder.exists() else nullcontext():
                try:
                    scratch.rename(folder)
                except OSError:  # another process was faster
                    if read_environment(folder) is None:
                        raise
    except UvFailed as failure:
        raise BadInput("engine", f"{engine}@{lock.version}", f"a package that uv can install ({failure.summary})") from None
    except OSError as error:
        raise BadInput("engines", f"{folder}: {error.strerror}", "a cache folder that can be written, with room") from None
    environment = read_environment(folder)
    assert environment is not None
    return environment


def import_trouble(environment: Environment, distribution: Distribution) -> str:
    """Return why an engine cannot be imported in its environment; empty if it can."""
    try:
        worker_of(environment).ask("check", module=distribution.module)
    except (EngineCrashed, EngineTimeout) as failure:
        return str(failure.outcome)
    return ""


def remove(requirement: str) -> tuple[Environment | Program, ...]:
    """Remove the environment of a version, all environments of a name, or a program, and return them.

    Raise `BadInput` if there is none.
    """
    engine, version, _ = read_name(requirement, "engine", settings=False)
    if program := find_program(requirement):
        return (register(program, undo=True),)
    installed = {environment.name: environment for environment in list_environments()}
    chosen = tuple(
        environment
        for environment in installed.values()
        if environment.engine == engine and version in ("", environment.version)
    )
    if not chosen:
        near = f"an installed engine: {nearest(requirement, installed)}"
        raise BadInput("engine", repr(requirement), near if installed else "an installed engine (none is installed)")
    for environment in chosen:
        close_environment(environment.folder)
        drop(environment.folder)
    return chosen


def drop(folder: Path) -> None:
    """Remove a folder. It is renamed first, so that a partly removed environment is never used."""
    with _removed(folder):
        pass


@contextmanager
def _removed(folder: Path) -> Iterator[None]:
    """Rename a folder, and remove it at the end of the block; it gets its name back if the block raises."""
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
    """Remove the files of processes that were ended."""
    for path in (*folder_of_all().glob("*/.*-*"), *folder_of_projects().glob("*/.*-*")):
        remove_leftovers(path.with_name(path.name[1:].rpartition("-")[0]))
    for path in temporary_folder().iterdir():
        if not _is_alive(path.name):
            remove_tree(path)


def _is_alive(name: str) -> bool:
    """Return whether the process exists whose number is in a name such as `work-123-abc`."""
    import psutil

    number = name.split("-")[1] if name.count("-") >= 2 else ""
    with suppress(OSError):
        return number.isdecimal() and psutil.pid_exists(int(number))
    return True
