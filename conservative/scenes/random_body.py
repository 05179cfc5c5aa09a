"""Random bodies in four kinds of field: what every statement about the speed of a method is a statement about.

A body is drawn from the numbers of NumPy's bit generator PCG64, seeded with (seed, number of the field, index): the same to
round-off on every machine, whatever else is drawn. u below is uniform in [0, 1), each one drawn anew.

* Moments J1 <= J2 <= J3: condition J3/J1 = 1.1 to 100, log-uniform; J2 uniform between max(J1, J3 - J1) and J3, so that a mass
  distribution has them (J1 + J2 >= J3); their mean 0.1 to 10 kg m^2, log-uniform. Bodies of a high condition are needles.
* Body axes turned from the principal ones by a rotation uniform on the group, so that the inertia is a full matrix. The start
  attitude is another such rotation.
* Start rates of 0.3 to 3 rad/s, log-uniform, and the body's point, 0.1 to 1 m from the pivot, log-uniform, each in a direction
  that is uniform but for having at least a tenth of its length along every principal axis. Gravity is along the world's -z;
  the direction of its gradient, and of an anchor, is uniform in the world.
* The anchor of a spring or an attraction is (1 + g) times as far from the pivot as the body's point, g = 0.2 to 3,
  log-uniform: they come no closer than g times the point's distance from the pivot, so that there is no collision, and an
  attraction can be up to 121 times as strong in a passage as at its weakest. The spring's rest length is u times the anchor's
  distance.
* Strength: half of the range that the energy of the field has over all attitudes is 0.3 to 3 times the kinetic energy at the
  start, log-uniform.

The motion lasts `TURN` rad at the rate of the start. Source: ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..attitude import Array, from_quaternion
from ..body import RigidBody
from ..check import choice, describe, real_number
from ..errors import BadInput
from ..potentials.gravity_gradient import GravityGradient
from ..potentials.point_to_point import LinearSpring, PointAttraction, PointPotential
from ..potentials.potential import Potential
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene

FIELDS = ("gravity", "spring", "attraction", "gradient")
"""Uniform gravity, a linear spring with a rest length, an attraction by 1/r, and gravity's gradient."""
CONDITION = (1.1, 100.0)
MEAN_MOMENT = (0.1, 10.0)
RATE = (0.3, 3.0)
ARM = (0.1, 1.0)
GAP = (0.2, 3.0)
ENERGY = (0.3, 3.0)
"""Ranges of what is log-uniform: J3/J1; kg m^2; rad/s; m; of the anchor; half of the field's range over the kinetic energy."""
OFF_AXIS = 0.1
"""Least component of a direction along each principal axis."""
TURN = 12.0
"""Length of the motion, rad at the rate of the start."""

Draw = Callable[[], float]
"""Returns the next u."""


def random_body(field: str = FIELDS[0], seed: int = 0, index: int = 0) -> Scene:
    """Return body number `index` of those that a seed gives in a field, under the name that builds it again.

    Raises
    ------
    BadInput
        The field is none of `FIELDS`, or seed or index is not an integer of 0 or more.
    """
    choice("field", field, FIELDS)
    entropy = (_count("seed", seed), FIELDS.index(field), _count("index", index))
    draw = np.random.Generator(np.random.PCG64(entropy)).random
    J, R_BP = _moments(draw), _rotation(draw)
    w_P, point_P = _log_uniform(draw, RATE) * _off_axes(draw), _log_uniform(draw, ARM) * _off_axes(draw)
    inertia = R_BP @ np.diag(J) @ R_BP.T
    body = RigidBody((inertia + inertia.T) / 2)
    energy = _log_uniform(draw, ENERGY) * float(w_P @ (J * w_P)) / 2
    potential = _BUILDERS[field](draw, energy, R_BP @ point_P, body)
    name = "random_body" if (field, seed, index) == (FIELDS[0], 0, 0) else name_of(field, seed, index)
    t_end = TURN / float(np.linalg.norm(w_P))
    return Scene(name, body, _rotation(draw), R_BP @ w_P, t_end, potential, group="random", source="ours")


def name_of(field: str, seed: int, index: int) -> str:
    """Return the registered name of a body, which a command and `conservative.registry.scene` take."""
    return f"random_body:field={field},seed={seed},index={index}"


def _count(argument: str, value: object) -> int:
    number = real_number(value)
    if number is None or not 0 <= number < 2**63 or number != int(number):
        raise BadInput(argument, describe(value), "an integer of 0 or more")
    return int(number)


def _log_uniform(draw: Draw, limits: tuple[float, float]) -> float:
    low, high = limits
    return low * (high / low) ** draw()


def _direction(draw: Draw) -> Array:
    """Return a unit vector (3,), uniform on the sphere."""
    height, turn = 2 * draw() - 1, 2 * math.pi * draw()
    radius = math.sqrt(1 - height * height)
    return np.array((radius * math.cos(turn), radius * math.sin(turn), height))


def _off_axes(draw: Draw) -> Array:
    """Return a unit vector (3,) as uniform as `OFF_AXIS` allows."""
    while True:
        found = _direction(draw)
        if np.abs(found).min() >= OFF_AXIS:
            return found


def _rotation(draw: Draw) -> Array:
    """Return a rotation (3, 3), uniform on the group (Shoemake 1992)."""
    share, first, second = draw(), 2 * math.pi * draw(), 2 * math.pi * draw()
    a, b = math.sqrt(1 - share), math.sqrt(share)
    return from_quaternion((b * math.cos(second), a * math.sin(first), a * math.cos(first), b * math.sin(second)))


def _moments(draw: Draw) -> Array:
    """Return principal moments (3,), kg m^2."""
    condition = _log_uniform(draw, CONDITION)
    least = max(1.0, condition - 1)
    J = np.array((1.0, least + draw() * (condition - least), condition))
    return J * (_log_uniform(draw, MEAN_MOMENT) / J.mean())


def _gravity(draw: Draw, energy: float, point_B: Array, body: RigidBody) -> Potential:
    return UniformGravity(energy / float(np.linalg.norm(point_B)), point_B)


def _spring(draw: Draw, energy: float, point_B: Array, body: RigidBody) -> Potential:
    anchor_W = _anchor(draw, point_B)
    rest_length = draw() * float(np.linalg.norm(anchor_W))
    unit = half_range(LinearSpring(1.0, point_B, anchor_W, rest_length), rest_length)
    return LinearSpring(energy / unit, point_B, anchor_W, rest_length)


def _attraction(draw: Draw, energy: float, point_B: Array, body: RigidBody) -> Potential:
    anchor_W = _anchor(draw, point_B)
    return PointAttraction(energy / half_range(PointAttraction(1.0, point_B, anchor_W)), point_B, anchor_W)


def _gradient(draw: Draw, energy: float, point_B: Array, body: RigidBody) -> Potential:
    direction_W = _direction(draw)
    unit = GravityGradient(1.0, body.inertia, direction_W)
    range_ = unit.scale() * (1 - body.moments.min() / body.moments.max())
    return GravityGradient(math.sqrt(2 * energy / range_), body.inertia, direction_W)


_BUILDERS: dict[str, Callable[[Draw, float, Array, RigidBody], Potential]] = {
    "gravity": _gravity,
    "spring": _spring,
    "attraction": _attraction,
    "gradient": _gradient,
}


def _anchor(draw: Draw, point_B: Array) -> Array:
    return (1 + _log_uniform(draw, GAP)) * float(np.linalg.norm(point_B)) * _direction(draw)


def half_range(field: PointPotential, rest_length: float = math.inf) -> float:
    """Return half of the range of a field's energy over all attitudes, J; it is least at the rest length, where it has one."""
    near, far = (float(np.linalg.norm(field.anchor_W)) + sign * float(np.linalg.norm(field.point_B)) for sign in (-1, 1))
    values = field.energy_of(np.array((near, far, min(max(rest_length, near), far))))
    return float(np.ptp(values)) / 2
