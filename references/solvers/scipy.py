"""SciPy's `solve_ivp` on quaternion and body rates, the usual approach without an engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
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
from conservative.needs import Need
from conservative.potentials.load import Window, load_field
from conservative.potentials.potential import torque_W
from conservative.potentials.turning import static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import limit_reason, load, principal_axes, version
from ..engines.shared import compile_derivative, pack_field
from ..environments.plain_numbers import FIELDS, describe_field
from ..samples import QUATERNION, States

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
        takes=frozenset(Need) - {Need.FLIGHT},
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
        axes = principal_axes(scene)
        rate_scale = np.sqrt(2 * scene.energy_scale / axes.J.max())  # above 0 even for a scene that starts at rest
        atol = self.rtol * np.repeat([1.0, rate_scale], [4, 3])
        solver = _count_steps(getattr(integrate, self.integrator))
        pieces = list_derivatives(scene, float(grid.t[-1]), last=grid.last)

        def run() -> Trajectory:
            solver.steps = 0
            with np.errstate(all="ignore"):  # a diverging run is reported by its status
                y, evaluations, reason = solve_pieces(scene, pieces, grid.t, solver, self.rtol, atol)
            work = Counters(solver.steps, evaluations=evaluations)
            return axes.trajectory(grid, self.label, States(QUATERNION, y[None]), work, *([reason] if reason else []))

        return run


Pieces = list[tuple[float, float, Derivative]]


def list_derivatives(scene: Scene, t_end: float, t_start: float = 0.0, last: float = 0.0) -> Pieces:
    """Return the times, s, between which a scene is smooth, from t_start to t_end, s, and the derivative between each two.

    Break points are known until `last`, s, at least the end of the scene.
    """
    breaks = scene.smoothness(last).breaks
    inner = breaks[(breaks > t_start) & (breaks < t_end)].tolist()
    ends = [t_start, *inner, t_end]
    edges = [-math.inf, *breaks.tolist(), math.inf]
    first = int(np.searchsorted(breaks, t_start, side="right"))
    windows = list(pairwise(edges))[first:]
    return [(a, b, state_derivative(scene, window)) for (a, b), window in zip(pairwise(ends), windows, strict=False)]


def solve_pieces(
    scene: Scene,
    pieces: Pieces,
    t: Array,
    solver: Any = "DOP853",
    rtol: float = _SMALLEST_RTOL,
    atol: Any = _SMALLEST_RTOL,
) -> tuple[Array, int, str]:
    """Return states (n, 7), a quaternion and rates in principal axes, at increasing times t (n,), s, from SciPy's `solve_ivp`.

    `pieces` are those of `list_derivatives`: the solver starts again in each. The integrated rates are J^-1 (J w + h): a motor
    changes h, but not the sum. Return also the number of evaluations, and the reason if the states end early.
    """
    solve_ivp = load("scipy.integrate", "scipy", "SciPy").solve_ivp
    axes, found, evaluations, reason = principal_axes(scene), [], 0, ""
    wheel = wheel_rates(scene)
    y = np.concatenate([axes.q0, axes.w0 + wheel(pieces[0][0])])
    longest = scene.smoothness().step
    for a, b, derivative in pieces:
        last = b == pieces[-1][1]
        some = t[(t >= a) & ((t < b) | last)]
        if not np.isfinite(derivative(a, y)).all():  # SciPy would look for a first step for ever
            found.append(y[None][: len(some)])
            break
        at = some if last else np.append(some, b)
        try:
            solution = solve_ivp(derivative, (a, b), y, solver, at, rtol=rtol, atol=atol, max_step=longest)
        except (ArithmeticError, ValueError) as error:  # implicit solvers refuse matrices that are not finite or singular
            found.append(y[None][: len(some)])
            reason = str(error)
            break
        states = np.reshape(solution.y, (7, -1)).T  # SciPy returns an empty list if the first step failed
        evaluations += int(solution.nfev)
        found.append(states[: len(some)])
        if len(states) < len(at):
            reason = solution.message
            break
        y = states[-1]
    states = np.concatenate(found)
    if scene.body.motor is not None:
        states[:, 4:] -= np.array([wheel(each) for each in t[: len(states)].tolist()]).reshape(-1, 3)
    return states, evaluations, reason


def wheel_rates(scene: Scene, window: Window = (-math.inf, math.inf)) -> Callable[[float], Array]:
    """Return J^-1 h, rad/s, principal axes, as a function of time, s, for a rotor with a motor; 0 without a motor."""
    axes, motor = principal_axes(scene), scene.body.motor
    return (lambda t: np.zeros(3)) if motor is None else lambda t: (motor.at(t, None, window) @ axes.R_BF) / axes.J


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


def state_derivative(scene: Scene, window: Window = (-math.inf, math.inf)) -> Derivative:
    """Return the derivative of the state between two break points, s: a quaternion, scalar first, and rates in principal axes.

    numba compiles it, apart from the torques of a rotor, of loads and of potentials of Python functions. With a motor the rates
    of the state are J^-1 (J w + h).
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

    of_field = derivative if potential is None or type(static) in FIELDS else through_gradient
    gyroscopic, wheel = hat(axes.rotor) / axes.J[:, None], wheel_rates(scene, window)
    if not scene.loaded:
        return of_field if not gyroscopic.any() else lambda t, y: of_field(t, y) + np.append(np.zeros(4), gyroscopic @ y[4:])
    loads = load_field(None, scene.torque, scene.damping, axes.R_BF)._replace(clock=(0.0, *window))

    def with_loads(t: float, y: Array) -> Array:
        turning = wheel(t)
        w = y[4:] - turning
        out = of_field(t, np.concatenate([y[:4], w]))
        momentum = axes.J * turning if scene.body.motor is not None else axes.rotor
        (a, b, c), (x, y_, z) = momentum.tolist(), w.tolist()
        gyration = b * z - c * y_, c * x - a * z, a * y_ - b * x  # `np.cross` takes a third of the time of all this
        out[4:] += np.add(gyration, loads.at_time(t).load(y[:4], w)) / axes.J
        return out

    return with_loads
