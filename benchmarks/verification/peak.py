"""What this processor could do: loops of nothing but one kind of operation, on as many registers as fit, and plain writing."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import thread_time
from typing import Any

import numpy as np

from conservative.deferred_imports import kernels
from conservative.kernels import kernel

lanes: Any = kernels("lanes")
WIDTH = lanes.WIDTH
REPEATS = 200_000
MEGABYTES = 256
VALUES = 5
"""Values of two registers that a loop works on: enough to wait for none of them, and few enough to stay in registers."""


@kernel  # type: ignore[untyped-decorator]
def fuse_often(room: Any, repeats: int) -> None:
    """VALUES products and sums, rounded once, as often as asked for."""
    b, c = lanes.load(room, 0, WIDTH), lanes.load(room, WIDTH, WIDTH)
    v, w, x, y, z = c, c + c, c * c, b + c, b * c
    for _ in range(repeats):
        v, w, x, y, z = lanes.fuse(v, b, c), lanes.fuse(w, b, c), lanes.fuse(x, b, c), lanes.fuse(y, b, c), lanes.fuse(z, b, c)
    lanes.save(room, 0, v + w + x + y + z)


@kernel  # type: ignore[untyped-decorator]
def divide_often(room: Any, repeats: int) -> None:
    """VALUES divisions, as often as asked for."""
    b, c = lanes.load(room, 0, WIDTH), lanes.load(room, WIDTH, WIDTH)
    v, w, x, y, z = c, c + c, c * c, b + c, b * c
    for _ in range(repeats):
        v, w, x, y, z = b / v, b / w, b / x, b / y, b / z
    lanes.save(room, 0, v + w + x + y + z)


@kernel  # type: ignore[untyped-decorator]
def root_often(room: Any, repeats: int) -> None:
    """VALUES square roots, as often as asked for."""
    b, c = lanes.load(room, 0, WIDTH), lanes.load(room, WIDTH, WIDTH)
    v, w, x, y, z = c, c + c, c * c, b + c, b * c
    for _ in range(repeats):
        v, w, x, y, z = math.sqrt(v), math.sqrt(w), math.sqrt(x), math.sqrt(y), math.sqrt(z)
    lanes.save(room, 0, v + w + x + y + z)


LOOPS = {"an FMA": fuse_often, "a division": divide_often, "a square root": root_often}


def find_peaks(rounds: int = 20) -> dict[str, float]:
    """Return the time, s, of each operation on one double, by its name: of the fastest of interleaved rounds."""
    room = np.full(2 * WIDTH, 0.999)
    least = dict.fromkeys(LOOPS, math.inf)
    for _ in range(1 + rounds):
        for name, loop in LOOPS.items():
            room[:] = 0.999
            least[name] = min(least[name], spend(lambda loop=loop: loop(room, REPEATS)))  # type: ignore[misc]
    return {name: seconds / (REPEATS * VALUES * WIDTH) for name, seconds in least.items()}


def find_bandwidth(rounds: int = 5) -> float:
    """Return how many bytes per second are written to memory that no cache holds."""
    room = np.zeros(MEGABYTES * 2**17)
    return room.nbytes / min(spend(lambda: room.fill(1.0)) for _ in range(rounds))


def spend(call: Callable[[], object]) -> float:
    """Return the processor time of this thread, s, that a call takes."""
    start = thread_time()
    call()
    return thread_time() - start
