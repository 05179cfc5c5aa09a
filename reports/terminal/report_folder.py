"""The folder of a report, which is there whole or not at all: written beside its place, then renamed.

Of an earlier report the files that its manifest lists go; anything a person put beside them stays. A swap takes three steps:
the earlier folder steps aside, the new one takes its place, what is a person's moves over. Where a kill ends it in between, the
next report puts back what is missing, and removes the rest.
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

from conservative import files
from conservative.errors import BadInput, NotWritten

from .interrupts import unstoppable

MANIFEST = "measurements.json"
"""The file of a report that lists the others under `files`, and by which a folder is known to be one."""
_FOLDER = "a folder that can be written and is new, empty, or an earlier report, on a disk with room for it"
_ASIDE = "-old"
"""How the name of an earlier report that has stepped aside ends."""
_SWAP_TIME = 1.0
"""Time, s, that another report may take to finish with the same folder."""


@contextmanager
def report_folder(target: Path) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `target` when the block ends well, and vanishes when it does not.

    The folder is made before the block: a place that cannot be written is an error before any work.

    Raises
    ------
    BadInput
        The target cannot be written, is a file, or is a folder with other things in it; or the disk is full.
    """
    target = target.resolve()  # a link stays one
    _require_place(target)
    with ExitStack() as stack:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            recover(target)
            fresh, _ = stack.enter_context(files.temporary(target, _make))
        except OSError as error:
            raise NotWritten("out", target, error, _FOLDER) from None
        try:
            yield fresh
        except NotWritten as error:
            raise _in_place(error, fresh, target) from None
        with unstoppable():
            _swap(fresh, target)


def recover(target: Path) -> None:
    """Put back what a kill in the middle of a swap left beside a folder, and remove leftovers."""
    for old in files.leftovers(target, _ASIDE):
        with suppress(OSError):
            if target.exists():
                _move_foreign(old, target)
            else:
                old.rename(target)
    files.remove_leftovers(target)


def _require_place(target: Path) -> None:
    """Raise `BadInput` where a folder is no place for a report."""
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


def _make(path: Path) -> int:
    path.mkdir()
    return os.open(path, os.O_RDONLY)


def _in_place(error: NotWritten, fresh: Path, target: Path) -> NotWritten:
    """Return an error about a file of the new folder as one about the place of that."""
    return NotWritten("out", target, error.cause, _FOLDER) if error.path.is_relative_to(fresh) else error


def _swap(fresh: Path, target: Path) -> None:
    """Put one folder in the place of another. Nothing is deleted before all that must stay is where it belongs."""
    files.sync(fresh)
    aside: list[tuple[Path, int | None]] = []
    while True:
        with suppress(FileNotFoundError):
            aside.append(_step_aside(target))
        try:
            fresh.rename(target)
            break
        except OSError as error:  # another report was put there at this moment
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
    for old, handle in aside:
        _move_foreign(old, target)
        if handle is not None:
            files.release(handle)
    files.sync(target.parent)


def _step_aside(target: Path) -> tuple[Path, int | None]:
    """Rename an earlier report and return its new name, with its lock: nobody may take it for a leftover.

    Another report that holds it has just been put there, and is about to be done with it.
    """
    end = time.monotonic() + _SWAP_TIME
    while (handle := files.lock(target)) is None and target.exists() and time.monotonic() < end:
        time.sleep(0.01)
    return target.rename(target.with_name(f".{target.name}-{os.urandom(6).hex()}{_ASIDE}")), handle


def _move_foreign(old: Path, target: Path) -> None:
    """Move what no report wrote from an earlier folder into its successor, then remove the earlier one."""
    listed = _manifest(old / MANIFEST) or ()
    for name in sorted(path.name for path in old.iterdir() if path.name not in listed):
        if (target / name).exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target / name))
        (old / name).rename(target / name)
    done = target.with_name(old.name.removesuffix(_ASIDE))
    old.rename(done)  # by this name all of it is a leftover, should a kill end its removal
    files.remove(done)
