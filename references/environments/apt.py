"""Environments of engines in C++ whose libraries are packages of the system: what `lock` is for Python."""

from __future__ import annotations

import shutil
from pathlib import Path

from conservative.errors import BadInput

from .environment import Distribution, build, run_tool
from .lock import Lock, Source


def resolve(distribution: Distribution, version: str, source: Source) -> Lock:
    """Return the lock of an engine, whose only version is the system's. Raise `BadInput` as `lock.resolve`."""
    package = distribution.package
    advice = f"the packages of the system. Run: apt install {package} nlohmann-json3-dev g++ pkg-config"
    if missing := [tool for tool in ("g++", "pkg-config") if not shutil.which(tool)]:
        raise BadInput("engine", f"{package}, but no {' and no '.join(missing)} on this machine", advice)
    modules = (distribution.module, "nlohmann_json")
    own, *others = (run_tool("pkg-config", "--modversion", module, advice=advice) for module in modules)
    if version not in ("", own):
        raise BadInput("version", repr(f"{package}=={version}"), f"{own}, the version of the system")
    return Lock(own, "", "".join(f"{module}=={each}\n" for module, each in zip(modules, [own, *others], strict=True)))


def fill(folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
    """Compile the program. Return the runtime of the engine, such as `g++ 12.2.0`, and the packages."""
    build(folder)
    return f"g++ {run_tool('g++', '-dumpfullversion')}", tuple(lock.text.splitlines())


def list_versions(package: str, source: Source) -> list[str]:
    """Return no versions, because a system has one."""
    return []
