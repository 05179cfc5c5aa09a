"""Random bodies in five kinds of field: distribution 2.

A body is drawn from NumPy's bit generator PCG64, seeded with (seed, number of the field, index), so it is the same to
round-off on every machine. Below, u is uniform in [0, 1), drawn again for each use.

* Moments J1 <= J2 <= J3. Ray's asymmetry parameter (2 B - A - C)/(A - C), where A, B, C are the inverse moments, is uniform
  from -1 (long and thin) to 1 (flat). J3/J1 is 1.1 to 100, log-uniform, but at most 1 + sqrt(2/(1 + kappa)), so that a mass
  distribution with these moments exists. The mean moment is 0.1 to 10 kg m^2, log-uniform.
* The body axes are turned from the principal axes by a rotation uniform on the group, so the inertia is a full matrix. The
  initial attitude is another such rotation.
* The initial rates are 0.3 to 3 rad/s, log-uniform. The body's point is 0.1 to 1 m from the pivot, log-uniform. Both have
  directions that are uniform, except that each component along a principal axis is at least a tenth of the length. Gravity is
  along the world's -z. The directions of its gradient and of an anchor are uniform in the world.
* The gradient of gravity turns with a circular orbit, whose normal is uniform. The fixed gradient does not turn.
* The anchor of a spring or an attraction is (1 + g) times as far from the pivot as the body's point, g = 0.2 to 3,
  log-uniform. There is no collision, but the force of an attraction can vary by a factor of 121. The spring's rest length is u
  times the anchor's distance.
* Strength: the initial kinetic energy is 0.1 to 30 times the range of the field's energy over all attitudes, log-uniform.

The motion lasts `TURN` rad at the initial rate.

Distribution 1, until the first results with seeds 1000 and 1001, had no turning field, no fast tops (0.17 to 1.7 times the
range), and log-uniform moments, with nearly prolate bodies in 80 % of the cases.

Source of the asymmetry parameter: B. S. Ray, Z. Phys. 78, 74 (1932).
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
from ..potentials.turning import Orbit, Turning
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene

FIELDS = ("gravity", "spring", "attraction", "gradient", "fixed_gradient")
"""Uniform gravity, a linear spring with a rest length, an attraction by 1/r, and gravity's gradient in an orbit and fixed."""
CONDITION = (1.1, 100.0)
MEAN_MOMENT = (0.1, 10.0)
RATE = (0.3, 3.0)
ARM = (0.1, 1.0)
GAP = (0.2, 3.0)
ENERGY = (0.1, 30.0)
"""Log-uniform ranges: J3/J1; kg m^2; rad/s; m; g of the anchor; initial kinetic energy over the range of the field's energy."""
OFF_AXIS = 0.1
"""Smallest component of a direction along each principal axis."""
TURN = 12.0
"""Length of the motion, rad at the initial rate."""

Draw = Callable[[], float]
"""Returns the next u."""


def random_body(field: str = FIELDS[0], seed: int = 0, index: int = 0) -> Scene:
    """Return the random body with number `index` of a seed, in one of the `FIELDS`.

    Raises
    ------
    BadInput
        The field is unknown, or seed or index is not an integer of 0 or more.
    """
    choice("field", field, FIELDS)
    entropy = (_count("seed", seed), FIELDS.index(field), _count("index", index))
    draw = np.random.Generator(np.random.PCG64(entropy)).random
    J, R_BP = _moments(draw), _rotation(draw)
    w_P, point_P = _log_uniform(draw, RATE) * _off_axes(draw), _log_uniform(draw, ARM) * _off_axes(draw)
    inertia = R_BP @ np.diag(J) @ R_BP.T
    body = RigidBody((inertia + inertia.T) / 2)
    energy = float(w_P @ (J * w_P)) / 4 / _log_uniform(draw, ENERGY)  # half of the field's range
    potential = _draw_field(field, draw, energy, R_BP @ point_P, body)
    name = "random_body" if (field, seed, index) == (FIELDS[0], 0, 0) else name_of(field, seed, index)
    t_end = TURN / float(np.linalg.norm(w_P))
    return Scene(name, body, _rotation(draw), R_BP @ w_P, t_end, potential, group="random", source="ours")


def name_of(field: str, seed: int, index: int) -> str:
    """Return the name that `conservative.registry.scene` and the commands accept for a body."""
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
    """Return a unit vector (3,), uniform except that no component is below `OFF_AXIS`."""
    while True:
        direction = _direction(draw)
        if np.abs(direction).min() >= OFF_AXIS:
            return direction


def _rotation(draw: Draw) -> Array:
    """Return a rotation (3, 3), uniform on the group (Shoemake 1992)."""
    share, first, second = draw(), 2 * math.pi * draw(), 2 * math.pi * draw()
    a, b = math.sqrt(1 - share), math.sqrt(share)
    return from_quaternion((b * math.cos(second), a * math.sin(first), a * math.cos(first), b * math.sin(second)))


def _moments(draw: Draw) -> Array:
    kappa = 2 * draw() - 1
    most = min(CONDITION[1], 1 + math.sqrt(2 / (1 + kappa))) if kappa > -1 else CONDITION[1]
    condition = _log_uniform(draw, (CONDITION[0], most))
    J = np.array((1.0, 2 * condition / ((condition - 1) * kappa + condition + 1), condition))
    return J * (_log_uniform(draw, MEAN_MOMENT) / J.mean())


def _draw_field(field: str, draw: Draw, energy: float, point_B: Array, body: RigidBody) -> Potential | Turning:
    """Return the field of this name; `energy`, J, is half of its range over all attitudes."""
    arm = float(np.linalg.norm(point_B))
    if field == "gravity":
        return UniformGravity(energy / arm, point_B)
    if field in ("spring", "attraction"):
        anchor_W = (1 + _log_uniform(draw, GAP)) * arm * _direction(draw)
        if field == "attraction":
            return PointAttraction(energy / half_range(PointAttraction(1.0, point_B, anchor_W)), point_B, anchor_W)
        rest_length = draw() * float(np.linalg.norm(anchor_W))
        unit = half_range(LinearSpring(1.0, point_B, anchor_W, rest_length), rest_length)
        return LinearSpring(energy / unit, point_B, anchor_W, rest_length)
    orbit_W = [_direction(draw) for _ in range(2 if field == "gradient" else 0)]
    direction_W = _direction(draw)
    range_ = GravityGradient(1.0, body.inertia, direction_W).scale() * (1 - body.moments.min() / body.moments.max())
    rate = math.sqrt(2 * energy / range_)
    if orbit_W:
        return Orbit(rate, orbit_W[0]).gravity_gradient(body.inertia, np.cross(orbit_W[0], orbit_W[1]))
    return GravityGradient(rate, body.inertia, direction_W)


def half_range(field: PointPotential, rest_length: float = math.inf) -> float:
    """Return half of the range of a field's energy over all attitudes, J. A spring's energy is lowest at its rest length."""
    near, far = (float(np.linalg.norm(field.anchor_W)) + sign * float(np.linalg.norm(field.point_B)) for sign in (-1, 1))
    values = field.energy_of(np.array((near, far, min(max(rest_length, near), far))))
    return float(np.ptp(values)) / 2
