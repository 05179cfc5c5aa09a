"""What `conservative run` does: one run, its summary, its samples."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any

import numpy as np

from benchmarks.errors import relative_drift
from conservative import registry
from conservative.attitude import orthonormality
from conservative.invariants import Invariant
from conservative.method import Method, grid_for, integrate, require_support
from conservative.presentation import COLUMNS
from conservative.presentation import samples as samples_of
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from .output import text_file


def run(scene_name: str, method_name: str, dt: float | None, t_end: float | None, samples: Path | None) -> dict[str, Any]:
    """Integrate and return the summary; the samples go to the file `samples` if there is one.

    Raises
    ------
    BadInput
        A name, a setting, dt, t_end or the file cannot be used; found before the run starts.
    MissingEngine
        The method's engine is not installed.
    """
    scene, method = registry.scene(scene_name), registry.method(method_name)
    step = scene.dt if dt is None else dt
    _check(scene, method, step, t_end)
    assert step is not None  # a scene always has one
    with text_file(samples, "csv") if samples else nullcontext() as stream:
        trajectory = integrate(scene, step, method, t_end, on_failure="return")
        if stream is not None:
            write_samples(trajectory, stream)
    return summary_of(trajectory, method, step)


def _check(scene: Scene, method: Method, dt: float | None, t_end: float | None) -> None:
    """Find what `integrate` would refuse before a file is opened."""
    grid_for(scene, dt, t_end)
    require_support(method, scene)


def summary_of(trajectory: Trajectory, method: Method, dt: float) -> dict[str, Any]:
    """Return what a run was, how it ended, its drifts and its last state."""
    scene = trajectory.scene
    return {
        "scene": scene.name,
        "method": method.name,
        "label": trajectory.label,
        "dt": dt,
        "t_end": float(trajectory.t[-1]) if len(trajectory) else 0.0,
        "status": trajectory.status,
        "counters": asdict(trajectory.counters),
        "drift": {invariant.name: _drift(trajectory, invariant) for invariant in scene.invariants},
        "orthonormality": float(orthonormality(trajectory.R_WB).max(initial=0.0)),
        "last": _last(trajectory),
    }


def _drift(trajectory: Trajectory, invariant: Invariant) -> float:
    """Return the largest change of an invariant, relative to its scale."""
    change = relative_drift(trajectory, invariant).reshape(len(trajectory), -1)
    return float(np.linalg.norm(change, axis=1).max(initial=0.0))


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


def as_json(summary: dict[str, Any]) -> str:
    """Return the summary as JSON."""
    return json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)


def as_text(summary: dict[str, Any]) -> str:
    """Return the summary for a person."""
    counters = ", ".join(f"{count} {name}" for name, count in summary["counters"].items() if count is not None)
    lines = [
        ("scene", summary["scene"]),
        ("method", summary["label"]),
        ("status", summary["status"]),
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
