"""Satellites in a circular orbit, which the gradient of the planet's gravity turns: libration, tumbling, stability.

The planet goes round the satellite once an orbit, so that the field turns: the Jacobi integral is conserved, energy is not. A
field whose direction stays in the world is another motion: in it `tumbling_satellite` is off by 16 degrees after one orbit, and
`librating_satellite` by up to half a turn.

Of a satellite at rest in its orbit, with Hughes's axes (1 along the track, 2 opposite to the orbit's normal, 3 to the planet)
and k1 = (J2 - J3)/J1, k3 = (J2 - J1)/J3, small turns s obey, in time units of 1/rate,

    pitch         s'' + 3 (J1 - J3)/J2 s = 0                  stable for k1 > k3
    roll and yaw  s^4 + (1 + 3 k1 + k1 k3) s^2 + 4 k1 k3 = 0  stable for k1 k3 > 0, 1 + 3 k1 + k1 k3 > 4 sqrt(k1 k3)

Source: P. C. Hughes, Spacecraft Attitude Dynamics (1986), 9.2; D. B. DeBra and R. H. Delp, Rigid body attitude stability and
natural frequencies in a circular orbit (1961).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array, rotation_about
from ..body import RigidBody
from ..check import describe, finite_number
from ..errors import BadInput
from ..potentials.turning import Orbit
from ..scene import Scene

PERIOD = 5400.0
"""Time of an orbit, s: one some 280 km above the Earth."""
RATE = 2 * math.pi / PERIOD
LIBRATING_MOMENTS = (40.0, 110.0, 90.0)
DEFAULT_AMPLITUDE = 0.5
TUMBLING_INERTIA = ((90.0, -7.0, 4.0), (-7.0, 70.0, 11.0), (4.0, 11.0, 55.0))
TUMBLING_START = rotation_about((1.0, -2.0, 0.5), 0.9)
TUMBLING_RATES = (0.004, 0.009, -0.006)
TUMBLING_NORMAL = (0.3, -0.5, 0.8)
TUMBLING_DIRECTION = (0.5, 0.3, 0.0)
LARGEST_MOMENT = 100.0
STABLE, UNSTABLE = (0.6, 0.3), (0.3, 0.6)
DEFAULT_DISTURBANCE = 1e-3
DISTURBED_ABOUT = (0.6, 0.48, 0.64)
UPRIGHT = (0.0, 0.0, 1.0)
TO_PLANET = (1.0, 0.0, 0.0)
LIBRATING_DT, TUMBLING_DT = 20.0, 5.0
SOURCE = "Hughes (1986), 9.2"


def librating_satellite(amplitude: float = DEFAULT_AMPLITUDE, t_end: float = 2 * PERIOD) -> Scene:
    """Return a satellite that librates in the plane of its orbit like a pendulum, from rest at an angle, rad, to the planet.

    With axis 3 along the normal, J3 a'' = -3 rate^2 (J2 - J1) sin a cos a, so that sin a = k cd(W t, k), k = sin(amplitude),
    W^2 = 3 rate^2 (J2 - J1)/J3. Beyond a right angle it librates about the opposite direction.

    Raises
    ------
    BadInput
        amplitude is not finite, or t_end, s, is not above 0.
    """
    angle = finite_number("amplitude", amplitude, "a finite angle, rad")
    orbit, R_WB0 = Orbit(RATE, UPRIGHT), rotation_about(UPRIGHT, angle)
    body = RigidBody(LIBRATING_MOMENTS)
    return _in_orbit(Scene("librating_satellite", body, R_WB0, (0.0, 0.0, RATE), t_end, dt=LIBRATING_DT), orbit, TO_PLANET)


def tumbling_satellite(t_end: float = PERIOD) -> Scene:
    """Return a satellite that tumbles about ten times an orbit: generic inertia, start and orbit.

    Raises
    ------
    BadInput
        t_end, s, is not above 0.
    """
    orbit = Orbit(RATE, TUMBLING_NORMAL)
    body = RigidBody(np.array(TUMBLING_INERTIA))
    scene = Scene("tumbling_satellite", body, TUMBLING_START, TUMBLING_RATES, t_end, dt=TUMBLING_DT, source="ours")
    return _in_orbit(scene, orbit, TUMBLING_DIRECTION)


def stable_satellite(
    k1: float = STABLE[0], k3: float = STABLE[1], disturbance: float = DEFAULT_DISTURBANCE, t_end: float = 4 * PERIOD
) -> Scene:
    """Return a satellite near rest in its orbit, turned by a disturbance, rad, about a direction of no symmetry.

    By default it stays there: k1 > k3 > 0 is the region of stability that energy alone explains.

    Parameters
    ----------
    k1, k3
        (J2 - J3)/J1 and (J2 - J1)/J3, above -1 and below 1, no unit.
    disturbance
        Angle at the start, rad.
    t_end
        Duration, s.

    Raises
    ------
    BadInput
        k1 or k3 is out of its range, disturbance is not finite, or t_end is not above 0.
    """
    return _near_rest("stable_satellite", k1, k3, disturbance, t_end)


def unstable_satellite(
    k1: float = UNSTABLE[0], k3: float = UNSTABLE[1], disturbance: float = DEFAULT_DISTURBANCE, t_end: float = 2 * PERIOD
) -> Scene:
    """Return the same with moments that by default, as k1 < k3, let it swing away in pitch.

    Parameters
    ----------
    k1, k3, disturbance, t_end
        As in `stable_satellite`: no unit, rad, s.

    Raises
    ------
    BadInput
        As there.
    """
    return _near_rest("unstable_satellite", k1, k3, disturbance, t_end)


def moments_of(k1: float, k3: float) -> Array:
    """Return moments (3,), kg m^2, with these ratios (J2 - J3)/J1 and (J2 - J1)/J3, the largest of them `LARGEST_MOMENT`.

    Raises
    ------
    BadInput
        A ratio is not above -1 and below 1.
    """
    allowed = "a number above -1 and below 1, as that of every body"
    for name, value in (("k1", k1), ("k3", k3)):
        if not -1 < finite_number(name, value, allowed) < 1:
            raise BadInput(name, describe(value), allowed)
    moments = np.array([1 - k3, 1 - k1 * k3, 1 - k1])
    return LARGEST_MOMENT / moments.max() * moments


def _near_rest(name: str, k1: float, k3: float, disturbance: float, t_end: float) -> Scene:
    normal, planet = np.array(UPRIGHT), np.array(TO_PLANET)
    angle = finite_number("disturbance", disturbance, "a finite angle, rad")
    R_WB0 = np.stack([np.cross(-normal, planet), -normal, planet], axis=1) @ rotation_about(DISTURBED_ABOUT, angle)
    orbit = Orbit(RATE, normal)
    scene = Scene(name, RigidBody(moments_of(k1, k3)), R_WB0, RATE * normal @ R_WB0, t_end, dt=LIBRATING_DT)
    return _in_orbit(scene, orbit, planet)


def _in_orbit(scene: Scene, orbit: Orbit, direction_W: ArrayLike) -> Scene:
    """Return the scene with the gradient of gravity in an orbit, where the planet is in about that direction at the start."""
    direction = np.asarray(direction_W, dtype=float)
    across = direction - orbit.normal_W @ direction * orbit.normal_W
    field = orbit.gravity_gradient(scene.body.inertia, across)
    return scene.rename(scene.name, potential=field, group="satellite", source=scene.source or SOURCE)
