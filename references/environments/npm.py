"""Environments of packages of JavaScript, made by npm: what `lock` is for Python.

npm uses its own configuration, and runs no scripts of packages. A lock names no registry, so that it can be used with any.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from conservative.errors import BadInput

from .environment import NODE, Distribution, find_node, folder_of_all, temporary_folder, version_key
from .lock import Lock, Source


def resolve(distribution: Distribution, version: str, source: Source) -> Lock:
    """Return the lock of a version of an engine, by default the newest. Raise `BadInput` as `lock.resolve`."""
    package, known = distribution.package, list_versions(distribution.package, source)
    if version not in ("", *known):
        raise BadInput("version", repr(f"{package}=={version}"), f"one of {', '.join(known)}")
    with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"lock-{os.getpid()}-") as name:
        folder = Path(name)
        (folder / "package.json").write_text('{"name": "environment"}', encoding="utf-8")
        options = ("--package-lock-only", "--omit-lockfile-registry-resolved", "--save-exact")
        _run_npm(folder, "install", *options, f"{package}@{version or known[0]}")
        return Lock(version or known[0], "", (folder / "package-lock.json").read_text(encoding="utf-8"))


def fill(folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
    """Install the packages of a lock. Return the runtime of the engine, such as `Node 20.20.2`, and its packages."""
    ask = [find_node("node"), "-p", "process.versions.node"]
    node = subprocess.run(ask, capture_output=True, text=True, check=True, timeout=60).stdout.strip()
    if version_key(node) < version_key("20"):
        raise BadInput("engine", f"an engine in JavaScript, but Node {node}", NODE)
    packages = json.loads(lock.text)["packages"]
    (folder / "package.json").write_text(json.dumps(packages.pop("")), encoding="utf-8")
    (folder / "package-lock.json").write_text(lock.text, encoding="utf-8")
    (folder / "find.mjs").write_text("export const find = (name) => import.meta.resolve(name);", encoding="utf-8")
    _run_npm(folder, "ci")
    names = (f"{place.rpartition('node_modules/')[2]}=={each['version']}" for place, each in packages.items())
    return f"Node {node}", tuple(sorted(names))


def list_versions(package: str, source: Source) -> list[str]:
    """Return the releases of a package, newest first. Raise `BadInput` if npm's registry does not list them."""
    if source.find_links is not None:
        raise BadInput("find_links", repr(str(source.find_links)), f"nothing for {package}, which npm installs")
    known = _run_npm(temporary_folder(), "view", package, "versions")
    releases = [each for each in ([known] if isinstance(known, str) else known) if "-" not in each]
    return sorted(releases, key=version_key, reverse=True)


def _run_npm(folder: Path, *arguments: str) -> Any:
    """Return the output of a command of npm, which is JSON. Raise `BadInput` if it fails."""
    options = ("--json", "--ignore-scripts", "--no-audit", "--no-fund", "--no-update-notifier")
    variables = {"npm_config_cache": str(folder_of_all().parent / "npm"), **os.environ}
    command = [find_node("npm"), *arguments, *options]
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return json.loads(done.stdout)
    words = " ".join((done.stdout + done.stderr).split())  # npm hides passwords
    summary = re.search(r'"summary": "([^"]*)', words)
    got = f"npm {arguments[0]} {arguments[-1]}, which failed ({summary[1][:300] if summary else words[-300:]})"
    raise BadInput("engine", got, "a network, a package that npm can install, and a disk with room")
