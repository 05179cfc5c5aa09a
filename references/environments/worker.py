"""The program that runs in an engine's environment: started by path, asked over pipes, and nothing else of ours is there.

It needs Python 3.9 and NumPy. A message is a prefix, values as JSON, and arrays as the bytes that NumPy has of them:

    b"cv01", length of the JSON, length of the arrays        4 + 4 + 8 bytes
    {..., "arrays": [[name, dtype, shape], ...]}              UTF-8
    the arrays, one after the other

What is asked is one of `OPERATIONS`; the answer has what was found, or `error` and `message`. An adapter is a file with a
function `prepare(given)`, which returns a function without arguments that integrates and returns values and arrays; some have
`prepare_many(bodies)` for many at once, which is given a list of them.
"""

from __future__ import annotations

import faulthandler
import gc
import importlib.util
import json
import os
import struct
import sys
from time import perf_counter_ns
from types import SimpleNamespace

TYPE_CHECKING = False
if TYPE_CHECKING:  # no import of typing where nobody checks types: a worker starts faster
    from collections.abc import Callable
    from types import ModuleType
    from typing import Any

    Read = Callable[[int], bytes]
    Message = dict[str, Any]

MAGIC = b"cv01"
PREFIX = struct.Struct("<4sIQ")
LARGEST_FILE = 1 << 28
"""Bytes that a file may have that an engine writes, what it prints included."""


class Unreadable(Exception):
    """What came over the pipe is no message."""


def pack(message: Message) -> bytes:
    """Return a message as bytes; values that are NumPy arrays travel as they are, everything else as JSON."""
    arrays = {name: value for name, value in message.items() if hasattr(value, "tobytes") and value.shape}
    kinds = [[name, array.dtype.str, array.shape] for name, array in arrays.items()]
    values = {name: value for name, value in message.items() if name not in arrays}
    header = json.dumps({**values, "arrays": kinds}, default=_plain).encode()
    data = b"".join(array.tobytes() for array in arrays.values())
    return PREFIX.pack(MAGIC, len(header), len(data)) + header + data


def _plain(value: Any) -> Any:
    return value.tolist()  # a number of NumPy's, or an array without axes


def unpack(read: Read) -> Message:
    """Return the next message, from a function that returns so many bytes.

    Raises
    ------
    EOFError
        There is none.
    Unreadable
        It begins as no message does.
    """
    magic, header, data = PREFIX.unpack(read(PREFIX.size))
    if magic != MAGIC:
        raise Unreadable(f"a message begins with {magic!r}")
    message: Message = json.loads(read(header))
    kinds = message.pop("arrays")
    return message | _arrays(kinds, read(data) if data else b"")


def _arrays(kinds: list[Any], data: bytes) -> Message:
    import numpy as np

    found, start = {}, 0
    for name, kind, shape in kinds:
        count = int(np.prod(shape))
        found[name] = np.frombuffer(data, kind, count, start).reshape(shape).copy()
        start += found[name].nbytes
    return found


# ------------------------------------------------------------------------------------------------- what the worker is asked


class Adapters:
    """The adapters that were loaded, and the runs that they have prepared, by number."""

    def __init__(self) -> None:
        self._modules: dict[str, ModuleType] = {}
        self._runs: dict[int, Callable[[], Message]] = {}
        self._count = 0

    def check(self, module: str) -> Message:
        """Import an engine."""
        importlib.import_module(module)
        return {"python": sys.version.split()[0]}

    def prepare(self, adapter: str, settings: Message, **numbers: Any) -> Message:
        """Prepare a run of a scene, which is numbers, with settings of the engine, or of many if some stand in rows."""
        loaded = self._load(adapter)
        rows = numbers.pop("rows", None)
        if rows is None:
            run = loaded.prepare(SimpleNamespace(**numbers, **settings))
        else:
            run = loaded.prepare_many([SimpleNamespace(**body, **settings) for body in _split(numbers, rows)])
        self._count += 1
        self._runs[self._count] = run
        return {"run": self._count}

    def _load(self, adapter: str) -> ModuleType:
        """Return an adapter, imported from its path."""
        if adapter not in self._modules:
            spec = importlib.util.spec_from_file_location(f"adapter_{len(self._modules)}", adapter)
            module = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
            spec.loader.exec_module(module)  # type: ignore[union-attr]
            self._modules[adapter] = module
        return self._modules[adapter]

    def run(self, run: int) -> Message:
        """Return what a run finds."""
        return self._runs[run]()

    def time(self, run: int, calls: int) -> Message:
        """Return the wall time of so many calls of a run, s, in a loop that runs here."""
        gc.disable()
        try:
            return {"seconds": _wall_time(self._runs[run], calls)}
        finally:
            gc.enable()

    def forget(self, run: int) -> None:
        """Forget a run that nobody can ask for any more."""
        self._runs.pop(run, None)


def _split(numbers: Message, rows: list[str]) -> list[Message]:
    """Return the numbers of each body; those of the names in `rows` have a row for each, the others are all bodies'."""
    count = len(numbers[rows[0]])
    shared = {name: value for name, value in numbers.items() if name not in rows}
    return [{**shared, **{name: _unwrap(numbers[name][i]) for name in rows}} for i in range(count)]


def _unwrap(value: Any) -> Any:
    """Return an array as it is, and a number of NumPy's as Python's."""
    return value if value.shape else value.item()


def _wall_time(run: Any, calls: int) -> float:
    """Return the wall time of calls, s. What a run has to do before each call, its `renew`, is in no time."""
    renew: Callable[[], None] | None = getattr(run, "renew", None)
    if renew is not None:
        return sum(_renewed_time(run, renew) for _ in range(calls))
    start = perf_counter_ns()
    for _ in range(calls):
        run()
    return (perf_counter_ns() - start) * 1e-9


def _renewed_time(run: Any, renew: Callable[[], None]) -> float:
    renew()
    start = perf_counter_ns()
    run()
    return (perf_counter_ns() - start) * 1e-9


OPERATIONS = ("check", "prepare", "run", "time")


def answer(adapters: Adapters, do: str, forget: list[int], **values: Any) -> Message:
    """Return the answer to a request; whatever an engine raises is an answer, too."""
    try:
        for run in forget:
            adapters.forget(run)
        if do not in OPERATIONS:
            raise ValueError(f"no operation {do!r}")
        return getattr(adapters, do)(**values)
    except BaseException as error:  # an engine may even call sys.exit
        return {"error": type(error).__name__, "message": " ".join(str(error).split())[:2000]}


# ------------------------------------------------------------------------------------------------------------ the process


def serve(memory: int, life: int) -> None:
    """Answer requests until there are no more; `memory` is in bytes, `life` a pipe that ends with who started us."""
    requests, answers = _take_pipes()
    faulthandler.enable()
    _limit(memory)
    _end_with(life)
    adapters = Adapters()
    while True:
        try:
            request = unpack(lambda count: _read(requests, count))
        except EOFError:
            os._exit(0)  # what an engine does at exit is of no use here, and some of them crash in it
        answers.write(pack(answer(adapters, **request)))
        answers.flush()


def _read(stream: Any, count: int) -> bytes:
    data: bytes = stream.read(count)
    if len(data) < count:
        raise EOFError
    return data


def _take_pipes() -> tuple[Any, Any]:
    """Return the pipes of stdin and stdout, and put others in their place: whatever an engine prints goes where stderr goes."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    return requests, answers


def _limit(memory: int) -> None:
    """Keep a run that needs too much memory, or prints too much, from harming others."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
        resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST_FILE, LARGEST_FILE))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with open("/proc/self/oom_score_adj", "w") as file:  # noqa: PTH123 - the first that a system without memory ends
            file.write("1000")
    except (ImportError, OSError, ValueError):
        return  # a system without such limits


def _end_with(life: int) -> None:
    """Have the system end this process when the other end of a pipe closes, even in the middle of an engine's loop."""
    try:
        import fcntl

        fcntl.fcntl(life, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(life, fcntl.F_SETFL, fcntl.fcntl(life, fcntl.F_GETFL) | os.O_ASYNC)
    except (ImportError, OSError, AttributeError):
        return


if __name__ == "__main__":
    serve(int(sys.argv[1]), int(sys.argv[2]))
