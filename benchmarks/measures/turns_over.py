"""Number of flips of a free body, a qualitative property of its motion."""

from __future__ import annotations

import numpy as np

from conservative.attitude import Array
from conservative.scene import Scene
from conservative.trajectory import Trajectory

FAR_SIDE = 0.5
"""Fraction of the initial momentum along the spin axis that the reversed momentum has to reach for a flip."""


def count_turns_over(trajectory: Trajectory) -> int:
    """Return how often a body turned over.

    That is how often the component of its momentum along one principal axis changed sides: the axis that has most of it at the
    start, about which a body of three different moments turns over where that is the middle one. A side counts from `FAR_SIDE`
    of the component at the start on, so that a wobble across zero does not.
    """
    along = momentum_along_spin(trajectory.scene, trajectory.w_WB_B)
    sides = np.sign(along[np.abs(along) >= FAR_SIDE * abs(along[0])])
    return int(np.count_nonzero(np.diff(sides)))


def momentum_along_spin(scene: Scene, w_WB_B: Array) -> Array:
    """Return the momentum (n,), kg m^2/s, along the principal axis that has most at the start, for rates (n, 3), rad/s."""
    along = scene.body.momentum(w_WB_B) @ scene.body.R_BP
    start = scene.body.momentum(scene.w_WB_B0) @ scene.body.R_BP
    found: Array = along[:, int(np.argmax(np.abs(start)))]
    return found
