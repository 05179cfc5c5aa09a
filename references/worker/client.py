"""The client of the protocol in PROTOCOL.md: it starts a program, sends requests, and turns every failure into an outcome.

Requests travel over bare pipes. A round trip takes 39 us at best and 66 us in the median, against 110 us and 198 us with
execnet, whose second thread would also compete with the engine for the interpreter.
"""

from __future__ import annotations

import atexit
import os
import select
import shutil
import signal
import subprocess
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import chain
from pathlib import Path
from threading import Lock, Timer
from time import monotonic
from typing import IO, Any, NoReturn

from conservative.errors import IntegrationFailed, shorten
from conservative.outcome import Outcome, OutcomeKind
from conservative.posix import end_group, life_line, limit_resources, session_options

from . import program

START_LIMIT = 120.0
"""Time in seconds that a program may take to start, also on a busy machine."""
TIME_LIMIT = 600.0
"""Time limit of a request in seconds, unless `time_limit` sets another."""
LARGEST_ANSWER = 1 << 30
"""Largest answer in bytes."""
LARGEST_FILE = 1 << 28
"""Largest file in bytes that a program with a memory limit may write, including its output."""
_LONGEST_LINE = 300
"""Most characters of a line of output in a message."""
_ERRORS = ("Fatal Python error", "Current thread", "FATAL ERROR")
"""Beginnings of the lines above a stack, of Python and of Node."""
_PATIENCE = 2.0
"""Time, s, for a program to end after its input closes."""
_LONGEST_WAIT = 1e6
"""Longest time of a timer, s."""
_LARGEST = 1.7976931348623157e308
"""Largest float: larger integers are refused."""
_CAN_WAIT = hasattr(select, "poll")
"""True if waiting can have a limit. On Windows a thread ends a late process, which also ends the wait."""
_READ, _WRITE, _PART = (select.POLLIN, select.POLLOUT, select.PIPE_BUF) if _CAN_WAIT else (0, 0, 1 << 16)

_limit: ContextVar[float] = ContextVar("limit", default=TIME_LIMIT)
_workers: weakref.WeakSet[Worker] = weakref.WeakSet()


class EngineCrashed(IntegrationFailed):
    """The engine raised an exception, or its process ended. Attribute: `reason`."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.outcome = Outcome(OutcomeKind.CRASHED, reason)
        super().__init__(f"The engine {self.outcome}. Use another scene or setting")


class EngineError(EngineCrashed):
    """The engine answered a request with an error, and its process goes on."""


class EndlessAnswer(EngineCrashed):
    """The engine sent more than `LARGEST_ANSWER` as one answer."""

    def __init__(self) -> None:
        super().__init__(f"an answer of more than {LARGEST_ANSWER / (1 << 30):.3g} GiB")


class EngineTimeout(IntegrationFailed):
    """The engine did not answer in time, and its process was ended. Attribute: `limit` (s)."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self.outcome = Outcome(OutcomeKind.TIMEOUT, f"after {limit:g} s")
        super().__init__(f"The engine did not answer within {limit:g} s. Use a shorter run or a longer time limit")


class _Answer(dict[str, Any]):
    def __missing__(self, name: str) -> NoReturn:
        raise EngineCrashed(f"its answer has no `{name}`")


def is_number(value: object) -> bool:
    """Return whether a value is a finite number of 0 or more."""
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= _LARGEST


def is_text(value: object) -> bool:
    """Return whether a value is a text."""
    return isinstance(value, str)


def _is_array(value: object) -> bool:
    """Return whether a value is an array of numbers, as NumPy's or as lists, which may have None for nan."""
    if hasattr(value, "dtype"):
        return value.dtype.kind in "iuf"
    rows: list[Any] = [value]
    while rows and set(map(type, rows)) == {list}:
        rows = list(chain.from_iterable(rows))
    return isinstance(value, list) and set(map(type, rows)) <= {int, float, type(None)} and not any(
        type(row) is int and abs(row) > _LARGEST for row in rows
    )  # fmt: skip


_TEXT, _NUMBER, _ARRAY = (is_text, "a text"), (is_number, "a finite number of 0 or more"), (_is_array, "an array of numbers")
ANSWERS: Mapping[str, Mapping[str, tuple[Callable[[Any], bool], str]]] = {
    "hello": {
        "protocol": _NUMBER,
        "program": _TEXT,
        "version": _TEXT,
        "framing": (lambda value: value in ("lines", "binary"), "'lines' or 'binary'"),
        "engine": (lambda value: isinstance(value, dict), "an object"),
    },
    "prepare": {"run": _NUMBER},
    "run": {
        **dict.fromkeys(("q", "R", "w", "w_W", "p", "v"), _ARRAY),
        **dict.fromkeys(("evaluations", "steps"), (lambda value: is_number(value) or _is_array(value), _NUMBER[1])),
        "reason": _TEXT,
    },
    "time": {"seconds": _NUMBER},
    "load": {"accelerations": _ARRAY, "output": _TEXT},
}
"""Fields of the answers to each request, and what they have to be."""
_OF_ANY = {"error": _TEXT, "message": _TEXT}
_OPTIONAL = {"framing", "engine", "reason", "evaluations", "steps", "output", "message"}


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Set the time limit of every request in the block."""
    token = _limit.set(seconds)
    try:
        yield
    finally:
        _limit.reset(token)


class Worker:
    """A program in another process. It starts with the first request, and again with the next request after it ended.

    Parameters
    ----------
    command
        Command line of a program that speaks the protocol.
    folder
        Folder in which each process gets a working directory, removed when it ends; by default the current directory.
    variables
        Environment variables of the process; by default the same as of this one.
    memory
        Memory limit in bytes, which only Linux supports; 0 for none.
    show_output
        True if the output of the program goes to stderr. By default it is only used to describe a crash.

    Attributes: `starts`, how often the program was started.
    """

    def __init__(
        self,
        command: Sequence[str | os.PathLike[str]],
        folder: Path | None = None,
        variables: Mapping[str, str] | None = None,
        memory: int = 0,
        show_output: bool = False,
    ) -> None:
        self._command, self._folder, self._variables = tuple(command), folder, variables
        self._memory, self._show_output = memory, show_output
        self._binary, self._greeting = False, dict[str, Any]()
        self._forget_process()
        self._lock = Lock()
        self._unwanted: list[tuple[int, int]] = []
        self._owner, self.starts = os.getpid(), 0
        _workers.add(self)

    def _forget_process(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None
        self._work: Path | None = None
        self._life = -1

    def ask(self, do: str, **values: Any) -> dict[str, Any]:
        """Return the answer to a request. Requests of several threads are answered one after the other.

        Raises
        ------
        EngineCrashed
            The engine raised an exception (`EngineError`), or the process ended or sent something that is not an answer.
        EngineTimeout
            There was no answer within the limit (see `time_limit`).
        NotImplementedError
            The engine does not support the request; the message gives the reason.
        """
        with self._lock:
            self._start_if_ended()
            unwanted, self._unwanted = self._unwanted, []
            forget = [run for start, run in unwanted if start == self.starts]
            with self._ended_by_failure(_limit.get()) as deadline:
                answer = self._exchange({"do": do, "forget": forget, **values}, deadline)
        self._check(do, answer)
        if "error" not in answer:
            return _Answer(answer)
        message = shorten(answer.get("message") or "it gives no reason: no `message` beside its `error`")
        raise NotImplementedError(message) if answer["error"] == "unsupported" else EngineError(f"{answer['error']}: {message}")

    def _check(self, do: str, answer: dict[str, Any]) -> None:
        """Raise `EngineCrashed` if a field of an answer is not as in `ANSWERS`. Drop optional ones that are None."""
        for name, (is_right, expected) in (_OF_ANY | dict(ANSWERS.get(do, {}))).items():
            if name in answer and answer[name] is None and name in _OPTIONAL:
                del answer[name]
            if name in answer and not is_right(answer[name]):
                value = shorten(repr(answer[name])[:100])
                raise EngineCrashed(f"{self._command[0]} answers `{do}` with `{name}`: {value}; expected {expected}")

    def greet(self, limit: float = START_LIMIT) -> dict[str, Any]:
        """Return the answer of the program to `hello`, within a limit in s if it has to start. Raise as `ask`."""
        with self._lock:
            self._start_if_ended(limit)
        return self._greeting

    def forget(self, start: int, run: int) -> None:
        """Forget a run that was prepared after a given start. The next request tells the program to free it."""
        self._unwanted.append((start, run))

    @property
    def pid(self) -> int | None:
        """Process number; None if no process is running."""
        if self._owner != os.getpid():  # a fork has copies of the pipes, but the process belongs to its parent
            self._owner, self._unwanted = os.getpid(), []
            self._forget_process()
        process = self._process
        return None if process is None or process.poll() is not None else process.pid

    @property
    def busy(self) -> bool:
        """True while a request is being answered."""
        return self._lock.locked()

    def close(self) -> None:
        """End the process. The next request starts another one."""
        with self._lock:
            if self._owner == os.getpid():
                self._end()

    def _start_if_ended(self, limit: float = START_LIMIT) -> None:
        if self.pid is not None:
            return
        self._end()
        self._binary = False
        self._work = self._folder and Path(tempfile.mkdtemp(prefix=f"work-{os.getpid()}-", dir=self._folder))
        self._output = None if self._show_output else tempfile.TemporaryFile(dir=self._work)  # noqa: SIM115  # closed in _end
        life, self._life = life_line()
        try:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._output,
                bufsize=0,
                cwd=self._work,
                env=self._variables,
                **session_options(life),
            )
        except OSError as error:
            self._end()
            raise EngineCrashed(f"{self._command[0]} cannot be started: {error.strerror}") from None
        finally:
            if life >= 0:
                os.close(life)
        self.starts += 1
        if self._memory:
            limit_resources(self._process.pid, self._memory, LARGEST_FILE)
        with self._ended_by_failure(limit) as deadline:
            greeting = {"do": "hello", "protocol": program.PROTOCOL, "framings": ["binary", "lines"]}
            self._greeting = self._exchange(greeting | ({"life": life} if life >= 0 else {}), deadline)
            self._check("hello", self._greeting)
            if self._greeting.get("protocol") != program.PROTOCOL:
                raise program.Unreadable(self._greeting)
            self._binary = self._greeting.get("framing") == "binary"

    def _exchange(self, message: dict[str, Any], deadline: float) -> dict[str, Any]:
        """Send a request and return the answer."""
        process: Any = self._process
        if self._binary:
            _write_all(process, program.pack(message), deadline)
            return program.unpack(lambda count: _read_exactly(process, count, deadline))
        _write_all(process, program.to_json(message), deadline)
        return program.from_json(_read_line(process, deadline))

    @contextmanager
    def _ended_by_failure(self, limit: float) -> Iterator[float]:
        """Give the block its deadline. End the process if the block fails: a late answer would be taken for the next one."""
        expired: list[float] = []
        timer = None if _CAN_WAIT else Timer(min(limit, _LONGEST_WAIT), self._kill_late, (expired, limit))
        if timer:
            timer.daemon = True
            timer.start()
        try:
            yield monotonic() + limit
        except TimeoutError:
            self._end(at_once=True)
            raise EngineTimeout(limit) from None
        except (EOFError, OSError):  # Windows has several errors for a pipe without a reader
            if expired:
                self._end(at_once=True)
                raise EngineTimeout(limit) from None
            raise EngineCrashed(self._autopsy()) from None
        except EngineCrashed:  # a field of another kind
            self._end(at_once=True)
            raise
        except (program.Unreadable, ValueError, KeyError, TypeError, OverflowError, MemoryError, RecursionError) as error:
            self._end(at_once=True)
            reason = "an answer that cannot be read"
            if not self._binary:
                reason += f" from {self._command[0]}, which should speak version {program.PROTOCOL} of the protocol"
            if line := getattr(error, "doc", "").strip().partition("\n")[0]:  # the text of a JSONDecodeError
                reason += f". It starts with {line[:60]!r}: stdout is for answers only"
            raise EngineCrashed(reason) from None
        except BaseException:  # such as KeyboardInterrupt
            self._end(at_once=True)
            raise
        finally:
            if timer:
                timer.cancel()

    def _kill_late(self, expired: list[float], limit: float) -> None:
        expired.append(limit)
        if process := self._process:
            process.kill()

    def _autopsy(self) -> str:
        """Return how the process ended."""
        process = self._process
        assert process is not None
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:  # it closed its pipes, but goes on
            process.kill()
        code, last_line = process.wait(), self._last_line()
        self._end()
        how = f"exit code {code}" if code >= 0 else f"signal {-code}"
        name = f" ({signal.Signals(-code).name})" if -code in set(signal.Signals) else ""
        return f"{how}{name}" + (f": {last_line}" if last_line else "")

    def _last_line(self) -> str:
        """Return the last line of output. If Python or Node printed a stack, return the line above it, with the error."""
        if self._output is None:
            return ""
        size = self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, size - 8192))
        lines = [line.strip() for line in self._output.read().decode(errors="replace").splitlines() if line.strip()]
        stack = next((i for i, line in enumerate(lines) if line.startswith(_ERRORS)), None)
        last_lines = lines if stack is None else lines[: stack + 1]
        return "".join(char if char.isprintable() else "?" for char in (last_lines[-1] if last_lines else ""))[:_LONGEST_LINE]

    def _end(self, at_once: bool = False) -> None:
        if self._process is not None:
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe:
                    pipe.close()
            if at_once:
                self._process.kill()
            try:
                self._process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            end_group(self._process.pid)
        if self._life >= 0:
            os.close(self._life)
        if self._output:
            self._output.close()
        if self._work:
            shutil.rmtree(self._work, ignore_errors=True)
        self._forget_process()


@atexit.register
def close_workers() -> None:
    """End the processes of all idle workers. Each starts again with its next request."""
    for worker in list(_workers):
        if not worker.busy:
            worker.close()


def kill_workers() -> None:
    """End the processes of all workers at once. Requests that wait in other threads raise `EngineCrashed`."""
    for worker in list(_workers):
        if process := worker._process:
            process.kill()
            end_group(process.pid)


Process = subprocess.Popen[bytes]


def _wait(process: Process, descriptor: int, event: int, deadline: float) -> None:
    """Wait until a pipe can be read or written. Raise EOFError if the process ends, and TimeoutError after the deadline."""
    if not _CAN_WAIT:
        return
    poll = select.poll()
    poll.register(descriptor, event)
    while not poll.poll(max(0.0, min(deadline - monotonic(), _PATIENCE)) * 1000):
        if process.poll() is not None and not poll.poll(0):  # what it has forked can keep the pipe open
            raise EOFError
        if monotonic() >= deadline:
            raise TimeoutError


def _read_some(process: Process, most: int, deadline: float) -> bytes:
    assert process.stdout is not None
    descriptor = process.stdout.fileno()
    _wait(process, descriptor, _READ, deadline)
    part = os.read(descriptor, min(most, 1 << 20))
    if not part:
        raise EOFError
    return part


def _read_exactly(process: Process, count: int, deadline: float) -> bytes:
    """Return a number of bytes. Raise EOFError if there are fewer, TimeoutError after the deadline, and EndlessAnswer."""
    if count > LARGEST_ANSWER:
        raise EndlessAnswer
    parts = []
    while count:
        parts.append(_read_some(process, count, deadline))
        count -= len(parts[-1])
    return b"".join(parts)


def _read_line(process: Process, deadline: float) -> bytes:
    """Return a line. Each request has one answer, so nothing can follow it. Raise as `_read_exactly`."""
    parts, room = [_read_some(process, 1 << 20, deadline)], LARGEST_ANSWER
    while not parts[-1].endswith(b"\n"):
        parts.append(_read_some(process, 1 << 20, deadline))
        room -= len(parts[-1])
        if room < 0:
            raise EndlessAnswer
    return b"".join(parts)


def _write_all(process: Process, data: bytes, deadline: float) -> None:
    """Write bytes. Raise BrokenPipeError if the reader is gone, and TimeoutError after the deadline."""
    assert process.stdin is not None
    descriptor, rest = process.stdin.fileno(), memoryview(data)
    while rest:
        _wait(process, descriptor, _WRITE, deadline)
        rest = rest[os.write(descriptor, rest[:_PART]) :]
