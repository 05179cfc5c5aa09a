"""SciPy's `solve_ivp` on quaternion and body rates, the usual approach without an engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, hat
from conservative.card import Card, Maker
from conservative.check import choice, describe, finite_number
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.methods.units import in_own_units
from conservative.potentials.load import load_field
from conservative.potentials.potential import torque_W
from conservative.potentials.turning import static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import limit_reason, load, principal_axes, version
from ..environments.plain_numbers import FIELDS, describe_field
from ..samples import QUATERNION, States
from .shared import compile_derivative, pack_field

INTEGRATORS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
_SMALLEST_RTOL = 2.3e-14  # 100 rounding units; SciPy raises smaller ones to this, with a warning

Derivative = Callable[[float, Array], Array]


@dataclass(frozen=True)
class SciPy(Method):
    """`scipy.integrate.solve_ivp` with its own step control; dt is only the distance of samples.

    The state is the quaternion, scalar first, of principal axes F in the world, and the rates in F. Samples come from the
    integrator's interpolant. DOP853's is of order 7 and adds to the error of the steps: on 2 s of the brick, the error between
    steps is 1.6 to 2.4 times that at their ends. numba compiles the right-hand side for the fields of this package. Any other
    potential works as well, through its gradient. What remains is SciPy's own loop in Python; `cyrk` has the same integrator in
    compiled code.

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
    order = None
    card: ClassVar[Card] = Card(
        variants=("rtol=1e-9", "rtol=1e-12"),
        report=("",),
        suite=("rtol=1e-9",),
        colour="orange",
        time_dependent=True,
        loads=True,
        rotors=True,
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

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        integrate = load("scipy.integrate", "scipy", "SciPy")
        axes, derivative = principal_axes(scene), state_derivative(scene)
        start = np.concatenate([axes.q0, axes.w0])
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
            return axes.trajectory(grid, self.label, States(QUATERNION, y[None]), work, *reason)

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


def state_derivative(scene: Scene) -> Derivative:
    """Return the derivative of the state, a quaternion, scalar first, and rates in principal axes.

    numba compiles it, apart from the torques of a rotor, of loads and of potentials of Python functions.
    """
    axes, potential, compiled = principal_axes(scene), scene.potential, compile_derivative()
    field, static = SimpleNamespace(**describe_field(axes)), static_part(potential)
    moment = static.moment_B @ axes.R_BF if isinstance(static, UniformGravity) else 0.0
    body = np.concatenate([pack_field(field, moment), axes.J])  # type: ignore[no-untyped-call]

    def derivative(t: float, y: Array) -> Array:
        out = np.empty(7)
        compiled(out, t, y, body)
        return out

    def through_gradient(t: float, y: Array) -> Array:
        out, R_WF = derivative(t, y), from_quaternion(y[:4])
        out[4:] += torque_W(potential, R_WF @ axes.R_BF.T, np.asarray(t)) @ R_WF / axes.J  # type: ignore[arg-type]
        return out

    loads = load_field(None, scene.torque, scene.damping, axes.R_BF)
    of_field = derivative if potential is None or type(static) in FIELDS else through_gradient
    gyroscopic = hat(axes.rotor) / axes.J[:, None]

    def with_more(t: float, y: Array) -> Array:
        out = of_field(t, y)
        out[4:] += gyroscopic @ y[4:]
        if scene.loaded:
            out[4:] += np.array(loads.at_time(t).load(y[:4], y[4:])) / axes.J
        return out

    return with_more if scene.loaded or gyroscopic.any() else of_field
