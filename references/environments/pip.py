"""Environments of packages of Python: virtual environments that uv makes from a lock in the standard format, `pylock.toml`."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from conservative.errors import BadInput

from ..worker import program
from .kind import Distribution, EnvironmentKind, Lock, Source, version_key
from .uv_command import UvFailed, run_uv

_PYTHONS = ("3.14", "3.13", "3.12", "3.11", "3.10", "3.9")
"""Versions of Python that the worker supports, newest first."""
_COMPILE = ("pip", "compile", "--quiet", "--no-header", "--format", "pylock.toml", "--generate-hashes")


@dataclass(frozen=True)
class Pip(EnvironmentKind):
    """A virtual environment."""

    name, lock_file, suffix = "python", "pylock.toml", ".py"

    def resolve(self, distribution: Distribution, version: str, source: Source) -> Lock:
        """Return the lock of a version of an engine, by default the newest, with NumPy and its other requirements.

        The first Python on this machine for which there are wheels is used, starting with the running one. Raise `BadInput` if
        there is no such version, no wheel of it for a Python on this machine, or no network.
        """
        package = distribution.package
        pin = f"=={version}" if version else f">={distribution.oldest}" if distribution.oldest else ""
        python, text = _compile(distribution, package + pin, version, source)
        return Lock(versions_in(text)[normal_name(package)], text, python)

    def fill(self, folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
        python = interpreter_of(folder)
        run_uv("venv", "--quiet", "--relocatable", "--allow-existing", "--python", lock.python, folder)
        options = ("--quiet", "--require-hashes", "--python", python)
        lines = "" if source.find_links is None else requirements_in(lock.text)
        run_uv("pip", "sync", *options, *source.options, "-" if lines else folder / self.lock_file, stdin=lines)
        packages = tuple(run_uv("pip", "freeze", "--quiet", "--python", python).splitlines())
        ask = [str(python), "-I", "-c", "import platform; print('Python', platform.python_version())"]
        return subprocess.run(ask, capture_output=True, text=True, check=True, timeout=60).stdout.strip(), packages

    def list_versions(self, package: str, source: Source) -> list[str]:
        if source.find_links is not None:
            names = (path.name.split("-") for path in source.find_links.glob("*.whl"))
            versions = {parts[1] for parts in names if normal_name(parts[0]) == normal_name(package)}
            return sorted(versions, key=version_key, reverse=True)
        options = () if source.allow_build else ("--only-binary=:all:",)
        try:
            listing = run_uv("tool", "run", "--quiet", "pip", "index", "versions", package, *options)
        except UvFailed:
            return []
        line = re.search(r"Available versions: (.+)", listing)
        return line[1].split(", ") if line else []

    def read_lock(self, folder: Path, version: str, runtime: str) -> Lock:
        return replace(super().read_lock(folder, version, runtime), python=_find_python(runtime.partition(" ")[2]))

    def command(self, folder: Path) -> tuple[str | Path, ...]:
        return interpreter_of(folder), "-I", program.__file__


def interpreter_of(folder: Path) -> Path:
    """Return the Python of a virtual environment."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def versions_in(lock: str) -> dict[str, str]:
    """Return the versions of all packages in the text of a lock, by their normal names."""
    return {package["name"]: package.get("version", "") for package in tomllib.loads(lock)["packages"]}


def requirements_in(lock: str) -> str:
    """Return the packages of a lock with their hashes as requirements, which a folder of wheels can satisfy without a network.

    A lock has the addresses from which its packages came. Empty if one of them has no version or no hash, or is a file of its
    own, such as a build, which no folder of wheels has.
    """
    lines = []
    for package in tomllib.loads(lock)["packages"]:
        files = [*package.get("wheels", ()), *([package["sdist"]] if "sdist" in package else ())]
        hashes = sorted({f"--hash={kind}:{value}" for file in files for kind, value in file.get("hashes", {}).items()})
        if not hashes or "version" not in package:
            return ""
        marker = f" ; {package['marker']}" if "marker" in package else ""
        lines.append(f"{package['name']}=={package['version']}{marker} {' '.join(hashes)}\n")
    return "".join(lines)


def resolve_wheel(distribution: Distribution, wheel: Path, version: str, source: Source) -> Lock:
    """Return the lock of a wheel of an engine, under a version of our own. Raise as `Pip.resolve`."""
    python, text = _compile(distribution, f"{distribution.package} @ {wheel.as_uri()}", version, source)
    return Lock(version, text, python)


def _compile(distribution: Distribution, requirement: str, version: str, source: Source) -> tuple[str, str]:
    """Return the path of the first Python for which there are wheels, and the text of the lock."""
    package, requirements = distribution.package, "\n".join([requirement, "numpy", *distribution.requirements])
    name, tried = f"{package}=={version}" if version else package, []
    for python, path in _pythons():
        tried.append(python)
        try:
            return path, run_uv(*_COMPILE, *source.options, "--python", path, "-", stdin=requirements)
        except UvFailed as failure:
            if not failure.no_wheel:
                raise _as_bad_input(package, name, version, failure, source) from None
    others = []
    for python in sorted(set(_PYTHONS).difference(tried)):
        with suppress(UvFailed):
            run_uv(*_COMPILE, *source.options, "--python-version", python, "-", stdin=requirements)
            others.append(python)
    needs = f"Python {' or '.join(others)} on this machine" if others else "another version, or --allow-build"
    raise BadInput("version", f"{name!r}, which has no wheel for Python {' or '.join(tried)}", needs)


def _as_bad_input(package: str, name: str, version: str, failure: UvFailed, source: Source) -> BadInput:
    if failure.says("there is no version of", "there are no versions of"):
        newest = sorted(Pip().list_versions(package, source), key=version_key, reverse=True)
        if not newest:
            return BadInput("version", repr(name), "a version that exists")
        nearest = next((release for release in newest if version_key(release) <= version_key(version)), newest[-1])
        return BadInput("version", repr(name), f"{nearest} (nearest), or one of {', '.join(newest)}")
    if failure.says("Failed to fetch", "error sending request", "network was disabled"):
        return BadInput("engines", f"no answer for {name!r} from the package index", "a network, or --find-links FOLDER")
    if failure.says("was not found in"):
        place = "the package index" if source.find_links is None else str(source.find_links)
        return BadInput("engine", repr(name), f"a package that {place} has")
    return BadInput("engine", repr(name), f"a package that uv can install ({failure.summary})")


def normal_name(package: str) -> str:
    """Return the name of a package in the form that indexes compare, without extras."""
    return re.sub(r"[-_.]+", "-", package.partition("[")[0]).lower()


def _find_python(version: str) -> str:
    """Return the path of a Python with the major and minor number of a version, by default of the running Python."""
    return dict(_pythons()).get(".".join(version.split(".")[:2]), sys.executable)


def _pythons() -> Iterator[tuple[str, str]]:
    """Yield version and path of the running Python, then of others on this machine, newest first."""
    ours = f"{sys.version_info.major}.{sys.version_info.minor}"
    yield ours, sys.executable
    # uv finds Pythons on the path. It does not follow the shims of pyenv, so the folders of pyenv are added.
    path = [folder for folder in os.environ.get("PATH", "").split(os.pathsep) if Path(folder).name != "shims"]
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    path += [str(folder) for folder in sorted(root.glob("versions/*/bin"))]
    try:
        listing = json.loads(
            run_uv("python", "list", "--only-installed", "--output-format", "json", PATH=os.pathsep.join(path))
        )
    except (UvFailed, ValueError):
        return
    installed = [entry for entry in listing if entry.get("path") and entry.get("implementation") == "cpython"]
    others = {".".join(entry["version"].split(".")[:2]): entry["path"] for entry in installed}
    yield from ((python, others[python]) for python in _PYTHONS if python in others and python != ours)
