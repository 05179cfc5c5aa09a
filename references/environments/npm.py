"""Environments of packages of JavaScript, made by npm: what `lock` is for Python.

npm uses its own configuration, and its cache is next to the environments. It runs no scripts of packages. The lock contains
versions and hashes and names no registry, so that it can be used with any.
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
from .lock import Lock, Source, no_version

_OPTIONS = ("--json", "--ignore-scripts", "--no-audit", "--no-fund", "--no-update-notifier")


def resolve(distribution: Distribution, version: str, source: Source) -> Lock:
    """Return the lock of a version of an engine, by default the newest. Raise `BadInput` as `lock.resolve`."""
    package, known = distribution.package, list_versions(distribution.package, source)
    chosen = version or known[0]
    if chosen not in known:
        raise no_version(f"{package}=={version}", version, known)
    with tempfile.TemporaryDirectory(dir=temporary_folder(), prefix=f"lock-{os.getpid()}-") as folder:
        (Path(folder) / "package.json").write_text('{"name": "environment"}', encoding="utf-8")
        options = ("--package-lock-only", "--omit-lockfile-registry-resolved", "--save-exact")
        _run_npm("install", *options, f"{package}@{chosen}", folder=Path(folder))
        return Lock(chosen, "", (Path(folder) / "package-lock.json").read_text(encoding="utf-8"))


def fill(folder: Path, lock: Lock, source: Source) -> tuple[str, tuple[str, ...]]:
    """Install the packages of a lock in `node_modules`. Return the version of Node, and the packages."""
    node = subprocess.run(
        [find_node("node"), "--version"], capture_output=True, text=True, check=True, timeout=60
    ).stdout.strip()
    if version_key(node[1:]) < version_key("20"):
        raise BadInput("engine", f"an engine in JavaScript, and Node {node[1:]}", NODE)
    packages = json.loads(lock.text)["packages"]
    (folder / "package.json").write_text(json.dumps(packages.pop("")), encoding="utf-8")
    (folder / "package-lock.json").write_text(lock.text, encoding="utf-8")
    _run_npm("ci", folder=folder)
    names = (f"{place.rpartition('node_modules/')[2]}=={each['version']}" for place, each in packages.items())
    return f"Node {node[1:]}", tuple(sorted(names))


def list_versions(package: str, source: Source) -> list[str]:
    """Return the releases of a package, newest first. Raise `BadInput` if npm's registry does not list them."""
    if source.find_links is not None:
        raise BadInput("find_links", repr(str(source.find_links)), f"nothing for {package}, which npm installs")
    known = _run_npm("view", package, "versions", folder=temporary_folder())
    releases = [each for each in ([known] if isinstance(known, str) else known) if "-" not in each]
    return sorted(releases, key=version_key, reverse=True)


def _run_npm(*arguments: str, folder: Path) -> Any:
    """Return the output of a command of npm, which is JSON. Raise `BadInput` if it fails."""
    command = [find_node("npm"), *arguments, *_OPTIONS]
    variables = {"npm_config_cache": str(folder_of_all().parent / "npm"), **os.environ}
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return json.loads(done.stdout)
    # Without the password that an address may have.
    words = re.sub(r"(?<=://)[^/@\s]+@", "", " ".join((done.stdout + done.stderr).split()))
    code, summary = (re.search(rf'"{name}": "([^"]*)', words) for name in ("code", "summary"))
    got = f"npm {arguments[0]} {arguments[-1]}, which failed ({summary[1][:300] if summary else words[-300:]})"
    remedy = {"E404": "a package of npm's registry", "ENOSPC": "a cache folder with room, or `engines remove`"}
    raise BadInput("engine", got, remedy.get(code[1] if code else "", "a network, or a package that npm can install"))
