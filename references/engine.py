"""Common functions of engines: version, module, and scenes in axes that every engine supports.

Engines get the body in axes F in which its inertia is diagonal. Both conversions are here:

    there       R_WF = R_WB R_BF      w_F = R_BF' w_B
    and back    R_WB = R_WF R_BF'     w_B = R_BF w_F
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import import_module, metadata
from typing import Any

import numpy as np

from conservative.attitude import Array, axes_about, to_quaternion
from conservative.body import RigidBody
from conservative.errors import Diverged, MissingEngine
from conservative.grid import Grid
from conservative.invariants import axial_direction
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from .samples import MATRIX, Delivered, States, to_body_axes

STEP_LIMIT = 10_000_000
"""Largest number of steps of an adaptive engine: minutes of heyoka, an hour of SciPy."""
PACE_STEPS = 1000
"""Number of steps between estimates of all steps of a run, which ends at one that exceeds ten times `STEP_LIMIT`."""
SHARE = 15 / 16
"""Mass of a body about a fixed point, relative to the largest possible one: the share of a cone on its tip,
such as the cone of Krenk & Nielsen (`scenes.tops`), whose height is twice its radius.
"""
LONG = 1e5
"""Rotation in a run, rad, above which heyoka's pace is checked first. Shorter runs stay far below the limit."""


def limit_reason(steps: int, share: float) -> str:
    """Return why a run has to end after some steps and a share of its time, 0 to 1; "" if it may continue."""
    if steps >= STEP_LIMIT:
        return f"step limit of {STEP_LIMIT} reached"
    if steps % PACE_STEPS == 0 and steps > 10 * STEP_LIMIT * share:
        return f"step limit of {STEP_LIMIT} out of reach: the first {steps} steps did {share:.1g} of the time"
    return ""


def pace_reason(scene: Scene, integrator: Any, t_end: float) -> str:
    """Return why heyoka's integrator cannot reach t_end, s, from the initial state; "" if it may. This steps the integrator."""
    angle = t_end * math.sqrt(2 * scene.energy_scale / float(scene.body.moments.min()))
    if angle < LONG:
        return ""
    for _ in range(PACE_STEPS):
        integrator.step()
    share = float(integrator.time) / t_end
    return limit_reason(PACE_STEPS, share) if math.isfinite(share) else ""


@lru_cache(maxsize=32)
def version(package: str, engine: str) -> str:
    """Return the version of an installed package, without importing it. Raise `MissingEngine`."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        raise MissingEngine(engine, package) from None


@lru_cache(maxsize=32)
def load(module: str, package: str, engine: str) -> Any:
    """Import the module of an engine. Raise `MissingEngine` if that fails."""
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingEngine(engine, package) from error


@dataclass(frozen=True, eq=False)
class EngineAxes:
    """The initial state of a scene in axes F in which the inertia is diagonal.

    Attributes
    ----------
    scene
        The scene.
    R_BF
        Rotation (3, 3), F to body components.
    J
        Moments (3,) about the axes F, kg m^2.
    """

    scene: Scene
    R_BF: Array
    J: Array

    @property
    def R_WF0(self) -> Array:
        """Initial attitude (3, 3), F to world."""
        return self.scene.R_WB0 @ self.R_BF

    @property
    def q0(self) -> Array:
        """Initial attitude: unit quaternion (4,) of `R_WF0`, scalar first."""
        return to_quaternion(self.R_WF0)

    @property
    def w0(self) -> Array:
        """Initial angular velocity (3,), rad/s, axes F."""
        return self.scene.w_WB_B0 @ self.R_BF

    @property
    def rotor(self) -> Array:
        """Momentum of the rotor (3,), kg m^2/s, axes F; zero without one."""
        return np.array(self.scene.body.rotor_along(self.R_BF) or (0.0, 0.0, 0.0))

    @property
    def moment(self) -> Array:
        """Weight times centre of mass (3,), N m, axes F; zero for a free body."""
        potential = self.scene.potential
        return potential.moment_B @ self.R_BF if isinstance(potential, UniformGravity) else np.zeros(3)

    def trajectory(
        self,
        grid: Grid,
        label: str,
        states: States,
        work: Counters,
        reason: str = "the state is not finite",
        *,
        frame: tuple[Array, Array] | None = None,
    ) -> Trajectory:
        """Return the samples in body axes from states of this body and, in free flight, `frame` as `Trajectory` has it.

        Samples end before the first that is not finite or missing; `reason` is the reason.
        """
        R_WB, w_WB_B, finite = to_body_axes(grid.t, states, self.R_BF[None])
        good = int(finite[0])
        if frame:
            good = min(good, *(int(np.append(np.isfinite(part).all(axis=1), False).argmin()) for part in frame))
            frame = frame[0][:good], frame[1][:good]
        failure = None if good == grid.n_samples else Diverged(float(grid.t[max(good - 1, 0)]), reason)
        return Trajectory(self.scene, grid.t[:good], R_WB[0, :good], w_WB_B[0, :good], label, work, failure, frame=frame)


class EngineRun:
    """A run of an engine: its loop, with limits, and the conversion of the result.

    `bind` returns the loop as a user of the engine would write it, with everything bound before and without limits. It is the
    attribute `own_loop`, which benchmarks time after the first call of the run; by default it is the loop itself.
    `bind_final` returns the same followed by the shortest conversion of the final state to attitude and rates in body axes. It
    is the attribute `final_call`, which benchmarks compare with a run of ours; by default it is the run itself.
    """

    def __init__(
        self,
        loop: Callable[[], Any],
        convert: Callable[[Any], Trajectory],
        bind: Callable[[], Callable[[], Any]] | None = None,
        bind_final: Callable[[], Callable[[], Delivered]] | None = None,
    ) -> None:
        # So that the first call does not compile the conversion.
        to_body_axes(np.empty(0), States(MATRIX, np.empty((0, 0, 12))), np.empty((0, 3, 3)))
        self._loop, self._convert, self._bind, self._bind_final = loop, convert, bind, bind_final

    @cached_property
    def own_loop(self) -> Callable[[], Any]:
        return self._bind() if self._bind else self._loop

    @cached_property
    def final_call(self) -> Callable[[], Any]:
        return self._bind_final() if self._bind_final else self

    def __call__(self) -> Trajectory:
        return self._convert(self._loop())


def principal_axes(scene: Scene) -> EngineAxes:
    """Return the initial state in principal axes. If the inertia is diagonal, they are the body axes in their order."""
    return EngineAxes(scene, scene.body.R_BP, scene.body.moments)


def symmetric_axes(scene: Scene) -> EngineAxes | None:
    """Return the initial state in axes whose third is an axis of symmetry of body and field; None if there is none."""
    axis = axial_direction(scene.body, scene.potential)
    if axis is None:
        return None
    # The first axis is perpendicular to the coordinate axis farthest from `axis`, not as in our kernels: heyoka's tolerance is
    # relative to the state, and with the axes of our kernels its errors change by a few per cent.
    R_BF = axes_about(axis, beside=int(np.argmin(np.abs(axis))))
    return EngineAxes(scene, R_BF, np.diag(R_BF.T @ scene.body.inertia @ R_BF).copy())


@dataclass(frozen=True, eq=False)
class MassModel:
    """A mass, its centre and the inertia about it that are equivalent to the scene's body, axes F.

    A scene contains only the product of weight and centre of mass, which determines the motion. Engines need a mass m and the
    inertia about the centre of mass c, J_c = J - m (c'c - c c'). Any m gives the same joint-space inertia J and, with gravity
    weight/m, the same torque, as long as a mass distribution with J_c exists.

    Attributes
    ----------
    mass, com, gravity
        Mass, kg; centre of mass (3,), m; downward acceleration, m/s^2.
    body
        Inertia about the centre of mass, its principal moments and axes.
    """

    mass: float
    com: Array
    gravity: float
    body: RigidBody


def mass_model(axes: EngineAxes) -> MassModel | None:
    """Return a physical mass model, None if there is none.

    With the second moments S = tr(J)/2 - J of the mass distribution about the fixed point, those about the centre of mass are
    S - m c c'. Neither may be negative: the first is the triangle inequality, the second m c' S^-1 c <= 1. The mass is `SHARE`
    of the largest one. In joint coordinates any mass gives the same motion; engines whose joints are constraints between free
    bodies lose far more energy with half of it.
    """
    second = axes.J.sum() / 2 - axes.J
    if second.min() < -1e-15 * axes.J.max():  # negative by more than round-off
        return None
    potential, flight = axes.scene.potential, axes.scene.flight
    if flight:
        return MassModel(flight.mass, flight.com_B @ axes.R_BF, flight.g, RigidBody(axes.J))
    if not isinstance(potential, UniformGravity) or not np.any(axes.moment):
        return MassModel(1.0, np.zeros(3), 0.0, RigidBody(axes.J))
    com = potential.com_B @ axes.R_BF
    com[np.abs(com) < 1e-15 * np.linalg.norm(com)] = 0.0  # round-off of a rotation
    lever = com != 0
    if second[lever].min() <= 1e-15 * axes.J.max():
        return None
    mass = SHARE / float(np.sum(com[lever] ** 2 / second[lever]))
    inertia_com = np.diag(axes.J) - mass * (com @ com * np.eye(3) - np.outer(com, com))
    return MassModel(mass, com, potential.weight / mass, RigidBody(inertia_com))


def unsupported_reason(scene: Scene) -> str | None:
    """Return why no engine with a mass model supports a scene; None if one may."""
    if mass_model(principal_axes(scene)) is None:
        return "no mass distribution has this inertia and centre of mass: a moment exceeds the sum of the other two"
    return None
