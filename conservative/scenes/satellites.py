"""Satellites in a circular orbit, turned by the gravity gradient of the planet: libration, tumbling, stability.

The planet moves round the satellite once per orbit, so the field turns: the Jacobi integral is conserved and energy is not. A
field fixed in the world would cause a different motion: after one orbit, the attitude of `tumbling_satellite` would differ by
16 degrees, and the attitude of `librating_satellite` by up to half a turn.

For a satellite at rest in its orbit, with the axes of Hughes (1 along the track, 2 opposite to the orbit's normal, 3 towards
the planet) and k1 = (J2 - J3)/J1, k3 = (J2 - J1)/J3, small angles s obey, in time units of 1/rate,

    pitch         s'' + 3 (J1 - J3)/J2 s = 0                  stable for k1 > k3
    roll and yaw  s^4 + (1 + 3 k1 + k1 k3) s^2 + 4 k1 k3 = 0  stable for k1 k3 > 0, 1 + 3 k1 + k1 k3 > 4 sqrt(k1 k3)

Source: P. C. Hughes, Spacecraft Attitude Dynamics (1986), 9.2; D. B. DeBra and R. H. Delp, Rigid body attitude stability and
natural frequencies in a circular orbit (1961). Builders raise `BadInput` for arguments that are not finite or out of range.
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
"""Period of the orbit, s: about 280 km above the Earth."""
RATE = 2 * math.pi / PERIOD
DISTURBED_ABOUT = (0.6, 0.48, 0.64)
"""Axis, in body axes, about which a disturbed satellite is turned from its equilibrium."""
_NORMAL, _TO_PLANET = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
"""Normal of the orbit, and direction to the planet at the start, world axes."""
_SOURCE = "Hughes (1986), 9.2"


def librating_satellite(amplitude: float = 0.5, t_end: float = 2 * PERIOD) -> Scene:
    """Return a satellite that librates in the orbital plane like a pendulum, released at `amplitude` rad to the planet.

    With axis 3 along the normal, J3 a'' = -3 rate^2 (J2 - J1) sin a cos a, so sin a = k cd(W t, k), k = sin(amplitude),
    W^2 = 3 rate^2 (J2 - J1)/J3. Beyond a right angle it librates about the opposite direction. `t_end` is in s.
    """
    R_WB0 = rotation_about(_NORMAL, finite_number("amplitude", amplitude, "a finite angle, rad"))
    scene = Scene("librating_satellite", RigidBody((40.0, 110.0, 90.0)), R_WB0, (0.0, 0.0, RATE), t_end, dt=20.0)
    return _in_orbit(scene, Orbit(RATE, _NORMAL), _TO_PLANET)


def tumbling_satellite(t_end: float = PERIOD) -> Scene:
    """Return a satellite with a generic inertia, start and orbit, which tumbles about ten times per orbit; `t_end` is in s."""
    body = RigidBody(np.array(((90.0, -7.0, 4.0), (-7.0, 70.0, 11.0), (4.0, 11.0, 55.0))))
    R_WB0, rates = rotation_about((1.0, -2.0, 0.5), 0.9), (0.004, 0.009, -0.006)
    scene = Scene("tumbling_satellite", body, R_WB0, rates, t_end, dt=5.0, source="ours")
    return _in_orbit(scene, Orbit(RATE, (0.3, -0.5, 0.8)), (0.5, 0.3, 0.0))


def stable_satellite(k1: float = 0.6, k3: float = 0.3, disturbance: float = 1e-3, t_end: float = 4 * PERIOD) -> Scene:
    """Return a satellite near equilibrium in its orbit. By default it is stable: k1 > k3 > 0.

    Parameters
    ----------
    k1, k3
        Ratios (J2 - J3)/J1 and (J2 - J1)/J3, above -1 and below 1.
    disturbance
        Initial angle, rad, between the satellite and its equilibrium, about an oblique axis.
    t_end
        Duration, s.
    """
    return _near_rest("stable_satellite", k1, k3, disturbance, t_end)


def unstable_satellite(k1: float = 0.3, k3: float = 0.6, disturbance: float = 1e-3, t_end: float = 2 * PERIOD) -> Scene:
    """Return `stable_satellite` with moments that by default are unstable in pitch: k1 < k3."""
    return _near_rest("unstable_satellite", k1, k3, disturbance, t_end)


def moments_of(k1: float, k3: float) -> Array:
    """Return moments (3,) with the ratios (J2 - J3)/J1 = k1 and (J2 - J1)/J3 = k3, the largest of them 100 kg m^2."""
    allowed = "a number above -1 and below 1, as for every body"
    for name, value in (("k1", k1), ("k3", k3)):
        if not -1 < finite_number(name, value, allowed) < 1:
            raise BadInput(name, describe(value), allowed)
    moments = np.array([1 - k3, 1 - k1 * k3, 1 - k1])
    return 100.0 / moments.max() * moments


def _near_rest(name: str, k1: float, k3: float, disturbance: float, t_end: float) -> Scene:
    normal, planet = np.array(_NORMAL), np.array(_TO_PLANET)
    angle = finite_number("disturbance", disturbance, "a finite angle, rad")
    R_WB0 = np.stack([np.cross(-normal, planet), -normal, planet], axis=1) @ rotation_about(DISTURBED_ABOUT, angle)
    scene = Scene(name, RigidBody(moments_of(k1, k3)), R_WB0, RATE * normal @ R_WB0, t_end, dt=20.0)
    return _in_orbit(scene, Orbit(RATE, normal), planet)


def _in_orbit(scene: Scene, orbit: Orbit, direction_W: ArrayLike) -> Scene:
    """Return the scene with the gravity gradient of a planet that is initially about in the direction `direction_W`."""
    direction = np.asarray(direction_W, dtype=float)
    across = direction - orbit.normal_W @ direction * orbit.normal_W
    field = orbit.gravity_gradient(scene.body.inertia, across)
    return scene.rename(scene.name, potential=field, group="satellite", source=scene.source or _SOURCE)
