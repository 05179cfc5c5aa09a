"""MuJoCo: its five integrators on one body. Source: its documentation, Computation, Numerical integration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.check import choice
from conservative.declarations import BetterEnergy, Claims, SameErrors
from conservative.method import Grid, Method, Role, Run
from conservative.methods.units import in_own_units
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import Axes, gravity_or_free, load, mass_model, mass_model_reason, principal_axes, version

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast", "discrete")

# All that MuJoCo computes in a step and one body without contacts, actuators, springs or sensors has no use for. Bits that a
# version does not have are skipped. Autoreset would silently start a diverged run afresh.
_SWITCHED_OFF = (
    *("CONSTRAINT", "EQUALITY", "FRICTIONLOSS", "LIMIT", "CONTACT", "SPRING", "DAMPER", "PASSIVE", "CLAMPCTRL", "WARMSTART"),
    *(
        "FILTERPARENT",
        "ACTUATION",
        "REFSAFE",
        "SENSOR",
        "MIDPHASE",
        "EULERDAMP",
        "AUTORESET",
        "NATIVECCD",
        "ISLAND",
        "MULTICCD",
    ),
)
# Reading a sample out costs about as much as one Euler step; storing every step inside the engine's loop costs a tenth of one.
_ROLLOUT_UP_TO = 8


@dataclass(frozen=True)
class MuJoCo(Method):
    """MuJoCo with one of its integrators, in its own loop.

    The loop is `mujoco.rollout` where samples are close and `mj_step(m, d, nstep)` from sample to sample where they are not.
    The body's principal axes are MuJoCo's body axes; everything the motion does not need is switched off. A free body has a
    free joint at its centre of mass, as MuJoCo's users have it; a body in a field has a ball joint at its fixed point.

    Parameters
    ----------
    integrator
        "Euler", "RK4", "implicit", "implicitfast" or "discrete".

    Raises
    ------
    BadInput
        The integrator is unknown.
    MissingEngine
        MuJoCo is not installed.
    """

    integrator: str = "RK4"

    family: ClassVar[str] = "mujoco"
    role: ClassVar[Role] = Role.ENGINE
    claims: ClassVar[Claims] = Claims(
        "MuJoCo documentation, Computation, Numerical integration",
        comparisons=(
            BetterEnergy("RK4 is better than Euler on energy-conserving systems", "mujoco", "mujoco:integrator=Euler"),
            SameErrors(
                "implicit and implicitfast coincide for a free body",
                ("mujoco:integrator=implicit", "mujoco:integrator=implicitfast"),
                tolerance=1e-6,
                free=True,
            ),
        ),
    )
    colour: ClassVar[str] = "vermilion"
    module: ClassVar[str] = "mujoco"

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, INTEGRATORS)
        version("mujoco", "MuJoCo")

    @property
    def label(self) -> str:
        return f"mujoco=={version('mujoco', 'MuJoCo')}/{self.integrator}"

    @property
    def order(self) -> int:
        return 4 if self.integrator == "RK4" else 1

    def unsupported(self, scene: Scene) -> str | None:
        return gravity_or_free(scene) or mass_model_reason(scene)

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        mj = load("mujoco", "mujoco", "MuJoCo")
        axes = principal_axes(scene)
        model = _model(mj, axes, grid.dt, self.integrator, scene.free)
        data = mj.MjData(model)
        start = _start(mj, model, data, axes)
        march = _roll_out if grid.every <= _ROLLOUT_UP_TO else _step_to_samples

        def run() -> Trajectory:
            with _quiet(mj):
                q, w, reason = march(mj, model, data, start, grid)
            evaluations = grid.n_steps * (4 if self.integrator == "RK4" else 1)
            return axes.trajectory(
                grid, self.label, from_quaternion(q), w, Counters(grid.n_steps, evaluations=evaluations), reason
            )

        return run

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return tuple(cls(integrator) for integrator in INTEGRATORS)

    @classmethod
    def suite_settings(cls) -> tuple[Method, ...]:
        return cls("Euler"), cls("RK4")

    @classmethod
    def picture_settings(cls) -> tuple[Method, ...]:
        return cls("Euler"), cls("RK4"), cls("implicit")


def _model(mj: Any, axes: Axes, dt: float, integrator: str, free_joint: bool) -> Any:
    """Return the compiled model: one body, its inertia about the centre of mass in that inertia's own principal axes."""
    mass = mass_model(axes)
    assert mass is not None  # `unsupported` has seen to it
    spec = mj.MjSpec()
    spec.option.timestep = dt
    spec.option.integrator = getattr(mj.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.gravity = (0, 0, -mass.gravity)
    spec.option.disableflags = _switched_off(mj, "GRAVITY" if mass.gravity == 0 else "")
    body = spec.worldbody.add_body(name="body", explicitinertial=True, mass=mass.mass, ipos=mass.com)
    # MuJoCo refuses moments of a planar body that exceed the sum of the others by a rounding unit.
    moments = mass.body.moments
    body.inertia = np.minimum(moments, np.roll(moments, 1) + np.roll(moments, 2))
    body.iquat = to_quaternion(mass.body.R_BP)  # MuJoCo: scalar first
    body.add_joint(type=mj.mjtJoint.mjJNT_FREE if free_joint else mj.mjtJoint.mjJNT_BALL)
    return spec.compile()


def _switched_off(mj: Any, *more: str) -> int:
    return sum(int(getattr(mj.mjtDisableBit, f"mjDSBL_{name}", 0)) for name in (*_SWITCHED_OFF, *more))


def _start(mj: Any, model: Any, data: Any, axes: Axes) -> Array:
    """Return MuJoCo's state vector (time, qpos, qvel) at the start.

    qpos ends with the quaternion, scalar first, body to world; qvel ends with the angular velocity in body axes, for the free
    joint as for the ball joint (the free joint's translation, ahead of them, is zero).
    """
    mj.mj_resetData(model, data)
    data.qpos[-4:], data.qvel[-3:] = axes.q0, axes.w0
    state = np.empty(mj.mj_stateSize(model, mj.mjtState.mjSTATE_FULLPHYSICS))
    mj.mj_getState(model, data, state, mj.mjtState.mjSTATE_FULLPHYSICS)
    return state


def _roll_out(mj: Any, model: Any, data: Any, start: Array, grid: Grid) -> tuple[Array, Array, str]:
    """Return quaternions, rates and a reason from one call that stores every step."""
    rollout = load("mujoco.rollout", "mujoco", "MuJoCo").rollout
    mj.mj_resetData(model, data)
    states = np.empty((1, grid.n_steps, len(start)))
    rollout(model, data, start[None], nstep=grid.n_steps, state=states)
    states = np.concatenate([start[None], states[0]])
    reason = _warning(mj, data)
    if reason:
        # The rollout fills what it could not compute with the last state it had, whose time then stands still.
        states[1:][np.diff(states[:, 0]) <= 0] = np.nan
    states = states[grid.steps.astype(int)]
    nq = 1 + model.nq
    return states[:, nq - 4 : nq], states[:, nq + model.nv - 3 : nq + model.nv], reason


def _step_to_samples(mj: Any, model: Any, data: Any, start: Array, grid: Grid) -> tuple[Array, Array, str]:
    """Return quaternions, rates and a reason, stepping from sample to sample inside the engine."""
    mj.mj_resetData(model, data)
    mj.mj_setState(model, data, start, mj.mjtState.mjSTATE_FULLPHYSICS)
    q, w = np.full((grid.n_samples, 4), np.nan), np.full((grid.n_samples, 3), np.nan)
    q[0], w[0] = data.qpos[-4:], data.qvel[-3:]
    for sample, n_steps in enumerate(np.diff(grid.steps).astype(int), start=1):
        mj.mj_step(model, data, int(n_steps))
        reason = _warning(mj, data)
        if reason:
            return q, w, reason
        q[sample], w[sample] = data.qpos[-4:], data.qvel[-3:]
    return q, w, ""


def _warning(mj: Any, data: Any) -> str:
    """Return the engine's own word for a state that it found bad, "" if it found none."""
    for kind in ("BADQPOS", "BADQVEL", "BADQACC"):
        if data.warning[int(getattr(mj.mjtWarning, f"mjWARN_{kind}"))].number:
            return f"MuJoCo warned of {kind}"
    return ""


class _Quiet:
    """Keeps MuJoCo from writing its warnings to a file in the working directory; they are read from the data instead.

    The first of the runs that overlap puts the user's own handler aside, the last one puts it back.
    """

    def __init__(self) -> None:
        self._lock, self._runs, self._before = Lock(), 0, None

    @contextmanager
    def __call__(self, mj: Any) -> Iterator[None]:
        with self._lock:
            if self._runs == 0:
                self._before = mj.get_mju_user_warning()
                mj.set_mju_user_warning(lambda message: None)
            self._runs += 1
        try:
            yield
        finally:
            with self._lock:
                self._runs -= 1
                if self._runs == 0:
                    mj.set_mju_user_warning(self._before)


_quiet = _Quiet()
