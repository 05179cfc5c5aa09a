"""SciPy's `solve_ivp` on quaternion and body rates: what one writes without an engine. Source: Euler's equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion
from conservative.check import choice, describe, finite_number
from conservative.errors import BadInput
from conservative.method import Grid, Method, Role, Run
from conservative.methods.units import in_own_units
from conservative.potentials.potential import torque_W
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import Axes, limit_reason, load, principal_axes, version

INTEGRATORS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
_SMALLEST_RTOL = 2.3e-14  # 100 rounding units; SciPy raises smaller ones to this, with a warning

Derivative = Callable[[float, Array], list[float]]
Torque = Callable[[float, float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class SciPy(Method):
    """`scipy.integrate.solve_ivp` with its own step control; dt is only the distance of samples.

    The state is the quaternion of `R_WF`, scalar first, and the rates in principal axes F. Samples come from the integrator's
    interpolant, whose error is that of the steps. Any potential works, through its gradient; uniform gravity is written out.

    Parameters
    ----------
    integrator
        "DOP853", "RK45", "RK23", "Radau", "BDF" or "LSODA".
    rtol
        Relative tolerance, 2.3e-14 to 1. The absolute one is this times the size of each part of the state.

    Raises
    ------
    BadInput
        The integrator is unknown, or rtol is out of range.
    """

    integrator: str = "DOP853"
    rtol: float = 1e-12

    family: ClassVar[str] = "scipy"
    role: ClassVar[Role] = Role.ENGINE
    colour: ClassVar[str] = "orange"
    module: ClassVar[str] = "scipy.integrate"

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, INTEGRATORS)
        allowed = f"a number from {_SMALLEST_RTOL:g} (100 rounding units) to below 1"
        if not _SMALLEST_RTOL <= finite_number("rtol", self.rtol, allowed) < 1:
            raise BadInput("rtol", describe(self.rtol), allowed)

    @property
    def label(self) -> str:
        return f"scipy=={version('scipy', 'SciPy')}/{self.integrator},rtol={self.rtol:g}"

    @property
    def order(self) -> None:
        return None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        integrate = load("scipy.integrate", "scipy", "SciPy")
        axes = principal_axes(scene)
        derivative = _derivative(axes)
        start = np.concatenate([axes.q0, axes.w0])
        atol = self.rtol * np.repeat([1.0, _rate_scale(axes)], [4, 3])
        span = (0.0, float(grid.t[-1]))

        solver = _count_steps(getattr(integrate, self.integrator))

        def run() -> Trajectory:
            solver.steps = 0
            if not np.isfinite(derivative(0.0, start)).all():  # SciPy would look for a first step for ever
                return axes.trajectory(grid, self.label, from_quaternion(start[None, :4]), start[None, 4:], Counters(0))
            try:
                with np.errstate(all="ignore"):  # a diverging run is reported by its status
                    found = integrate.solve_ivp(derivative, span, start, solver, grid.t, rtol=self.rtol, atol=atol)
            except (ArithmeticError, ValueError) as error:  # implicit solvers refuse matrices that are not finite or singular
                return axes.trajectory(
                    grid, self.label, from_quaternion(start[None, :4]), start[None, 4:], Counters(solver.steps), str(error)
                )
            y = np.reshape(found.y, (7, -1))  # SciPy has an empty list where the first step failed
            work = Counters(solver.steps, evaluations=int(found.nfev))
            return axes.trajectory(grid, self.label, from_quaternion(y[:4].T), y[4:].T, work, found.message)

        return run

    @classmethod
    def variants(cls) -> tuple[Method, ...]:
        return (cls(rtol=1e-9), cls(rtol=1e-12))

    @classmethod
    def suite_settings(cls) -> tuple[Method, ...]:
        return (cls(rtol=1e-9),)


def _count_steps(solver: Any) -> Any:
    """Return the solver class with a count of its steps, which `solve_ivp` does not tell, and a limit to it."""

    def step(self: Any) -> Any:
        counting.steps += 1
        reason = limit_reason(counting.steps, float(self.t / self.t_bound))
        if reason:
            self.status = "failed"
            return reason
        return solver.step(self)

    counting: Any = type(solver.__name__, (solver,), {"steps": 0, "step": step})
    return counting


def _rate_scale(axes: Axes) -> float:
    """Return a size of the rates that is above 0 even for a scene that starts at rest, rad/s."""
    return float(np.sqrt(2 * axes.scene.energy_scale / axes.J.max()))


def _derivative(axes: Axes) -> Derivative:
    """Return Euler's equations and q' = q w / 2 in plain floats: arrays of three cost more than their arithmetic."""
    J1, J2, J3 = axes.J.tolist()
    a1, a2, a3 = (J2 - J3) / J1, (J3 - J1) / J2, (J1 - J2) / J3
    torque = _torque(axes)

    def free(_: float, y: Array) -> list[float]:
        q0, q1, q2, q3, w1, w2, w3 = y.tolist()
        return [
            -0.5 * (q1 * w1 + q2 * w2 + q3 * w3),
            0.5 * (q0 * w1 + q2 * w3 - q3 * w2),
            0.5 * (q0 * w2 + q3 * w1 - q1 * w3),
            0.5 * (q0 * w3 + q1 * w2 - q2 * w1),
            a1 * w2 * w3,
            a2 * w3 * w1,
            a3 * w1 * w2,
        ]

    def in_field(t: float, y: Array) -> list[float]:
        out = free(t, y)
        t1, t2, t3 = torque(*y[:4].tolist())  # type: ignore[misc]
        out[4] += t1 / J1
        out[5] += t2 / J2
        out[6] += t3 / J3
        return out

    return free if torque is None else in_field


def _torque(axes: Axes) -> Torque | None:
    """Return the torque in axes F as a function of the quaternion of `R_WF`."""
    potential = axes.scene.potential
    if potential is None:
        return None
    if not isinstance(potential, UniformGravity):
        return _general_torque(potential, axes.R_BF)
    m1, m2, m3 = axes.moment.tolist()

    def uniform(q0: float, q1: float, q2: float, q3: float) -> tuple[float, float, float]:
        g1, g2, g3 = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3
        return g2 * m3 - g3 * m2, g3 * m1 - g1 * m3, g1 * m2 - g2 * m1

    return uniform


def _general_torque(potential: Any, R_BF: Array) -> Torque:
    def torque(*q: float) -> tuple[float, float, float]:
        R_WF = from_quaternion(q)
        t1, t2, t3 = (torque_W(potential, R_WF @ R_BF.T) @ R_WF).tolist()
        return t1, t2, t3

    return torque
