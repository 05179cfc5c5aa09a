"""Single runs: one method on one scene, with its samples, or several methods on one scene."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from conservative import registry
from conservative.attitude import angle_between, orthonormality
from conservative.errors import BadInput
from conservative.files import text_file
from conservative.grid import Grid, grid_for
from conservative.integration.one import integrate, read_method, require_support
from conservative.invariants import sizes
from conservative.method import Method
from conservative.presentation import COLUMNS
from conservative.presentation import samples as samples_of
from conservative.references.exact.method import Exact
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..terminal.progress import Step

SAMPLES = 1_000_000
"""Largest number of samples. Shorter runs store every step."""
STEPS = 10**11
"""Largest number of steps: a day's work of a fast method."""
TIMED = 0.2
"""Time, s, for which a run of a table is repeated; a longer one is made once."""
FIRST_STEPS = 10
"""Steps of the run that compiles a method before it is timed."""


def run_once(
    scene_name: str, method_name: str | None, dt: float | None, t_end: float | None, samples: Path | None
) -> dict[str, Any]:
    """Integrate and return the summary; samples go to the file `samples` if there is one, one line each, with every digit.

    Raises
    ------
    BadInput
        A name, a setting, dt, t_end or the file cannot be used; raised before the run.
    MissingEngine
        The method's engine is not installed.
    """
    scene = registry.scene(scene_name)
    method = read_method(method_name or None, scene)
    grid = bounded_grid(scene, method, dt, t_end)
    with text_file(samples, "csv") if samples else nullcontext() as stream:
        trajectory = _integrate(scene, method, grid)
        if stream is not None:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(COLUMNS)
            writer.writerows(samples_of(trajectory).tolist())
    return summarize(trajectory, method, grid.dt)


def compare(
    scene_name: str, method_names: Sequence[str], dt: float | None, t_end: float | None, step: Step
) -> list[dict[str, Any]]:
    """Return the summary of each method on a scene, with its wall time and the attitude error at the end of the run.

    `wall_time`, s, is that of the fastest run after a short first one, which compiles. `attitude_error`, rad, is relative to
    the exact solution. It is None if no exact solution is known, or the run did not reach its end.

    Raises
    ------
    BadInput
        A name, a setting, dt or t_end cannot be used, or a method does not support the scene; raised before the first run.
    MissingEngine
        The engine of a method is not installed.
    """
    scene = registry.scene(scene_name)
    runs = [(method, bounded_grid(scene, method, dt, t_end)) for method in map(registry.method, method_names)]
    for method, _ in runs:
        _ = method.label  # raises `MissingEngine`
    exact = Exact()
    summaries = []
    for number, (method, grid) in enumerate(runs):
        step(number / len(runs), method.name)
        _integrate(scene, method, replace(grid, n_steps=min(grid.n_steps, FIRST_STEPS), every=1))
        wall_time, error, begin = math.inf, None, perf_counter()
        while wall_time == math.inf or perf_counter() - begin < TIMED:
            start = perf_counter()
            trajectory = _integrate(scene, method, grid)
            wall_time = min(wall_time, perf_counter() - start)
        if trajectory.ok and exact.unsupported(scene) is None:
            truth = exact.solve(scene, Grid(grid.dt * grid.n_steps, 1))
            error = float(angle_between(trajectory.R_WB[-1:], truth.R_WB[-1:])[0])
        summaries.append(summarize(trajectory, method, grid.dt) | {"attitude_error": error, "wall_time": wall_time})
    return summaries


def bounded_grid(scene: Scene, method: Method, dt: float | None, t_end: float | None) -> Grid:
    """Return the grid. Invalid arguments raise here, before a file is opened."""
    dt = scene.dt if dt is None else dt
    try:
        grid = grid_for(scene, dt, t_end, STEPS)  # few samples: their number is determined below
    except OverflowError:  # more steps than a float can count
        grid = Grid(dt or 0.0, STEPS + 1)
    require_support(method, scene)
    if grid.n_steps > STEPS:
        raise BadInput("dt", f"{grid.dt:g}, for more than {STEPS:.0e} steps", "a longer step, or a shorter run (--t-end)")
    return Grid(grid.dt, grid.n_steps, math.ceil(grid.n_steps / SAMPLES))


def _integrate(scene: Scene, method: Method, grid: Grid) -> Trajectory:
    return integrate(scene, grid.dt, method, grid.dt * grid.n_steps, grid.every, on_failure="return")


def summarize(trajectory: Trajectory, method: Method, dt: float) -> dict[str, Any]:
    """Return the description of a run, its outcome, its drifts and its final state."""
    scene = trajectory.scene
    return {
        "scene": scene.name,
        "method": method.name,
        "label": trajectory.label,
        "dt": dt,
        "t_end": float(trajectory.t[-1]) if len(trajectory) else 0.0,
        "outcome": trajectory.outcome,
        "counters": asdict(trajectory.counters),
        "drift": {each.name: float(sizes(trajectory.drift(each)).max(initial=0.0)) for each in scene.invariants},
        "orthonormality": float(orthonormality(trajectory.R_WB).max(initial=0.0)),
        "last": {
            "t": float(trajectory.t[-1]),
            "R_WB": trajectory.R_WB[-1].tolist(),
            "w_WB_B": trajectory.w_WB_B[-1].tolist(),
            "energy": float(trajectory.energy[-1]),
            "momentum_W": trajectory.momentum_W[-1].tolist(),
        }
        if len(trajectory)
        else None,
    }
