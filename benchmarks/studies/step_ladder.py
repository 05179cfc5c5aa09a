"""Steps, long to short, and tolerances of a study: all runs on a scene are sampled at the same times, whatever the method."""

from __future__ import annotations

import math

import numpy as np

from conservative.grid import Grid
from conservative.method import Method
from conservative.scene import Scene

SAMPLES = 12
"""Intervals between samples. Errors are read at all of them, because the final error can be small by chance."""
RADIANS = 1.0
"""Turn of the body in the longest step, rad."""
LENGTH, FIRST_ORDER_LENGTH = 8, 12
"""Number of step sizes, each half of the previous one. First-order methods need many."""
HIGH_ORDER = 6
"""Order from which halving a step can lead from no accuracy to round-off. Such step sizes are closer and start larger."""
HIGH_LENGTH = 14
"""Number of such step sizes, by a factor of sqrt 2, starting with one step per interval. If the motion between two samples is
slow, a method of high order is close to round-off with the first one. It then has no observed order."""
TOLERANCES = (0.5, 0.1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-14)
"""Tolerances of adaptive methods in addition to their own."""


def samples(scene: Scene, method: Method) -> Grid:
    """Return the grid of the samples with the fewest steps of the method: for reference solutions and adaptive methods."""
    finer = math.ceil(scene.t_end / SAMPLES / method.longest_step(scene)) or 1
    return _grid(scene, finer)


def steps(scene: Scene, method: Method) -> list[Grid]:
    """Return the grids of a method with a step, coarse to fine, over the scene's duration."""
    if (method.order or 0) >= HIGH_ORDER:
        return [_grid(scene, k) for k in sorted({round(2 ** (k / 2)) for k in range(HIGH_LENGTH)})]
    rate = float(np.linalg.norm(scene.w_WB_B0))
    coarsest = max(1, round(scene.t_end * rate / RADIANS / SAMPLES))
    return [_grid(scene, coarsest * 2**k) for k in range(FIRST_ORDER_LENGTH if method.order == 1 else LENGTH)]


def _grid(scene: Scene, per_interval: int) -> Grid:
    n = SAMPLES * per_interval
    return Grid(scene.t_end / n, n, per_interval)
