"""Single runs: one method on one scene, with its samples, or several methods on one scene."""

from __future__ import annotations

import csv
import io
import math
import shlex
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from conservative import registry
from conservative.attitude import Array, angle_between, orthonormality
from conservative.errors import AccuracyNotReached, BadInput, IntegrationFailed, MissingEngine
from conservative.grid import ROUNDING, Grid, grid_for
from conservative.integration import one
from conservative.integration.one import integrate, interrupt_of, read_method, require_support, warn_of_steps
from conservative.invariants import sizes
from conservative.method import Method
from conservative.outcome import Outcome, OutcomeKind
from conservative.presentation import header
from conservative.presentation import samples as samples_of
from conservative.references.exact.method import Exact
from conservative.references.truth import solve
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..document.cells import angle
from ..terminal.progress import Tell

SAMPLES = 1_000_000
"""Largest number of samples. Shorter runs store every step."""
STEPS = 10**11
"""Largest number of steps: a day's work of a fast method."""
TIMED = 0.2
"""Time, s, for which a run of a table is repeated; a longer one is made once."""
FIRST_STEPS = 10
"""Steps of the run that compiles a method before it is timed."""
COMPARED = 20_000
"""Largest number of intervals between samples that are compared with the reference solution; of longer runs, even ones are."""
TURNS = 1000.0
"""Angle at the initial rate, rad, up to which a solution without closed form is computed unasked: it takes seconds."""
LARGE = 0.1
"""Attitude error, rad, above which a run is called inaccurate and another method or step is looked for."""
MOST_TRIED = 10**6
"""Largest number of steps of an accurate run that is looked for."""


@dataclass(frozen=True, eq=False)
class Planned:
    """A run of a method that is `typed` in a command, and the reason why it does not support the scene, or ""."""

    typed: str
    method: Method
    grid: Grid
    refusal: str = ""

    def refused(self, scene: Scene) -> dict[str, Any]:
        """Return the summary of a run that was not made."""
        named = {"scene": scene.name, "method": self.method.name, "typed": self.typed, "label": self.method.label}
        return named | {"outcome": Outcome(OutcomeKind.UNSUPPORTED, self.refusal), "error": {"reason": "not supported"}}


def read_error(error: float | None, dt: float | None, names: Sequence[str]) -> float | None:
    """Return the attitude error, rad, for which a command chooses the method and the step, or None if it does not.

    The default is as in `integrate`. Raise `BadInput` for an error and a method.
    """
    if error is not None and names:
        raise BadInput("methods", ", ".join(names), "none together with --error, which chooses the method")
    return one.read_error(error, names or None, dt)


def plan_runs(scene: Scene, names: Sequence[str], dt: float | None, t_end: float | None, usual: bool = False) -> list[Planned]:
    """Return the runs of the named methods on a scene, by default of the first one that supports it.

    `usual` stands for the step that an engine's users take, where no dt, s, is given. A method that does not support the scene
    raises `Unsupported` unless there are others.
    """
    chosen = [(name, registry.method(name)) for name in names]
    if not chosen:
        method = read_method(None, scene)
        chosen = [(method.name, method)]
    longest = scene.t_end if t_end is None else t_end
    planned = []
    for name, method in chosen:
        step = min(method.method_info.usual_dt or scene.dt, longest) if usual and dt is None else dt
        planned.append(Planned(name, method, bounded_grid(scene, step, t_end), method.unsupported(scene) or ""))
    if all(run.refusal for run in planned):
        require_support(planned[0].method, scene)
    return planned


def run_methods(
    scene_name: str,
    method_names: Sequence[str],
    dt: float | None,
    t_end: float | None,
    truth: bool | None,
    tell: Tell,
    target: float | None = None,
) -> tuple[list[dict[str, Any]], Trajectory]:
    """Return the summary of each method on a scene, with its errors, and the trajectory of the last one.

    `target` is the attitude error, rad, for which method and step are chosen (`read_error`). The errors come
    from `find_errors`. Of several methods, `wall_time`, s, is the time of the fastest run after a short first one, which
    compiles; a method that does not support the scene has the outcome "unsupported".

    Raises
    ------
    BadInput
        A name, a setting, dt, t_end or the target cannot be used, or no method supports the scene; raised before the first run.
    MissingEngine
        The engine of a method is not installed.
    """
    scene, target = registry.scene(scene_name), read_error(target, dt, method_names)
    if target is not None:
        trajectory, grid = run_chosen(scene, target, dt, t_end)
        errors = find_errors(trajectory, grid, truth, scene_name, t_end)
        return [summarize_chosen(trajectory) | {"error": errors}], trajectory
    planned, summaries = plan_runs(scene, method_names, dt, t_end), []
    for run in planned:
        _ = run.method.label  # raises `MissingEngine`
    for number, run in enumerate(planned):
        tell(number / len(planned), run.typed)
        if run.refusal:
            summaries.append(run.refused(scene))
            continue
        timed = {}
        if len(planned) == 1:
            trajectory = run_on(scene, run.method, run.grid)
        else:
            trajectory, timed["wall_time"] = time_run(scene, run.method, run.grid)
        errors = find_errors(trajectory, run.grid, truth, scene_name, t_end)
        summaries.append(summarize(trajectory, run.method, run.grid.dt, run.typed) | {"error": errors, **timed})
    return summaries, trajectory


def csv_text(trajectory: Trajectory) -> str:
    """Return the samples as CSV, with every digit."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header(trajectory))
    writer.writerows(samples_of(trajectory).tolist())
    return stream.getvalue()


def run_chosen(scene: Scene, error: float, dt: float | None, t_end: float | None) -> tuple[Trajectory, Grid]:
    """Return the trajectory of `integrate(error=)` with samples every dt, s, by default the scene's step, and their grid.

    The summary states a target that is not reached, so there is no warning.
    """
    steps = bounded_grid(scene, dt, t_end)
    end, n = scene.t_end if t_end is None else t_end, math.ceil(steps.n_steps / steps.every)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyNotReached)
        trajectory = integrate(scene, t_end=end, error=error, t_eval=n + 1, on_failure="return")
    return trajectory, Grid(end / n, n)


def run_on(scene: Scene, method: Method, grid: Grid) -> Trajectory:
    """Return the trajectory on a grid; a failure ends it early, or before its first sample if an engine crashes."""
    warn_of_steps(scene, method, grid)
    try:
        return method.solve(scene, grid)
    except IntegrationFailed as failure:
        return Trajectory(scene, np.empty(0), np.empty((0, 3, 3)), np.empty((0, 3)), method.label, failure=failure)
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


@dataclass(frozen=True, eq=False)
class Compared:
    """The errors of a run against the reference solution at the same times.

    Attributes: `truth`, the reference solution at the compared samples; `stride`, every how many samples of the run there is
    one; `numbers` of the samples (n,), and their errors `attitude`, rad, and `rate`, rad/s, (n,).
    """

    truth: Trajectory
    stride: int
    numbers: Array
    attitude: Array
    rate: Array

    def at_samples(self, n: int) -> Array:
        """Return the largest attitude error so far, rad, at each of the n samples of the run."""
        return np.maximum.accumulate(self.attitude)[np.searchsorted(self.numbers, np.arange(n), side="right") - 1]


def compare(trajectory: Trajectory, grid: Grid, wanted: bool | None) -> Compared | str:
    """Return the errors of a run on a grid, whose samples can end early, or the reason why there are none.

    At most `COMPARED` intervals are compared. `wanted` None leaves out long runs without closed form (`TURNS`).
    """
    scene, n = trajectory.scene, len(trajectory)
    if wanted is False:
        return "not computed (--no-truth)"
    if n < 2:
        return "not computed, because the run has no step"
    if wanted is None and Exact().unsupported(scene) is not None and np.linalg.norm(scene.w_WB_B0) * trajectory.t[-1] > TURNS:
        return "not computed, because the reference solution of a long run takes long; --truth computes it"
    stride, steps = math.ceil((n - 1) / COMPARED), int(grid.steps[n - 1])
    try:
        truth = solve(scene, Grid(grid.dt, steps, min(grid.every * stride, steps)))
    except MissingEngine as missing:
        return f"not computed: {missing}"
    if not truth.ok:
        return f"not computed: the reference solution ended: {truth.outcome}"
    numbers = np.unique([*range(0, n, stride), n - 1])
    attitude = angle_between(truth.R_WB, trajectory.R_WB[numbers])
    return Compared(truth, stride, numbers, attitude, np.linalg.norm(truth.w_WB_B - trajectory.w_WB_B[numbers], axis=1))


def find_errors(
    trajectory: Trajectory, grid: Grid, wanted: bool | None, scene_name: str | None, t_end: float | None
) -> dict[str, Any]:
    """Return the largest errors against the reference solution, or the reason why there are none; see `compare`.

    `attitude` is in rad and `rate` in rad/s. If the attitude error is above `LARGE`, `better` is the result of `find_better`.
    `scene_name` and `t_end` are options of the command; without a name there is no search.
    """
    if wanted is not False and not trajectory.ok:
        return {"reason": "not computed, because the run did not reach its end"}
    compared = compare(trajectory, grid, wanted)
    errors = describe_errors(compared)
    if isinstance(compared, str) or scene_name is None or errors["attitude"] <= LARGE:
        return errors
    return errors | {"better": find_better(compared.truth, grid, compared.stride, scene_name, t_end)}


def describe_errors(compared: Compared | str) -> dict[str, Any]:
    """Return the summary of errors: the largest ones, the number of compared samples and the label of the truth."""
    if isinstance(compared, str):
        return {"reason": compared}
    largest = {"attitude": float(compared.attitude.max()), "rate": float(compared.rate.max())}
    return largest | {"samples": len(compared.numbers), "truth": compared.truth.label}


def find_better(truth: Trajectory, grid: Grid, stride: int, scene_name: str, t_end: float | None) -> dict[str, Any] | None:
    """Return the run by the method and the step that `integrate(error=)` chooses; None if it becomes inaccurate at once.

    The step is the same or an equal part of it, so that the run is compared with the reference solution `truth`, which has
    every `stride`-th sample of the grid. The result has the `command` and its `attitude` error. A run that becomes inaccurate
    ends before.
    """
    scene, n = truth.scene, len(truth.t)
    end = min(float(truth.t[-1]), scene.t_end if t_end is None else t_end)
    try:
        choice = run_chosen(scene, one.TARGET, end, end)[0].choice
        assert choice is not None  # `integrate(error=)` always has one
        parts = math.ceil(grid.dt / choice.dt * (1 - ROUNDING))
        if grid.n_steps * parts > MOST_TRIED:
            return None
        trajectory = choice.method.solve(scene, Grid(grid.dt / parts, grid.n_steps * parts, grid.every * stride * parts))
    except (BadInput, MissingEngine):  # such as an error that takes too many steps
        return None
    errors = angle_between(truth.R_WB[: len(trajectory)], trajectory.R_WB)
    good = int(np.argmax([*~(errors <= LARGE), True]))  # samples before the first with a large error
    if good < 2:
        return None
    end_time = t_end if good == n else float(trajectory.t[good - 1])
    command = ["conservative", "run", scene_name, "-m", choice.method.name, "--dt", f"{grid.dt / parts:.10g}"]
    command += [] if end_time is None else ["--t-end", f"{end_time:.10g}"]
    return {"command": shlex.join(command), "attitude": float(errors[:good].max()), "shorter": good < n}


def attitude_error(summary: dict[str, Any]) -> float | None:
    """Return the attitude error of a run, rad, or its estimate; None if neither is known."""
    choice = summary.get("choice")
    error: float | None = summary["error"].get("attitude", choice["estimate"] if choice else None)
    return error


def is_right(summary: dict[str, Any]) -> bool:
    """Return whether a run reached its end and is not known to be inaccurate."""
    attitude = attitude_error(summary)
    return bool(summary["outcome"].ok and (attitude is None or attitude <= LARGE))


class Status(NamedTuple):
    """The status of a run: its outcome, or that it is inaccurate or may be, and in which respect."""

    short: str
    detail: str = ""

    def __str__(self) -> str:
        return self.short + self.detail


RIGHT = Status("ok")


def status_of(summary: dict[str, Any]) -> Status:
    """Return the status of a run."""
    if not summary["outcome"].ok:
        return Status(str(summary["outcome"]))
    choice, attitude = summary.get("choice"), attitude_error(summary)
    if attitude is None:
        return Status("ok", ", but its attitude error is not known")
    detail = f": the attitude error is {angle(attitude)} rad"
    if not is_right(summary):
        return Status("inaccurate", detail)
    if choice and not choice["reached"] and not summary["error"].get("attitude", math.inf) <= choice["error"]:
        return Status("less accurate than asked for", detail)
    return RIGHT


def bounded_grid(scene: Scene, dt: float | None, t_end: float | None) -> Grid:
    """Return the grid, by default with the scene's step. Invalid arguments raise here, before a file is opened."""
    dt = scene.dt if dt is None else dt
    try:
        grid = grid_for(scene, dt, t_end, STEPS)  # few samples: their number is determined below
    except OverflowError:  # more steps than a float can count
        grid = Grid(dt or 0.0, STEPS + 1)
    if grid.n_steps > STEPS:
        raise BadInput("dt", f"{grid.dt:g}, for more than {STEPS:.0e} steps", "a longer step, or a shorter run (--t-end)")
    return Grid(grid.dt, grid.n_steps, math.ceil(grid.n_steps / SAMPLES))


def summarize_chosen(trajectory: Trajectory) -> dict[str, Any]:
    """Return the description of a run whose method was chosen for an error."""
    choice = trajectory.choice
    assert choice is not None  # `integrate(error=)` always has one
    asked = {"error": choice.error, "estimate": choice.estimate, "reached": choice.reached}
    return summarize(trajectory, choice.method, choice.dt) | {"choice": asked}


def summarize(trajectory: Trajectory, method: Method, dt: float, typed: str = "") -> dict[str, Any]:
    """Return the description of a run, its outcome, its drifts and its final state; `typed` is the method in the command."""
    scene = trajectory.scene
    return {
        "scene": scene.name,
        "method": method.name,
        "typed": typed or method.name,
        "choice": None,
        "label": trajectory.label,
        "dt": dt,
        "t_end": float(trajectory.t[-1]) if len(trajectory) else 0.0,
        "outcome": trajectory.outcome,
        "counters": asdict(trajectory.counters),
        "drift": {invariant.name: float(sizes(trajectory.drift(invariant)).max(initial=0.0)) for invariant in scene.invariants},
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
