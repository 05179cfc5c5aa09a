"""SciPy's `solve_ivp` on quaternion and body rates, the usual approach without an engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, to_quaternion
from conservative.card import Card, Maker
from conservative.check import choice, describe, finite_number
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.units import in_own_units
from conservative.potentials.potential import torque_W
from conservative.potentials.turning import Turning, static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import EngineAxes, limit_reason, load, orbit_turn, principal_axes, version
from ..heyoka_equations.accelerations import READERS, express_field
from ..heyoka_equations.forms import kinematics_in_world
from ..samples import QUATERNION, States

INTEGRATORS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
_SMALLEST_RTOL = 2.3e-14  # 100 rounding units; SciPy raises smaller ones to this, with a warning

Derivative = Callable[[float, Array], list[float]]
Acceleration = Callable[[float, float, float, float, float], Sequence[float]]
"""Maps time and quaternion to the angular acceleration by the field, rad/s^2, axes F."""


@dataclass(frozen=True)
class SciPy(Method):
    """`scipy.integrate.solve_ivp` with its own step control; dt is only the distance of samples.

    The state is the quaternion, scalar first, of principal axes F in world axes whose third is the field's, and the rates in F.
    Samples come from the integrator's interpolant, whose error is that of the steps. This package's fields are written out;
    any other potential works as well, through its gradient.

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
    card: ClassVar[Card] = Card(
        variants=("rtol=1e-9", "rtol=1e-12"), report=("",), suite=("rtol=1e-9",), colour="orange", time_dependent=True
    )

    def __post_init__(self) -> None:
        choice("integrator", self.integrator, INTEGRATORS)
        allowed = f"a number from {_SMALLEST_RTOL:g} (100 rounding units) to below 1"
        if not _SMALLEST_RTOL <= finite_number("rtol", self.rtol, allowed) < 1:
            raise BadInput("rtol", describe(self.rtol), allowed)

    @property
    def maker(self) -> Maker:
        return Maker("scipy", version("scipy", "SciPy"))

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"integrator": self.integrator, "rtol": f"rtol={self.rtol:g}"}

    @property
    def order(self) -> None:
        return None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        integrate = load("scipy.integrate", "scipy", "SciPy")
        axes, R_WD, acceleration, turn_D = _express(scene)
        derivative = _derivative(axes, acceleration, turn_D)
        start = np.concatenate([to_quaternion(R_WD.T @ axes.R_WF0), axes.w0])
        rate_scale = np.sqrt(2 * scene.energy_scale / axes.J.max())  # above 0 even for a scene that starts at rest
        atol = self.rtol * np.repeat([1.0, rate_scale], [4, 3])
        span = (0.0, float(grid.t[-1]))

        solver = _count_steps(getattr(integrate, self.integrator))

        def run() -> Trajectory:
            solver.steps = 0
            if not np.isfinite(derivative(0.0, start)).all():  # SciPy would look for a first step for ever
                return finish(start[None], Counters(0))
            try:
                with np.errstate(all="ignore"):  # a diverging run is reported by its status
                    solution = integrate.solve_ivp(derivative, span, start, solver, grid.t, rtol=self.rtol, atol=atol)
            except (ArithmeticError, ValueError) as error:  # implicit solvers refuse matrices that are not finite or singular
                return finish(start[None], Counters(solver.steps), str(error))
            y = np.reshape(solution.y, (7, -1))  # SciPy returns an empty list if the first step failed
            return finish(y.T, Counters(solver.steps, evaluations=int(solution.nfev)), solution.message)

        def finish(y: Array, work: Counters, *reason: str) -> Trajectory:
            turn = None if turn_D is None else orbit_turn(scene)
            return axes.trajectory(grid, self.label, States(QUATERNION, y[None], R_WD[None], turn), work, *reason)

        return run


def _count_steps(solver: Any) -> Any:
    """Return the solver class with a count of its steps, which `solve_ivp` does not return, and a limit."""

    def step(self: Any) -> Any:
        counting.steps += 1
        reason = limit_reason(counting.steps, float(self.t / self.t_bound))
        if reason:
            self.status = "failed"
            return reason
        return solver.step(self)

    counting: Any = type(solver.__name__, (solver,), {"steps": 0, "step": step})
    return counting


def _express(scene: Scene) -> tuple[EngineAxes, Array, Acceleration | None, Array | None]:
    """Return principal axes F, axes D (3, 3) with the field's as the third, the field as a function of F in D, rates of D.

    The last, (3,), rad/s, in D, is None where D does not turn.
    """
    axes, potential = principal_axes(scene), scene.potential
    if potential is None:
        return axes, np.eye(3), None, None
    if isinstance(potential, UniformGravity):
        return axes, np.eye(3), _uniform(axes), None
    if type(static_part(potential)) in READERS:
        field = express_field(scene)
        parameters = tuple(field.parameters)
        turn_D = field.turn_D if isinstance(potential, Turning) else None
        return field.axes, field.R_WD, lambda _, *q: field.acceleration(parameters, _unit_row(*q)), turn_D

    def through_gradient(t: float, *q: float) -> list[float]:
        R_WF = from_quaternion(q)
        return (torque_W(potential, R_WF @ axes.R_BF.T, np.asarray(t)) @ R_WF / axes.J).tolist()

    return axes, np.eye(3), through_gradient, None


def _derivative(axes: EngineAxes, acceleration: Acceleration | None, turn_D: Array | None = None) -> Derivative:
    """Return Euler's equations and q' = (q w - turn q) / 2 in plain floats: arrays of three cost more than their arithmetic."""
    J1, J2, J3 = axes.J.tolist()
    a1, a2, a3 = (J2 - J3) / J1, (J3 - J1) / J2, (J1 - J2) / J3

    def free(_: float, y: Array) -> list[float]:
        # Written out: a call of `kinematics_in_body` takes a quarter of the time of this function.
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
        b1, b2, b3 = acceleration(t, *y[:4].tolist())  # type: ignore[misc]
        out[4] += b1
        out[5] += b2
        out[6] += b3
        return out

    def in_turning_field(t: float, y: Array) -> list[float]:
        out = in_field(t, y)
        transport = kinematics_in_world(y[:4].tolist(), turn)
        return [*(x - each for x, each in zip(out[:4], transport, strict=True)), *out[4:]]

    if turn_D is None:
        return free if acceleration is None else in_field
    turn = turn_D.tolist()
    return in_turning_field


def _uniform(axes: EngineAxes) -> Acceleration:
    (m1, m2, m3), (J1, J2, J3) = axes.moment.tolist(), axes.J.tolist()

    def acceleration(_: float, *q: float) -> tuple[float, float, float]:
        g1, g2, g3 = _third_row(*q)
        return (g2 * m3 - g3 * m2) / J1, (g3 * m1 - g1 * m3) / J2, (g1 * m2 - g2 * m1) / J3

    return acceleration


def _third_row(q0: float, q1: float, q2: float, q3: float) -> tuple[float, float, float]:
    """Return the last row of the rotation matrix."""
    return 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


def _unit_row(*q: float) -> tuple[float, float, float]:
    """Return the row with length 1: fields take roots of it, and loose tolerances let the quaternion drift."""
    g1, g2, g3 = _third_row(*q)
    square = sum(x * x for x in q)
    return g1 / square, g2 / square, g3 / square
