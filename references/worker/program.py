"""The program that runs an engine in its environment. It speaks the protocol of PROTOCOL.md, and uses no other file.

It needs Python 3.9, and NumPy for arrays. An adapter is a Python file with a function `prepare(given)`: it builds the engine's
model from the numbers and settings in `given` and returns a run, a function without arguments that integrates and returns a
dictionary. An adapter may also define

    prepare_many(bodies)    the same for a list of bodies, in one run
    run.loop()              measured instead of the run: the loop as users of the engine write it, without reading of samples
    run.renew()             called before each measured call, and not measured
    run.dispose()           called when the run is not needed any more

and may import files of its own folder, `from .shared import sample`.
"""

from __future__ import annotations

import faulthandler
import gc
import importlib
import json
import math
import os
import struct
import sys
from functools import partial
from time import perf_counter
from types import ModuleType, SimpleNamespace

TYPE_CHECKING = False
if TYPE_CHECKING:  # importing typing costs time at every start
    from collections.abc import Callable
    from typing import Any

    Message = dict[str, Any]

PROTOCOL = 1
"""Version of the protocol."""
MAGIC = b"cv01"
"""First bytes of a message in binary framing."""
PREFIX = struct.Struct("<4sIQ")
"""`MAGIC`, and the lengths of the JSON and of the arrays in bytes."""
NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
"""JSON has no such numbers, so they travel as text."""
WARM_UP = 0.02
"""Time in seconds that a run has to spend in unmeasured calls before it is measured: compilers optimise during these."""


class Unreadable(Exception):
    """The bytes received are not a message."""


def to_json(value: Any) -> bytes:
    """Return a message in one line. NumPy arrays become lists, numbers that are not finite become text."""
    try:
        text = json.dumps(value, allow_nan=False, default=lambda array: array.tolist())
    except ValueError:
        text = json.dumps(_name_numbers(value), allow_nan=False)
    return text.encode() + b"\n"


def _name_numbers(value: Any) -> Any:
    """Return a value with lists for NumPy arrays, and text for floats that are not finite."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {name: _name_numbers(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_name_numbers(item) for item in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def from_json(data: bytes) -> Message:
    """Return the message in a line of JSON. Raise `Unreadable` if it is not an object."""
    message = json.loads(data)
    if not isinstance(message, dict):
        raise Unreadable(data[:80])
    restored: Message = _restore_numbers(message) if b'nan"' in data or b'inf"' in data else message
    return restored


def _restore_numbers(value: Any) -> Any:
    """Return a value with floats for the texts of `NOT_FINITE`."""
    if isinstance(value, dict):
        return {name: _restore_numbers(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_restore_numbers(item) for item in value]
    return NOT_FINITE.get(value, value) if isinstance(value, str) else value


def pack(message: Message) -> bytes:
    """Return a message in binary framing: a prefix, JSON, and the bytes of all NumPy arrays."""
    arrays = {name: value for name, value in message.items() if hasattr(value, "tobytes") and value.shape}
    kinds = [[name, array.dtype.str, array.shape] for name, array in arrays.items()]
    header = to_json({**{name: value for name, value in message.items() if name not in arrays}, "arrays": kinds})
    data = b"".join(array.tobytes() for array in arrays.values())
    return PREFIX.pack(MAGIC, len(header), len(data)) + header + data


def unpack(read: Callable[[int], bytes]) -> Message:
    """Return the next message in binary framing; `read` returns a given number of bytes, or raises EOFError at the end.

    Raise `Unreadable` if the bytes are not a message.
    """
    magic, header, size = PREFIX.unpack(read(PREFIX.size))
    if magic != MAGIC:
        raise Unreadable(magic)
    message = from_json(read(header))
    kinds, data, start = message.pop("arrays"), read(size) if size else b"", 0
    for name, kind, shape in kinds:
        import numpy as np

        array = np.frombuffer(data, kind, math.prod(shape), start).reshape(shape)
        message[name] = array.copy()  # writable
        start += array.nbytes
    return message


class Runs:
    """The operations of the protocol, on the runs that have been prepared."""

    def __init__(self) -> None:
        self._adapters: dict[str, Any] = {}
        self._runs: dict[int, Callable[[], Message]] = {}
        self._spent: dict[int, float] = {}  # seconds in calls that were not measured
        self._count = 0

    def check(self, module: str) -> Message:
        importlib.import_module(module)
        return {}

    def call(self, adapter: str, function: str, **values: Any) -> Message:
        return getattr(self._load(adapter), function)(**values)

    def prepare(self, adapter: str, settings: Message, **numbers: Any) -> Message:
        loaded = self._load(adapter)
        rows = numbers.pop("rows", None)
        if rows is None:
            run = loaded.prepare(SimpleNamespace(**numbers, **settings))
        else:
            run = loaded.prepare_many([SimpleNamespace(**body, **settings) for body in _split(numbers, rows)])
        self._count += 1
        self._runs[self._count], self._spent[self._count] = run, 0.0
        return {"run": self._count}

    def _load(self, adapter: str) -> Any:
        """Return the module of an adapter, given by its path, or by its name if it can be imported."""
        if adapter not in self._adapters:
            name = adapter
            if os.path.isabs(adapter):  # noqa: PTH117  # importing pathlib costs time at every start
                folder, file = os.path.split(adapter)
                # A package of the folder, so that `from .shared import ...` works in adapters.
                package = ModuleType(f"adapters_{len(self._adapters)}")
                package.__path__ = [folder]
                sys.modules[package.__name__] = package
                name = f"{package.__name__}.{file[:-3]}"
            self._adapters[adapter] = importlib.import_module(name)
        return self._adapters[adapter]

    def run(self, run: int) -> Message:
        start = perf_counter()
        samples = self._runs[run]()
        self._spent[run] += perf_counter() - start
        return samples

    def time(self, run: int, calls: int) -> Message:
        while self._spent[run] < WARM_UP:
            self.run(run)
        gc.disable()
        try:
            return {"seconds": _wall_time(self._runs[run], calls)}
        finally:
            gc.enable()

    def forget(self, number: int) -> None:
        run = self._runs.pop(number, None)
        getattr(run, "dispose", lambda: None)()


def _split(numbers: Message, rows: list[str]) -> list[Message]:
    """Return the numbers of each body: those named in `rows` have a row per body, all bodies share the others."""
    shared = {name: value for name, value in numbers.items() if name not in rows}
    # .item() gives floats of Python, which some engines insist on.
    bodies = zip(*([row if row.shape else row.item() for row in numbers[name]] for name in rows))  # noqa: B905
    return [{**shared, **dict(zip(rows, body))} for body in bodies]  # noqa: B905


def _wall_time(run: Any, calls: int) -> float:
    renew: Callable[[], None] | None = getattr(run, "renew", None)
    loop = getattr(run, "loop", run)
    # A run in another process measures its loop itself, without the exchange with it.
    if inner := getattr(getattr(run, "own_loop", loop), "wall_time", None):
        return float(inner(calls))
    if renew is None:
        start = perf_counter()
        for _ in range(calls):
            loop()
        return perf_counter() - start
    total = 0.0
    for _ in range(calls):
        renew()
        start = perf_counter()
        loop()
        total += perf_counter() - start
    return total


def answer(runs: Runs, do: str, forget: tuple[int, ...] = (), **values: Any) -> Message:
    """Return the answer to a request. Exceptions become answers as well, even `SystemExit`."""
    try:
        for number in forget:
            runs.forget(number)
        if do not in ("check", "call", "prepare", "run", "time"):
            raise ValueError(f"no operation {do!r}")
        return getattr(runs, do)(**values)
    except BaseException as error:
        kind = "unsupported" if isinstance(error, NotImplementedError) else type(error).__name__
        return {"error": kind, "message": " ".join(str(error).split())[:2000]}


def serve() -> None:
    """Answer requests until stdin closes."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # From here on stdin is empty and stdout goes to stderr, as engines print.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    faulthandler.enable()
    greeting = requests.readline()
    receive: Callable[[], Message] = partial(unpack, partial(_read, requests))
    if greeting:
        if not _end_with(from_json(greeting).get("life")):
            receive = _receive_in_thread(receive)
        version = ".".join(map(str, sys.version_info[:3]))
        answers.write(to_json({"protocol": PROTOCOL, "program": "python", "version": version, "framing": "binary"}))
        answers.flush()
    runs = Runs()
    while True:
        try:
            request = receive()
        except EOFError:
            os._exit(0)  # some engines crash in their exit handlers
        answers.write(pack(answer(runs, **request)))
        answers.flush()


def _read(stream: Any, count: int) -> bytes:
    data: bytes = stream.read(count)
    if len(data) < count:
        raise EOFError
    return data


def _end_with(life: int | None) -> bool:
    """Have the system end this process when the client is gone and the pipe `life` closes, even inside an engine's loop.

    Return False if that is not possible.
    """
    if life is None:
        return False
    try:
        import fcntl

        # The signal goes to the whole group if this process leads it: to processes that an engine has forked, too.
        fcntl.fcntl(life, fcntl.F_SETOWN, os.getpid() if os.getpgrp() != os.getpid() else -os.getpid())
        fcntl.fcntl(life, fcntl.F_SETFL, fcntl.fcntl(life, fcntl.F_GETFL) | os.O_ASYNC)  # sends SIGIO
    except (ImportError, OSError, AttributeError):  # not available on this system
        return False
    return True


def _receive_in_thread(receive: Callable[[], Message]) -> Callable[[], Message]:
    """Return a function that returns the next request, from a thread that ends this process when stdin closes, also in a run.

    An engine that keeps the interpreter ends with its run.
    """
    from queue import SimpleQueue
    from threading import Thread

    requests: Any = SimpleQueue()

    def read() -> None:
        try:
            while True:
                requests.put(receive())
        finally:
            os._exit(0)

    Thread(target=read, daemon=True).start()
    return requests.get


if __name__ == "__main__":
    serve()
