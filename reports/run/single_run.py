"""Single runs: one method on one scene, with its samples, or several methods on one scene."""

from __future__ import annotations

import csv
import math
import shlex
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from conservative import registry
from conservative.attitude import angle_between, orthonormality
from conservative.errors import BadInput, MissingEngine
from conservative.files import text_file
from conservative.grid import Grid, grid_for
from conservative.integration.one import interrupt_of, read_method, require_support, warn_of_loads
from conservative.invariants import sizes
from conservative.method import Method
from conservative.methods.search import candidates
from conservative.presentation import header
from conservative.presentation import samples as samples_of
from conservative.references.exact.method import Exact
from conservative.references.truth import solve
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
COMPARED = 200
"""Largest number of samples that are compared with the reference solution, evenly chosen."""
TURNS = 1000.0
"""Angle at the initial rate, rad, up to which a solution without closed form is computed unasked: it takes seconds."""
LARGE = 0.1
"""Attitude error, rad, above which a run is called inaccurate and another method or step is looked for."""
PARTS, MOST_TRIED = (1, 10, 100), 10**6
"""Parts into which steps are divided in the search for an accurate run, and the largest number of steps of a run there."""


def run_methods(
    scene_name: str,
    method_names: Sequence[str],
    dt: float | None,
    t_end: float | None,
    truth: bool | None,
    step: Step,
    csv_file: Path | None = None,
    parquet_file: Path | None = None,
) -> list[dict[str, Any]]:
    """Return the summary of each method on a scene, by default of the one that `integrate` uses, with its errors.

    The errors are those of `find_errors`. Of several methods, `wall_time`, s, is that of the fastest run after a short first
    one, which compiles. The samples of the last method go to the files, with every digit.

    Raises
    ------
    BadInput
        A name, a setting, dt, t_end or a file cannot be used, or a method does not support the scene; raised before the first
        run.
    MissingEngine
        The engine of a method is not installed.
    """
    scene = registry.scene(scene_name)
    methods = [read_method(name, scene) for name in method_names or (None,)]
    runs = [(method, bounded_grid(scene, method, dt, t_end)) for method in methods]
    for method in methods:
        _ = method.label  # raises `MissingEngine`
    summaries = []
    with ExitStack() as stack:
        stream = stack.enter_context(text_file(csv_file, "csv")) if csv_file else None
        binary = stack.enter_context(text_file(parquet_file, "parquet")).buffer if parquet_file else None
        for number, (method, grid) in enumerate(runs):
            step(number / len(runs), method.name)
            timed = {}
            if len(runs) == 1:
                trajectory = run_on(scene, method, grid)
            else:
                trajectory, timed["wall_time"] = time_run(scene, method, grid)
            errors = find_errors(trajectory, grid, truth, scene_name, t_end)
            summaries.append(summarize(trajectory, method, grid.dt) | {"error": errors, **timed})
        if stream is not None:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(header(trajectory))
            writer.writerows(samples_of(trajectory).tolist())
        if binary is not None:
            binary.write(trajectory.to_pandas().set_axis(header(trajectory), axis=1).to_parquet(index=False))
    return summaries


def run_on(scene: Scene, method: Method, grid: Grid) -> Trajectory:
    """Return the trajectory on a grid; a failure ends it early."""
    warn_of_loads(scene, method, grid.dt)
    try:
        return method.solve(scene, grid)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # as in `integrate`


def time_run(scene: Scene, method: Method, grid: Grid) -> tuple[Trajectory, float]:
    """Return the trajectory and the wall time, s, of the fastest of the runs that `TIMED` has room for."""
    run_on(scene, method, replace(grid, n_steps=min(grid.n_steps, FIRST_STEPS), every=1))
    wall_time, begin = math.inf, perf_counter()
    while wall_time == math.inf or perf_counter() - begin < TIMED:
        start = perf_counter()
        trajectory = run_on(scene, method, grid)
        wall_time = min(wall_time, perf_counter() - start)
    return trajectory, wall_time


def find_errors(
    trajectory: Trajectory, grid: Grid, wanted: bool | None, scene_name: str, t_end: float | None
) -> dict[str, Any]:
    """Return the largest errors against the reference solution, or the reason why there are none.

    At most `COMPARED` samples are compared. `attitude` is in rad and `rate` in rad/s. `wanted` None leaves out long runs
    without closed form (`TURNS`). If the attitude error is above `LARGE`, `better` is the result of `find_better`.
    `scene_name` and `t_end` are those of the command.
    """
    scene = trajectory.scene
    if wanted is False:
        return {"reason": "not computed (--no-truth)"}
    if not trajectory.ok:
        return {"reason": "not computed, because the run did not reach its end"}
    if wanted is None and Exact().unsupported(scene) is not None and np.linalg.norm(scene.w_WB_B0) * trajectory.t[-1] > TURNS:
        return {"reason": "not computed, because the reference solution of a long run takes long; --truth computes it"}
    stride = math.ceil(grid.n_samples / COMPARED)
    try:
        truth = solve(scene, replace(grid, every=grid.every * stride))
    except MissingEngine as missing:
        return {"reason": f"not computed: {missing}"}
    if not truth.ok:
        return {"reason": f"not computed: the reference solution ended: {truth.outcome}"}
    compared = np.unique([*range(0, len(trajectory), stride), len(trajectory) - 1])
    attitude = angle_between(truth.R_WB, trajectory.R_WB[compared])
    rate = np.linalg.norm(truth.w_WB_B - trajectory.w_WB_B[compared], axis=1)
    errors = {"attitude": float(attitude.max()), "rate": float(rate.max()), "samples": len(compared), "truth": truth.label}
    better = {} if attitude.max() <= LARGE else {"better": find_better(truth, grid, stride, scene_name, t_end)}
    return errors | better


def find_better(truth: Trajectory, grid: Grid, stride: int, scene_name: str, t_end: float | None) -> dict[str, Any] | None:
    """Return the most accurate run by a candidate of the automatic choice, at the same step, or else at a part of it.

    Candidates are run and compared with the reference solution `truth`, which has every `stride`-th sample of the grid. The
    result has the `command` and its `attitude` error. If all runs become inaccurate, it is the one that does so last, up to
    that time; None if all do so at once.
    """
    scene, n, best, ranks = truth.scene, len(truth.t), None, [(1, 0.0)]
    for parts in PARTS:
        finer = Grid(grid.dt / parts, grid.n_steps * parts, grid.every * stride * parts)
        for method in candidates(scene) if finer.n_steps <= MOST_TRIED else ():
            try:
                found = method.solve(scene, finer)
            except (BadInput, MissingEngine):  # such as a step that is too long for the method
                continue
            errors = angle_between(truth.R_WB[: len(found)], found.R_WB)
            good = int(np.argmax([*~(errors <= LARGE), True]))  # samples before the first with a large error
            rank = good, -float(errors[:good].max(initial=0.0))
            if rank > max(ranks):
                end = t_end if good == n else float(found.t[good - 1])
                words = ["conservative", "run", scene_name, "-m", method.name, "--dt", f"{finer.dt:.10g}"]
                command = shlex.join(words + ([] if end is None else ["--t-end", f"{end:.10g}"]))
                best = {"command": command, "attitude": -rank[1], "shorter": good < n}
            ranks.append(rank)
        if best is not None and max(ranks)[0] == n:
            break
    return best


def status_of(summary: dict[str, Any]) -> str:
    """Return the status of a run in words: its outcome, or that it is inaccurate."""
    attitude = summary["error"].get("attitude", 0.0)
    if summary["outcome"].ok and not attitude <= LARGE:
        return f"inaccurate: the attitude error is {attitude:.1e} rad"
    return str(summary["outcome"])


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
