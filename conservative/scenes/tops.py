"""Tops and pendulums: a body on a pivot in uniform gravity.

Durations `t_end` are in s, angles in rad, rates in rad/s. `slow` stretches time by a factor; see `slow_motion`. Builders raise
`BadInput` for arguments that are not finite or out of range.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array, from_quaternion, rotation_about
from ..body import RigidBody
from ..check import finite_number, positive_number
from ..errors import BadInput
from ..invariants import Invariant
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from .transforms import slow_motion, turned

_HEIGHT, _DENSITY, _GRAVITY, _TILT = 0.1, 2700.0, 9.81, math.pi / 3
"""The cone of Krenk & Nielsen. The height, missing in the paper's text, is from the companion examples in the literature."""


def _top(
    name: str, body: RigidBody, R_WB0: ArrayLike, rates: ArrayLike, t_end: float, field: UniformGravity, dt: float, source: str
) -> Scene:
    return Scene(name, body, R_WB0, rates, t_end, field, dt=dt, group="top", source=source)


def _tilted(tilt: float) -> Array:
    return rotation_about((1, 0, 0), finite_number("tilt", tilt, "a finite angle, rad"))


def lagrange_top(
    tilt: float = _TILT,
    precession: float = 10.0,
    height: float = _HEIGHT,
    density: float = _DENSITY,
    gravity: float = _GRAVITY,
    t_end: float | None = None,
    slow: float = 1.0,
) -> Scene:
    """Return the cone of Krenk & Nielsen, 5.2 (radius half the height), in steady precession without nutation.

    Parameters
    ----------
    tilt
        Angle between the axis and the vertical, rad, in (0, pi).
    precession
        Rate of precession about the vertical, rad/s, not 0. The spin follows from

            m g l / (J3 phidot^2) = psidot / phidot + ((J3 - J1) / J3) cos(tilt)
    height, density, gravity
        Height of the cone, m, its density, kg/m^3, and the acceleration of gravity, m/s^2.
    t_end
        Duration, s; by default one period of precession.
    slow
        Factor by which the motion is slower.
    """
    tilt = finite_number("tilt", tilt, "an angle in (0, pi), rad")
    if not 0 < tilt < math.pi:
        raise BadInput("tilt", tilt, "an angle in (0, pi), rad")
    if finite_number("precession", precession, "a rate other than 0, rad/s") == 0:
        raise BadInput("precession", precession, "a rate other than 0, rad/s")
    positive_number("height", height)
    positive_number("density", density)
    finite_number("gravity", gravity, "a finite number, m/s^2")
    mass, lever, J1, J3 = cone(height, density)
    body = RigidBody((J1, J1, J3))  # before the division by J3: it refuses moments that are too small
    spin = mass * gravity * lever / (J3 * precession) - (J3 - J1) / J3 * math.cos(tilt) * precession
    rates = (0.0, precession * math.sin(tilt), spin + precession * math.cos(tilt))
    end = 2 * math.pi / abs(precession) if t_end is None else t_end
    field = UniformGravity(mass * gravity, (0, 0, lever))
    return slow_motion(_top("lagrange_top", body, _tilted(tilt), rates, end, field, 0.01, "Krenk & Nielsen, 5.2"), slow)


def cone(height: float, density: float) -> tuple[float, float, float, float]:
    """Return mass, distance of the centre of mass from the tip, and moments J1 = J2 and J3 about the tip, in SI units.

    The radius of the cone is half its height, m; the density is in kg/m^3.
    """
    radius = height / 2
    mass = density * math.pi * radius**2 * height / 3
    lever = 3 * height / 4
    J1 = 3 / 80 * mass * (4 * radius**2 + height**2) + mass * lever**2
    return mass, lever, J1, 3 / 10 * mass * radius**2


# Out of steady precession the axis of the cone nutates. Between the two tilts at which it turns back it precesses at
# phidot = (Lz - L3 cos(tilt)) / (J1 sin(tilt)^2). Released at the upper tilt, it precesses faster further down, so the rate at
# release decides the figure that the axis draws: 0 gives cusps, a rate against the precession loops, and a rate along it,
# below the steady one, waves (unduloid).


def nutating_top(t_end: float = 2.0, slow: float = 1.0) -> Scene:
    """Return the cone with (0.003, 0.001, 0) kg m^2/s, body axes, added to its initial momentum."""
    steady = lagrange_top(t_end=t_end)
    rates = steady.w_WB_B0 + steady.body.inverse @ np.array((0.003, 0.001, 0.0))
    top = steady.rename("nutating_top", w_WB_B0=rates, dt=0.0025, source="Krenk & Nielsen, 5.2, disturbed")
    return slow_motion(top, slow)


def cusped_top(t_end: float = 2.0, slow: float = 1.0) -> Scene:
    """Return the cone released with its axis at rest: the axis draws cusps."""
    return _released("cusped_top", 0.0, t_end, slow)


def looping_top(precession: float = -4.0, t_end: float = 2.0, slow: float = 1.0) -> Scene:
    """Return the cone released with a precession below 0: the axis draws loops."""
    if finite_number("precession", precession, "a finite rate below 0, rad/s") >= 0:
        raise BadInput("precession", precession, "a finite rate below 0, rad/s")
    return _released("looping_top", precession, t_end, slow)


def unduloid_top(precession: float = 4.0, t_end: float = 2.0, slow: float = 1.0) -> Scene:
    """Return the cone released with a precession between 0 and the steady rate of 10: the axis draws waves."""
    if not 0 < finite_number("precession", precession, "a rate between 0 and 10, rad/s") < 10:
        raise BadInput("precession", precession, "a rate between 0 and 10, rad/s")
    return _released("unduloid_top", precession, t_end, slow)


def _released(name: str, precession: float, t_end: float, slow: float) -> Scene:
    """Return the steady top, its spin L3/J3 included, with another rate of precession and the tilt stationary."""
    steady = lagrange_top(t_end=t_end)
    rates = (0.0, precession * math.sin(_TILT), steady.w_WB_B0[2])
    top = steady.rename(name, w_WB_B0=rates, dt=0.0025, source="Goldstein, Classical Mechanics, 5.7")
    return slow_motion(top, slow)


# An upright symmetric top is stable if stability = J3^2 w3^2 / (4 J1 m g l) > 1. Below 1 a small tilt grows like exp(rate t)
# with rate = sqrt(m g l / J1 (1 - stability)).


def sleeping_top(stability: float = 1.05, tilt: float = 1e-3, t_end: float = 3.0, slow: float = 1.0) -> Scene:
    """Return the cone almost upright, with a spin fast enough to stay so: stability above 1."""
    if positive_number("stability", stability, "a finite number above 1") <= 1:
        raise BadInput("stability", stability, "a finite number above 1")
    return slow_motion(_upright("sleeping_top", stability, tilt, t_end), slow)


def falling_top(stability: float = 0.95, tilt: float = 1e-3, t_end: float = 3.0, slow: float = 1.0) -> Scene:
    """Return the cone almost upright, with a spin too slow to stay so: stability in (0, 1)."""
    if positive_number("stability", stability, "a number in (0, 1)") >= 1:
        raise BadInput("stability", stability, "a number in (0, 1)")
    return slow_motion(_upright("falling_top", stability, tilt, t_end), slow)


def _upright(name: str, stability: float, tilt: float, t_end: float) -> Scene:
    mass, lever, J1, J3 = cone(_HEIGHT, _DENSITY)
    weight = mass * _GRAVITY
    spin = math.sqrt(4 * J1 * weight * lever * stability) / J3
    field, source = UniformGravity(weight, (0, 0, lever)), "Routh; Arnold, Mathematical Methods of Classical Mechanics, 30"
    return _top(name, RigidBody((J1, J1, J3)), _tilted(tilt), (0.0, 0.0, spin), t_end, field, 0.001, source)


def simo_wong_top(tilt: float = 0.05, t_end: float = 10.0) -> Scene:
    """Return the fast top of Simo & Wong: J = (5, 5, 1), m g l = 20, spin 50, tilted about its first axis."""
    body, field = RigidBody((5.0, 5.0, 1.0)), UniformGravity(20.0, (0, 0, 1))
    return _top("simo_wong_top", body, _tilted(tilt), (0.0, 0.0, 50.0), t_end, field, 0.01, "Simo & Wong 1991")


def lie_group_top(spin: float = 150.0, t_end: float = 2.0, slow: float = 1.0) -> Scene:
    """Return the heavy top of the Lie-group literature, rates (0, spin, -4.61538) (Brüls, Cardona & Arnold 2012).

    A mass of 15 kg at (0, 1, 0) m has central moments (0.234375, 0.46875, 0.234375) kg m^2. The body once hangs straight down
    to 7e-7 rad, where Euler angles break down.
    """
    mass, com = 15.0, np.array((0.0, 1.0, 0.0))
    offset = mass * (com @ com * np.eye(3) - np.outer(com, com))  # parallel axes
    body, field = RigidBody(np.diag((0.234375, 0.46875, 0.234375)) + offset), UniformGravity(mass * 9.81, com)
    rates = (0.0, finite_number("spin", spin, "a finite rate, rad/s"), -4.61538)
    return slow_motion(_top("lie_group_top", body, np.eye(3), rates, t_end, field, 0.001, "Brüls, Cardona & Arnold 2012"), slow)


def asymmetric_top(t_end: float = 30.0) -> Scene:
    """Return the asymmetric heavy top of Hairer, Lubich & Wanner, Geometric Numerical Integration, VII.5, not integrable.

    J = (0.5, 0.85, 1), weight and lever arm 1, q0 = (0.4, 0.2, 0.4, 0.8) scalar first, L0 = (0.2, 1, 0.4).
    """
    J, R_WB0, field = (0.5, 0.85, 1.0), from_quaternion((0.4, 0.2, 0.4, 0.8)), UniformGravity(1.0, (0, 0, 1))
    rates, source = np.divide((0.2, 1.0, 0.4), J), "Hairer, Lubich & Wanner, VII.5"
    return _top("asymmetric_top", RigidBody(J), R_WB0, rates, t_end, field, 0.05, source)


def turned_top(angle: float = 0.7, t_end: float | None = None) -> Scene:
    """Return the asymmetric heavy top in a body frame turned by `angle` about (1, 2, 3): an inertia with off-diagonal terms."""
    return turned(asymmetric_top(), angle, t_end, "turned_top")


def kovalevskaya_top(axial: float = 1.0, moment: float = 1.0, t_end: float = 30.0) -> Scene:
    """Return the Kovalevskaya top: moments (2 axial, 2 axial, axial), kg m^2, weight times lever arm `moment`, N m.

    The centre of mass lies in the plane of the equal moments. The top has a fourth integral, of degree four, which methods
    that conserve energy and momentum do not conserve.
    """
    J3, rates = positive_number("axial", axial), (0.5, 1.0, 2.0)
    k = positive_number("moment", moment) / J3
    body, field = RigidBody((2 * J3, 2 * J3, J3)), UniformGravity(moment, (1, 0, 0))
    top = _top("kovalevskaya_top", body, np.eye(3), rates, t_end, field, 0.02, "Kovalevskaya 1889")
    return top.rename(top.name, extra_invariants=(kovalevskaya_integral(k, rates),))


def kovalevskaya_integral(k: float, w0: tuple[float, float, float]) -> Invariant:
    """Return the integral K = (w1^2 - w2^2 - k g1)^2 + (2 w1 w2 - k g2)^2, 1/s^4, with g = R_WB' e_z and k = weight com / J3.

    The initial rates `w0` determine its scale.
    """

    def evaluate(R_WB: Array, w_WB_B: Array) -> Array:
        gamma, w = R_WB[..., 2, :], w_WB_B
        real = w[..., 0] ** 2 - w[..., 1] ** 2 - k * gamma[..., 0]
        imaginary = 2 * w[..., 0] * w[..., 1] - k * gamma[..., 1]
        return real**2 + imaginary**2

    return Invariant("Kovalevskaya integral", "1/s^4", (w0[0] ** 2 + w0[1] ** 2 + k) ** 2, evaluate)


# The tilt of the pendulum obeys J1 tilt'' = -m g l sin(tilt). Its weight is 20 N and its lever arm 0.4 m.


def hanging_rest(t_end: float = 5.0) -> Scene:
    """Return a body hanging at rest: its momentum is 0."""
    return _pendulum("hanging_rest", -0.4, 0.0, t_end)


def inverted_rest(t_end: float = 5.0) -> Scene:
    """Return a body standing at rest: an unstable equilibrium."""
    return _pendulum("inverted_rest", 0.4, 0.0, t_end)


def pendulum_over_top(excess: float = 1e-3, t_end: float = 5.0) -> Scene:
    """Return a body that swings from below over the top, with the energy 2 m g l (1 + excess) above hanging rest.

    It passes the top after a time that grows like log(1/excess).
    """
    energy = 2 * 20.0 * 0.4 * (1 + positive_number("excess", excess))
    return _pendulum("pendulum_over_top", -0.4, math.sqrt(2 * energy / 1.3), t_end)


def _pendulum(name: str, height: float, rate: float, t_end: float) -> Scene:
    body, field = RigidBody((1.3, 0.9, 0.7)), UniformGravity(20.0, (0, 0, height))
    return _top(name, body, np.eye(3), (rate, 0.0, 0.0), t_end, field, 0.01, "the compound pendulum")
