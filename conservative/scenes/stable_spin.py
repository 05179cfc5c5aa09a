"""A spin about the stable axis of largest moment, for many revolutions: its axis stays within the polhode it starts on.

Engines that hold |L| by force (clamping) drift through the polhodes until any spin turns over.
"""

from __future__ import annotations

import math

import numpy as np

from ..body import RigidBody
from ..check import finite_number, positive_number
from ..errors import BadInput
from ..scene import Scene
from .brick_flip import DEFAULT_INERTIA

DEFAULT_SPIN = 10.0
DEFAULT_DISTURBANCE = 0.1
DEFAULT_REVOLUTIONS = 100.0
DEFAULT_DT = 0.01


def stable_spin(
    revolutions: float = DEFAULT_REVOLUTIONS, spin: float = DEFAULT_SPIN, disturbance: float = DEFAULT_DISTURBANCE
) -> Scene:
    """Return the paper's brick with rates (spin, disturbance, disturbance), rad/s, for so many revolutions.

    The hard case is 1e6 revolutions (`stable_spin:revolutions=1e6`), 62.8 million steps: sample it sparsely.

    Raises
    ------
    BadInput
        revolutions is not above 0, spin is 0, or an argument is not finite.
    """
    if finite_number("spin", spin, "a finite rate other than 0, rad/s") == 0:
        raise BadInput("spin", spin, "a finite rate other than 0, rad/s")
    turns = positive_number("revolutions", revolutions)
    across = finite_number("disturbance", disturbance, "a finite rate, rad/s")
    return Scene(
        "stable_spin",
        RigidBody(DEFAULT_INERTIA),
        np.eye(3),
        (spin, across, across),
        2 * math.pi * turns / abs(spin),
        dt=DEFAULT_DT,
        group="free body",
        source="Euler's equations; Poinsot",
    )
