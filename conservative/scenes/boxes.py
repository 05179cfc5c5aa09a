"""Free boxes that engines are tested with, so that their published errors can be set beside what is measured here.

A box with sides a, b, c and mass m has J = m/12 (b^2 + c^2, c^2 + a^2, a^2 + b^2) about its centre. The motion of a free body
depends on the ratios of its moments only.
"""

from __future__ import annotations

import numpy as np

from ..body import RigidBody
from ..scene import Scene

GAZEBO_SIDES = (0.1, 0.4, 0.9)
GAZEBO_MASS = 10.0
GAZEBO_RATES = (0.1, 5.0, 0.1)
GAZEBO_T_END = 10.0
MUJOCO_SIDES = (0.1, 0.2, 0.3)
MUJOCO_MASS = 6.0
TUMBLING_RATES = (1.0, 2.0, 3.0)
TUMBLING_T_END = 5.0
NEAR_INTERMEDIATE_RATES = (0.05, 5.0, 0.05)
NEAR_INTERMEDIATE_T_END = 100.0
DEFAULT_DT = 0.01


def gazebo_box(t_end: float = GAZEBO_T_END) -> Scene:
    """Return the box 0.1 x 0.4 x 0.9 of Gazebo's comparison of ODE, Bullet, Simbody and DART ("complex" case, rotation only).

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return _box("gazebo_box", GAZEBO_SIDES, GAZEBO_MASS, GAZEBO_RATES, t_end, "Peters & Hsu, boxes benchmark of Gazebo")


def tumbling_box(t_end: float = TUMBLING_T_END) -> Scene:
    """Return the box 0.1 x 0.2 x 0.3 with rates (1, 2, 3) rad/s of MuJoCo's own tests.

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return _box("tumbling_box", MUJOCO_SIDES, MUJOCO_MASS, TUMBLING_RATES, t_end, "MuJoCo's tests of free bodies")


def near_intermediate_box(t_end: float = NEAR_INTERMEDIATE_T_END) -> Scene:
    """Return the same box turning almost about its intermediate axis, for long, as in MuJoCo's own tests.

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return _box(
        "near_intermediate_box",
        MUJOCO_SIDES,
        MUJOCO_MASS,
        NEAR_INTERMEDIATE_RATES,
        t_end,
        "MuJoCo's tests of free bodies",
    )


def _box(
    name: str,
    sides: tuple[float, float, float],
    mass: float,
    rates: tuple[float, float, float],
    t_end: float,
    source: str,
) -> Scene:
    squares = np.square(sides)
    body = RigidBody(mass / 12 * (squares.sum() - squares))
    return Scene(name, body, np.eye(3), rates, t_end, dt=DEFAULT_DT, group="free body", source=source)
