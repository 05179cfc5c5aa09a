"""`integrate`: a scene, a method and a step, checked, to a trajectory or an exception that says what failed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from numpy.typing import ArrayLike

from .. import registry
from ..attitude import Array
from ..check import choice, describe, positive_integer, positive_number
from ..errors import BadInput, Unsupported
from ..grid import MOST_STEPS, grid_for
from ..method import Method
from ..methods.automatic import integrate_to_error
from ..methods.between import Samples, grid_before, read_times, sample_between
from ..methods.reduced import Reduced
from ..methods.search import candidates
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Trajectory

DEFAULT_DT = 0.01
"""Step, s, where nobody names one: the paper's."""


def require_support(method: Method, scene: Scene) -> None:
    """Raise `Unsupported` if the method cannot do the scene."""
    reason = method.unsupported(scene)
    if reason:
        raise Unsupported("method", f"{method.name} for the scene {scene.name!r}", f"a scene that it supports ({reason})")


def default_method(scene: Scene) -> Method:
    """Return what a scene is integrated with where nobody names a method."""
    first = Reduced()
    return first if first.unsupported(scene) is None else (*candidates(scene), first)[0]


def read_method(method: object, scene: Scene) -> Method:
    """Return a method from what users give: one, the name of one, or None for that of the scene.

    Raises
    ------
    BadInput
        It is none of these.
    """
    if isinstance(method, str):
        method = registry.method(method)
    method = default_method(scene) if method is None else method
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
        Step size, s; default 0.01. For adaptive methods, and with `error`, the sampling interval.
    method
        A method, or its name, for example `"mujoco@3.6.0:RK4"`. Default: `Reduced()`, the paper's integrator in three
        unknowns; in fields that depend on time, the first candidate of the automatic choice.
    t_end
        Duration, s; default: the scene's. The run ends with the first step at or after it.
    sample_every
        Store every `sample_every`-th step, and the first and last state.
    error
        Target for the attitude error over the run, rad. The method and the step size are then chosen automatically and
        stored in `trajectory.choice`, together with the estimated error. If round-off prevents that error, the warning
        `AccuracyNotReached` is issued. Trial runs are cached: the next call for the same scene makes one run only.
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
    NotConverged
        The equations of a step could not be solved.
    Diverged
        The state is no longer finite, or an engine stopped.
    NotConserved
        Orthonormality, or an invariant that the method conserves, is outside the method's `bounds`.
    InvalidResult
        The method's result is not a trajectory of the scene with all samples of the grid.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    choice("on_failure", on_failure, ("raise", "return"))
    if progress is not None and not callable(progress):
        raise BadInput("progress", describe(progress), "a function of a Progress, such as print, or None")
    at = None if t_eval is None else _read_t_eval(scene, t_end, sample_every, t_eval)
    try:
        if error is not None:
            _require_choice(error, dt, method, at)
            trajectory = _integrate_to(error, scene, dt, t_end, sample_every, at, progress)
        else:
            trajectory = _integrate_with(method, scene, dt, t_end, sample_every, at)
    except SystemError as failure:
        raise interrupt_of(failure)  # noqa: B904  # where it is the failure itself, its own reasons stay
    if trajectory.failure is not None and on_failure == "raise":
        raise trajectory.failure
    return trajectory


def interrupt_of(failure: SystemError) -> BaseException:
    """Return the interrupt that came while Python called machine code, which makes `SystemError`s of it; else the failure."""
    reason: BaseException | None = failure
    while isinstance(reason, SystemError):
        reason = reason.__cause__ or reason.__context__
    return reason if isinstance(reason, KeyboardInterrupt) else failure


def _read_t_eval(scene: Scene, t_end: float | None, sample_every: int, t_eval: ArrayLike | int) -> Array:
    """Return the times of samples, s, that `integrate` was asked for."""
    if sample_every != 1:
        raise BadInput("sample_every", describe(sample_every), "1, the default, together with t_eval, which says what is kept")
    end = scene.t_end if t_end is None else positive_number("t_end", t_end, "a finite duration above 0, s")
    return read_times(t_eval, end)


def _require_choice(error: float, dt: float | None, method: Method | str | None, at: Array | None) -> None:
    """Raise `BadInput` unless a method and a step can be chosen for an error, rad, with no step dt, s, asked for as well."""
    positive_number("error", error, "a finite attitude error above 0, rad")
    if method is not None:
        raise BadInput("method", describe(method), "None together with error, which chooses the method")
    if dt is not None and at is not None:
        raise BadInput(
            "dt", describe(dt), "None together with error, which chooses the step, and t_eval, which has the samples"
        )


def _integrate_with(
    method: Method | str | None, scene: Scene, dt: float | None, t_end: float | None, sample_every: int, at: Array | None
) -> Trajectory:
    method = read_method(method, scene)
    step = DEFAULT_DT if dt is None else dt
    grid = grid_for(scene, step, t_end, sample_every if at is None else MOST_STEPS)
    require_support(method, scene)
    if at is None:
        return method.solve(scene, grid)
    grid = grid_before(scene, method, grid.dt, at)
    return sample_between(method.solve(scene, grid), method, grid, at)


def _integrate_to(
    error: float,
    scene: Scene,
    dt: float | None,
    t_end: float | None,
    sample_every: int,
    at: Array | None,
    progress: Callable[[Progress], object] | None,
) -> Trajectory:
    end = scene.t_end if t_end is None else positive_number("t_end", t_end, "a finite duration above 0, s")
    spacing = None if dt is None else grid_for(scene, dt, end).dt
    samples = Samples(spacing, positive_integer("sample_every", sample_every), at)
    return integrate_to_error(scene, error, end if at is None else at[-1] or end, samples, progress)
