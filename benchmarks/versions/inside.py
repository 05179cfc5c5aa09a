"""The code that runs in the environment of a version. The worker loads this file there, and it imports that version.

It uses only parts of `conservative` that old versions have as well: names of methods and scenes, `Grid`, `prepare`, `check`.
The worker calls its functions, or prepares the run of a task.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import entry_points
from types import SimpleNamespace
from typing import Any

import numpy as np

from conservative import Grid, RigidBody, Scene, registry
from conservative.errors import Unsupported
from conservative.method import Method, Role
from conservative.potentials.uniform_gravity import UniformGravity

Answer = dict[str, Any]
Array = np.ndarray[Any, Any]
_scene = lru_cache(maxsize=64)(registry.scene)


def prepare(task: SimpleNamespace) -> Callable[[], Any]:
    """Return the run of a task, "solve", "probe" or "time"."""
    return {"solve": solve, "probe": probe, "time": keep_running}[task.task](task)


def list_methods(names: list[str], project: str = "") -> Answer:
    """List the settings of the methods `names` in the suite.

    By default they are the methods with the role `Role.OURS` that the project registers, or all of that role if it registers
    none.
    """
    families: dict[str, Any] = dict(registry.list_families())
    registered = set()
    for entry_point in entry_points(group="conservative.methods"):
        if entry_point.dist and re.sub(r"[-_.]+", "-", entry_point.dist.name).lower() == project:
            registered.add(entry_point.name)
    with suppress(ImportError):  # a version without programs
        from conservative.programs import list_programs

        families |= dict.fromkeys(set(list_programs()).difference(families))
    methods: list[Method] = []
    ours = [name for name, family in sorted(families.items()) if family and family.role == Role.OURS]
    for name in names or [name for name in ours if name in registered] or ours:
        family = families.get(name)
        if family and hasattr(family, "settings_for"):
            methods += family.settings_for("suite")
        elif family:  # a version before `settings_for`
            methods += getattr(family, "suite_settings", family.variants)()
        elif name.partition(":")[0] in families:  # a method that this version does not have is a missing row, not an error
            methods.append(registry.method(name))

    def describe(method: Method) -> Answer:
        engine = method.label if method.role == Role.ENGINE and families[method.family] else ""
        numbers = {"order": method.order, "precision": getattr(method, "precision", "f64")}
        return {"name": method.name, "label": method.label, "engine": engine, **numbers}

    return {"methods": [describe(method) for method in methods]}


def describe_pair(scene: str, method: str) -> Answer:
    """Describe why a method does not support a scene (empty if it does), and its longest step there in seconds."""
    built, chosen = _scene(scene), registry.method(method)
    reason = chosen.unsupported(built) or ""
    try:
        if not reason:  # some engines refuse a scene only when they build it
            chosen.prepare(built, Grid(built.dt, 1, 1))
    except Unsupported as error:
        reason = str(error.__context__ or error)  # the engine's own message, which its adapter has wrapped
    return {"unsupported": reason, "longest_step": float(chosen.longest_step(built))}


def solve(task: SimpleNamespace) -> Callable[[], Answer]:
    """Integrate a `scene` by a `method` from `w_WB_B0` over a grid (`dt`, `n_steps`, `every`), and check the result."""
    scene, method = replace(_scene(task.scene), w_WB_B0=task.w_WB_B0), registry.method(task.method)
    grid = Grid(task.dt, task.n_steps, task.every)
    run = method.prepare(scene, grid)

    def solve_once() -> Answer:
        trajectory = method.check(scene, grid, run())
        counts = {name: count for name, count in vars(trajectory.counters).items() if count is not None}
        outcome = trajectory.outcome
        failure = [outcome.kind.value, outcome.reason, outcome.step, outcome.time, outcome.residual]
        states = {"t": trajectory.t, "R_WB": trajectory.R_WB, "w_WB_B": trajectory.w_WB_B}
        return {**states, "counts": counts, "failure": [] if outcome.ok else failure}

    return solve_once


def probe(task: SimpleNamespace) -> Callable[[], Answer]:
    """Integrate a body of principal `moments` about a fixed point, with a `weight` at `com`, and do not check the result."""
    field = UniformGravity(task.weight, task.com) if task.weight else None
    scene = Scene("probe", RigidBody(task.moments), task.R_WB0, task.w_WB_B0, 1.0, potential=field)
    try:
        run = registry.method(task.method).prepare(scene, Grid(task.dt, task.n_steps, task.every))
    except Unsupported as error:
        raise NotImplementedError(str(error)) from None  # the worker answers that the scene is unsupported

    def solve_once() -> Answer:
        trajectory = run()
        return {"t": trajectory.t, "R_WB": trajectory.R_WB, "w_WB_B": trajectory.w_WB_B, "counts": {}, "failure": []}

    return solve_once


def keep_running(task: SimpleNamespace) -> Callable[[], Any]:
    """Return the run of a `scene` by a `method` over `n_steps` steps `dt`, final state only, for the worker to time."""
    return registry.method(task.method).prepare(_scene(task.scene), Grid(task.dt, task.n_steps, task.n_steps))
