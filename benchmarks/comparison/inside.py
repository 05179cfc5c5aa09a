"""What runs in the environment of a version: the worker's program loads this file, and what it imports is that version's own.

It asks of a version no more than `conservative` has had since methods are registered: names of methods and scenes, `Grid`,
`prepare`, `check`. What `given` has beside `task`, its name, is said with each task.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

from conservative import registry
from conservative.method import Grid, Method, Role
from conservative.scene import Scene

Answer = dict[str, Any]


def prepare(given: SimpleNamespace) -> Callable[[], Any]:
    """Return what does a task."""
    return TASKS[given.task](given)


def list_methods(given: SimpleNamespace) -> Callable[[], Answer]:
    """Return what lists the settings of the suite of methods that are called `names`, by default of all that are under test."""
    return lambda: {"methods": [_describe(method) for method in _methods(given.names)]}


def _methods(names: list[str]) -> Iterator[Method]:
    families = registry.list_families()
    for name in names or sorted(name for name, family in families.items() if family.role == Role.OURS):
        if name in families:
            yield from _suite_settings(families[name])
        elif name.partition(":")[0] in families:  # one that this version does not have is missing, and no error
            yield registry.method(name)


def _suite_settings(family: type[Method]) -> tuple[Method, ...]:
    found: Callable[[], tuple[Method, ...]] = getattr(family, "suite_settings", family.variants)
    return found()


def _describe(method: Method) -> Answer:
    engine = method.label if method.role == Role.ENGINE else ""
    return {"name": method.name, "label": method.label, "order": method.order, "engine": engine}


def describe_scene(given: SimpleNamespace) -> Callable[[], Answer]:
    """Return what says which motion a `scene` is, with its energies at attitudes `probes` (n, 3, 3)."""
    scene = _scene(given.scene)
    return lambda: {
        "inertia": scene.body.inertia,
        "R_WB0": scene.R_WB0,
        "w_WB_B0": scene.w_WB_B0,
        "ends": [scene.t_end, scene.dt],
        "energies": _energies(scene, given.probes),
        "invariants": [invariant.name for invariant in scene.invariants],
    }


def _energies(scene: Scene, probes: Any) -> list[float]:
    """Return energies, J, at attitudes (n, 3, 3); of a field that turns, at the start and at the end."""
    potential: Any = scene.potential  # a version may be older than the protocols of potentials
    if potential is None:
        return []
    if getattr(potential, "time_dependent", False):
        return [float(potential.energy_at(R, t)) for t in (0.0, scene.t_end) for R in probes]
    return [float(potential.energy(R)) for R in probes]


def describe_pair(given: SimpleNamespace) -> Callable[[], Answer]:
    """Return what says why a `method` cannot do a `scene`, empty if it can, and its longest step there, s."""
    scene, method = _scene(given.scene), registry.method(given.method)
    return lambda: {"unsupported": method.unsupported(scene) or "", "longest_step": float(method.longest_step(scene))}


def solve(given: SimpleNamespace) -> Callable[[], Answer]:
    """Return what integrates a `scene` from a start `w_WB_B0` over a grid (`dt`, `n_steps`, `every`), and checks the result."""
    scene, method = replace(_scene(given.scene), w_WB_B0=given.w_WB_B0), registry.method(given.method)
    grid = Grid(given.dt, given.n_steps, given.every)
    run = method.prepare(scene, grid)

    def solve_once() -> Answer:
        found = method.check(scene, grid, run())
        counts = {name: count for name, count in vars(found.counters).items() if count is not None}
        outcome = found.outcome
        failure = [outcome.kind.value, outcome.reason, outcome.step, outcome.time, outcome.residual]
        states = {"t": found.t, "R_WB": found.R_WB, "w_WB_B": found.w_WB_B}
        return {**states, "counts": counts, "failure": [] if outcome.ok else failure}

    return solve_once


def keep_running(given: SimpleNamespace) -> Callable[[], Any]:
    """Return the run of a `scene` over `n_steps` steps `dt` that keeps its end alone, for the worker to time."""
    return registry.method(given.method).prepare(_scene(given.scene), Grid(given.dt, given.n_steps, given.n_steps))


@lru_cache(maxsize=64)
def _scene(name: str) -> Scene:
    return registry.scene(name)


TASKS = {"list": list_methods, "scene": describe_scene, "pair": describe_pair, "solve": solve, "time": keep_running}
