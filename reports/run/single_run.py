"""One run of one method on one scene: its summary and its samples."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import asdict, replace
from io import StringIO
from pathlib import Path
from typing import IO, Any

from conservative import registry
from conservative.attitude import orthonormality
from conservative.benchmarks.measures.timing import wall_time
from conservative.errors import BadInput
from conservative.files import text_file
from conservative.integration.one import default_method, integrate, require_support
from conservative.invariants import Invariant, sizes
from conservative.method import Grid, Method, grid_for
from conservative.presentation import COLUMNS
from conservative.presentation import samples as samples_of
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..tables.cells import outcome_record
from ..terminal.progress import Expect

TRIAL = 100
"""The part of a run's steps, as a divisor, that runs first to tell how long the run takes."""
SAMPLES = 1_000_000
"""Largest number of samples; every step is one in runs of no more steps."""
STEPS = 10**11
"""Largest number of steps: a day's work of a fast method."""


def run_once(
    scene_name: str,
    method_name: str | None,
    dt: float | None,
    t_end: float | None,
    samples: Path | None,
    expect: Expect | None = None,
) -> dict[str, Any]:
    """Integrate and return the summary; samples go to the file `samples` if there is one; `expect` is told how long it takes.

    Raises
    ------
    BadInput
        A name, a setting, dt, t_end or the file cannot be used; found before the run starts.
    MissingEngine
        The method's engine is not installed.
    """
    scene = registry.scene(scene_name)
    method = registry.method(method_name) if method_name else default_method(scene)
    grid = _bounded_grid(scene, method, scene.dt if dt is None else dt, t_end)
    with text_file(samples, "csv") if samples else nullcontext() as stream:
        if expect is not None:
            _announce_time(scene, method, grid, stream is not None, expect)
        return _integrate(scene, method, grid, stream)


def _bounded_grid(scene: Scene, method: Method, dt: float | None, t_end: float | None) -> Grid:
    """Return the steps and samples, or find what `integrate` would refuse before a file is opened."""
    try:
        grid = grid_for(scene, dt, t_end, STEPS)  # few samples: how many there will be is decided below
    except OverflowError:  # more steps than a float can count
        grid = Grid(dt or 0.0, STEPS + 1)
    require_support(method, scene)
    if grid.n_steps > STEPS:
        raise BadInput("dt", f"{grid.dt:g}, for more than {STEPS:.0e} steps", "a longer step, or a shorter run (--t-end)")
    return Grid(grid.dt, grid.n_steps, math.ceil(grid.n_steps / SAMPLES))


def _integrate(scene: Scene, method: Method, grid: Grid, stream: IO[str] | None) -> dict[str, Any]:
    duration = grid.dt * grid.n_steps
    trajectory = integrate(scene, grid.dt, method, duration, grid.every, on_failure="return")
    if stream is not None:
        write_samples(trajectory, stream)
    return summarize(trajectory, method, grid.dt)


def _announce_time(scene: Scene, method: Method, grid: Grid, writes: bool, expect: Expect) -> None:
    """Do the first of `TRIAL` parts, again now that it is compiled, and tell how long all take; of few steps say nothing."""
    if grid.n_steps >= TRIAL:
        part = replace(grid, n_steps=grid.n_steps // TRIAL)
        _integrate(scene, method, part, None)
        expect(TRIAL * wall_time(lambda: _integrate(scene, method, part, StringIO() if writes else None)))


def summarize(trajectory: Trajectory, method: Method, dt: float) -> dict[str, Any]:
    """Return what a run was, how it ended, its drifts and its last state."""
    scene = trajectory.scene
    return {
        "scene": scene.name,
        "method": method.name,
        "label": trajectory.label,
        "dt": dt,
        "t_end": float(trajectory.t[-1]) if len(trajectory) else 0.0,
        "outcome": trajectory.outcome,
        "counters": asdict(trajectory.counters),
        "drift": {invariant.name: _drift(trajectory, invariant) for invariant in scene.invariants},
        "orthonormality": float(orthonormality(trajectory.R_WB).max(initial=0.0)),
        "last": _last(trajectory),
    }


def _drift(trajectory: Trajectory, invariant: Invariant) -> float:
    """Return the largest change of an invariant, relative to its scale."""
    return float(sizes(trajectory.drift(invariant)).max(initial=0.0))


def _last(trajectory: Trajectory) -> dict[str, Any] | None:
    if not len(trajectory):
        return None
    return {
        "t": float(trajectory.t[-1]),
        "R_WB": trajectory.R_WB[-1].tolist(),
        "w_WB_B": trajectory.w_WB_B[-1].tolist(),
        "energy": float(trajectory.energy[-1]),
        "momentum_W": trajectory.momentum_W[-1].tolist(),
    }


def write_samples(trajectory: Trajectory, stream: IO[str]) -> None:
    """Write one line a sample, with every digit, under `COLUMNS` (SI units; R_WB by rows)."""
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(samples_of(trajectory).tolist())


def json_text(summary: dict[str, Any]) -> str:
    """Return the summary as JSON."""
    content = summary | {"outcome": outcome_record(summary["outcome"])}
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)


def summary_text(summary: dict[str, Any]) -> str:
    """Return the summary for a person."""
    counters = ", ".join(f"{count} {name}" for name, count in summary["counters"].items() if count is not None)
    lines = [
        ("scene", summary["scene"]),
        ("method", summary["label"]),
        ("status", str(summary["outcome"])),
        ("run", f"{summary['t_end']:g} s with dt = {summary['dt']:g} s"),
        ("work", counters),
        *((f"drift of {name}", f"{value:.2e} (relative)") for name, value in summary["drift"].items()),
        ("orthonormality", f"{summary['orthonormality']:.2e}"),
        *_last_lines(summary["last"]),
    ]
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{width}}  {value}" for name, value in lines)


def _last_lines(last: dict[str, Any] | None) -> list[tuple[str, str]]:
    if last is None:
        return []
    rows = [(f"R_WB row {number}", _numbers(row)) for number, row in enumerate(last["R_WB"], start=1)]
    return [(f"at t = {last['t']:g} s", ""), *rows, ("w_WB_B, rad/s", _numbers(last["w_WB_B"]))]


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:+.12g}" for value in values)
