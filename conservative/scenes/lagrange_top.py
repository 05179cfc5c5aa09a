"""The Lagrange top: a cone spinning on its tip in uniform gravity, in steady precession.

Krenk & Nielsen, section 5.2. The height 0.1 m, lost in the paper's text, is that of the companion examples in the literature.
"""

from __future__ import annotations

import math

from ..attitude import rotation_about
from ..body import RigidBody
from ..check import finite_number, positive_number
from ..errors import BadInput
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from .slow_motion import slow_motion

DEFAULT_HEIGHT = 0.1
DEFAULT_DENSITY = 2700.0
DEFAULT_GRAVITY = 9.81
DEFAULT_TILT = math.pi / 3
DEFAULT_PRECESSION = 10.0
DEFAULT_PERIODS = 1.0
DEFAULT_DT = 0.01


def lagrange_top(
    tilt: float = DEFAULT_TILT,
    precession: float = DEFAULT_PRECESSION,
    height: float = DEFAULT_HEIGHT,
    density: float = DEFAULT_DENSITY,
    gravity: float = DEFAULT_GRAVITY,
    t_end: float | None = None,
    slow: float = 1.0,
) -> Scene:
    """Return the paper's cone (radius half the height) in steady precession without nutation.

    Parameters
    ----------
    tilt
        Angle between the axis and the vertical, rad, in (0, pi).
    precession
        Rate of precession about the vertical, rad/s, not 0. The spin that makes it steady follows from

            m g l / (J3 phidot^2) = psidot / phidot + ((J3 - J1) / J3) cos(tilt)
    height, density, gravity
        Of the cone, in m, its material, in kg/m^3, and the field, in m/s^2.
    t_end
        Duration, s; default one period of precession.
    slow
        How many times slower the motion is, its duration and step longer; dimensionless.

    Raises
    ------
    BadInput
        An argument is out of its range.
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
    body = RigidBody((J1, J1, J3))  # first, as it refuses what has become too small to divide by
    spin = mass * gravity * lever / (J3 * precession) - (J3 - J1) / J3 * math.cos(tilt) * precession
    rates = (0.0, precession * math.sin(tilt), spin + precession * math.cos(tilt))
    top = Scene(
        "lagrange_top",
        body,
        rotation_about((1, 0, 0), tilt),
        rates,
        2 * math.pi / abs(precession) * DEFAULT_PERIODS if t_end is None else t_end,
        UniformGravity(mass * gravity, (0, 0, lever)),
        dt=DEFAULT_DT,
        group="top",
        source="Krenk & Nielsen, 5.2",
    )
    return slow_motion(top, slow)


def cone(height: float, density: float) -> tuple[float, float, float, float]:
    """Return mass, kg, distance of the centre of mass from the tip, m, and moments J1 = J2 and J3 about the tip, kg m^2.

    The cone has a height, m, and a density, kg/m^3; its radius is half the height.
    """
    radius = height / 2
    mass = density * math.pi * radius**2 * height / 3
    lever = 3 * height / 4
    J1 = 3 / 80 * mass * (4 * radius**2 + height**2) + mass * lever**2
    return mass, lever, J1, 3 / 10 * mass * radius**2
