"""Work in a process of its own, which is ended when the work takes too long or ends the process itself.

Neither a thread nor a signal can end work for certain: an engine may keep the interpreter to itself for ever. A process can
always be killed. It is started afresh and not forked, so that threads of the parent do no harm and the main module of a script
is not run again; it stays for the next piece of work, so that imports and compiled code are paid for once. Source: our own.
"""

from __future__ import annotations

import atexit
import faulthandler
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from conservative.integration.pickling import NotTransferable, dump, load

T = TypeVar("T")
START_LIMIT = 120.0
"""Time, s, that a process may take to start, on however busy a machine."""
GRACE = 5.0
"""How long after its limit, s, a process ends by itself: where the parent is not there any more to end it."""
MOST_SHARED = 8
"""Shared objects that either side keeps: the parent their bytes, the process what was made of them, compiled code included."""
MOST_MODULES = 16
"""Modules at most that are sent because the process cannot import them."""
LONGEST_LIMIT = 1e6
"""Time, s, that any piece of work may take at most: 11 days. Clocks of operating systems take not much more."""
_idle: list[Worker] = []


class TimeLimitExceeded(TimeoutError):
    """A piece of work took longer than it was given, and was ended. Attribute: `limit` (s)."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"ended after {limit:g} s")


class WorkerDied(RuntimeError):
    """A piece of work ended its process, such as by a segmentation fault. Attribute: `status`, negative for a signal."""

    def __init__(self, status: int) -> None:
        self.status = status
        super().__init__(f"signal {-status}" if status < 0 else f"its process ended with status {status}")


def run_within(limit: float, work: Callable[[], T], shared: Sequence[object] = ()) -> T:
    """Return what `work` returns, or raise what it raises, if that takes no longer than `limit` s; else it is ended.

    It runs in another process: what it changes there changes nothing here.

    Parameters
    ----------
    limit
        Wall time, s, without the start of the process.
    work
        What to do. It may be a lambda, and hold anything that cloudpickle can make bytes of.
    shared
        Frozen objects that it refers to, which are sent once and kept for the next piece of work; those that it returns are
        these very objects again. Hashable.

    Raises
    ------
    TimeLimitExceeded
        It takes longer.
    WorkerDied
        It ended its process.
    NotTransferable
        It, or what it returns, has parts that exist in one process only. It was not begun, or is lost.
    MissingExtra
        cloudpickle, of the extra `report`, is not installed.
    """
    limit = min(limit, LONGEST_LIMIT)
    by_value: list[str] = []
    while True:
        kept = [_bytes_of(each, tuple(by_value)) for each in shared]
        kind, content = _ask(limit, kept, dump(work, shared, by_value))
        if kind == "returned":
            return load(content, shared)
        if kind == "raised":
            raise load(content, shared)
        name = content.decode()
        if kind == "lost" or name not in sys.modules or name in by_value or len(by_value) == MOST_MODULES:
            raise NotTransferable(name)
        by_value.append(name)  # the process cannot import it


def python_command(statement: str, *arguments: str) -> list[str]:
    """Return the command for a fresh interpreter that finds the modules that this one does; arguments are `sys.argv[2:]`."""
    start = "import json, sys; sys.path[:] = json.loads(sys.argv[1]);"
    places = json.dumps([place for place in sys.path if isinstance(place, str)])
    return [sys.executable or "python3", "-P", "-c", f"{start} {statement}", places, *arguments]


@lru_cache(maxsize=MOST_SHARED)
def _bytes_of(value: object, by_value: tuple[str, ...]) -> bytes:
    return dump(value, (), by_value)


def _ask(limit: float, shared: list[bytes], work: bytes) -> tuple[str, bytes]:
    """Return the answer of an idle process, or of a new one, which is idle again after that."""
    worker = _take_idle() or Worker()
    try:
        answer = worker.answer(limit, dump((sys.path, _find_folder(), limit, shared, work)))
    except BaseException:  # KeyboardInterrupt too
        worker.end()
        raise
    _idle.append(worker)
    return answer


def _find_folder() -> str:
    """Return the working directory, "" where it is there no more."""
    with suppress(OSError):
        return os.getcwd()  # noqa: PTH109  # as it is
    return ""


def _take_idle() -> Worker | None:
    """Return a process that waits for work; None where none does."""
    with suppress(IndexError):
        while True:
            worker = _idle.pop()
            if worker.parent == os.getpid() and worker.process.poll() is None:
                return worker
            worker.end()
    return None


@atexit.register
def end_idle() -> None:
    """End all processes that wait for work: nothing is left running, and the next piece of work starts a new one."""
    while (worker := _take_idle()) is not None:
        worker.end()


class Worker:
    """A process that does one piece of work after the other."""

    def __init__(self) -> None:
        self.parent = os.getpid()
        ours, theirs = socket.socketpair()
        life, self._life = map(os.fdopen, os.pipe(), "rw")
        with ours, theirs, life:
            descriptors = [theirs.fileno(), life.fileno()]
            with _block_interrupts():
                self.process = subprocess.Popen(
                    python_command(f"from {__name__} import serve; serve(*map(int, sys.argv[2:]))", *map(str, descriptors)),
                    pass_fds=descriptors,
                    stdin=subprocess.DEVNULL,
                )
            self.connection = Connection(ours.detach())
        try:
            self.answer(START_LIMIT, b"")
        except BaseException:
            self.end()
            raise

    def answer(self, limit: float, message: bytes) -> tuple[str, bytes]:
        """Return what the process answers within `limit`, s; see `serve`. Raise `TimeLimitExceeded` or `WorkerDied`."""
        try:
            self.connection.send_bytes(message)
            found = self.connection.recv_bytes() if self.connection.poll(limit) else None
        except (EOFError, OSError):  # an OSError where it ends in the middle of an answer
            raise WorkerDied(self._wait()) from None
        if found is None:
            raise TimeLimitExceeded(limit)
        kind, content = load(found)
        return kind, content

    def _wait(self) -> int:
        """Return how the process ended, which has closed the connection; one that goes on without it is ended."""
        with suppress(subprocess.TimeoutExpired):
            return self.process.wait(GRACE)
        self.process.kill()
        return self.process.wait()

    def end(self) -> None:
        """End the process, whatever it does, and wait until it is gone."""
        self.connection.close()
        self._life.close()
        if self.parent == os.getpid():
            self.process.kill()
            self.process.wait()


@contextmanager
def _block_interrupts() -> Iterator[None]:
    """Start processes in the block that Ctrl-C does not reach: it is for the parent, which ends them.

    They stay in its process group, so that whoever ends that ends them as well.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def serve(descriptor: int, life: int) -> None:
    """Do one piece of work after the other, as messages from the parent say, until the parent is gone.

    The parent holds the other end of the pipe `life`. When that closes, the system sends SIGIO, which ends this process
    whatever it does.
    """
    with suppress(ImportError, OSError, AttributeError):  # not every system has it
        import fcntl

        fcntl.fcntl(life, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(life, fcntl.F_SETFL, os.O_ASYNC)
    connection = Connection(descriptor)
    # A stream with a descriptor: that of stderr where this is closed.
    with open(os.devnull, "w") as nowhere, suppress(EOFError, ConnectionError):  # noqa: PTH123
        os.dup2(2, 1)
        while True:
            message = connection.recv_bytes()
            connection.send_bytes(dump(_do(message, nowhere) if message else ("started", b"")))


def _do(message: bytes, nowhere: Any) -> tuple[str, bytes]:
    """Return how a piece of work ended, and the bytes of what it returned or raised.

    "unknown" is a module that cannot be imported here, and "lost" why there are no bytes.
    """
    sys.path[:], folder, limit, kept, work = load(message)
    with suppress(OSError):
        os.chdir(folder)
    faulthandler.dump_traceback_later(limit + GRACE, exit=True, file=nowhere)
    try:
        shared = [_load_shared(content) for content in kept]
        do = load(work, shared)
    except ModuleNotFoundError as error:
        return "unknown", (error.name or "").encode()
    else:
        return _answer(do, shared)
    finally:
        faulthandler.cancel_dump_traceback_later()


_load_shared = lru_cache(maxsize=MOST_SHARED)(load)


def _answer(work: Callable[[], Any], shared: Sequence[object]) -> tuple[str, bytes]:
    try:
        kind, found = "returned", work()
    except Exception as error:
        kind, found = "raised", error
    try:
        return kind, dump(found, shared)
    except NotTransferable as error:
        return "lost", str(error).encode()
