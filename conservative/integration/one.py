"""`integrate`: a scene, a method and a step size to a checked trajectory, or an exception with the failure."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Literal

from numpy.typing import ArrayLike

from .. import registry
from ..attitude import Array
from ..check import choice, describe, positive_integer, positive_number
from ..errors import BadInput, LoadNotResolved, RotationNotResolved, Unsupported
from ..grid import MOST_STEPS, Grid, grid_for, read_end
from ..method import Method, Role
from ..methods.automatic import integrate_to_error
from ..methods.between import SampleTimes, grid_before, read_times, sample_between
from ..methods.reduced import Reduced
from ..methods.search import candidates
from ..methods.units import bound_rate
from ..outcome import Progress
from ..potentials.smoothness import examine, find_unresolved
from ..scene import Scene
from ..trajectory import Trajectory

TARGET = 1e-6
"""Attitude error, rad, for which the method and the step are chosen if neither is given."""


def require_support(method: Method, scene: Scene) -> None:
    """Raise `Unsupported` if the method does not support the scene."""
    reason = method.unsupported(scene)
    if reason:
        raise Unsupported("method", f"{method.name} for the scene {scene.name!r}", f"a scene that it supports ({reason})")


ROD, RESOLVED = 100.0, 0.5
"""Ratio of principal moments above which a body is a rod, and the longest step in radians of its fastest rotation."""


def warn_of_steps(scene: Scene, method: Method, grid: Grid, rod: Scene | None = None) -> None:
    """Warn if fixed steps are too long for a function of time, a table, or the rotation of a rod, by default of the scene.

    See `integrate`. Adaptive methods get no warning: they are told the longest step.
    """
    if method.order is None:
        return
    if scene.loads:
        end, smooth = grid.n_steps * grid.dt, scene.smoothness(grid.last)
        if grid.dt > smooth.step and end < scene.t_end:  # it may be smooth as long as the run is
            smooth = examine(scene.loads, end)
        if grid.dt > smooth.step:
            warnings.warn(LoadNotResolved(grid.dt, 0.0 if smooth.noise else smooth.step, smooth.interval), stacklevel=3)
        for load in scene.loads:
            if unresolved := find_unresolved(load, grid.dt, grid.n_steps):
                warnings.warn(LoadNotResolved(grid.dt, *unresolved), stacklevel=3)
    rod = rod or scene  # the errors of a method can produce a rotation about its axis
    if rod.body.condition > ROD and method.role in (Role.OURS, Role.BASELINE):
        rate = rod.derive(bound_rate)
        if grid.dt * rate > RESOLVED and method.follows_fastest(rod):
            warnings.warn(RotationNotResolved(method.name, grid.dt, rate, RESOLVED / rate), stacklevel=3)


_REDUCED = Reduced()


def read_method(method: object, scene: Scene) -> Method:
    """Return a method given as a `Method`, by its name, or as None for the default method of the scene.

    Raise `BadInput` if the argument is something else, or the name is unknown.
    """
    if method is None:
        return _REDUCED if _REDUCED.unsupported(scene) is None else (*candidates(scene), _REDUCED)[0]
    if isinstance(method, str):
        method = registry.method(method)
    if not isinstance(method, Method):
        raise BadInput("method", describe(method), "a Method, such as Reduced(), or the name of one, such as 'mujoco:RK4'")
    return method


def integrate(
    scene: Scene,
    dt: float | None = None,
    method: Method | str | None = None,
    t_end: float | None = None,
    sample_every: int = 1,
    *,
    error: float | None = None,
    on_failure: Literal["raise", "return"] = "raise",
    t_eval: ArrayLike | int | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Trajectory:
    """Integrate a scene.

    Parameters
    ----------
    scene
        The scene.
    dt
        Step size, s; default: the scene's (`Scene.dt`), shortened to a part of t_end if there are functions of time. For
        adaptive methods, and with `error`, the sampling interval.
    method
        A method, or its name, for example `"mujoco@3.6.0:RK4"`. Without a method and a step, both are chosen as for
        `error=1e-6`. With a step alone it is `Reduced()`, the paper's integrator in three unknowns; in fields that depend on
        time, the first candidate of the automatic choice.
    t_end
        Duration, s; default: the scene's. The run ends with the first step at or after it.
    sample_every
        Store every `sample_every`-th step, and the first and last state.
    error
        Target for the attitude error over the run, rad. The method and the step size are then chosen automatically and
        stored in `trajectory.choice`, together with the estimated error. If round-off prevents that error, the warning
        `AccuracyNotReached` is issued. Trial runs are cached: the next call for the same scene makes one run only, unless it
        contains a function that cannot be compared (`Scene.key`). Default: 1e-6 without a method and a step.
    on_failure
        "raise", or "return" to return the samples before the failure; `trajectory.outcome` then describes the failure.
    t_eval
        Increasing times of the samples, s, from 0 to t_end, or the number of evenly spaced samples; replaces `sample_every`.
        The steps do not change: each sample is computed from the step before it with substeps that add only round-off. The
        run ends with the last sample.
    progress
        Called with a `Progress` before each trial run for an `error`, for example `print`: after the first second, and at
        most ten times per second.

    Raises
    ------
    BadInput
        An argument is invalid, the samples do not fit in memory, there are too many steps, or the step is too long for the
        method.
    MissingEngine
        The method needs an engine that is not installed.
    Unsupported
        The method does not support the scene.
    LoadNotResolved
        A warning: the steps are too long for a torque, damping or motor that is a function of time without `breaks`, or a
        table with more corners than steps. Steps are divided at the corners of a table, so its samples are right.
    RotationNotResolved
        A warning: the steps are too long for the rotation about the axis of a rod that errors of the method can produce.
    NotConverged
        The equations of a step could not be solved.
    Diverged
        The state is no longer finite, its energy is wrong by more than the reference scale, or an engine stopped.
    NotConserved
        Orthonormality, or an invariant that the method conserves, is outside the method's `bounds`.
    InvalidResult
        The method's result is not a trajectory of the scene with all samples of the grid.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    scene = scene.now()
    choice("on_failure", on_failure, ("raise", "return"))
    if progress is not None and not callable(progress):
        raise BadInput("progress", describe(progress), "a function of a Progress, such as print, or None")
    at = None
    if t_eval is not None:
        if sample_every != 1:
            allowed = "1, the default, together with t_eval, which has the samples"
            raise BadInput("sample_every", describe(sample_every), allowed)
        at = read_times(t_eval, read_end(scene, t_end))
    error = read_error(error, method, dt)
    try:
        if error is not None:
            end, samples = read_target(scene, error, method, dt, t_end, sample_every, at)
            trajectory = integrate_to_error(scene, error, end, samples, progress)
        else:
            method = read_method(method, scene)
            grid = grid_for(scene, dt, t_end, sample_every if at is None else MOST_STEPS)
            require_support(method, scene)
            warn_of_steps(scene, method, grid)
            if at is None:
                trajectory = method.solve(scene, grid)
            else:
                grid = grid_before(scene, method, grid.dt, at)
                trajectory = sample_between(method.solve(scene, grid), method, grid, at)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # if it is the failure itself, it keeps its own cause
    if trajectory.failure is not None and on_failure == "raise":
        raise trajectory.failure
    return trajectory


def interrupt_of(failure: SystemError) -> BaseException:
    """Return the interrupt that is the cause of a `SystemError`, as one during a call of machine code is; else the failure."""
    reason: BaseException | None = failure
    while isinstance(reason, SystemError):
        reason = reason.__cause__ or reason.__context__
    return reason if isinstance(reason, KeyboardInterrupt) else failure


def read_error(error: float | None, method: object, dt: object) -> float | None:
    """Return the target for the attitude error, rad: `TARGET` if neither an error nor a method nor a step is given."""
    return TARGET if error is None and method is None and dt is None else error


def read_target(
    scene: Scene,
    error: object,
    method: object,
    dt: float | None,
    t_end: float | None,
    sample_every: int,
    at: Array | None = None,
) -> tuple[float, SampleTimes]:
    """Return the duration, s, and the samples of a run with a target error, rad; `at` are the times of the samples, s.

    Raise `BadInput` if an argument is invalid, or given together with an error that determines it.
    """
    positive_number("error", error, "a finite attitude error above 0, rad")
    if method is not None:
        raise BadInput("method", describe(method), "None together with error, which chooses the method")
    if dt is not None and at is not None:
        allowed = "None together with error, which chooses the step, and t_eval, which has the samples"
        raise BadInput("dt", describe(dt), allowed)
    end = read_end(scene, t_end)
    spacing = None if dt is None else grid_for(scene, dt, end).dt
    samples = SampleTimes(spacing, positive_integer("sample_every", sample_every), at)
    return (end if at is None else float(at[-1]) or end), samples
