"""Whether a program speaks PROTOCOL.md: its answers to `hello`, `prepare`, `run` and `time`. Exact motions test conventions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from time import perf_counter

import numpy as np

from conservative.attitude import rotation_about
from conservative.body import RigidBody
from conservative.grid import Grid
from conservative.number_text import number
from conservative.references.engine import principal_axes
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.environment import worker_of
from conservative.references.environments.plain_numbers import describe, read_states
from conservative.references.worker.client import EndlessAnswer, EngineTimeout, Worker
from conservative.references.worker.program import WARM_UP
from conservative.scene import Scene

from .finding import Finding, Verdict

FREE = Scene("free body", RigidBody((2.1, 3.3, 4.2)), rotation_about((1, -1, 0.3), 1.1), np.array((0.9, -1.1, 0.7)), 1.0)
GRID = Grid(0.0025, 400, 40)
PACE = 0.2
"""Wall time of the calls in a measurement, s."""
TRIES = 5
"""Measurements of which one has to be honest: a busy machine can delay the exchange of any of them."""
ANSWERS = "answer each request once, in one line that ends with a newline (or one binary message), and flush stdout"
BUILD = "build it or change it as PROTOCOL.md describes"


def findings(subject: str, method: EngineMethod) -> Iterator[Finding]:
    """Yield the findings on the answers to `hello`, `prepare` and `run`. Raise `IntegrationFailed` for unusable ones."""
    worker = worker_of(method.environment)
    greeting = worker.greet()
    detail = f"{greeting.get('program')}, version {greeting['version']}"
    yield Finding(subject, "protocol", "hello", Verdict.RIGHT, detail=detail)
    try:
        run = _prepare(method, worker)
        read_states(worker.ask("run", run=run), (GRID.n_samples,))
    except NotImplementedError as reason:
        yield Finding(subject, "protocol", "run", Verdict.NOT_TESTED, detail=f"a free body is not supported ({reason})")
        return
    yield Finding(subject, "protocol", "run", Verdict.RIGHT)


def _prepare(method: EngineMethod, worker: Worker) -> int:
    return int(worker.ask("prepare", settings=method.settings, **describe(principal_axes(FREE), GRID))["run"])


def unusable(subject: str, failure: Exception) -> Finding:
    """Return the finding on a program that does not start, does not answer, or answers something else."""
    cause = getattr(failure, "cause", failure)
    remedy = ANSWERS if isinstance(cause, EngineTimeout | EndlessAnswer) else BUILD
    problem = getattr(cause, "reason", getattr(failure, "problem", getattr(failure, "outcome", "")))
    return Finding(subject, "protocol", "", Verdict.WRONG, detail=f"{problem}: {remedy}")


def times(subject: str, method: EngineMethod) -> Iterator[Finding]:
    """Yield the finding on the measured time of a run, with the time of a request beside its work.

    The time cannot exceed the wall time of the request, and most of a long request has to be its runs.
    """
    worker = worker_of(method.environment)
    try:
        run = _prepare(method, worker)
    except NotImplementedError as reason:
        yield Finding(subject, "times", "", Verdict.NOT_TESTED, detail=f"a free body is not supported ({reason})")
        return
    problem = ""
    for _ in range(TRIES):
        problem, text = _measure(worker, run)
        if not problem:
            break
    if problem:
        yield Finding(subject, "times", "", Verdict.WRONG, detail=f"{text}: {problem}")
        return
    rest = math.inf  # shortest time of a request without its call
    for _ in range(20):
        start = perf_counter()
        inside = float(worker.ask("time", run=run, calls=1)["seconds"])
        rest = min(rest, perf_counter() - start - inside)
    text += f". A request takes {1e6 * rest:.0f} µs more, which no measured time contains"
    text += ": call the run without measuring it only at the first `time` of a run" * (rest > 0.5 * WARM_UP)
    yield Finding(subject, "times", "", Verdict.RIGHT, detail=text)


def _measure(worker: Worker, run: int) -> tuple[str, str]:
    """Return the fault in the time of a long request, or "", and a sentence with its numbers."""
    calls, wall, seconds = 1, 0.0, 0.0
    while wall < PACE and calls < 1e6:
        calls, start = 4 * calls, perf_counter()
        seconds = float(worker.ask("time", run=run, calls=calls)["seconds"])
        wall = perf_counter() - start
    text = f"{number(seconds)} s for {calls} runs of {GRID.n_steps} steps, and {number(wall)} s with the exchange"
    if wall < PACE:
        return "`time` has to make `calls` runs", text
    if seconds > wall:
        return "`seconds` is in s, and only of the calls", text
    return ("`seconds` is the wall time of all calls together" if seconds < 0.5 * wall else ""), text
