"""Pipes that are read and written before a deadline, as `time.monotonic` tells it, s."""

from __future__ import annotations

import os
import select
from time import monotonic
from typing import IO


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
    """Write bytes until a deadline, in s. Raises BrokenPipeError where nobody reads them, and TimeoutError."""
    descriptor, rest = pipe.fileno(), memoryview(data)
    while rest:
        _wait(descriptor, select.POLLOUT, deadline)
        rest = rest[os.write(descriptor, rest[: select.PIPE_BUF]) :]
