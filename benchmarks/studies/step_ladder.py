"""Steps, long to short, and tolerances of a study: all runs on a scene are sampled at the same times, whatever the method."""

from __future__ import annotations

import math

import numpy as np

from conservative.grid import Grid
from conservative.method import Method
from conservative.scene import Scene

SAMPLES = 12
"""Intervals between samples: errors are read at these times, so that no lucky zero at the end passes for accuracy."""
RADIANS = 1.0
"""Turn of the body in the longest step, rad."""
LENGTH, FIRST_ORDER_LENGTH = 8, 12
"""Number of steps, each half of the one before. First-order methods begin to converge late."""
HIGH_ORDER = 6
"""From this order on one halving can go from no accuracy to round-off, so steps are spaced closer and start longer."""
HIGH_LENGTH = 14
"""Number of such steps, by sqrt 2, of which the first is one to an interval. Where the motion between two samples is slow, a
method of high order is near round-off at that: it has no order then, and no cheaper way to a coarse error either."""
TOLERANCES = (0.5, 0.1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
"""Tolerances of adaptive methods, beside their own."""


def samples(scene: Scene, method: Method) -> Grid:
    """Return the grid of the samples with the fewest steps the method can take: of the truth, and of what has no order."""
    finer = math.ceil(scene.t_end / SAMPLES / method.longest_step(scene)) or 1
    return _grid(scene, finer)


def steps(scene: Scene, method: Method) -> list[Grid]:
    """Return the grids of a method with a step, coarse to fine, over the scene's duration."""
    return [_grid(scene, k) for k in _per_interval(scene, method)]


def _grid(scene: Scene, per_interval: int) -> Grid:
    n = SAMPLES * per_interval
    return Grid(scene.t_end / n, n, per_interval)


def _per_interval(scene: Scene, method: Method) -> list[int]:
    if (method.order or 0) >= HIGH_ORDER:
        return sorted({round(2 ** (k / 2)) for k in range(HIGH_LENGTH)})
    rate = float(np.linalg.norm(scene.w_WB_B0))
    coarsest = max(1, round(scene.t_end * rate / RADIANS / SAMPLES))
    return [coarsest * 2**k for k in range(FIRST_ORDER_LENGTH if method.order == 1 else LENGTH)]
