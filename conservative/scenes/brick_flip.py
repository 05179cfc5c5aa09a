"""The flying brick: spin about the unstable intermediate axis, which turns over at regular intervals.

Krenk & Nielsen, section 5.1: a box 1 x 3 x 2 of mass 12, so J = (13, 5, 10), free, started about its 3-axis, which is the
intermediate one.
"""

from __future__ import annotations

import numpy as np

from ..body import RigidBody
from ..check import finite_number
from ..scene import Scene

DEFAULT_INERTIA = (13.0, 5.0, 10.0)
DEFAULT_SPIN = 10.0
DEFAULT_DISTURBANCE = 0.05
DEFAULT_T_END = 6.0
DEFAULT_DT = 0.01


def brick_flip(disturbance: float = DEFAULT_DISTURBANCE, spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the paper's brick: rates (0, disturbance, spin) in rad/s, for t_end seconds.

    Reversals follow each other after a time that grows like log(1/disturbance): 2.723 s for the paper's 0.05.

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    disturbance = finite_number("disturbance", disturbance, "a finite rate, rad/s")
    rates = (0.0, disturbance, finite_number("spin", spin, "a finite rate, rad/s"))
    name = "brick_flip" if disturbance == DEFAULT_DISTURBANCE else f"brick_flip_{disturbance:g}"
    return Scene(
        name,
        RigidBody(DEFAULT_INERTIA),
        np.eye(3),
        rates,
        t_end,
        dt=DEFAULT_DT,
        group="free body",
        source="Krenk & Nielsen, 5.1",
    )
