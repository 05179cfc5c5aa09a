"""Steps and tolerances that a study walks along, all with samples at the same times."""

from __future__ import annotations

import numpy as np

from conservative.method import Grid, Method
from conservative.scene import Scene

SAMPLES = 12
"""Intervals between samples: errors are read at these times, so that no lucky zero at the end passes for accuracy."""
RADIANS = 1.0
"""Turn of the body in the coarsest step, rad."""
LENGTH = 8
"""Steps of a ladder, each half of the one before."""
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)
HIGH_ORDER = 6
"""From this order on the steps of a ladder are closer, since one halving can lead from no accuracy to the round-off floor."""


def steps(scene: Scene, method: Method) -> list[Grid]:
    """Return the grids of a method with a step, coarse to fine, over the scene's duration."""
    rate = float(np.linalg.norm(scene.w_WB_B0))
    coarsest = max(1, round(scene.t_end * rate / RADIANS / SAMPLES))
    ratio = 2.0 if (method.order or 0) < HIGH_ORDER else 2.0**0.5
    per_sample = sorted({round(coarsest * ratio**k) for k in range(LENGTH)})
    return [Grid(scene.t_end / (SAMPLES * n), SAMPLES * n, n) for n in per_sample]


def samples(scene: Scene) -> Grid:
    """Return the grid of an adaptive method and of the truth: the samples alone."""
    return Grid(scene.t_end / SAMPLES, SAMPLES)
