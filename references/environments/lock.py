"""From a name and a version to a lock: every package, its version and hashes, and the Python that it is for."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput

from .environment import Distribution, describe_versions, version_key
from .uv_command import UvFailed, run_uv

_NAME = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?")
_VERSION = re.compile(r"[0-9]+(?:[.!+a-z0-9_-]*[a-z0-9])?")
_PYTHONS = ("3.14", "3.13", "3.12", "3.11", "3.10", "3.9")
"""Versions of Python that a worker runs in."""


@dataclass(frozen=True)
class Source:
    """Where packages come from.

    Attributes
    ----------
    find_links
        A folder of wheels to take everything from, without an index; None for the index.
    allow_build
        Whether code of a package may run where it has no wheel.
    """

    find_links: Path | None = None
    allow_build: bool = False

    @property
    def options(self) -> tuple[str, ...]:
        """Options of uv."""
        folder = () if self.find_links is None else ("--no-index", "--find-links", str(self.find_links))
        return (*folder, *(() if self.allow_build else ("--only-binary", ":all:")))


@dataclass(frozen=True)
class Lock:
    """What an environment is to have.

    Attributes
    ----------
    version
        That of the engine.
    python
        Path of the Python that it is for.
    text
        Requirements with hashes, as uv and pip read them.
    """

    version: str
    python: str
    text: str


def split_requirement(text: str) -> tuple[str, str]:
    """Return name and version out of NAME or NAME==VERSION; the version is empty where none is named.

    Raises
    ------
    BadInput
        It is neither.
    """
    name, equals, version = text.partition("==")
    if not _NAME.fullmatch(name) or bool(equals) != bool(_VERSION.fullmatch(version)):
        raise BadInput("engine", repr(text), "NAME or NAME==VERSION: letters, digits, '.', '_' and '-'")
    return name, version


def resolve(distribution: Distribution, version: str, source: Source) -> Lock:
    """Return the lock of a version of an engine, by default the newest, with NumPy and what else it needs.

    The first Python of the machine that there are wheels for is taken, ours before all others.

    Raises
    ------
    BadInput
        There is no such version, no wheel of it for a Python of this machine, or no network.
    """
    package = distribution.package
    pin = f"=={version}" if version else f">={distribution.oldest}" if distribution.oldest else ""
    wanted = "\n".join([package + pin, "numpy", *distribution.requirements])
    python, text = _compile(package, version, wanted, source)
    return _lock(package, python, text)


def resolve_wheel(distribution: Distribution, wheel: Path, version: str, source: Source) -> Lock:
    """Return the lock of a wheel of an engine, under a version that is not its own, with NumPy and what else it needs.

    Raises
    ------
    BadInput
        It is for no Python of this machine, what it needs cannot be had, or there is no network.
    """
    package = distribution.package
    wanted = "\n".join([f"{package} @ {wheel.as_uri()}", "numpy", *distribution.requirements])
    return Lock(version, *_compile(package, version, wanted, source))


def _compile(package: str, version: str, wanted: str, source: Source) -> tuple[str, str]:
    """Return the path of the first Python that there are wheels for, and all requirements with their hashes."""
    tried, failure = [], None
    for python, path in _pythons():
        tried.append(python)
        try:
            return path, run_uv(*_COMPILE, *source.options, "--python", path, "-", stdin=wanted)
        except UvFailed as error:
            failure = error
            if not error.no_wheel:
                break
    assert failure is not None
    if not failure.no_wheel:
        raise _as_bad_input(package, version, failure, source)
    raise _no_wheel(package, version, wanted, tried, source)


_COMPILE = ("pip", "compile", "--quiet", "--no-header", "--no-annotate", "--generate-hashes")


def _lock(package: str, python: str, text: str) -> Lock:
    pattern = rf"^{re.escape(normal_name(package))}==([^\s\\;]+)"
    found = re.search(pattern, text, re.MULTILINE)
    assert found is not None, text
    return Lock(found[1], python, text)


def normal_name(package: str) -> str:
    """Return the name of a package as indexes compare it, without extras."""
    return re.sub(r"[-_.]+", "-", package.partition("[")[0]).lower()


def find_python(version: str) -> str:
    """Return the path of a Python with the major and minor number of a version, such as 3.11.7; ours if there is none."""
    return dict(_pythons()).get(".".join(version.split(".")[:2]), sys.executable)


def _pythons() -> Iterator[tuple[str, str]]:
    """Yield version and path of this Python, then of others on the machine, newer ones first."""
    ours = f"{sys.version_info.major}.{sys.version_info.minor}"
    yield ours, sys.executable
    others = {".".join(entry["version"].split(".")[:2]): entry["path"] for entry in _installed()}
    yield from ((python, others[python]) for python in _PYTHONS if python in others and python != ours)


def _installed() -> list[dict[str, str]]:
    """Return what uv knows of Pythons on this machine, those of pyenv included, whose stand-ins on the path it cannot ask."""
    path = [folder for folder in os.environ.get("PATH", "").split(os.pathsep) if Path(folder).name != "shims"]
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    path += [str(folder) for folder in sorted(root.glob("versions/*/bin"))]
    try:
        listing = run_uv("python", "list", "--only-installed", "--output-format", "json", PATH=os.pathsep.join(path))
        return [entry for entry in json.loads(listing) if entry.get("path") and entry.get("implementation") == "cpython"]
    except (UvFailed, ValueError):
        return []


# --------------------------------------------------------------------------------------------------------- what can be wrong


def _as_bad_input(package: str, version: str, failure: UvFailed, source: Source) -> BadInput:
    wanted = f"{package}=={version}" if version else package
    if failure.says("there is no version of", "there are no versions of"):
        return BadInput("version", repr(wanted), describe_versions(version, list_versions(package, source)))
    if failure.says("Failed to fetch", "error sending request", "network was disabled"):
        return BadInput(
            "engines", f"no answer for {wanted!r} from where packages come from", "a network, or --find-links FOLDER"
        )
    if failure.says("was not found in"):
        place = "the package index" if source.find_links is None else str(source.find_links)
        return BadInput("engine", repr(wanted), f"a package that {place} has")
    return BadInput("engine", repr(wanted), f"a package that uv can install ({failure.summary})")


def _no_wheel(package: str, version: str, wanted: str, tried: list[str], source: Source) -> BadInput:
    """Return an error that says which Python has a wheel, if any has."""
    got = f"{package}=={version}" if version else package
    others = [python for python in _PYTHONS if python not in tried and _resolves(python, wanted, source)]
    needs = f"Python {' or '.join(sorted(others))} on this machine" if others else "another version, or --allow-build"
    return BadInput("version", f"{got!r}, which has no wheel for Python {' or '.join(tried)}", needs)


def _resolves(python: str, wanted: str, source: Source) -> bool:
    try:
        run_uv(*_COMPILE, *source.options, "--python-version", python, "-", stdin=wanted)
    except UvFailed:
        return False
    return True


def list_versions(package: str, source: Source) -> list[str]:
    """Return the versions of a package that have wheels, newest first; none where nobody can tell."""
    if source.find_links is not None:
        names = (path.name.split("-") for path in source.find_links.glob("*.whl"))
        found = {parts[1] for parts in names if normal_name(parts[0]) == normal_name(package)}
        return sorted(found, key=version_key, reverse=True)
    options = () if source.allow_build else ("--only-binary=:all:",)
    try:
        listing = run_uv("tool", "run", "--quiet", "pip", "index", "versions", package, *options)
    except UvFailed:
        return []
    line = re.search(r"Available versions: (.+)", listing)
    return line[1].split(", ") if line else []
