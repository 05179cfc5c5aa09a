"""Environments of packages of JavaScript, made by npm.

npm uses its own configuration, and runs no scripts of packages. A lock names no registry, so that it can be used with any.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conservative.errors import BadInput

from ..worker import program
from .folders import folder_of_all, temporary_folder
from .kind import Distribution, EnvironmentKind, Lock, Source, version_key

NODE = "Node 20 or later with npm, from https://nodejs.org or the system's packages"


@dataclass(frozen=True)
class Npm(EnvironmentKind):
    """A folder of `node_modules`."""

    name, lock_file, suffix = "npm", "package-lock.json", ".mjs"

    def resolve(self, distribution: Distribution, version: str, source: Source) -> Lock:
        package, versions = distribution.package, self.list_versions(distribution.package, source)
        if version not in ("", *versions):
            raise BadInput("version", repr(f"{package}=={version}"), f"one of {', '.join(versions)}")
        with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"lock-{os.getpid()}-") as name:
            folder = Path(name)
            (folder / "package.json").write_text('{"name": "environment"}', encoding="utf-8")
            options = ("--package-lock-only", "--omit-lockfile-registry-resolved", "--save-exact")
            _run_npm(folder, "install", *options, f"{package}@{version or versions[0]}")
            return Lock(version or versions[0], (folder / self.lock_file).read_text(encoding="utf-8"))

    def fill(self, folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
        ask = [find_program("node"), "-p", "process.versions.node"]
        node = subprocess.run(ask, capture_output=True, text=True, check=True, timeout=60).stdout.strip()
        if version_key(node) < version_key("20"):
            raise BadInput("engine", f"an engine in JavaScript, but Node {node}", NODE)
        packages = json.loads(lock.text)["packages"]
        (folder / "package.json").write_text(json.dumps(packages.pop("")), encoding="utf-8")
        (folder / "find.mjs").write_text("export const find = (name) => import.meta.resolve(name);", encoding="utf-8")
        _run_npm(folder, "ci")
        names = (f"{place.rpartition('node_modules/')[2]}=={package['version']}" for place, package in packages.items())
        return f"Node {node}", tuple(sorted(names))

    def list_versions(self, package: str, source: Source) -> list[str]:
        """Return the releases of a package, newest first. Raise `BadInput` if npm's registry does not list them."""
        if source.find_links is not None:
            raise BadInput("find_links", repr(str(source.find_links)), f"nothing for {package}, which npm installs")
        listed = _run_npm(temporary_folder(), "view", package, "versions")
        releases = [release for release in ([listed] if isinstance(listed, str) else listed) if "-" not in release]
        return sorted(releases, key=version_key, reverse=True)

    def command(self, folder: Path) -> tuple[str | Path, ...]:
        return find_program("node"), Path(program.__file__).with_suffix(self.suffix), folder


def find_program(name: str) -> str:
    """Return the path of `node` or `npm`. Raise `BadInput` if it is not installed."""
    if path := shutil.which(name):
        return path
    raise BadInput("engine", f"an engine in JavaScript, but no {name} on this machine", NODE)


def _run_npm(folder: Path, *arguments: str) -> Any:
    """Return the output of a command of npm, which is JSON. Raise `BadInput` if it fails."""
    options = ("--json", "--ignore-scripts", "--no-audit", "--no-fund", "--no-update-notifier")
    variables = {"npm_config_cache": str(folder_of_all().parent / "npm"), **os.environ}
    command = [find_program("npm"), *arguments, *options]
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return json.loads(done.stdout)
    output = " ".join((done.stdout + done.stderr).split())  # npm hides passwords
    summary = re.search(r'"summary": "([^"]*)', output)
    got = f"npm {arguments[0]} {arguments[-1]}, which failed ({summary[1][:300] if summary else output[-300:]})"
    raise BadInput("engine", got, "a network, a package that npm can install, and a disk with room")
