"""Our side of a worker: start it, ask it, and turn each way in which it can end into an outcome.

Requests travel over bare pipes. execnet was measured beside them, on a machine with two busy cores, one round trip without an
engine: 39 us bare and 110 us with execnet at best, 66 us and 198 us at the median; its worker also has a second thread, which
an engine's loop would share the interpreter with.
"""

from __future__ import annotations

import atexit
import os
import select
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import IO, Any

from . import worker as program
from .environment import Environment, temporary_folder
from .failures import EngineCrashed, EngineTimeout, describe_exit

TIME_LIMIT = 600.0
"""Time, s, after which a run that nobody has set another limit for is ended."""
_LAST_WORDS = 300
_PATIENCE = 2.0  # s, for a worker that was told to end

_limit: ContextVar[float] = ContextVar("limit", default=TIME_LIMIT)


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Give every request within the block so much time, in s."""
    token = _limit.set(seconds)
    try:
        yield
    finally:
        _limit.reset(token)


class Worker:
    """A process in an environment. It is started when it is first asked, and again after it ended.

    Parameters
    ----------
    python
        Path of the environment's Python.
    home
        What the engine takes for the user's home: it stays, as what an engine has compiled should.
    work
        Folder in which the process has a working directory of its own, which goes with it.
    variables
        Of the process, beside ours.
    memory
        Bytes that it may take; by default three quarters of the machine's.

    Attributes: `starts`, how often it was started.
    """

    def __init__(
        self, python: Path, home: Path, work: Path, variables: Mapping[str, str] | None = None, memory: int = 0
    ) -> None:
        self._python, self._home, self._variables = python, home, dict(variables or {})
        self._folder, self._memory = work, memory or _memory()
        self._process: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None
        self._life = -1
        self._lock = Lock()
        self._unwanted: list[tuple[int, int]] = []
        self._owner, self.starts = os.getpid(), 0

    def ask(self, do: str, **values: Any) -> dict[str, Any]:
        """Return the answer to a request. One is answered at a time; others wait.

        Raises
        ------
        EngineCrashed
            The engine raised an exception, or the process ended or answered nonsense.
        EngineTimeout
            There was no answer within the limit; see `time_limit`.
        NotImplementedError
            The engine cannot do what it is asked for, and says why.
        """
        with self._lock:
            answer = self._exchange(program.pack({"do": do, "forget": self._take_unwanted(), **values}), _limit.get())
        if answer.get("error") == "NotImplementedError":
            raise NotImplementedError(answer["message"])
        if "error" in answer:
            raise EngineCrashed(f"{answer['error']}: {answer['message']}")
        return answer

    def forget(self, start: int, run: int) -> None:
        """Have a run forgotten that was prepared in the process of a start; it is told with the next request."""
        self._unwanted.append((start, run))

    def _take_unwanted(self) -> list[int]:
        unwanted, self._unwanted = self._unwanted, []
        return [run for start, run in unwanted if start == self.starts]

    @property
    def pid(self) -> int | None:
        """Number of the process; None while there is none that runs."""
        self._disown()
        process = self._process
        return None if process is None or process.poll() is not None else process.pid

    @property
    def busy(self) -> bool:
        """Whether it is being asked."""
        return self._lock.locked()

    def _disown(self) -> None:
        """Leave the process to who has started it, if that is not this process: a fork has a copy of both pipes."""
        if self._owner != os.getpid():
            self._process, self._owner, self._unwanted = None, os.getpid(), []

    def close(self) -> None:
        """End the process; the next request starts another one."""
        with self._lock:
            self._end()

    def _exchange(self, request: bytes, limit: float) -> dict[str, Any]:
        deadline = monotonic() + limit
        process = self._running()
        stdin, stdout = process.stdin, process.stdout
        assert stdin is not None
        assert stdout is not None
        try:
            write_all(stdin, request, deadline)
            return program.unpack(lambda count: read_exactly(stdout, count, deadline))
        except TimeoutError:
            self._end(at_once=True)
            raise EngineTimeout(limit) from None
        except (EOFError, BrokenPipeError):
            raise EngineCrashed(self._autopsy()) from None
        except (program.Unreadable, ValueError, KeyError, TypeError, MemoryError):
            self._end(at_once=True)
            raise EngineCrashed("an answer that cannot be read") from None
        except BaseException:  # Ctrl-C in the middle of a request: its answer would be taken for that to the next one
            self._end(at_once=True)
            raise

    def _running(self) -> subprocess.Popen[bytes]:
        self._disown()
        if self._process is not None and self._process.poll() is None:
            return self._process
        self._end()
        self._process = self._start()
        self.starts += 1
        return self._process

    def _start(self) -> subprocess.Popen[bytes]:
        self._home.mkdir(parents=True, exist_ok=True)
        self._work = Path(tempfile.mkdtemp(prefix=f"work-{os.getpid()}-", dir=self._folder))
        self._output = tempfile.TemporaryFile(dir=self._work)  # noqa: SIM115 - closed with the process
        inherited, self._life = os.pipe()
        try:
            return subprocess.Popen(
                [self._python, "-I", program.__file__, str(self._memory), str(inherited)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._output,
                bufsize=0,
                cwd=self._work,
                env=self._environment(),
                pass_fds=[inherited],
                start_new_session=True,  # Ctrl-C in a terminal is for us
            )
        except OSError as error:
            raise EngineCrashed(f"{self._python} cannot be started: {error.strerror}") from None
        finally:
            os.close(inherited)

    def _environment(self) -> dict[str, str]:
        """Return the variables of the process: ours, but with a home of its own, as engines write into it."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "XDG_"))}
        return kept | {"HOME": str(self._home)} | self._variables

    def _autopsy(self) -> str:
        """Return how the process ended."""
        process = self._process
        assert process is not None
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:  # it closed its pipes and lives on
            process.kill()
        words = describe_exit(process.wait(), self._last_words())
        self._end()
        return words

    def _last_words(self) -> str:
        """Return the line that says most of what was printed last: that of an error, not of the stack below it."""
        if self._output is None:
            return ""
        size = self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, size - 8192))
        lines = [line.strip() for line in self._output.read().decode(errors="replace").splitlines() if line.strip()]
        stack = next((i for i, line in enumerate(lines) if line.startswith(("Fatal Python error", "Current thread"))), None)
        words = lines if stack is None else lines[: stack + 1]
        return "".join(char if char.isprintable() else "?" for char in (words[-1] if words else ""))[:_LAST_WORDS]

    def _end(self, at_once: bool = False) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        for pipe in (process.stdin, process.stdout):
            if pipe:
                pipe.close()
        _stop(process, at_once)
        os.close(self._life)
        if self._output:
            self._output.close()
        shutil.rmtree(self._work, ignore_errors=True)


def _stop(process: subprocess.Popen[bytes], at_once: bool) -> None:
    """Wait until a process has ended by itself, or end it."""
    if at_once:
        process.kill()
    try:
        process.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _memory() -> int:
    """Return three quarters of the machine's memory, bytes."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 4 * 3


_workers: dict[tuple[tuple[object, ...], int], Worker] = {}
_lock = Lock()


def worker_of(environment: Environment, variables: Mapping[str, str] | None = None) -> Worker:
    """Return the worker of an environment whose process has some variables beside ours.

    A forked process has workers of its own, as two cannot share a pipe.
    """
    key = (environment.folder, *sorted((variables or {}).items())), os.getpid()
    with _lock:
        if key not in _workers:
            home = environment.folder / "home"
            _workers[key] = Worker(environment.interpreter, home, temporary_folder(), variables)
        return _workers[key]


@atexit.register
def close_workers(folder: Path | None = None) -> None:
    """End the workers of an environment, by default all of this process; each is started again when it is asked."""
    for ((place, *_), process), worker in list(_workers.items()):
        if process == os.getpid() and folder in (None, place):
            worker.close()


def _wait(descriptor: int, event: int, deadline: float) -> None:
    """Wait until a pipe can be read or written, or its other end is gone."""
    poll = select.poll()
    poll.register(descriptor, event)
    while not poll.poll(max(0.0, deadline - monotonic()) * 1000):
        if monotonic() >= deadline:
            raise TimeoutError


def read_exactly(pipe: IO[bytes], count: int, deadline: float) -> bytes:
    """Return so many bytes until a deadline, in s. Raises EOFError where there are no more, and TimeoutError."""
    descriptor, parts = pipe.fileno(), []
    while count:
        _wait(descriptor, select.POLLIN, deadline)
        part = os.read(descriptor, min(count, 1 << 20))
        if not part:
            raise EOFError
        parts.append(part)
        count -= len(part)
    return b"".join(parts)


def write_all(pipe: IO[bytes], data: bytes, deadline: float) -> None:
    """Write bytes until a deadline, in s. Raise BrokenPipeError if the reader is gone, and TimeoutError."""
    descriptor, rest = pipe.fileno(), memoryview(data)
    while rest:
        _wait(descriptor, select.POLLOUT, deadline)
        rest = rest[os.write(descriptor, rest[: select.PIPE_BUF]) :]
