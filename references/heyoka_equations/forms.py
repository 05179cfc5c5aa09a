"""Equations of motion as heyoka expressions: the forms that `Heyoka` and `Precise` integrate.

Properties of bodies and fields are runtime parameters, so one compiled integrator serves all scenes of the same form (measured:
a parameter costs 2 % more than a constant). Terms that vanish for a scene, such as terms of equal moments or of a centre of
mass on an axis, are not in its form.

Source: Euler's and Poisson's equations; the slow frame is in `conservative.methods.non_spinning`.

Symbols: q quaternion, scalar first, body to world; w rates in body axes; u rates of the slow frame, world axes; n the body's
axis of symmetry, world axes.

Tried and rejected: rates scaled so that all coefficients are 1 (8 % less time per step, but more steps); second-order equations
in one rate (square roots lose half the digits at every reversal); cross products with five products instead of six (their sums
cost more).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ..engine import load

Expression = Any
"""A `heyoka.expression`, or a float if constant."""

Equations = list[tuple[Expression, Expression]]
"""Pairs of a state variable and its derivative."""


def heyoka() -> Any:
    """Return the module heyoka, imported at the first call."""
    return load("heyoka", "heyoka", "heyoka")


@dataclass(frozen=True)
class Form:
    """Equations up to the values of their parameters, and a flag for each parameter that is not zero."""

    equations: Callable[[Sequence[Expression]], Equations]
    used: tuple[bool, ...]

    def build(self, numbers: Sequence[float] = ()) -> Equations:
        """Return the equations with `numbers` as constants, or with numbered runtime parameters, and zeros for unused ones."""
        values = iter([float(x) for x in numbers] or [heyoka().par[i] for i in range(sum(self.used))])
        return self.equations([next(values) if used else 0.0 for used in self.used])


def form_of(equations: Callable[[Sequence[Expression]], Equations], parameters: Sequence[Any]) -> tuple[Form, list[Any]]:
    """Return the form for these parameters, and the parameters that are not zero."""
    return Form(equations, tuple(bool(p != 0) for p in parameters)), [p for p in parameters if p != 0]


class Integrators:
    """A pool of equal integrators of one form, so that concurrent runs do not share one.

    The first is compiled. Others are copies of it, made in a millisecond when no integrator is idle.
    """

    def __init__(self, compiled: Any) -> None:
        self._first, self._idle = compiled, [copy(compiled)]

    def copy(self) -> Any:
        """Return an integrator for the caller alone."""
        return copy(self._first)

    @contextmanager
    def borrow(self) -> Iterator[Any]:
        """Yield an idle integrator. The caller sets state, time and parameters."""
        try:
            integrator = self._idle.pop()
        except IndexError:
            integrator = self.copy()
        try:
            yield integrator
        finally:
            self._idle.append(integrator)


@lru_cache(maxsize=256)
def compile_double(
    form: Form, tol: float, fast_math: bool = False, numbers: tuple[float, ...] = (), width: int = 0
) -> Integrators:
    """Return integrators of a form in double precision, for a relative tolerance; of `width` bodies at once, of one if 0."""
    equations, hy = form.build(numbers), heyoka()
    if not width:
        return Integrators(hy.taylor_adaptive(equations, [0.0] * len(equations), tol=tol, fast_math=fast_math))
    start = [[0.0] * width for _ in equations]
    return Integrators(hy.taylor_adaptive_batch(equations, start, tol=tol, fast_math=fast_math))


@dataclass(frozen=True)
class EulerEquations:
    """Euler's equations in principal axes and the equations of the attitude, state (attitude, w).

    Parameters: (J2 - J3)/J1 and its cyclic permutations (3), the rates of the axes to which the attitude refers (3), in those
    axes, the matrix J^-1 hat(h) of a rotor with momentum h (9, row by row), and the parameters of the field.

    Attributes
    ----------
    attitude
        Maps the rates of the body and of those axes to the equations of the attitude and to the field's axis in the body.
    acceleration
        Maps the field's parameters and its axis to the angular acceleration by the field.
    """

    attitude: Callable[[Sequence[Expression], Sequence[Expression]], tuple[Equations, Sequence[Expression]]]
    acceleration: Callable[[Sequence[Expression], Sequence[Expression]], Sequence[Expression]]

    def __call__(self, parameters: Sequence[Expression]) -> Equations:
        w = heyoka().make_vars("w1", "w2", "w3")
        equations, axis = self.attitude(w, parameters[3:6])
        gyroscopic = [parameters[i] * (w[(i + 1) % 3] * w[(i + 2) % 3]) for i in range(3)]
        others = _sums(self.acceleration(parameters[15:], axis), product(parameters[6:15], w))
        return [*equations, *zip(w, _sums(gyroscopic, others), strict=True)]


def quaternion(w: Sequence[Expression], turn: Sequence[Expression]) -> tuple[Equations, Sequence[Expression]]:
    """Return the equations of the quaternion and the field's axis in the body: 12 and at most 6 products.

    In turning axes q' has the additional term -turn q / 2.
    """
    q = heyoka().make_vars("q0", "q1", "q2", "q3")
    transport = quaternion_product([0.0, *(x if is_zero(x) else -0.5 * x for x in turn)], q)
    return list(zip(q, _sums(kinematics_in_body(q, w), transport), strict=True)), vertical(q)


def base_vectors(w: Sequence[Expression], turn: Sequence[Expression]) -> tuple[Equations, Sequence[Expression]]:
    """Return the equations of the third and the first row of the rotation matrix, 12 products; the third is the field's axis.

    In turning axes the columns have the additional term -turn x column.
    """
    hy = heyoka()
    third, first = hy.make_vars("g1", "g2", "g3"), hy.make_vars("a1", "a2", "a3")
    rates = [cross(third, w), cross(first, w)]
    if not (is_zero(turn[0]) and is_zero(turn[2])):
        second = cross(third, first)
        rates = [_add_multiple(rates[0], turn[0], second, -1.0), _add_multiple(rates[1], turn[2], second, 1.0)]
    rates = [_add_multiple(rates[0], turn[1], first, 1.0), _add_multiple(rates[1], turn[1], third, -1.0)]
    return [*zip(third, rates[0], strict=True), *zip(first, rates[1], strict=True)], third


def axis_and_angle_in_body(w: Sequence[Expression], turn: Sequence[Expression]) -> tuple[Equations, Sequence[Expression]]:
    """Return the equations of the field's axis g in the body and of one angle about it, and g: 10 products and a division.

    The attitude is the smallest rotation whose third row is g, followed by a rotation by p about the third axis. p' = (w.g +
    w3)/(1 + g3), so that g must stay away from -e_3. The axes of the attitude do not turn.
    """
    hy = heyoka()
    g, p = hy.make_vars("g1", "g2", "g3"), hy.expression("p")
    along = w[0] * g[0] + w[1] * g[1] + w[2] * g[2]
    return [*zip(g, cross(g, w), strict=True), (p, (along + w[2]) / (1.0 + g[2]))], g


def _add_multiple(a: list[Expression], factor: Expression, b: Sequence[Expression], sign: float) -> list[Expression]:
    """Return a + sign factor b."""
    return a if is_zero(factor) else [x + sign * factor * y for x, y in zip(a, b, strict=True)]


def non_spinning(parameters: Sequence[Expression]) -> Equations:
    """Return the slow frame of a body symmetric about its axis 3, state (q, u1, u2), with u = l/J1 and l the world momentum.

    Parameters: moment of the weight over J1, and u3, which is constant.
    """
    hy = heyoka()
    q, u = hy.make_vars("q0", "q1", "q2", "q3"), hy.make_vars("u1", "u2")
    k, u3 = parameters
    n1, n2 = 2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1])
    return [*zip(q, kinematics_in_world(q, [*u, u3]), strict=True), (u[0], -k * n2), (u[1], k * n1)]


def free_rates_and_angle(parameters: Sequence[Expression]) -> Equations:
    """Return a free body as rates and one angle, state (w, p), with four products instead of fifteen.

    The direction of the constant momentum in the body and an angle about it determine the attitude. If the momentum circulates
    about the third axis, L3 > 0, that angle is l t/J3 + p with p' = c/(l/J3 + w3), c = (2 T - l^2/J3)/J3. Parameters: (J2 -
    J3)/J1 and its cyclic permutations (3), l/J3, c.
    """
    hy = heyoka()
    w, p = hy.make_vars("w1", "w2", "w3"), hy.expression("p")
    gyroscopic = [parameters[i] * (w[(i + 1) % 3] * w[(i + 2) % 3]) for i in range(3)]
    return [*zip(w, gyroscopic, strict=True), (p, parameters[4] / (parameters[3] + w[2]))]


def axis_and_angle(parameters: Sequence[Expression]) -> Equations:
    """Return the slow frame of a symmetric body as its axis and one angle, state (n, u1, u2, p): seven products, not eighteen.

    The frame is a rotation by p followed by the smallest rotation from the vertical to n. p' = (u.n + u3)/(1 + n3) has a
    constant numerator; n must stay away from -e_z. Parameters: moment of the weight over J1, u3, u.n + u3.
    """
    hy = heyoka()
    n, u, p = hy.make_vars("n1", "n2", "n3"), hy.make_vars("u1", "u2"), hy.expression("p")
    k, u3, numerator = parameters
    return [*zip(n, cross([*u, u3], n), strict=True), (u[0], -k * n[1]), (u[1], k * n[0]), (p, numerator / (1.0 + n[2]))]


def cross(a: Sequence[Expression], b: Sequence[Expression]) -> list[Expression]:
    """Return a x b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def kinematics_in_body(q: Sequence[Expression], w: Sequence[Expression]) -> list[Expression]:
    """Return q' = q w / 2 for rates w in body axes."""
    return [
        -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]),
        0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]),
        0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]),
        0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]),
    ]


def kinematics_in_world(q: Sequence[Expression], u: Sequence[Expression]) -> list[Expression]:
    """Return q' = u q / 2 for rates u in world axes."""
    return [
        -0.5 * (q[1] * u[0] + q[2] * u[1] + q[3] * u[2]),
        0.5 * (q[0] * u[0] - q[2] * u[2] + q[3] * u[1]),
        0.5 * (q[0] * u[1] - q[3] * u[0] + q[1] * u[2]),
        0.5 * (q[0] * u[2] + q[2] * u[0] - q[1] * u[1]),
    ]


def quaternion_product(p: Sequence[Expression], q: Sequence[Expression]) -> list[Expression]:
    """Return p q without the products with zeros."""
    pairs = (
        ((0, 0, 1), (1, 1, -1), (2, 2, -1), (3, 3, -1)),
        ((0, 1, 1), (1, 0, 1), (2, 3, 1), (3, 2, -1)),
        ((0, 2, 1), (1, 3, -1), (2, 0, 1), (3, 1, 1)),
        ((0, 3, 1), (1, 2, 1), (2, 1, -1), (3, 0, 1)),
    )
    return [sum((sign * p[i] * q[j] for i, j, sign in row if not is_zero(p[i])), 0.0) for row in pairs]


def vertical(q: Sequence[Expression]) -> list[Expression]:
    """Return e_z in body axes: the last row of the rotation matrix of a unit q."""
    return [2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])]


def to_body(q: Sequence[Expression], vector: Sequence[Expression]) -> list[Expression]:
    """Return the body components of a vector in world axes, for a unit q."""
    rows = (
        [1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] - q[0] * q[3]), 2 * (q[1] * q[3] + q[0] * q[2])],
        [2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] - q[0] * q[1])],
        vertical(q),
    )
    total = [0.0, 0.0, 0.0]
    for component, row in zip(vector, rows, strict=True):
        if not is_zero(component):
            total = [x + component * y for x, y in zip(total, row, strict=True)]
    return total


def product(matrix: Sequence[Expression], vector: Sequence[Expression]) -> list[Expression]:
    """Return the product of a matrix (9, row by row) and a vector, without the terms that are zero."""
    terms = ([(c, v) for c, v in zip(matrix[i : i + 3], vector, strict=True) if not is_zero(c)] for i in (0, 3, 6))
    return [sum((c * v for c, v in row), 0.0) for row in terms]


def _sums(a: Sequence[Expression], b: Sequence[Expression]) -> list[Expression]:
    return [x if is_zero(y) else x + y for x, y in zip(a, b, strict=True)]


def is_zero(x: Expression) -> bool:
    """Return True if an expression is the constant 0, whose terms are not in a form."""
    return isinstance(x, float) and x == 0
