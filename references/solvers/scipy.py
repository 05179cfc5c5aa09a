"""SciPy's integrators on quaternion and body rates, the usual approach without an engine."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array, from_quaternion, hat
from conservative.check import choice, describe, finite_number
from conservative.errors import BadInput
from conservative.features import Feature
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.method_info import Maker, MethodInfo
from conservative.methods.units import in_own_units
from conservative.potentials.load import Window, load_field
from conservative.potentials.potential import torque_W
from conservative.potentials.turning import static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..engine import LONG, PACE_STEPS, STEP_LIMIT, EngineAxes, EngineRun, limit_reason, load, principal_axes, version
from ..engines.shared import compile_derivative, pack_field
from ..environments.plain_numbers import FIELDS, describe_field
from ..samples import QUATERNION, Delivered, States, bind_conversion

INTEGRATORS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
_COMPILED: dict[str, dict[str, Any]] = {
    **{"DOP853": {"name": "dop853"}, "RK45": {"name": "dopri5"}, "LSODA": {"name": "lsoda"}},
    **{"BDF": {"name": "vode", "method": "bdf", "with_jacobian": True}, "Adams": {"name": "vode", "method": "adams"}},
}
"""Settings of `scipy.integrate.ode` for its integrators that are like ours."""
_RESTARTED = ("DOP853", "RK45")
"""Integrators whose compiled loops start again at each sample."""
_SMALLEST_RTOL = 2.3e-14
"""Smallest relative tolerance, 100 rounding units. `solve_ivp` raises smaller ones to this one, with a warning, and `lsoda` and
`vode` refuse them."""
_SMALLEST_OF_COMPILED = 1e-15
"""The same for `dop853` and `dopri5`. Smaller ones do not reduce the error: 8e-14 rad at 1e-14, 1e-14 at 1e-15 and below."""

Derivative = Callable[[float, Array], Array]


@dataclass(frozen=True)
class SciPy(Method):
    """SciPy's integrators with their own step control; dt is only the interval between samples.

    The state is the quaternion, scalar first, of principal axes F in the world, and the rates in F. numba compiles the
    right-hand side for the fields of this package. Any other potential works as well, through its gradient.

    Parameters
    ----------
    integrator
        "DOP853", "RK45", "RK23", "Radau", "BDF" or "LSODA"; with compiled loops "Adams" as well.
    rtol
        Relative tolerance, 2.3e-14 to 1, and 1e-15 to 1 with a compiled loop of "DOP853" or "RK45". The absolute one is this
        times the size of each part of the state, in compiled loops of the smaller part.
    loop
        "python": `solve_ivp`, whose loop is in Python. Samples come from the integrator's interpolant; DOP853's is of order 7
        and adds to the error of the steps: on 2 s of the brick, the error between steps is 1.6 to 2.4 times that at their ends.
        "compiled": `ode`, five times as fast (brick, 1e-6 rad). "DOP853" (`dop853`) and "RK45" (`dopri5`) start again
        at each sample, "BDF" and "Adams" (`vode`) and "LSODA" interpolate.

    Raises
    ------
    BadInput
        The integrator or the loop is unknown, the integrator has no such loop, or rtol is out of range.
    """

    integrator: str = "DOP853"
    rtol: float = 1e-12
    loop: str = "python"

    family: ClassVar[str] = "scipy"
    role: ClassVar[Role] = Role.ENGINE
    order = None
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=("rtol=1e-9", "rtol=1e-12", "loop=compiled", "LSODA,loop=compiled"),
        report=("loop=compiled",),
        suite=("rtol=1e-9",),
        colour="orange",
        supports=frozenset(Feature) - {Feature.FLIGHT},
    )

    def __post_init__(self) -> None:
        choice("loop", self.loop, ("python", "compiled"))
        choice("integrator", self.integrator, INTEGRATORS if self.loop == "python" else tuple(_COMPILED))
        smallest = _SMALLEST_OF_COMPILED if self.loop == "compiled" and self.integrator in _RESTARTED else _SMALLEST_RTOL
        allowed = f"a number from {smallest:g} to below 1"
        if not smallest <= finite_number("rtol", self.rtol, allowed) < 1:
            raise BadInput("rtol", describe(self.rtol), allowed)

    @property
    def maker(self) -> Maker:
        return Maker("scipy", version("scipy", "SciPy"))

    @property
    def setting_parts(self) -> dict[str, str]:
        parts = {"integrator": self.integrator, "rtol": f"rtol={self.rtol:g}"}
        return parts if self.loop == "python" else parts | {"loop": "compiled"}

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        axes = principal_axes(scene)
        rate_scale = np.sqrt(2 * scene.energy_scale / axes.J.max())  # above 0 even for a scene that starts at rest
        if self.loop == "python":
            solver: SolveIvp | Ode = SolveIvp(self.integrator, self.rtol, self.rtol * np.repeat([1.0, rate_scale], [4, 3]))
        else:
            solver = Ode(self.integrator, self.rtol, self.rtol * min(1.0, rate_scale), LONG / rate_scale)
        pieces = list_derivatives(scene, float(grid.t[-1]), last=grid.last)

        def loop() -> tuple[Array, Counters, str]:
            with np.errstate(all="ignore"):  # a diverging run is reported by its status
                return solve_pieces(scene, pieces, grid.t, solver, grid.last)

        def convert(result: tuple[Array, Counters, str]) -> Trajectory:
            y, work, reason = result
            return axes.trajectory(grid, self.label, States(QUATERNION, y[None]), work, *([reason] if reason else []))

        smooth, longest = len(pieces) == 1 and scene.body.motor is None, scene.smoothness(grid.last).step
        bind = partial(solver.bind, pieces[0][2], initial_state(axes), grid.t, longest)

        def bind_final() -> Callable[[], Delivered]:
            own_loop, at_end = bind(), bind_conversion(float(grid.t[-1]), States(QUATERNION, np.empty((1, 0, 0))), axes.R_BF)
            return lambda: at_end(np.array(own_loop(), ndmin=2)[-1])

        return EngineRun(loop, convert, *((bind, bind_final) if smooth else ()))


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
    scene: Scene, pieces: Pieces, t: Array, solver: SolveIvp | Ode, last: float = 0.0
) -> tuple[Array, Counters, str]:
    """Return states (n, 7), a quaternion and rates in principal axes, at increasing times t (n,), s, from a solver.

    `pieces` are from `list_derivatives`, for the same `last`: the solver starts again in each. The integrated rates are
    J^-1 (J w + h): a motor changes h, but not the sum. Return also the steps and evaluations, and the reason if the states end
    early.
    """
    samples, steps, evaluations, reason = list[Array](), 0, 0, ""
    wheel = wheel_rates(scene)
    y = initial_state(principal_axes(scene))
    y[4:] += wheel(pieces[0][0])
    longest = scene.smoothness(last).step
    for a, b, derivative in pieces:
        last = b == pieces[-1][1]
        some = t[(t >= a) & ((t < b) | last)]
        if not np.isfinite(derivative(a, y)).all():  # SciPy would look for a first step for ever
            samples.append(y[None][: len(some)])
            break
        states, work, reason = solver.march(derivative, (a, b), y, some if last else np.append(some, b), longest)
        steps, evaluations = steps + work[0], evaluations + work[1]
        samples.append(states[: len(some)])
        if reason:
            break
        y = states[-1]
    states = np.concatenate(samples)
    if scene.body.motor is not None:
        states[:, 4:] -= np.array([wheel(time) for time in t[: len(states)].tolist()]).reshape(-1, 3)
    return states, Counters(steps, evaluations=evaluations), reason


def initial_state(axes: EngineAxes) -> Array:
    """Return the initial quaternion and rates (7,) in principal axes."""
    return np.concatenate([axes.q0, axes.w0])


@dataclass(frozen=True, eq=False)
class Settings:
    """One of SciPy's integrators with tolerances.

    Its subclasses have two loops. `march` returns states (n, 7) at times t of a span, s, the numbers of steps and evaluations,
    and the reason if they end early; `f` is smooth in the span, and steps are at most `longest`, s. `bind` returns the loop as
    users write it, for a run that does not fail.
    """

    integrator: str
    rtol: float = _SMALLEST_RTOL
    atol: Any = _SMALLEST_RTOL


class SolveIvp(Settings):
    """`scipy.integrate.solve_ivp`."""

    def march(self, f: Derivative, span: tuple[float, float], y: Array, t: Array, longest: float) -> tuple[Array, Any, str]:
        integrate = load("scipy.integrate", "scipy", "SciPy")
        kind = _count_steps(getattr(integrate, self.integrator))
        try:
            result = integrate.solve_ivp(f, span, y, kind, t, rtol=self.rtol, atol=self.atol, max_step=longest)
        except (ArithmeticError, ValueError) as error:  # implicit solvers refuse matrices that are not finite or singular
            return y[None][: np.count_nonzero(t[:1] == span[0])], (kind.steps, 0), str(error)
        states = np.reshape(result.y, (7, -1)).T  # SciPy returns an empty list if the first step failed
        return states, (kind.steps, int(result.nfev)), result.message if len(states) < len(t) else ""

    def bind(self, f: Derivative, y: Array, t: Array, longest: float) -> Callable[[], Any]:
        solve = load("scipy.integrate", "scipy", "SciPy").solve_ivp
        how = {"rtol": self.rtol, "atol": self.atol, "max_step": longest, "t_eval": t if len(t) > 2 else None}
        return lambda: solve(f, (t[0], t[-1]), y, self.integrator, **how).y.T


@dataclass(frozen=True, eq=False)
class Ode(Settings):
    """`scipy.integrate.ode`, whose loops are compiled. The pace of the first steps is checked in spans from `slow` s on."""

    slow: float = math.inf

    def march(self, f: Derivative, span: tuple[float, float], y: Array, t: Array, longest: float) -> tuple[Array, Any, str]:
        start, end = span
        solver, states, work = self._make(f, longest), list[Array](), np.zeros(2, int)
        restarts = self.integrator in _RESTARTED  # these start again at each sample, and so do their counters
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the same as its status
            if end - start >= self.slow:
                first = self._make(f, longest, PACE_STEPS).set_initial_value(y, start)
                first.advance(end)
                if reason := limit_reason(PACE_STEPS, (first.t - start) / (end - start)):
                    return y[None][: np.count_nonzero(t[:1] == start)], (PACE_STEPS, 0), reason
            solver.set_initial_value(y, start)
            for time in t.tolist():
                if time > start:
                    y = solver.advance(time).copy()
                    counts = solver._integrator.iwork[17:15:-1] if restarts else solver._integrator.iwork[10:12]
                    work = counts + work * restarts
                if not solver.successful():
                    messages = solver._integrator.messages | {-2 if restarts else -1: f"step limit of {STEP_LIMIT} reached"}
                    return np.reshape(states, (-1, 7)), work.tolist(), messages.get(solver.get_return_code(), "it failed")
                if not np.isfinite(y).all():
                    return np.reshape(states, (-1, 7)), work.tolist(), "the state is not finite"
                states.append(y)
        return np.reshape(states, (-1, 7)), work.tolist(), ""

    def bind(self, f: Derivative, y: Array, t: Array, longest: float) -> Callable[[], Any]:
        solver, times, end = self._make(f, longest), t[1:].tolist(), float(t[-1])

        def to_end() -> Any:
            solver.set_initial_value(y, 0.0)
            return solver.advance(end)

        def to_samples() -> Any:
            solver.set_initial_value(y, 0.0)
            return np.array([y, *(solver.advance(time).copy() for time in times)])

        return to_end if len(t) == 2 else to_samples

    def _make(self, f: Derivative, longest: float, steps: int | None = None) -> Any:
        failures, nothing = list[BaseException](), np.full(7, np.nan)

        def guarded(t: float, y: Array) -> Array:  # `dop853` never ends after an exception, such as Ctrl-C's
            try:
                return f(t, y)
            except BaseException as failure:
                failures.append(failure)
                return nothing

        def advance(time: float) -> Any:
            y = solver.integrate(time)
            if failures:
                raise failures[0]
            return y

        solver = load("scipy.integrate", "scipy", "SciPy").ode(guarded)
        solver.advance = advance
        limits = {"nsteps": steps or STEP_LIMIT, "max_step": longest if longest < math.inf else 0.0}
        return solver.set_integrator(**_COMPILED[self.integrator], rtol=self.rtol, atol=self.atol, **limits)


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
