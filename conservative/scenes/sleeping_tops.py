"""Tops that spin upright: asleep above the limit of stability, falling below it.

An upright symmetric top is stable where stability = J3^2 w3^2 / (4 J1 m g l) > 1. Below 1 a small tilt grows like exp(rate t)
with rate = sqrt(m g l / J1 (1 - stability)).
"""

from __future__ import annotations

import math

from ..attitude import rotation_about
from ..body import RigidBody
from ..check import finite_number, positive_number
from ..errors import BadInput
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from .lagrange_top import DEFAULT_DENSITY, DEFAULT_GRAVITY, DEFAULT_HEIGHT, cone
from .slow_motion import slow_motion

DEFAULT_ABOVE = 1.05
DEFAULT_BELOW = 0.95
DEFAULT_TILT = 1e-3
DEFAULT_T_END = 3.0
DEFAULT_DT = 0.001
SIMO_WONG_INERTIA = (5.0, 5.0, 1.0)
SIMO_WONG_MOMENT = 20.0
SIMO_WONG_SPIN = 50.0
SIMO_WONG_TILT = 0.05
SIMO_WONG_T_END = 10.0
SIMO_WONG_DT = 0.01
LIMIT = "Routh; Arnold, Mathematical Methods of Classical Mechanics, 30"


def sleeping_top(
    stability: float = DEFAULT_ABOVE, tilt: float = DEFAULT_TILT, t_end: float = DEFAULT_T_END, slow: float = 1.0
) -> Scene:
    """Return the paper's cone upright but for a tilt, rad, spinning fast enough to stay so.

    All of it is `slow` times slower; see `slow_motion`.

    Raises
    ------
    BadInput
        stability is not above 1, tilt is not finite, or t_end, s, or slow is not above 0.
    """
    if positive_number("stability", stability, "a finite number above 1") <= 1:
        raise BadInput("stability", stability, "a finite number above 1")
    return slow_motion(_upright("sleeping_top", stability, tilt, t_end), slow)


def falling_top(
    stability: float = DEFAULT_BELOW, tilt: float = DEFAULT_TILT, t_end: float = DEFAULT_T_END, slow: float = 1.0
) -> Scene:
    """Return the paper's cone upright but for a tilt, rad, spinning too slowly to stay so.

    All of it is `slow` times slower; see `slow_motion`.

    Raises
    ------
    BadInput
        stability is not in (0, 1), tilt is not finite, or t_end, s, or slow is not above 0.
    """
    if positive_number("stability", stability, "a number in (0, 1)") >= 1:
        raise BadInput("stability", stability, "a number in (0, 1)")
    return slow_motion(_upright("falling_top", stability, tilt, t_end), slow)


def simo_wong_top(tilt: float = SIMO_WONG_TILT, t_end: float = SIMO_WONG_T_END) -> Scene:
    """Return the fast top of Simo & Wong: J = (5, 5, 1), M g l = 20, spin 50 rad/s, tilted about its 1-axis, rad.

    Raises
    ------
    BadInput
        tilt is not finite, or t_end, s, is not above 0.
    """
    return Scene(
        "simo_wong_top",
        RigidBody(SIMO_WONG_INERTIA),
        rotation_about((1, 0, 0), finite_number("tilt", tilt, "a finite angle, rad")),
        (0.0, 0.0, SIMO_WONG_SPIN),
        t_end,
        UniformGravity(SIMO_WONG_MOMENT, (0, 0, 1)),
        dt=SIMO_WONG_DT,
        group="top",
        source="Simo & Wong 1991",
    )


def _upright(name: str, stability: float, tilt: float, t_end: float) -> Scene:
    mass, lever, J1, J3 = cone(DEFAULT_HEIGHT, DEFAULT_DENSITY)
    weight = mass * DEFAULT_GRAVITY
    spin = math.sqrt(4 * J1 * weight * lever * stability) / J3
    return Scene(
        name,
        RigidBody((J1, J1, J3)),
        rotation_about((1, 0, 0), finite_number("tilt", tilt, "a finite angle, rad")),
        (0.0, 0.0, spin),
        t_end,
        UniformGravity(weight, (0, 0, lever)),
        dt=DEFAULT_DT,
        group="top",
        source=LIMIT,
    )
