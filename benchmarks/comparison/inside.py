"""The code that runs in the environment of a version: the worker loads this file, and its imports are those of that version.

It uses only parts of `conservative` that old versions have as well: names of methods and scenes, `Grid`, `prepare`, `check`.
`given` has the name of a `task`, and the values that the docstring of the task names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

from conservative import registry
from conservative.grid import Grid
from conservative.method import Method, Role
from conservative.scene import Scene

Answer = dict[str, Any]


def prepare(given: SimpleNamespace) -> Callable[[], Any]:
    """Return the function of a task."""
    return TASKS[given.task](given)


def list_methods(given: SimpleNamespace) -> Callable[[], Answer]:
    """List the settings of the methods `names` in the suite, by default of all with the role `Role.OURS`."""

    def describe(method: Method) -> Answer:
        engine = method.label if method.role == Role.ENGINE else ""
        return {"name": method.name, "label": method.label, "order": method.order, "engine": engine}

    return lambda: {"methods": [describe(method) for method in _methods(given.names)]}


def _methods(names: list[str]) -> Iterator[Method]:
    families = registry.list_families()
    for name in names or sorted(name for name, family in families.items() if family.role == Role.OURS):
        if name in families:
            yield from _suite_settings(families[name])
        elif name.partition(":")[0] in families:  # a method that this version does not have is a missing row, not an error
            yield registry.method(name)


def _suite_settings(family: Any) -> tuple[Method, ...]:
    if hasattr(family, "settings_for"):
        return tuple(family.settings_for("suite"))
    return tuple(getattr(family, "suite_settings", family.variants)())  # versions before cards


def describe_scene(given: SimpleNamespace) -> Callable[[], Answer]:
    """Describe the motion of a `scene`, with its energies, J, at attitudes `probes` (n, 3, 3)."""
    scene = _scene(given.scene)
    potential: Any = scene.potential  # a version may be older than the protocols of potentials
    if potential is None:
        energies = []
    elif getattr(potential, "time_dependent", False):
        energies = [float(potential.energy_at(R, t)) for t in (0.0, scene.t_end) for R in given.probes]
    else:
        energies = [float(potential.energy(R)) for R in given.probes]
    return lambda: {
        "inertia": scene.body.inertia,
        "R_WB0": scene.R_WB0,
        "w_WB_B0": scene.w_WB_B0,
        "ends": [scene.t_end, scene.dt],
        "energies": energies,
        "invariants": [invariant.name for invariant in scene.invariants],
    }


def describe_pair(given: SimpleNamespace) -> Callable[[], Answer]:
    """Describe why a `method` does not support a `scene`, empty if it does, and its longest step there, s."""
    scene, method = _scene(given.scene), registry.method(given.method)
    return lambda: {"unsupported": method.unsupported(scene) or "", "longest_step": float(method.longest_step(scene))}


def solve(given: SimpleNamespace) -> Callable[[], Answer]:
    """Integrate a `scene` by a `method` from `w_WB_B0` over a grid (`dt`, `n_steps`, `every`), and check the result."""
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
    """Return the run of a `scene` by a `method` over `n_steps` steps `dt`, final state only, for the worker to time."""
    return registry.method(given.method).prepare(_scene(given.scene), Grid(given.dt, given.n_steps, given.n_steps))


@lru_cache(maxsize=64)
def _scene(name: str) -> Scene:
    return registry.scene(name)


TASKS = {"list": list_methods, "scene": describe_scene, "pair": describe_pair, "solve": solve, "time": keep_running}
