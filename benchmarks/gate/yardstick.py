"""What our kernels' time is measured in: a small fixed loop, compiled the same way, timed in turn with them.

The loop turns a free body by an explicit midpoint step and normalises: like our kernels a chain of dependent additions,
multiplications, one division and one root in registers. It shares no code with them, so that no change to them changes it.

What is compared is the fastest of many short samples of each, both taken until more of them change nothing. Short means that
most fit between two interruptions, and the fastest is what the machine can do: on a machine with three times as many busy
processes as cores the ratio of minimums repeats to 1 % where that of medians scatters by 5 %. Now and then a machine is slow
for some seconds, and where its machine code happens to lie makes a kernel up to 7 % slower for as long as a process lives. What
is too slow for a baseline is therefore measured again in new processes, and only what stays too slow is slow.
"""

from __future__ import annotations

import inspect
import math
import subprocess
import sys
from collections.abc import Callable
from functools import lru_cache
from time import sleep
from typing import Any

from conservative import registry
from conservative.method import Grid, Method
from conservative.scene import Scene

from ..measures.timing import wall_time, without_collector

SAMPLE = 0.0004
"""Duration of a sample, s."""
ROUNDS, MOST_ROUNDS = 30, 300
"""Samples of each in one batch, and in all."""
MINIMUM_TOLERANCE, STABLE_BATCHES = 0.002, 3
"""Sampling stops when STABLE_BATCHES batches in a row lower no minimum by more than this fraction."""
MOST_STEPS = 2**20
"""Steps of a sample at most, for what takes no time."""
PREPARATIONS = 4
"""Preparations of a method that are timed: where its arrays happen to lie in memory can cost a tenth."""
RETRIES, PAUSE = 3, 0.5
"""How often what looks too slow is measured again, each time in a new process, and the time, s, before each."""


def step_reference_body(n_steps: int, h: float) -> float:
    """Take n_steps steps of h s of a body with moments 1, 2, 3 kg m^2 and return a number that depends on every one of them."""
    x, y, z = 0.3, 1.1, -0.7
    a, b, c, d = 1.0, 0.0, 0.0, 0.0
    for _ in range(n_steps):
        u = x - 0.5 * h * y * z
        v = y + 0.5 * h * z * x
        w = z - h * x * y / 6.0
        x, y, z = x - h * v * w, y + h * w * u, z - h * u * v / 3.0
        p, q, r = 0.5 * h * u, 0.5 * h * v, 0.5 * h * w
        a, b, c, d = a - b * p - c * q - d * r, b + a * p + c * r - d * q, c + a * q + d * p - b * r, d + a * r + b * q - c * p
        s = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
        a, b, c, d = a * s, b * s, c * s, d * s
    return a + x


def time_ratio_elsewhere(scene: str, method: str) -> float:
    """Return the time ratio of a registered method at the step of a registered scene, measured in a process of its own."""
    command = [sys.executable, "-m", "conservative.benchmarks.gate.yardstick", scene, method]
    return float(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)


def confirm(ratio: float, limit: float, measure: Callable[[], float]) -> float:
    """Return the least of a ratio and, as long as it is above a limit, of what repeated measurements find."""
    for _ in range(RETRIES):
        if ratio <= limit:
            break
        sleep(PAUSE)
        ratio = min(ratio, measure())
    return ratio


@lru_cache(maxsize=1)
def compile_reference() -> Any:
    """Return `step_reference_body`, compiled once in a process."""
    from numba import njit

    loop: Any = njit(cache=True, error_model="numpy")(step_reference_body)
    loop(1, 1e-3)
    return loop


def definition() -> str:
    """Return the source of all that a ratio depends on beside the method.

    The rows of a baseline hold a hash of this text. In it the function is called `turn`, so that its name here is free.
    """
    source = inspect.getsource(step_reference_body).replace(step_reference_body.__name__, "turn", 1)
    return source + f"{SAMPLE, ROUNDS, MINIMUM_TOLERANCE, STABLE_BATCHES, PREPARATIONS}"


def time_ratio(method: Method, scene: Scene, dt: float) -> float:
    """Return the time of a step of the method, in steps of the yardstick."""
    loop = compile_reference()
    steps, run = last_a_sample(lambda n: method.prepare(scene, Grid(dt, n, n)))
    reference_steps, reference = last_a_sample(lambda n: lambda: loop(n, 1e-3))
    again = [method.prepare(scene, Grid(dt, steps, steps)) for _ in range(PREPARATIONS - 1)]
    theirs, *ours = measure_minimums(reference, run, *again)
    return (min(ours) / steps) / (theirs / reference_steps)


def last_a_sample(prepare: Callable[[int], Callable[[], Any]]) -> tuple[int, Callable[[], Any]]:
    """Return the number of steps that last a sample, to a few per cent, and the run that takes them."""
    n = 16
    while True:
        run = prepare(n)
        run()
        spent = min(wall_time(run) for _ in range(5))
        if spent >= 0.9 * SAMPLE or n >= MOST_STEPS:
            return n, run
        n = max(n + 1, math.ceil(n * min(8.0, SAMPLE / max(spent, 1e-9))))


def measure_minimums(*runs: Callable[[], Any]) -> tuple[float, ...]:
    """Return the shortest time, s, of each run, sampled in turn until none gets shorter."""
    shortest = [math.inf for _ in runs]
    taken, quiet = 0, 0
    with without_collector():
        while quiet < STABLE_BATCHES and taken < MOST_ROUNDS:
            before = list(shortest)
            for _ in range(ROUNDS):
                shortest = [min(best, wall_time(run)) for best, run in zip(shortest, runs, strict=True)]
            taken += ROUNDS
            calm = all(best > (1 - MINIMUM_TOLERANCE) * old for best, old in zip(shortest, before, strict=True))
            quiet = quiet + 1 if calm else 0
    return tuple(shortest)


if __name__ == "__main__":
    _scene = registry.scene(sys.argv[1])
    print(time_ratio(registry.method(sys.argv[2]), _scene, _scene.dt))
