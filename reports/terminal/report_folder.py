"""The folder of a report, complete or absent: it is written next to its place and then renamed.

The files in the manifest of an earlier report are removed, other files stay. The exchange has three steps: the earlier folder
is renamed, the new one takes its place, and other files move over. After a kill between them, the next report restores missing
files and removes leftovers.
"""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from conservative import files, posix
from conservative.errors import BadInput, NotWritten
from conservative.posix import unstoppable

MANIFEST = "measurements.json"
"""The file of a report that lists the others under `files`. It identifies the folder of a report."""
_FOLDER = "a folder that can be written and is new, empty, or an earlier report, on a disk with room for it"
_ASIDE = "-old"
"""Suffix of the renamed folder of an earlier report."""
_SWAP_TIME = 1.0
"""Time, s, to wait for another report that exchanges the same folder."""


@contextmanager
def report_folder(target: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces `target` when the block succeeds, and is removed when it fails.

    The folder is created before the block, so a place that cannot be written is an error before any work.

    Raises
    ------
    BadInput
        The target cannot be written, is a file, or is a folder with other files; or the disk is full.
    """
    target = target.resolve()  # a link stays a link
    _require_place(target)
    with ExitStack() as stack:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            recover(target)
            fresh = stack.enter_context(files.temporary(target, Path.mkdir))
        except OSError as error:
            raise NotWritten("out", target, error, _FOLDER) from None
        try:
            yield fresh
        except NotWritten as error:
            # an error about a file in the new folder is one about its place
            raise NotWritten("out", target, error.cause, _FOLDER) if error.path.is_relative_to(fresh) else error from None
        with unstoppable():
            _swap(fresh, target)


def recover(target: Path) -> None:
    """Restore the files of an interrupted exchange, and remove leftovers."""
    for old in files.leftovers(target, _ASIDE):
        with suppress(OSError):
            if target.exists():
                _move_foreign(old, target)
            else:
                old.rename(target)
    files.remove_leftovers(target)


def _require_place(target: Path) -> None:
    """Raise `BadInput` if a folder must not be replaced by a report."""
    if not target.exists():
        return
    if not target.is_dir():
        raise BadInput("out", f"{str(target)!r}, a file", _FOLDER)
    if not os.access(target, os.R_OK | os.W_OK | os.X_OK):
        raise BadInput("out", f"{str(target)!r}, which cannot be written", _FOLDER)
    names = sorted(path.name for path in target.iterdir())
    if names and _manifest(target / MANIFEST) is None:
        raise BadInput("out", f"{str(target)!r}, which holds {names[0]!r} and no report", _FOLDER)


def _manifest(path: Path) -> list[str] | None:
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        return [str(name) for name in content["files"]]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _swap(fresh: Path, target: Path) -> None:
    """Replace a folder by another. Files are deleted last."""
    files.sync(fresh)
    aside: list[tuple[Path, int | None]] = []
    while True:
        with suppress(FileNotFoundError):
            aside.append(_step_aside(target))
        try:
            fresh.rename(target)
            break
        except OSError as error:  # another report appeared at this moment
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
    for old, handle in aside:
        _move_foreign(old, target)
        if handle is not None:
            posix.release(handle)
    files.sync(target.parent)


def _step_aside(target: Path) -> tuple[Path, int | None]:
    """Rename an earlier report and return its new name and its lock, which protects it from `recover`.

    If another process holds the lock, it has just written this report and is about to release it. If it still holds it after
    `_SWAP_TIME`, the folder is renamed without a lock.
    """
    end = time.monotonic() + _SWAP_TIME
    while (handle := posix.lock(target)) is None and target.exists() and time.monotonic() < end:
        time.sleep(0.01)
    return target.rename(target.with_name(f".{target.name}-{os.urandom(6).hex()}{_ASIDE}")), handle


def _move_foreign(old: Path, target: Path) -> None:
    """Move files that no report wrote from an earlier folder into the new one, then remove the earlier one."""
    listed = _manifest(old / MANIFEST) or ()
    for name in sorted(path.name for path in old.iterdir() if path.name not in listed):
        if (target / name).exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target / name))
        (old / name).rename(target / name)
    done = target.with_name(old.name.removesuffix(_ASIDE))
    old.rename(done)  # with this name it is a leftover if a kill interrupts its removal
    files.remove(done)
