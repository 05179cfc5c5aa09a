"""Environments of several releases of an engine, and of builds that are no release: of a wheel, or of a folder of sources."""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from conservative.errors import BadInput

from .environment import (
    BUILD,
    Environment,
    MissingEnvironment,
    distribution_of,
    find_environment,
    folder_of_all,
    read_environment,
    temporary_folder,
    version_key,
)
from .install import Installation, check, import_trouble, install, make
from .lock import Source, list_versions, normal_name, resolve_wheel
from .uv_command import UvFailed, run_uv

_ALLOWED = "a wheel, or a folder with pyproject.toml or setup.py"
_EPOCH = "315532800"  # 1980, the first time that a zip file knows: the same sources give the same wheel


def install_build(engine: str, path: Path, source: Source) -> Installation:
    """Return the environment of a build of an engine, made where it is not there.

    Its version is that of the wheel with the beginning of its hash, such as 4.0.1+build.1a2b3c4d, so that no build is taken
    for a release or for another build.

    Raises
    ------
    BadInput
        It is neither a wheel nor a folder of sources, is another package, may not be built, or cannot be installed.
    """
    if path.suffix == ".whl" and path.is_file():
        return _install_wheel(engine, path, source)
    if not any((path / name).is_file() for name in ("pyproject.toml", "setup.py")):
        raise BadInput("against", repr(str(path)), _ALLOWED)
    if not source.allow_build:
        raise BadInput("against", f"{str(path)!r}, which has to be built", "a wheel, or --allow-build, which runs its code")
    with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"build-{os.getpid()}-") as folder:
        return _install_wheel(engine, build_wheel(path, Path(folder), source), source)


def _install_wheel(engine: str, wheel: Path, source: Source) -> Installation:
    distribution = distribution_of(engine)
    version = _version_of(wheel, normal_name(distribution.package))
    folder = folder_of_all() / engine / version
    there = read_environment(folder)
    environment = there or make(engine, resolve_wheel(distribution, wheel.resolve(), version, source), folder, source)
    return Installation(environment, there is None, import_trouble(environment, distribution))


def _version_of(wheel: Path, package: str) -> str:
    """Return the version that a wheel gets here. Raises `BadInput` where it is no wheel of the package."""
    name, _, rest = wheel.name.partition("-")
    if normal_name(name) != package or not re.fullmatch(r"[0-9][^-]*(-[^-]+){3,4}\.whl", rest):
        raise BadInput("against", repr(wheel.name), f"a wheel of {package}")
    version = rest.partition("-")[0].lower()
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()[:8]
    return f"{version}{'.' if '+' in version else '+'}{BUILD}{digest}"


def build_wheel(path: Path, folder: Path, source: Source, **variables: str) -> Path:
    """Return the wheel that a folder of sources builds, with variables beside ours; it is put into another folder.

    Raises
    ------
    BadInput
        It does not build.
    """
    options = ("--quiet", "--wheel", "--out-dir", folder)
    try:
        run_uv("build", *options, *source.options, path.resolve(), SOURCE_DATE_EPOCH=_EPOCH, **variables)
    except UvFailed as failure:
        raise BadInput("against", repr(str(path)), f"a folder that uv can build ({failure.summary})") from None
    return next(folder.glob("*.whl"))


def newest_releases(engine: str, count: int, source: Source) -> tuple[str, ...]:
    """Return the newest versions of an engine that there are wheels for and that its adapter is meant for, oldest first.

    Raises
    ------
    BadInput
        The engine is unknown, or where packages come from does not say which versions there are.
    """
    distribution = distribution_of(engine)
    known = list_versions(distribution.package, source)
    if not known:
        got = f"no list of versions of {distribution.package} from where packages come from"
        raise BadInput("last", got, "a network, --find-links FOLDER, or versions that are installed")
    meant = [each for each in known if version_key(each) >= version_key(distribution.oldest)]
    return tuple(sorted(meant, key=version_key)[-count:])


def install_releases(
    engine: str, versions: Iterable[str], source: Source, tell: Callable[[str], None]
) -> tuple[Environment, ...]:
    """Return the environment of each version, in this order; what is not there is installed, and `tell` is told before.

    Raises
    ------
    BadInput
        The engine or a version is unknown, or cannot be had here and now.
    """
    names = [f"{engine}=={version}" for version in versions]
    for name in names:
        check(name)  # all of them, before the first takes minutes
    return tuple(_find_or_install(name, source, tell) for name in names)


def _find_or_install(name: str, source: Source, tell: Callable[[str], None]) -> Environment:
    engine, _, version = name.partition("==")
    try:
        return find_environment(engine, version)
    except MissingEnvironment:
        tell(f"installing {name}")
        return install(name, source).environment
