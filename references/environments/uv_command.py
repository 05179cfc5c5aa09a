"""Run uv, which creates environments, and interpret its errors.

uv uses the indexes and folders of pip's configuration, unless uv is configured itself. It downloads no Python, and its cache is
next to the environments. Variables: https://docs.astral.sh/uv/reference/environment/
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from conservative.errors import BadInput, require_extra

from .folders import folder_of_all, temporary_folder

_FROM_PIP = {
    "index-url": "UV_DEFAULT_INDEX",
    "extra-index-url": "UV_INDEX",
    "find-links": "UV_FIND_LINKS",
    "cert": "SSL_CERT_FILE",
}
_OF_UV = ("UV_DEFAULT_INDEX", "UV_INDEX", "UV_INDEX_URL", "UV_EXTRA_INDEX_URL", "UV_FIND_LINKS", "UV_NO_INDEX")


class UvFailed(RuntimeError):
    """uv ended with an error. Attribute: `output`."""

    def __init__(self, output: str) -> None:
        self.output = re.sub(r"(?<=://)[^/@\s]+@", "", output)  # an index may have a password in its address
        super().__init__(self.summary)

    def says(self, *texts: str) -> bool:
        """Return True if the output contains one of the texts."""
        return any(text in self.output for text in texts)

    @property
    def no_wheel(self) -> bool:
        """True if the version exists, but has no wheel for this Python and system."""
        wheels = self.says("no wheels with a matching", "has no usable wheels", "have no usable wheels")
        return wheels or self.says("Requires-Python", "depends on Python", "does not satisfy Python")

    @property
    def summary(self) -> str:
        """The error message in one line."""
        lines = [line.strip() for line in self.output.splitlines() if line.strip()]
        errors = [line for line in lines if line.startswith(("error:", "cause:", "×", "╰─▶"))] or lines[-1:]
        return " ".join(errors[-1].split())[:300] if errors else "uv ended with an error"


def run_uv(*arguments: str | Path, stdin: str | None = None, **variables: str) -> str:
    """Return the output of a command of uv. Raise `UvFailed`, or `BadInput` if the disk is full."""
    require_extra("conservative engines", "environments", "uv", "platformdirs")
    from uv import find_uv_bin

    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    configured = {} if set(_OF_UV) & set(kept) else _from_pip()
    always = {"UV_PYTHON_DOWNLOADS": "never", "UV_NO_PROGRESS": "1", "NO_COLOR": "1"}
    done = subprocess.run(
        [find_uv_bin(), *map(str, arguments)],
        input=stdin,
        stdin=subprocess.DEVNULL if stdin is None else None,
        cwd=temporary_folder(),  # where no project's configuration applies
        env={"UV_CACHE_DIR": str(folder_of_all().parent / "uv")} | configured | kept | always | variables,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == 0:
        return done.stdout
    failure = UvFailed(done.stderr)
    if failure.says("No space left on device", "os error 28"):
        raise BadInput("engines", f"{folder_of_all()} on a disk without room", "a cache folder with room, or `engines remove`")
    raise failure


@lru_cache(maxsize=1)
def _from_pip() -> dict[str, str]:
    """Return pip's settings as variables of uv. Environment variables override configuration files."""
    pip = [sys.executable, "-m", "pip"] if find_spec("pip") else [shutil.which("pip") or ""]
    if not pip[0]:
        return {}
    done = subprocess.run([*pip, "config", "list"], capture_output=True, text=True, check=False, timeout=60)
    lines = re.findall(r"^(\S+)\.([\w-]+)='(.*)'$", done.stdout, re.MULTILINE)
    ranks = {"global": 0, "install": 1, ":env:": 2}
    settings = sorted((ranks[section], key, value) for section, key, value in lines if section in ranks)
    variables = {_FROM_PIP[key]: value for _, key, value in settings if key in _FROM_PIP}
    if "UV_FIND_LINKS" in variables:
        variables["UV_FIND_LINKS"] = ",".join(variables["UV_FIND_LINKS"].split())
    if "UV_INDEX" in variables:  # the best version of all indexes is installed, as with pip
        variables["UV_INDEX_STRATEGY"] = "unsafe-best-match"
    return variables
