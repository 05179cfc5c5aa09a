"""Files that are written completely or not at all.

A file is written under a temporary name next to its place, and renamed once all of it is on the disk. After a full disk, an
exception or a kill, the previous file is unchanged. The process that creates a temporary file holds a lock on it, which ends
with the process. A temporary file without a lock is a leftover of a killed process. It is removed when the same file is written
again. Where the system has no locks, it is removed `_AGE` after its last change.
"""

from __future__ import annotations

import errno
import hashlib
import io
import os
import re
import shutil
import stat
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from .errors import CONVERTED, REMOVED, BadInput, NotWritten
from .posix import NO_LOCK, lock, release

_AGE = 7 * 86400.0
"""Age, s, of a leftover on a system without locks."""


@contextmanager
def text_file(target: Path, argument: str) -> Iterator[io.TextIOWrapper]:
    """Yield a text stream whose contents become the file `target` when the block succeeds.

    A file that cannot be written is an error before the block. A link stays a link, a file keeps its permissions, and a device
    or a pipe, such as /dev/null, is written directly. Raise `NotWritten`, which names `argument`, if the file cannot be written
    or the disk is full.
    """
    with _raw_file(target, argument) as raw:
        stream = io.TextIOWrapper(io.BufferedWriter(raw), encoding="utf-8", newline="")
        try:
            yield stream
            stream.flush()
        except BaseException:
            raw.ignore = True
            raise
        finally:
            stream.detach().detach()


def write_text(target: Path, text: str, argument: str) -> None:
    """Write a text to the file `target`. Raise `NotWritten` as `text_file` does."""
    write_bytes(target, text.encode(), argument)


def write_bytes(target: Path, content: bytes, argument: str) -> None:
    """Write bytes to the file `target`. Raise `NotWritten` as `text_file` does."""
    with _raw_file(target, argument) as raw:
        left = memoryview(content)
        while left:
            left = left[raw.write(left) :]


def require_ending(argument: str, path: Path, endings: Iterable[str]) -> None:
    """Raise `BadInput` for the name of a file with another ending. For a format that is gone, it says what to do instead."""
    allowed = list(endings)
    if path.suffix not in allowed:
        suffix = path.suffix.lower()
        helps = suffix in REMOVED and (suffix not in CONVERTED or CONVERTED[suffix] in allowed)
        instead = f". Instead of {suffix}: {REMOVED[suffix]}" if helps else ""
        raise BadInput(argument, repr(str(path)), f"a file that ends in {', '.join(allowed)}{instead}")


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading. Raise `OSError` for a pipe or a device: opening or reading it could go on for ever."""
    stream = open(path, "rb", opener=_open_at_once)  # noqa: SIM115  # Path.open has no opener; the caller closes it
    if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        return stream
    stream.close()
    raise OSError(errno.EINVAL, "a pipe or a device, not a file", str(path))


def _open_at_once(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))  # otherwise a pipe waits for a writer


def read_bytes(path: Path, largest: int) -> bytes:
    """Return the content of a file. Raise `OSError` for a pipe or a device, and for more bytes than `largest`."""
    with open_file(path) as stream:
        content = stream.read(largest + 1)
    if len(content) > largest:
        raise OSError(errno.EFBIG, f"more than {largest} bytes", str(path))
    return content


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8. Raise `OSError` as `read_bytes`, for more than 1 GiB."""
    return read_bytes(path, 1 << 30).decode()


def safe_name(text: str) -> str:
    """Return a name for a file without a suffix: letters, digits, and some signs instead of any other, in at most 100 bytes."""
    name = re.sub(r"[^\w+=,-]", "_", text)  # no point either: a suffix starts at the last one
    return name if len(name.encode()) <= 100 else f"{name[:20]}_{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def make_folder(folder: Path, argument: str) -> None:
    """Create a folder and its missing parents. Raise `NotWritten` for `argument` if that fails."""
    with _errors(folder, argument):
        folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def temporary(place: Path, make: Callable[[Path], object]) -> Iterator[Path]:
    """Yield the name of a temporary file or folder next to a place, which `make` creates. It is removed after the block.

    Leftovers are removed first. An `OSError` is not converted.
    """
    remove_leftovers(place)
    while True:
        fresh = place.with_name(f".{place.name}-{os.urandom(6).hex()}")
        make(fresh)
        handle = lock(fresh)
        if handle is not None:  # otherwise another process removed it as a leftover before it was locked
            break
    try:
        yield fresh
    finally:
        remove(fresh)
        release(handle)


def remove_leftovers(place: Path) -> None:
    """Remove the temporaries of processes that have ended."""
    for path in leftovers(place):
        remove(path)


def leftovers(place: Path, suffix: str = "") -> Iterator[Path]:
    """Yield the temporaries of processes that have ended. Each is locked until the next one."""
    pattern = re.compile(rf"\.{re.escape(place.name)}-[0-9a-f]{{12}}{suffix}")
    with suppress(OSError):  # in a folder that cannot be read, nothing can be removed
        for path in list(place.parent.iterdir()):
            if pattern.fullmatch(path.name) and (handle := lock(path)) is not None:
                if handle != NO_LOCK or path.stat().st_mtime < time.time() - _AGE:
                    yield path
                release(handle)


def remove(path: Path) -> None:
    """Remove a file, or a folder with its contents, if it exists and can be removed."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()


def sync(path: Path) -> None:
    """Flush a file, or the names in a folder, to the disk, if the file system supports it."""
    with suppress(OSError):
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


class _RawFile(io.FileIO):
    """A file whose errors contain the name of its target. With `ignore` it discards everything written to it."""

    def __init__(self, path: Path, target: Path, argument: str) -> None:
        super().__init__(path, "w")
        self.target, self.argument, self.ignore = target, argument, False

    def write(self, content: Any) -> int:
        if self.ignore:
            return memoryview(content).nbytes
        try:
            return super().write(content)
        except OSError as error:
            self.ignore = True
            raise NotWritten(self.argument, self.target, error) from None


@contextmanager
def _raw_file(target: Path, argument: str) -> Iterator[_RawFile]:
    """Yield a raw file that replaces `target`, and has its permissions, when the block succeeds; or a device or pipe itself."""
    with ExitStack() as stack:
        with _errors(target, argument):
            place = Path(os.path.realpath(target))  # a link stays a link
            if target.exists() and not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            if is_file := target.is_file() or not target.exists():
                fresh = stack.enter_context(temporary(place, partial(Path.touch, exist_ok=False)))
            raw = stack.enter_context(_RawFile(fresh if is_file else target, target, argument))  # an error for a folder
            if is_file and place.exists():
                fresh.chmod(stat.S_IMODE(place.stat().st_mode))
        yield raw
        if is_file:
            with _errors(target, argument):
                os.fsync(raw.fileno())  # before the renaming: a crash of the machine could otherwise leave an empty file
                raw.close()  # Windows does not rename an open file
                fresh.replace(place)
            sync(place.parent)


@contextmanager
def _errors(target: Path, argument: str) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:  # a ValueError: a NUL in the name
        raise NotWritten(argument, target, error) from None
