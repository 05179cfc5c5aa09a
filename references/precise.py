"""Reference solutions for any scene: multi-precision Taylor integration by heyoka on MPFR numbers (Biscani & Izzo 2021).

An entry in `FIELDS` adds a potential. The torques here are independent of the torques that heyoka and SciPy
integrate in double precision, so a mistake in one of them is detected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from threading import RLock
from typing import Any, ClassVar

import mpmath
import numpy as np
from numpy.typing import NDArray

from conservative.attitude import to_quaternion
from conservative.check import describe, positive_integer
from conservative.errors import BadInput
from conservative.features import Feature, features_of
from conservative.grid import Grid
from conservative.method import Method, Role, Run
from conservative.method_info import Maker, MethodInfo
from conservative.potentials.gravity_gradient import GravityGradient
from conservative.potentials.point_to_point import LinearSpring, PointAttraction, PointPotential
from conservative.potentials.potential import Potential
from conservative.potentials.turning import Turning, static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from .engine import STEP_LIMIT, EngineAxes, limit_reason, pace_reason, version
from .heyoka_equations import forms
from .samples import QUATERNION, States

Reals = NDArray[Any]
"""An array of `heyoka.real`."""

Number = Any
"""A float, an `mpmath.mpf` or a text with any number of digits."""

Expressions = Sequence[forms.Expression]


@dataclass(frozen=True)
class TorqueExpression:
    """A potential as expressions: the values of its parameters, and its torque in body axes from quaternion and parameters."""

    values: Callable[[Any], Sequence[Number]]
    torque: Callable[[Expressions, Expressions], list[forms.Expression]]


def uniform(q: Expressions, moment: Expressions) -> list[forms.Expression]:
    """Return g x m for V = m.g, with g the vertical in body axes."""
    return forms.cross(forms.to_body(q, (0.0, 0.0, 1.0)), moment)


def spring(q: Expressions, parameters: Expressions) -> list[forms.Expression]:
    """Return the torque of V = k/2 (d - d0)^2, parameters b (3), A (3), k, d0."""
    stiffness, rest_length = parameters[6:]
    return _pull(q, parameters, lambda square: stiffness * (1 - rest_length / forms.heyoka().sqrt(square)))


def attraction(q: Expressions, parameters: Expressions) -> list[forms.Expression]:
    """Return the torque of V = -c/d, parameters b (3), A (3), c."""
    return _pull(q, parameters, lambda square: parameters[6] * square**-1.5)


def gradient(q: Expressions, parameters: Expressions) -> list[forms.Expression]:
    """Return u x (3 rate^2 J u) for V = 3/2 rate^2 u'J u, parameters 3 rate^2 (1), J (9), direction (3)."""
    u = forms.to_body(q, parameters[10:])
    return [parameters[0] * x for x in forms.cross(u, forms.product(parameters[1:10], u))]


def _pull(q: Expressions, parameters: Expressions, law: Callable[[forms.Expression], Any]) -> list[forms.Expression]:
    """Return the torque b x (A - b) law(d^2) of a force along the line between the points, body axes."""
    b, anchor = parameters[:3], forms.to_body(q, parameters[3:6])
    pull = law(sum((x - y) ** 2 for x, y in zip(b, anchor, strict=True)))
    return [pull * x for x in forms.cross(b, anchor)]


def _points(potential: PointPotential) -> list[Number]:
    return [*potential.point_B.tolist(), *potential.anchor_W.tolist()]


FIELDS: dict[type[Potential], TorqueExpression] = {
    UniformGravity: TorqueExpression(lambda p: p.moment_B.tolist(), uniform),
    LinearSpring: TorqueExpression(lambda p: [*_points(p), p.stiffness, p.rest_length], spring),
    PointAttraction: TorqueExpression(lambda p: [*_points(p), p.strength], attraction),
    GravityGradient: TorqueExpression(lambda p: [p.factor, *p.inertia.ravel().tolist(), *p.direction_W.tolist()], gradient),
}
"""Potentials that `Precise` supports, by type."""


def find_field(potential: Any) -> TorqueExpression | None:
    """Return the expressions of a potential, or of the potential that turns; None if there are none."""
    if not isinstance(potential, Turning):
        return FIELDS.get(type(potential))
    field = FIELDS.get(type(potential.potential))
    return None if field is None else _turn(field)


@lru_cache
def _turn(field: TorqueExpression) -> TorqueExpression:
    """Return the expressions of a field that turns with an orbit: parameters rate (1), normal (3), then the field's.

    The result is cached, because compiled integrators are cached by it.
    """

    def values(potential: Turning) -> list[Number]:
        return [potential.orbit.rate, *potential.orbit.normal_W.tolist(), *field.values(potential.potential)]

    def torque(q: Expressions, parameters: Expressions) -> list[forms.Expression]:
        half = 0.5 * parameters[0] * forms.heyoka().time
        sine = forms.heyoka().sin(half)
        back = [forms.heyoka().cos(half), *(x if forms.is_zero(x) else -sine * x for x in parameters[1:4])]
        return field.torque(forms.quaternion_product(back, q), parameters[4:])

    return TorqueExpression(values, torque)


@dataclass(frozen=True)
class Precise(Method):
    """Quaternion and body rates integrated by heyoka in multi-precision; dt is only the sampling interval.

    The initial state is taken as exact numbers, and samples are rounded to double.

    Parameters
    ----------
    bits
        Precision, 53 to 4096 bits; the tolerance of a step is 2^-(bits - 1). A motion that amplifies errors by e^N
        costs 1.44 N bits.

    Raises
    ------
    BadInput
        bits is not an integer in that range.
    MissingEngine
        heyoka is not installed.
    """

    bits: int = 256

    family: ClassVar[str] = "precise"
    role: ClassVar[Role] = Role.TRUTH
    order = None
    method_info: ClassVar[MethodInfo] = MethodInfo(
        report=(),
        colour="grey",
        supports=frozenset({Feature.TURNING, Feature.ROTOR, Feature.FLIGHT}).union(*map(features_of, FIELDS)),
    )

    def __post_init__(self) -> None:
        allowed = "an integer from 53 (double precision) to 4096"
        if not 53 <= positive_integer("bits", self.bits, allowed) <= 4096:
            raise BadInput("bits", describe(self.bits), allowed)
        version("heyoka", "heyoka")

    @property
    def maker(self) -> Maker:
        return Maker("heyoka", version("heyoka", "heyoka"))

    @property
    def setting_parts(self) -> dict[str, str]:
        return {"bits": f"{self.bits} bits"}

    def unsupported(self, scene: Scene) -> str | None:
        if scene.potential is None or find_field(scene.potential) is not None:
            return None
        kind, table = type(static_part(scene.potential)).__name__, "conservative.references.precise.FIELDS"
        return f"no multi-precision expressions for {kind}; add them to {table}"

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        field = find_field(scene.potential)
        values = () if field is None else field.values(scene.potential)
        axes = EngineAxes(scene, np.eye(3), np.diag(scene.body.inertia))
        values = *axes.rotor.tolist(), *values
        solve = _solver(scene.body.inertia.tolist(), to_quaternion(scene.R_WB0), scene.w_WB_B0, field, values, self.bits)
        t = _reals(grid.steps.tolist(), self.bits) * _real(grid.dt, self.bits)

        def run() -> Trajectory:
            reason, steps, reals = solve(t, scene)
            doubles = np.array([[float(x) for x in row] for row in reals]).reshape(-1, 7)
            return axes.trajectory(grid, self.label, States(QUATERNION, doubles[None]), Counters(steps), reason)

        return run


@dataclass(frozen=True)
class QuaternionEquations:
    """The equations q' = q w / 2 and w' = J^-1 ((J w + h) x w + torque), state (q, w).

    Parameters: J (9), J^-1 (9), momentum h of the rotor (3), and the field's.
    """

    field: TorqueExpression | None

    def __call__(self, parameters: Sequence[forms.Expression]) -> forms.Equations:
        hy = forms.heyoka()
        q, w = hy.make_vars("q0", "q1", "q2", "q3"), hy.make_vars("w1", "w2", "w3")
        J, K, rotor, rest = parameters[:9], parameters[9:18], parameters[18:21], parameters[21:]
        momentum = [a if forms.is_zero(b) else a + b for a, b in zip(forms.product(J, w), rotor, strict=True)]
        torque = forms.cross(momentum, w)
        if self.field is not None:
            torque = [a + b for a, b in zip(torque, self.field.torque(q, rest), strict=True)]
        return [*zip(q, forms.kinematics_in_body(q, w), strict=True), *zip(w, forms.product(K, torque), strict=True)]


@lru_cache(maxsize=64)
def _compile(form: forms.Form, bits: int) -> forms.Integrators:
    hy = forms.heyoka()
    equations = form.build()
    zeros = _reals([0] * len(equations), bits)
    # Compact mode: unrolled code of some 90 orders takes minutes to compile and is not faster on these numbers.
    return forms.Integrators(hy.taylor_adaptive(equations, zeros, fp_type=hy.real, prec=bits, compact_mode=True))


def _solver(
    inertia: Sequence[Any], q0: Any, w0: Any, field: TorqueExpression | None, values: Sequence[Number], bits: int
) -> Callable[[Reals, Scene | None], tuple[str, int, Reals]]:
    """Return a function of times, the first 0, that returns the reason of its end, the number of steps and states (n, 7).

    With a scene, a run that would exceed the limit of steps is not started.
    """
    with _digits(bits + 32) as mp:
        J, quaternion = mp.matrix(inertia), [mp.mpf(x) for x in q0]
        norm = mp.sqrt(mp.fsum(x * x for x in quaternion))
        start = _reals([*(x / norm for x in quaternion), *w0], bits)
        form, used = forms.form_of(QuaternionEquations(field), [*J, *J**-1, *map(mp.mpf, values)])
        parameters = _reals(used, bits)
    integrators = _compile(form, bits)

    def solve(t: Reals, scene: Scene | None) -> tuple[str, int, Reals]:
        with integrators.borrow() as integrator:
            # heyoka does not store unused parameters at the end, such as a pivot spring's.
            integrator.pars[:] = parameters[: len(integrator.pars)]
            integrator.time, integrator.state[:] = _real(0, bits), start
            reason = pace_reason(scene, integrator, float(t[-1])) if scene else ""
            integrator.time, integrator.state[:] = _real(0, bits), start
            if reason:
                return reason, 0, start[None]
            outcome, _, _, steps, _, reals = integrator.propagate_grid(t, max_steps=STEP_LIMIT)
        return limit_reason(int(steps), 1.0) or f"heyoka: {outcome.name}", int(steps), reals

    return solve


_mp = mpmath.MPContext()
_mp_lock = RLock()


@contextmanager
def _digits(bits: int) -> Iterator[Any]:
    """Yield a private context of mpmath: the global one has a single precision for all threads."""
    with _mp_lock, _mp.workprec(bits):
        yield _mp


def _real(x: Number, bits: int) -> Any:
    """Return a number as `heyoka.real`: floats and integers exactly, others from their digits."""
    hy = forms.heyoka()
    if isinstance(x, float | int):
        return hy.real(x, bits)
    with _digits(bits + 32) as mp:
        return hy.real(mp.nstr(mp.mpf(x), math.ceil(bits * 0.30103) + 5), bits)


def _reals(values: Sequence[Number], bits: int) -> Reals:
    return np.array([_real(x, bits) for x in values])
