"""Equations of motion as heyoka expressions: the forms that `Heyoka` and `Precise` integrate.

What belongs to a body or a field is a runtime parameter, so that one compiled integrator does every scene of the same form
(measured: a parameter costs 2 % more than a constant). Terms that vanish for a scene, as those of equal moments or of a
centre of mass on an axis, are left out of its form.

Source: Euler's and Poisson's equations; the slow frame is that of `conservative.methods.non_spinning`.

Symbols: q quaternion, scalar first, body to world; w rates in body axes; u rates of the slow frame, world axes; n the body's
axis of symmetry, world axes.

Tried and not kept: rates scaled so that all coefficients are 1 (8 % less a step, more steps); second-order equations in one
rate (its square roots lose half the digits at every reversal); cross products of five products instead of six (their sums cost
more); one angle beside the field's axis in place of a second row (4 products fewer, but a pole, and 10 to 20 % more steps).
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
"""A `heyoka.expression`, or a float where it is constant."""

Equations = list[tuple[Expression, Expression]]
"""Pairs of a state variable and its derivative."""


def heyoka() -> Any:
    """Return the module, imported at the first call."""
    return load("heyoka", "heyoka", "heyoka")


@dataclass(frozen=True)
class Form:
    """A system up to the values of its parameters: its equations, and which parameters are not zero."""

    equations: Callable[[Sequence[Expression]], Equations]
    used: tuple[bool, ...]

    def build(self) -> Equations:
        """Return the equations with runtime parameters, numbered through, in the places that are used and zeros elsewhere."""
        places = iter(range(len(self.used)))
        return self.equations([heyoka().par[next(places)] if used else 0.0 for used in self.used])


def form_of(equations: Callable[[Sequence[Expression]], Equations], parameters: Sequence[Any]) -> tuple[Form, list[Any]]:
    """Return the form for these parameters, and those of them that are not zero."""
    return Form(equations, tuple(bool(p != 0) for p in parameters)), [p for p in parameters if p != 0]


class Integrators:
    """Equal integrators of one form: a run borrows one, so that no two runs at a time write into the same.

    The first is compiled; others are copies of it, made (in a millisecond) when all there are so far are lent out.
    """

    def __init__(self, compiled: Any) -> None:
        self._first, self._idle = compiled, [copy(compiled)]

    @contextmanager
    def borrow(self) -> Iterator[Any]:
        """Lend an integrator; whoever borrows it sets state, time and parameters."""
        try:
            integrator = self._idle.pop()
        except IndexError:
            integrator = copy(self._first)
        try:
            yield integrator
        finally:
            self._idle.append(integrator)


@lru_cache(maxsize=64)
def compile_double(form: Form, tol: float, fast_math: bool = False) -> Integrators:
    """Return integrators of a form in double precision, for a relative tolerance."""
    equations = form.build()
    return Integrators(heyoka().taylor_adaptive(equations, [0.0] * len(equations), tol=tol, fast_math=fast_math))


@dataclass(frozen=True)
class Turning:
    """Euler's equations in principal axes with those of the attitude, state (attitude, w).

    Parameters are (J2 - J3)/J1 and its kin (3), the rates at which the world axes of the attitude turn (3), in those axes, then
    those of the field.

    Attributes
    ----------
    attitude
        Takes the body's rates and those of the world axes to the attitude's equations and to the field's axis in the body.
    acceleration
        Takes the field's parameters and that axis to what the field adds to w'.
    """

    attitude: Callable[[Sequence[Expression], Sequence[Expression]], tuple[Equations, Sequence[Expression]]]
    acceleration: Callable[[Sequence[Expression], Sequence[Expression]], Sequence[Expression]]

    def __call__(self, parameters: Sequence[Expression]) -> Equations:
        """Return the equations with these parameters."""
        w = heyoka().make_vars("w1", "w2", "w3")
        equations, axis = self.attitude(w, parameters[3:6])
        gyroscopic = [parameters[i] * (w[(i + 1) % 3] * w[(i + 2) % 3]) for i in range(3)]
        return [*equations, *zip(w, _sums(gyroscopic, self.acceleration(parameters[6:], axis)), strict=True)]


def quaternion(w: Sequence[Expression], turn: Sequence[Expression]) -> tuple[Equations, Sequence[Expression]]:
    """Return the quaternion's equations, 12 products, and the axis in the body: 6 more where all of it is used.

    In axes that turn it loses turn q / 2.
    """
    q = heyoka().make_vars("q0", "q1", "q2", "q3")
    lost = quaternion_product([0.0, *(x if is_zero(x) else -0.5 * x for x in turn)], q)
    return list(zip(q, _sums(kinematics_in_body(q, w), lost), strict=True)), vertical(q)


def base_vectors(w: Sequence[Expression], turn: Sequence[Expression]) -> tuple[Equations, Sequence[Expression]]:
    """Return the equations of the third and the first row of the rotation matrix, 12 products; the third is the axis itself.

    In axes that turn, rows lose turn x columns: a term linear in the other row where the axes turn about the second of them.
    """
    hy = heyoka()
    third, first = hy.make_vars("g1", "g2", "g3"), hy.make_vars("a1", "a2", "a3")
    rates = [cross(third, w), cross(first, w)]
    if not (is_zero(turn[0]) and is_zero(turn[2])):
        second = cross(third, first)
        rates = [_add_multiple(rates[0], turn[0], second, -1.0), _add_multiple(rates[1], turn[2], second, 1.0)]
    rates = [_add_multiple(rates[0], turn[1], first, 1.0), _add_multiple(rates[1], turn[1], third, -1.0)]
    return [*zip(third, rates[0], strict=True), *zip(first, rates[1], strict=True)], third


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
    """Return a free body with its world momentum given once and for all, state (w, p): four products where `body` has fifteen.

    The momentum's direction in the body and one angle about it are the attitude. In axes whose third is one about which the
    momentum circulates, L3 > 0, that angle is l t/J3 + p with p' = c/(l/J3 + w3), c = (2 T - l^2/J3)/J3. Parameters: (J2 -
    J3)/J1 and its kin (3), l/J3, c.
    """
    hy = heyoka()
    w, p = hy.make_vars("w1", "w2", "w3"), hy.expression("p")
    gyroscopic = [parameters[i] * (w[(i + 1) % 3] * w[(i + 2) % 3]) for i in range(3)]
    return [*zip(w, gyroscopic, strict=True), (p, parameters[4] / (parameters[3] + w[2]))]


def axis_and_angle(parameters: Sequence[Expression]) -> Equations:
    """Return the slow frame of a symmetric body by its axis and one angle, state (n, u1, u2, p): seven products, not eighteen.

    The frame is the least rotation from the vertical to n after a turn by p, p' = (u.n + u3)/(1 + n3), whose numerator is
    constant; n must stay away from -e_z. Parameters: moment of the weight over J1, u3, u.n + u3.
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
    """Return p q, without the products with what is zero."""
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
    """Return a vector given in world axes in body axes, for a unit q."""
    rows = (
        [1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] - q[0] * q[3]), 2 * (q[1] * q[3] + q[0] * q[2])],
        [2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] - q[0] * q[1])],
        vertical(q),
    )
    found = [0.0, 0.0, 0.0]
    for component, row in zip(vector, rows, strict=True):
        if not is_zero(component):
            found = [x + component * y for x, y in zip(found, row, strict=True)]
    return found


def product(matrix: Sequence[Expression], vector: Sequence[Expression]) -> list[Expression]:
    """Return the product of a matrix (9, row by row) and a vector, without the terms that are zero."""
    terms = ([(c, v) for c, v in zip(matrix[i : i + 3], vector, strict=True) if not is_zero(c)] for i in (0, 3, 6))
    return [sum((c * v for c, v in row), 0.0) for row in terms]


def _sums(a: Sequence[Expression], b: Sequence[Expression]) -> list[Expression]:
    return [x if is_zero(y) else x + y for x, y in zip(a, b, strict=True)]


def is_zero(x: Expression) -> bool:
    """Return whether an expression is left out of a form."""
    return isinstance(x, float) and x == 0
