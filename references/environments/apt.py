"""Environments of engines in C++ whose libraries are packages of the system."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from conservative.errors import BadInput

from ..worker import program
from .kind import Distribution, EnvironmentKind, Lock, Source


@dataclass(frozen=True)
class Apt(EnvironmentKind):
    """A folder with a compiled program. The only version of an engine is the system's."""

    name, lock_file, suffix = "apt", "lock.txt", ".cpp"

    def resolve(self, distribution: Distribution, version: str, source: Source) -> Lock:
        package = distribution.package
        advice = f"the packages of the system. Run: apt install {package} nlohmann-json3-dev g++ pkg-config"
        if missing := [tool for tool in ("g++", "pkg-config") if not shutil.which(tool)]:
            raise BadInput("engine", f"{package}, but no {' and no '.join(missing)} on this machine", advice)
        modules = (distribution.module, "nlohmann_json")
        own, *others = (_run_tool("pkg-config", "--modversion", module, advice=advice) for module in modules)
        if version not in ("", own):
            raise BadInput("version", repr(f"{package}=={version}"), f"{own}, the version of the system")
        return Lock(own, "".join(f"{module}=={release}\n" for module, release in zip(modules, [own, *others], strict=True)))

    def fill(self, folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
        self.command(folder)
        return f"g++ {_run_tool('g++', '-dumpfullversion')}", tuple(lock.text.splitlines())

    def command(self, folder: Path) -> tuple[str | Path, ...]:
        """Return the program, compiled again if its sources have changed. Raise `BadInput` if that fails."""
        adapter = Path(__file__).parents[1] / "engines" / f"{folder.parent.name}{self.suffix}"
        sources = adapter, Path(program.__file__).with_suffix(".hpp")
        key = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]
        done = folder / f"program-{key}"
        if not done.is_file():
            new, lock = done.with_suffix(f".{os.getpid()}"), (folder / self.lock_file).read_text(encoding="utf-8")
            libraries = _run_tool("pkg-config", "--cflags", "--libs", *re.findall(r"^[^=]+", lock, re.MULTILINE)).split()
            _run_tool("g++", "-O2", adapter, "-o", new, *libraries, "-std=c++17")
            new.replace(done)
        return (done,)


def _run_tool(*command: str | Path, advice: str = "packages as in `conservative engines install`, which checks them") -> str:
    """Return the output of a command. Raise `BadInput` if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BadInput("engine", f"{command[0]}, which failed ({' '.join(done.stderr.split())[:300]})", advice)
    return done.stdout.strip()
