"""Fields that depend on the time: one that turns, and one given by Python functions of attitude and time.

`at_time` of `fields` gives either as it is at a time. A field that turns is then the one that is fixed in the axes O, at the
attitude of the body in them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from . import SMALL
from .fields import at_time, body_torque, energy, implements
from .function_field import BODY_TORQUE, STATE, evaluate, fill
from .vector import product

Triple = tuple[float, float, float]


class Turned(NamedTuple):
    """A field that is fixed in axes O: its parameters; rate, rad/s, and normal of O; the quaternion of W in O at the time."""

    field: Any
    rate: float
    normal: Triple
    back: tuple[float, float, float, float]


class FunctionInTime(NamedTuple):
    """Address of a Python object, rows of the frame R_BP as in `function_field.Function`, and the time, s.

    Only the torque is asked for: nothing is conserved that the energy is needed for.
    """

    address: int
    first: Any
    second: Any
    third: Any
    t: float


def start_turning(field: Any, rate: float, normal: Triple) -> Turned:
    """Return a field (a named tuple) that turns at a rate, rad/s, about a unit vector, world axes, as it is at t = 0."""
    return Turned(field, rate, normal, (1.0, 0.0, 0.0, 0.0))


@implements(at_time, Turned, **SMALL)
def _at_time_turned(field, t):
    half = 0.5 * field.rate * t
    c, s = math.cos(half), math.sin(half)
    x, y, z = field.normal
    return Turned(field.field, field.rate, field.normal, (c, -s * x, -s * y, -s * z))


@implements(energy, Turned, **SMALL)
def _energy_turned(field, q):
    return energy(field.field, product(field.back, q))


@implements(body_torque, Turned, **SMALL)
def _body_torque_turned(field, q):
    return body_torque(field.field, product(field.back, q))


@implements(at_time, FunctionInTime)
def _at_time_function(field, t):
    return FunctionInTime(field.address, field.first, field.second, field.third, t)


@implements(energy, FunctionInTime)
def _energy_function(field, q):
    return 0.0


@implements(body_torque, FunctionInTime)
def _body_torque_function(field, q):
    buffer = fill(field, q)
    buffer[STATE + 4] = field.t
    v = evaluate(field, BODY_TORQUE, buffer)
    return (v[0], v[1], v[2])
