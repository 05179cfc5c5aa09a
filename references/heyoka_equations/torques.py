"""Potentials as heyoka expressions: one entry in `FIELDS` adds one to multi-precision truth. Source: the potentials' own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from conservative.potentials.gravity_gradient import GravityGradient
from conservative.potentials.point_to_point import LinearSpring, PointAttraction, PointPotential
from conservative.potentials.potential import Potential
from conservative.potentials.turning import Turning
from conservative.potentials.uniform_gravity import UniformGravity

from .forms import Expression, cross, heyoka, is_zero, product, quaternion_product, to_body

Number = Any
"""A float, an `mpmath.mpf` or a text with as many digits as one likes."""

Expressions = Sequence[Expression]


@dataclass(frozen=True)
class Field:
    """A potential as expressions: the values of its parameters, and the torque in body axes from quaternion and parameters."""

    values: Callable[[Any], Sequence[Number]]
    torque: Callable[[Expressions, Expressions], list[Expression]]


def uniform(q: Expressions, moment: Expressions) -> list[Expression]:
    """Return g x m for V = m.g, with g the vertical in body axes."""
    return cross(to_body(q, (0.0, 0.0, 1.0)), moment)


def spring(q: Expressions, parameters: Expressions) -> list[Expression]:
    """Return the torque of V = k/2 (d - d0)^2, parameters b (3), A (3), k, d0."""
    b, anchor, (stiffness, rest_length) = parameters[:3], to_body(q, parameters[3:6]), parameters[6:]
    return _pull_torque(b, anchor, stiffness * (1 - rest_length / heyoka().sqrt(_squared_distance(b, anchor))))


def attraction(q: Expressions, parameters: Expressions) -> list[Expression]:
    """Return the torque of V = -c/d, parameters b (3), A (3), c."""
    b, anchor, strength = parameters[:3], to_body(q, parameters[3:6]), parameters[6]
    return _pull_torque(b, anchor, strength * _squared_distance(b, anchor) ** -1.5)


def gradient(q: Expressions, parameters: Expressions) -> list[Expression]:
    """Return u x (3 rate^2 J u) for V = 3/2 rate^2 u'J u, parameters 3 rate^2 (1), J (9), direction (3)."""
    u = to_body(q, parameters[10:])
    return [parameters[0] * x for x in cross(u, product(parameters[1:10], u))]


def _squared_distance(b: Expressions, anchor: Expressions) -> Expression:
    return sum((x - y) ** 2 for x, y in zip(b, anchor, strict=True))


def _pull_torque(b: Expressions, anchor: Expressions, pull: Expression) -> list[Expression]:
    """Return the torque b x (A - b) pull of a force along the line between the points, body axes."""
    return [pull * x for x in cross(b, anchor)]


def _points(potential: PointPotential) -> list[Number]:
    return [*potential.point_B.tolist(), *potential.anchor_W.tolist()]


FIELDS: dict[type[Potential], Field] = {
    UniformGravity: Field(lambda p: p.moment_B.tolist(), uniform),
    LinearSpring: Field(lambda p: [*_points(p), p.stiffness, p.rest_length], spring),
    PointAttraction: Field(lambda p: [*_points(p), p.strength], attraction),
    GravityGradient: Field(lambda p: [p.factor, *p.inertia.ravel().tolist(), *p.direction_W.tolist()], gradient),
}
"""Potentials that multi-precision truth knows."""


def find_field(potential: Any) -> Field | None:
    """Return a potential as expressions, None where there are none for it, nor for what turns."""
    if not isinstance(potential, Turning):
        return FIELDS.get(type(potential))
    found = FIELDS.get(type(potential.potential))
    return None if found is None else _turn(found)


@lru_cache
def _turn(field: Field) -> Field:
    """Return a field that turns: that of the body's attitude in the axes O, parameters rate (1), normal (3), its own.

    One for each field, so that integrators compiled for it are found again.
    """

    def values(potential: Turning) -> list[Number]:
        return [potential.orbit.rate, *potential.orbit.normal_W.tolist(), *field.values(potential.potential)]

    def torque(q: Expressions, parameters: Expressions) -> list[Expression]:
        half = 0.5 * parameters[0] * heyoka().time
        sine = heyoka().sin(half)
        back = [heyoka().cos(half), *(x if is_zero(x) else -sine * x for x in parameters[1:4])]
        return field.torque(quaternion_product(back, q), parameters[4:])

    return Field(values, torque)
