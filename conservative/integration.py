"""`integrate`: a scene, a method and a step, checked, to a trajectory or an exception that says what failed."""

from __future__ import annotations

from typing import Literal

from . import registry
from .check import choice, describe, positive_integer, positive_number
from .errors import BadInput, Unsupported
from .method import Method, grid_for
from .methods.automatic import integrate_to_error
from .methods.reduced import Reduced
from .scene import Scene
from .trajectory import Trajectory

DEFAULT_DT = 0.01
"""Step, s, where nobody names one: the paper's."""


def require_support(method: Method, scene: Scene) -> None:
    """Raise `Unsupported` if the method cannot do the scene."""
    reason = method.unsupported(scene)
    if reason:
        raise Unsupported("method", f"{method.name} for the scene {scene.name!r}", f"a scene it can do ({reason})")


def integrate(
    scene: Scene,
    dt: float | None = None,
    method: Method | str | None = None,
    t_end: float | None = None,
    sample_every: int = 1,
    *,
    error: float | None = None,
    on_failure: Literal["raise", "return"] = "raise",
) -> Trajectory:
    """Integrate a scene.

    Parameters
    ----------
    scene
        What moves.
    dt
        Step, s, by default 0.01. For adaptive methods, and with `error`, the distance of samples.
    method
        A method, or its name, as everywhere: `"mujoco@3.6.0:RK4"`. Default `Reduced()`, the paper's map in three unknowns.
    t_end
        Duration, s; default the scene's. The run ends with the first step at or past it.
    sample_every
        Keep every so many steps (and the first and last state).
    error
        Attitude error over the run, rad, instead of a method and a step: `conservative.methods.automatic` chooses both, and
        `trajectory.choice` has them and the estimated error; a warning `AccuracyNotReached` where round-off is in the way.
        What takes more than 10^10 steps is refused.
    on_failure
        "raise", or "return" to get the samples before the failure, with an outcome that says what failed.

    Raises
    ------
    BadInput
        An argument cannot be used, the steps do not fit in memory or are too many, or the method has no step of that length.
    MissingEngine
        A method of that name needs an engine that is not installed.
    Unsupported
        The method cannot do the scene.
    NotConverged
        The equations of a step could not be solved.
    Diverged
        The state stopped being finite, or an engine gave up.
    NotConserved
        Orthonormality, or an invariant that the method names, left the method's `bounds`.
    InvalidResult
        The method gave no trajectory of the scene, or not all samples, or others than those of the grid.
    """
    if not isinstance(scene, Scene):
        raise BadInput("scene", describe(scene), "a Scene, such as conservative.scenes.brick_flip()")
    choice("on_failure", on_failure, ("raise", "return"))
    try:
        if error is None:
            trajectory = _integrate_with(method, scene, dt, t_end, sample_every)
        else:
            trajectory = _integrate_to(error, scene, dt, method, t_end, sample_every)
    except SystemError as failure:
        raise _interrupt_of(failure)  # noqa: B904  # where it is the failure itself, its own reasons stay
    if trajectory.failure is not None and on_failure == "raise":
        raise trajectory.failure
    return trajectory


def _interrupt_of(failure: SystemError) -> BaseException:
    """Return the interrupt that came while Python called machine code, which makes `SystemError`s of it; else the failure."""
    reason: BaseException | None = failure
    while isinstance(reason, SystemError):
        reason = reason.__cause__ or reason.__context__
    return reason if isinstance(reason, KeyboardInterrupt) else failure


def _integrate_with(
    method: Method | str | None, scene: Scene, dt: float | None, t_end: float | None, sample_every: int
) -> Trajectory:
    if isinstance(method, str):
        method = registry.method(method)
    method = Reduced() if method is None else method
    if not isinstance(method, Method):
        raise BadInput("method", describe(method), "a Method, such as Reduced(), or the name of one, such as 'mujoco:RK4'")
    grid = grid_for(scene, DEFAULT_DT if dt is None else dt, t_end, sample_every)
    require_support(method, scene)
    return method.solve(scene, grid)


def _integrate_to(
    error: float, scene: Scene, dt: float | None, method: Method | str | None, t_end: float | None, sample_every: int
) -> Trajectory:
    positive_number("error", error, "a finite attitude error above 0, rad")
    if method is not None:
        raise BadInput("method", describe(method), "None together with error, which chooses the method")
    end = scene.t_end if t_end is None else positive_number("t_end", t_end, "a finite duration above 0, s")
    spacing = None if dt is None else grid_for(scene, dt, end).dt
    return integrate_to_error(scene, error, end, spacing, positive_integer("sample_every", sample_every))
