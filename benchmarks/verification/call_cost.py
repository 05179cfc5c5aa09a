"""What a call costs beside the compiled code, us: a prepared run, its check, `solve` and `integrate`. Nothing is asserted.

    python -m conservative.benchmarks.verification.call_cost --steps 1 --steps 1000

Times are those of this thread alone, the smallest of many rounds in which all calls take turns. A busy machine makes them
longer all the same, so that what counts is what the calls add, in the same rounds, to the bare entries. These are the kernel's
and that of the conversion to body axes, with outputs that are there already.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import click

from conservative import registry
from conservative.deferred_imports import kernels
from conservative.integration import integrate
from conservative.method import Grid, Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

Call = Callable[[], object]
ROUNDS, SECONDS = 60, 2e-3
"""Rounds, and about how long each call is repeated in one, s."""


def record_entry(prepare: Callable[[], Trajectory], module: Any, name: str) -> Call:
    """Return the call of a compiled entry with the arguments that a run gives it."""
    entry, seen = getattr(module, name), []

    def record(*arguments: Any) -> Any:
        seen.append(arguments)
        return entry(*arguments)

    setattr(module, name, record)
    try:
        prepare()
    finally:
        setattr(module, name, entry)
    return lambda: entry(*seen[0])


def calls_of(method: Method, scene: Scene, grid: Grid) -> dict[str, Call]:
    """Return the calls to compare by name, each after a first time."""
    run, end = method.prepare(scene, grid), grid.dt * grid.n_steps

    def prepared() -> Trajectory:
        return method.prepare(scene, grid)()

    found: dict[str, Call] = {
        "kernel": record_entry(prepared, kernels(method.kernel), "enter"),
        "to body axes": record_entry(prepared, kernels("samples"), "to_body_axes"),
        "run": run,
        "run, checked": lambda: method.check(scene, grid, run()),
        "solve": lambda: method.solve(scene, grid),
        "integrate": lambda: integrate(scene, grid.dt, method, end, grid.every),
    }
    for call in found.values():
        call()
    return found


def time_calls(calls: dict[str, Call], rounds: int = ROUNDS) -> dict[str, float]:
    """Return the smallest time of each call in microseconds, that is 1e-6 s, of rounds in which they take turns."""
    repeats = {name: max(1, int(SECONDS / max(1e-9, time_call(call, 3)))) for name, call in calls.items()}
    return {
        name: 1e6 * min(times)
        for name, times in zip(
            calls,
            zip(*([time_call(call, repeats[name]) for name, call in calls.items()] for _ in range(rounds)), strict=True),
            strict=True,
        )
    }


def time_call(call: Call, repeats: int) -> float:
    """Return the time, s, that this thread takes for a call, on average over some."""
    start = time.thread_time_ns()
    for _ in range(repeats):
        call()
    return (time.thread_time_ns() - start) * 1e-9 / repeats


@click.command()
@click.option("--method", "-m", "names", multiple=True, help="Names.  [default: all with a compiled loop]")
@click.option("--scene", default="asymmetric_top", show_default=True)
@click.option("--steps", multiple=True, type=int, default=(1, 1000), show_default=True)
def main(names: tuple[str, ...], scene: str, steps: tuple[int, ...]) -> None:
    """Print what each call costs, and what it adds to the compiled code, us."""
    body = registry.scene(scene)
    compiled = [name for name, family in registry.list_families().items() if family.kernel and not family().unsupported(body)]
    for name in names or compiled:
        for n in steps:
            times = time_calls(calls_of(registry.method(name), body, Grid(body.dt, n, 1)))
            bare = times["kernel"] + times["to body axes"]
            rest = ", ".join(f"{call} +{cost - bare:.2f}" for call, cost in list(times.items())[2:])
            click.echo(f"{name}, {n} steps: compiled code {bare:.2f} us; {rest}")


if __name__ == "__main__":
    main()
