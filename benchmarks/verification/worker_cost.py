"""What an engine's own process costs: the same version of it in this process and in an environment, timed in turn.

    conservative engines install mujoco==4.0.0
    python -m conservative.benchmarks.verification.worker_cost --engine mujoco --version 4.0.0

States have to agree bit for bit. An empty request's way there and back is in no time that a report shows.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterator
from time import perf_counter

import click
import numpy as np

from conservative import registry
from conservative.errors import BadInput
from conservative.method import Grid, Method, grid_for
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.environments.workers import worker_of
from conservative.trajectory import Trajectory

from ..measures.timing import time_interleaved

SCENES = ("brick_flip", "asymmetric_top")


def round_trips(method: EngineMethod, count: int = 1000) -> list[float]:
    """Return how long the worker takes to answer requests that ask for no work, s."""
    worker, found = worker_of(method.environment, method.variables), []
    for _ in range(count):
        start = perf_counter()
        worker.ask("check", module="sys")
        found.append(perf_counter() - start)
    return found


def same_states(first: Trajectory, second: Trajectory) -> bool:
    """Return whether two trajectories agree bit for bit."""
    return np.array_equal(first.R_WB, second.R_WB) and np.array_equal(first.w_WB_B, second.w_WB_B)


def compare(here: Method, there: Method, rounds: int) -> Iterator[tuple[str, bool, float, float]]:
    """Yield, of each scene and for close and for distant samples: where, whether states agree, ratios of minimum and median."""
    for name in SCENES:
        scene = registry.scene(name)
        close = grid_for(scene, 0.01)
        for what, grid in (("every step", close), ("the end only", Grid(close.dt, 10 * close.n_steps, 10 * close.n_steps))):
            runs = {"here": here.prepare(scene, grid), "there": there.prepare(scene, grid)}
            same = same_states(runs["here"](), runs["there"]())
            times = time_interleaved(runs, rounds, min_time=0.02)
            first, second = times["here"], times["there"]
            yield f"{name}, {what}", same, second.minimum / first.minimum, second.median / first.median


def pairs(engine: str, version: str) -> Iterator[tuple[Method, EngineMethod]]:
    """Yield each setting of an engine in this process and in an environment.

    Raises
    ------
    BadInput
        Both are not of the same version.
    """
    for here in type(registry.method(engine)).variants():
        name, _, setting = here.name.partition(":")
        there = registry.method(f"{name}@{version}:{setting}")
        if here.label != there.label:
            raise BadInput("version", version, f"that of this process, {here.label}")
        assert isinstance(there, EngineMethod)
        yield here, there


@click.command()
@click.option("--engine", required=True, help="One that runs in this process, too.")
@click.option("--version", required=True, help="Its version in this process, of which there is an environment.")
@click.option("--rounds", default=40, help="Interleaved rounds.")
def main(engine: str, version: str, rounds: int) -> None:
    """Compare states and times; exit with 1 if a state differs."""
    differs, ratios, trips = 0, [], []
    for here, there in pairs(engine, version):
        for what, same, minimum, median in compare(here, there, rounds):
            bits = "same bits" if same else "OTHER BITS"
            click.echo(f"{here.label}, {what}: {bits}; time {minimum:.3f} (minimum), {median:.3f} (median)")
            differs += not same
            ratios.append(minimum)
        trips = [trip * 1e6 for trip in round_trips(there)]
    click.echo(f"a request and its answer: {min(trips):.0f} us at best, {statistics.median(trips):.0f} us at the median")
    click.echo(
        f"{len(ratios)} comparisons, {differs} with other bits, time {statistics.median(ratios):.3f} of that in this process"
    )
    sys.exit(bool(differs))


if __name__ == "__main__":
    main()
