"""A body hanging or standing on a pivot: at rest, with no momentum to divide by, and swinging just over the top.

In the plane the tilt obeys J1 tilt'' = -m g l sin(tilt). With the energy 2 m g l (1 + excess) above hanging rest it passes
the top, after a time that grows like log(1/excess).
"""

from __future__ import annotations

import math

import numpy as np

from ..body import RigidBody
from ..check import positive_number
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene

DEFAULT_INERTIA = (1.3, 0.9, 0.7)
DEFAULT_WEIGHT = 20.0
DEFAULT_LEVER = 0.4
DEFAULT_EXCESS = 1e-3
DEFAULT_T_END = 5.0
DEFAULT_DT = 0.01


def hanging_rest(t_end: float = DEFAULT_T_END) -> Scene:
    """Return the body hanging at rest.

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return _pendulum("hanging_rest", -DEFAULT_LEVER, 0.0, t_end)


def inverted_rest(t_end: float = DEFAULT_T_END) -> Scene:
    """Return the body standing at rest: an unstable equilibrium.

    Raises
    ------
    BadInput
        t_end, s, is not a finite number above 0.
    """
    return _pendulum("inverted_rest", DEFAULT_LEVER, 0.0, t_end)


def pendulum_over_top(excess: float = DEFAULT_EXCESS, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the body swinging from below over the top with a relative excess of energy.

    Raises
    ------
    BadInput
        An argument, such as t_end, s, is not a finite number above 0.
    """
    energy = 2 * DEFAULT_WEIGHT * DEFAULT_LEVER * (1 + positive_number("excess", excess))
    return _pendulum("pendulum_over_top", -DEFAULT_LEVER, math.sqrt(2 * energy / DEFAULT_INERTIA[0]), t_end)


def _pendulum(name: str, height: float, rate: float, t_end: float) -> Scene:
    return Scene(
        name,
        RigidBody(DEFAULT_INERTIA),
        np.eye(3),
        (rate, 0.0, 0.0),
        t_end,
        UniformGravity(DEFAULT_WEIGHT, (0, 0, height)),
        dt=DEFAULT_DT,
        group="top",
        source="the compound pendulum",
    )
