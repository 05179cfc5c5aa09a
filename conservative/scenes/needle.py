"""A needle: one moment a 26th of the two others, which differ by 7 parts in 10,000 (MuJoCo, issue 3553).

There a fast spin of this body diverged when its mass was given to a fixed child of the free body, and did not when it was given
to the body itself. The start is ours: fast, about all axes.
"""

from __future__ import annotations

import numpy as np

from ..body import RigidBody
from ..check import finite_number
from ..scene import Scene
from .slow_motion import slow_motion

DEFAULT_INERTIA = (1.7231e-4, 6.58e-6, 1.7243e-4)
DEFAULT_SPIN = 100.0
DEFAULT_DIRECTION = (0.2, 1.0, 0.1)
DEFAULT_T_END = 2.0
DEFAULT_DT = 0.001


def needle(spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END, slow: float = 1.0) -> Scene:
    """Return the needle with rates spin (0.2, 1, 0.1), rad/s; all of it `slow` times slower (see `slow_motion`).

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, or slow is not above 0.
    """
    rates = finite_number("spin", spin, "a finite rate, rad/s") * np.array(DEFAULT_DIRECTION)
    fast = Scene(
        "needle",
        RigidBody(DEFAULT_INERTIA),
        np.eye(3),
        rates,
        t_end,
        dt=DEFAULT_DT,
        group="free body",
        source="MuJoCo, issue 3553 (inertia; the start is ours)",
    )
    return slow_motion(fast, slow)
