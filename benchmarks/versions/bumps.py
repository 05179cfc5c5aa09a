"""The versions of a package in the lock and requirements files of two commits."""

from __future__ import annotations

import re
from fnmatch import fnmatch
from pathlib import Path, PurePosixPath

from conservative.errors import BadInput

from ..measures.origin import git

FILES = (
    *("requirements*.txt", "requirements*.in", "constraints*.txt", "pyproject.toml", "environment*.y*ml"),
    *("*.lock", "package-lock.json", "package.json"),
)
"""Names of files that can hold a version."""


def find_bump(package: str, ref: str, folder: Path) -> tuple[str, str] | None:
    """Return the versions of a package at a ref and in a folder of a git repository; None if no file has two different ones.

    Raises `BadInput` if there is no such ref.
    """
    if not git(folder, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{ref}^{{commit}}"):
        raise BadInput("bump", repr(ref), "a git ref of the repository that this folder is in")
    for name in git(folder, "ls-files").splitlines():
        if any(fnmatch(PurePosixPath(name).name, pattern) for pattern in FILES) and (folder / name).is_file():
            was = find_version(git(folder, "show", f"{ref}:./{name}"), package)
            now = find_version((folder / name).read_text(encoding="utf-8", errors="replace"), package)
            if was and now and was != now:
                return was, now
    return None


def find_version(text: str, package: str) -> str:
    """Return the version that a lock or requirements file names for a package, "" for none.

    A range such as `>=3.2` does not count: it does not say which version is installed.
    """
    name = "[-_.]+".join(map(re.escape, re.split(r"[-_.]+", package.partition("[")[0])))
    forms = (
        rf"""(?:^|[\s"'])-?\s*{name}(?:\[[^\]]*\])?\s*={{1,3}}\s*v?(\d[\w.!+]*)""",  # requirements, environments, pyproject
        rf"""^name\s*=\s*"{name}"\s+version\s*=\s*"([^"]+)\"""",  # uv, poetry, pdm
        rf'"(?:node_modules/)?{name}":\s*{{\s*"version":\s*"([^"]+)"',  # package-lock.json
        rf'"{name}":\s*"v?(\d[\w.+-]*)"',  # package.json
    )
    matches = (re.search(form, text, re.MULTILINE | re.IGNORECASE) for form in forms)
    return next((match[1] for match in matches if match), "")
