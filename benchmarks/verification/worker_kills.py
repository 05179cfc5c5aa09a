"""Engines' processes killed at random moments: whatever is run when one dies, all rows come, and at most one is marked.

    python -m conservative.benchmarks.verification.worker_kills --method exudyn:RK44 --method mujoco@3.6.0:RK4 --count 30

A round takes all methods on all scenes. Each run ends as it did unharmed, bit for bit, or as a crash by the signal.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from time import perf_counter

import click
import numpy as np

from conservative import registry
from conservative.method import Method, grid_for
from conservative.references.environments.client import Worker
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.workers import worker_of
from conservative.scene import Scene

from ..studies.case import Case, Failure, Success, attempt

SCENES = ("brick_flip", "turned_brick", "separatrix", "stable_spin")
KILLED = "signal 9"

Row = Success | Failure


def cases(methods: list[Method]) -> list[Case]:
    """Return all methods on all scenes."""
    scenes = [registry.scene(name) for name in SCENES]
    return [Case("kills", scene, method, grid_for(scene, 0.01, _duration(scene))) for method in methods for scene in scenes]


def _duration(scene: Scene) -> float:
    return min(scene.t_end, 20.0)


def run_round(taken: list[Case], kill: Callable[[], None], delay: float) -> list[Row]:
    """Return how all cases end if something happens after a delay, s."""
    timer = threading.Timer(delay, kill)
    timer.start()
    try:
        return [attempt(case) for case in taken]
    finally:
        timer.cancel()
        timer.join()


def mistakes(unharmed: list[Row], rows: list[Row]) -> Iterator[str]:
    """Yield what is wrong with the rows of a round."""
    if len(rows) != len(unharmed):
        yield f"{len(rows)} rows instead of {len(unharmed)}"
    marked = [row for row in rows if isinstance(row, Failure)]
    if len(marked) > 1:
        yield f"{len(marked)} rows are marked"
    yield from (f"marked {row.outcome}" for row in marked if not row.outcome.reason.startswith(KILLED))
    for before, row in zip(unharmed, rows, strict=False):
        if isinstance(row, Success) and not (isinstance(before, Success) and _same(before, row)):
            yield f"another result of {row.trajectory.label}"


def _same(before: Success, after: Success) -> bool:
    return np.array_equal(before.trajectory.R_WB, after.trajectory.R_WB)


def kill_one(workers: list[Worker], draw: random.Random) -> None:
    """Kill the process of the worker that is asked, or of any where none is."""
    asked = [worker for worker in workers if worker.busy] or workers
    processes = [process for worker in asked if (process := worker.pid)]
    if processes:
        os.kill(draw.choice(processes), signal.SIGKILL)


@click.command()
@click.option("--method", "names", multiple=True, default=("exudyn:RK44",), help="Engines in environments.")
@click.option("--count", default=30, help="Rounds.")
@click.option("--seed", default=0)
def main(names: tuple[str, ...], count: int, seed: int) -> None:
    """Kill a worker in each round, at a random moment."""
    methods = [registry.method(name) for name in names]
    workers = [worker_of(each.environment, each.variables) for each in methods if isinstance(each, EngineMethod)]
    taken, draw = cases(methods), random.Random(seed)
    run_round(taken, lambda: None, 1e6)
    start = perf_counter()
    unharmed = run_round(taken, lambda: None, 1e6)
    duration, marked, wrong = perf_counter() - start, 0, 0
    for number in range(1, count + 1):
        rows = run_round(taken, lambda: kill_one(workers, draw), draw.uniform(0, duration))
        found = list(mistakes(unharmed, rows))
        marked += any(isinstance(row, Failure) for row in rows)
        wrong += bool(found)
        click.echo(f"round {number}: {'; '.join(found) or 'whole'}")
    click.echo(f"{count} rounds of {len(taken)} rows, {marked} with a row marked, {wrong} wrong")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
