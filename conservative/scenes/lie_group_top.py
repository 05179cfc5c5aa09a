"""The heavy top of the Lie-group literature (Bruels, Cardona & Arnold 2012): 150 rad/s, and once straight down to 7e-7 rad.

A mass of 15 kg at (0, 1, 0) m with central moments (0.234375, 0.46875, 0.234375) kg m^2. Euler angles break down at the
lower pole.
"""

from __future__ import annotations

import numpy as np

from ..body import RigidBody
from ..check import finite_number
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from .slow_motion import slow_motion

DEFAULT_CENTRAL_INERTIA = (0.234375, 0.46875, 0.234375)
DEFAULT_MASS = 15.0
DEFAULT_COM = (0.0, 1.0, 0.0)
DEFAULT_GRAVITY = 9.81
DEFAULT_SPIN = 150.0
DEFAULT_RATE = -4.61538
DEFAULT_T_END = 2.0
DEFAULT_DT = 0.001


def lie_group_top(spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END, slow: float = 1.0) -> Scene:
    """Return the heavy top with rates (0, spin, -4.61538), rad/s; all of it `slow` times slower (see `slow_motion`).

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, or slow is not above 0.
    """
    com = np.array(DEFAULT_COM)
    offset = DEFAULT_MASS * (com @ com * np.eye(3) - np.outer(com, com))  # parallel axes
    top = Scene(
        "lie_group_top",
        RigidBody(np.diag(DEFAULT_CENTRAL_INERTIA) + offset),
        np.eye(3),
        (0.0, finite_number("spin", spin, "a finite rate, rad/s"), DEFAULT_RATE),
        t_end,
        UniformGravity(DEFAULT_MASS * DEFAULT_GRAVITY, com),
        dt=DEFAULT_DT,
        group="top",
        source="Bruels, Cardona & Arnold 2012",
    )
    return slow_motion(top, slow)
