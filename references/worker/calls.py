"""Python functions with a time limit: they run in another process, which is ended after the limit.

Neither a thread nor a signal can end any function, because an engine may keep the interpreter forever. A process can always be
killed. It is started afresh and not forked, so that threads of the parent do no harm and the main module of a script is not run
again. It stays for the next function, so that imports and compilation happen once.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from conservative.pickling import NotTransferable, dump, load

from .client import Worker, time_limit

T = TypeVar("T")
MOST_SHARED = 8
"""Shared objects that each side keeps: this one their bytes, the other one the objects and the code compiled for them."""
MOST_MODULES = 16
"""Largest number of modules that are sent because the other process cannot import them."""
_idle: list[Worker] = []


def run_within(limit: float, work: Callable[[], T], shared: Sequence[object] = (), process: Worker | None = None) -> T:
    """Return the result of `work`, or raise its exception, if it takes no longer than `limit` seconds.

    It runs in another process, so its changes to objects are not visible here.

    Parameters
    ----------
    limit
        Wall time in seconds, without the start of the process.
    work
        Function without arguments, such as a lambda. cloudpickle must be able to transfer it.
    shared
        Frozen, hashable objects that `work` refers to. They are sent once and kept; if the result contains them, they are the
        same objects again.
    process
        A `python_worker` that the caller closes. By default any idle one.

    Raises
    ------
    EngineTimeout
        It takes longer.
    EngineCrashed
        It ended its process.
    NotTransferable
        The function cannot be sent, or its result cannot be returned.
    MissingExtra
        cloudpickle, of the extra `report`, is not installed.
    """
    by_value: list[str] = []
    folder = ""
    with suppress(OSError):  # the working directory was removed
        folder = os.getcwd()  # noqa: PTH109  # links are not resolved
    while True:
        kept = [_bytes_of(value, tuple(by_value)) for value in shared]
        content = dump((sys.path, folder, kept, dump(work, shared, by_value)))
        try:
            worker = process or _idle.pop()
        except IndexError:  # none is idle
            worker = python_worker(show_output=True)
        with time_limit(limit):
            answer = worker.ask("call", adapter=__name__, function="do", content=np.frombuffer(content, np.uint8))
        if process is None:
            _idle.append(worker)
        kind, result = answer["kind"], answer["content"].tobytes()
        if kind == "returned":
            return load(result, shared)
        if kind == "raised":
            raise load(result, shared)
        name = result.decode()
        if kind == "lost" or name not in sys.modules or name in by_value or len(by_value) == MOST_MODULES:
            raise NotTransferable(name)
        by_value.append(name)  # the other process cannot import it


def python_worker(variables: dict[str, str] | None = None, memory: int = 0, show_output: bool = False) -> Worker:
    """Return a worker with the interpreter and the module path of this process."""
    start = f"import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {__package__}.program import serve; serve()"
    path = json.dumps([place for place in sys.path if isinstance(place, str)])
    command = [sys.executable or "python3", "-P", "-c", start, path]
    return Worker(command, variables={**os.environ, **variables} if variables else None, memory=memory, show_output=show_output)


@lru_cache(maxsize=MOST_SHARED)
def _bytes_of(value: object, by_value: tuple[str, ...]) -> bytes:
    return dump(value, (), by_value)


# ------------------------------------------------------------------------------------------------ in the other process


def do(content: Any) -> dict[str, Any]:
    """Return how pickled work ended, and the bytes of its result or exception.

    The kind "unknown" names a module that cannot be imported here; "lost" gives the reason why there are no bytes.
    """
    sys.path[:], folder, kept, work = load(content.tobytes())
    with suppress(OSError):
        os.chdir(folder)
    kind, result = _call(kept, work)
    return {"kind": kind, "content": np.frombuffer(result, np.uint8)}


def _call(kept: Sequence[bytes], work: bytes) -> tuple[str, bytes]:
    try:
        shared = [_load_shared(content) for content in kept]
        function = load(work, shared)
    except ModuleNotFoundError as error:
        return "unknown", (error.name or "").encode()
    try:
        kind, value = "returned", function()
    except Exception as error:
        kind, value = "raised", error
    try:
        return kind, dump(value, shared)
    except NotTransferable as error:
        return "lost", str(error).encode()


_load_shared = lru_cache(maxsize=MOST_SHARED)(load)
