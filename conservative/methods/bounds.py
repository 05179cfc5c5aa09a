"""How far what our methods conserve may be off in a run that is called ok.

Measured on all registered scenes, and on random bodies with ratios k of the largest moment to the smallest up to 1e6: rounding
leaves at most 0.2 eps (10 + n) k after n steps, as an energy divides momenta by moments. A tolerance leaves at most half of
itself in each step. Bounds are twenty times as much, and never above `LOOSEST`.
Source: our own measurements.
"""

from __future__ import annotations

import sys

from ..grid import Grid
from ..scene import Scene
from ..trajectory import Bounds

EPSILON = sys.float_info.epsilon
LOOSEST = 1e-3
"""With a larger drift no run of ours is called ok, whatever the tolerance, the body and the number of steps."""
ROUNDING, SOLVER = 4.0, 10.0
"""Rounding units, and tolerances, that a step may leave."""
UNIT_QUATERNIONS = 1e-13
"""Orthonormality of matrices made of quaternions of length one."""


def bounds_of(scene: Scene, grid: Grid, tol: float = 0.0, orthonormality: float | None = UNIT_QUATERNIONS) -> Bounds:
    """Return the bounds of a run whose solver may leave a relative error `tol` in a step.

    `orthonormality` is None where it is kept no better than the invariants.
    """
    rounding = ROUNDING * EPSILON * (10 + grid.n_steps) * scene.body.condition
    drift = min(LOOSEST, rounding + SOLVER * tol * grid.n_steps)
    return Bounds(drift, drift if orthonormality is None else orthonormality)
