"""Functions that only some systems have. Elsewhere each function does nothing, or returns that the value is unknown.

No other file imports a module of one system, except the program of a worker, which uses no other file.
"""

from __future__ import annotations

import os
import signal
import stat
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

try:
    fcntl: Any = import_module("fcntl")
except ImportError:  # Windows
    fcntl = None

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Numbers of the signals that ask a process to end."""
NO_LOCK = -1
"""Handle of a file or folder on a system, or a file system, without locks."""


def lock(path: Path) -> int | None:
    """Lock a file or a folder until `release`, or until this process ends. Return its handle.

    The handle is None if another process has the lock or the path does not exist. It is `NO_LOCK` if there are no locks: on
    Windows, where a folder cannot be opened and an open file cannot be renamed, and on some network file systems.
    """
    try:
        if fcntl is None:
            path.lstat()
            return NO_LOCK
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError as error:
        return NO_LOCK if isinstance(error, PermissionError) else None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(handle), path.lstat()):
            return handle
    except (BlockingIOError, FileNotFoundError):
        pass
    except OSError:
        os.close(handle)
        return NO_LOCK
    os.close(handle)
    return None


def release(handle: int) -> None:
    """Unlock and close. Closing alone would leave the lock to processes forked in the meantime."""
    if handle != NO_LOCK:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_UN)
        os.close(handle)


def is_own(file: Path) -> bool:
    """Return whether a file belongs to this user, and no other one can write or replace it; True on Windows."""
    if not hasattr(os, "geteuid"):
        return True
    status, folder = file.stat(), file.parent.stat()
    sticky = folder.st_mode & stat.S_ISVTX  # in a folder such as /tmp, only the owner of a file can replace it
    writable = (status.st_mode | (0 if sticky else folder.st_mode)) & stat.S_IWOTH
    return status.st_uid == os.geteuid() and not writable


def physical_memory() -> int:
    """Return the memory of this machine in bytes; 0 if it is unknown, as on Windows."""
    with suppress(AttributeError, OSError, ValueError):
        return max(0, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return 0


def first_values(path: str) -> dict[str, str]:
    """Return the first value of every key in a file of lines `key: value` below /proc; empty if there is no such file."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    pairs = ((key.strip(), value.strip()) for key, _, value in (line.partition(":") for line in reversed(lines)))
    return dict(pairs)


def life_line() -> tuple[int, int]:
    """Return both ends of a pipe. The process that inherits the first is ended by the system when the second closes.

    Both are -1 on other systems than Linux: macOS ignores the signal.
    """
    return os.pipe() if fcntl is not None and sys.platform == "linux" else (-1, -1)


def session_options(life: int) -> dict[str, Any]:
    """Return options of `subprocess.Popen` for a process that inherits `life`, unless -1.

    Ctrl-C in a terminal does not reach the process.
    """
    return {} if fcntl is None else {"start_new_session": True, "pass_fds": [] if life < 0 else [life]}


def end_group(leader: int) -> None:
    """End all processes of the session that `session_options` began with this process, which has ended: those it has forked."""
    with suppress(OSError, AttributeError):  # there are none left; or, on Windows, no groups
        os.killpg(leader, signal.SIGKILL)


def limit_resources(process: int, memory: int, largest_file: int) -> None:
    """Keep a process from harming others by its memory or its output, both limits in bytes. Only Linux supports it."""
    with suppress(ImportError, OSError, ValueError, AttributeError):
        import resource

        limits = {resource.RLIMIT_DATA: memory, resource.RLIMIT_FSIZE: largest_file, resource.RLIMIT_CORE: 0}
        for which, most in limits.items():
            resource.prlimit(process, which, (most, most))
        Path(f"/proc/{process}/oom_score_adj").write_text("1000", encoding="utf-8")  # ended first when memory runs out


@contextmanager
def unstoppable() -> Iterator[None]:
    """Delay signals until the end of the block: for renames that belong together, and for imports.

    An import that ends half-way leaves modules behind with which the next one fails.
    """
    # Blocking them in this thread is not enough: the system would hand them to another one.
    waiting: list[int] = []
    in_main_thread = threading.current_thread() is threading.main_thread()  # only there can handlers be set
    handled = [number for number in SIGNALS if in_main_thread and signal.getsignal(number) not in (None, signal.SIG_IGN)]
    before = {number: signal.signal(number, lambda number, frame: waiting.append(number)) for number in handled}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in waiting[:1]:
            signal.raise_signal(number)
