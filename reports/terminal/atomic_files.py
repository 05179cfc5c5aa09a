"""Files that are there whole or not at all: write under a temporary name beside the target, then rename.

Both writers make their temporary name before the caller does any work, so a place that cannot be written is an error at once.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any
from uuid import uuid4

from conservative.errors import BadInput

from .interrupts import unstoppable

MANIFEST = "measurements.json"
"""The file of a report that lists the others under `files`, and by which a folder is known to be one."""

_FOLDER = "a folder that can be written and is new, empty, or an earlier report"


@contextmanager
def report_folder(target: Path) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `target` when the block ends well, and vanishes when it does not.

    Of an earlier report the files that its manifest lists go; anything a person put beside them stays.

    Raises
    ------
    BadInput
        The target cannot be written, is a file, or is a folder with other things in it.
    """
    target = target.resolve()  # a link stays one
    foreign = _foreign_files(target)
    fresh = target.with_name(f".{target.name}-{uuid4().hex[:12]}")
    try:  # from before the folder is there: an interrupt can come at any time
        with _as_bad_input("out", target, _FOLDER):
            target.parent.mkdir(parents=True, exist_ok=True)
            fresh.mkdir(mode=0o700)
        yield fresh
        with unstoppable():
            _swap(fresh, target, foreign)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


@contextmanager
def text_file(target: Path, argument: str) -> Iterator[IO[str]]:
    """Yield a text stream whose contents become the file `target` when the block ends well.

    Raises
    ------
    BadInput
        The file cannot be written; the message names `argument`.
    """
    allowed = "a file in a folder that exists and can be written"
    if target.is_dir():
        raise BadInput(argument, f"{str(target)!r}, a folder", allowed)
    with _as_bad_input(argument, target, allowed):
        handle, name = tempfile.mkstemp(prefix=f".{target.name}-", dir=target.absolute().parent)
    fresh = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            yield stream
        _open_to_all(fresh, 0o666)
        fresh.replace(target)
    finally:
        fresh.unlink(missing_ok=True)


def _foreign_files(target: Path) -> list[str]:
    """Return the names in `target` that no earlier report wrote; `BadInput` where it is no place for a report."""
    if not target.exists():
        return []
    if not target.is_dir():
        raise BadInput("out", f"{str(target)!r}, a file", _FOLDER)
    names = sorted(path.name for path in target.iterdir())
    listed = _manifest(target / MANIFEST)
    if names and listed is None:
        raise BadInput("out", f"{str(target)!r}, which holds {names[0]!r} and no report", _FOLDER)
    if not os.access(target, os.W_OK):
        raise BadInput("out", f"{str(target)!r}, which cannot be written", _FOLDER)
    return [name for name in names if name not in (listed or ())]


def _manifest(path: Path) -> list[str] | None:
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        return [str(name) for name in content["files"]]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _swap(fresh: Path, target: Path, foreign: list[str]) -> None:
    """Put one folder in the place of another. Nothing is deleted before all that must stay is where it belongs."""
    _open_to_all(fresh, 0o777)
    if not target.exists():
        fresh.rename(target)
        return
    old = target.with_name(f"{fresh.name}-old")
    target.rename(old)
    fresh.rename(target)
    for name in foreign:
        (old / name).rename(target / name)
    shutil.rmtree(old)


def _open_to_all(path: Path, mode: int) -> None:
    """Give a temporary file the permissions that an ordinary one would have got."""
    mask = os.umask(0)
    os.umask(mask)
    path.chmod(mode & ~mask)


@contextmanager
def _as_bad_input(argument: str, target: Path, allowed: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BadInput(argument, f"{str(target)!r} ({error.strerror})", allowed) from None
