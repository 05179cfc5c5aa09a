"""Bounds on the drift of conserved invariants in a run with the outcome ok.

Bounds are twenty times the largest measured drifts, and at most `LOOSEST`. The drifts were measured on all registered scenes
and on random bodies whose largest moment is up to k = 1e6 times the smallest. Rounding causes at most 0.2 eps (10 + n) k after
n steps; k enters because energy divides momenta by moments. A solver's tolerance causes at most half of itself in each step.
"""

from __future__ import annotations

import sys

from ..grid import Grid
from ..method import Method
from ..scene import Scene
from ..trajectory import LOOSEST, Bounds
from .pieces import count_most_steps

EPSILON = sys.float_info.epsilon
ROUNDING, SOLVER = 4.0, 10.0
"""Drift that a step may cause, in units of round-off and of the tolerance."""
UNIT_QUATERNIONS = 1e-13
"""Bound on the orthonormality error of matrices that are computed from unit quaternions."""


def within_round_off(
    method: Method | None,
    scene: Scene,
    grid: Grid,
    tol: float = 0.0,
    orthonormality: float | None = UNIT_QUATERNIONS,
    n_steps: int | None = None,
) -> Bounds:
    """Return the bounds of a run, as `Method.bounds`. Its solver may leave a relative error `tol` in a step.

    If `orthonormality` is None, it has the same bound as the invariants. `n_steps` is by default the number of steps of the
    grid, including those that break points add.
    """
    if n_steps is None:
        n_steps = count_most_steps(grid, scene.smoothness(grid.last).breaks) if scene.loads else grid.n_steps
    rounding = ROUNDING * EPSILON * (10 + n_steps) * scene.body.condition
    drift = min(LOOSEST, rounding + SOLVER * tol * n_steps)
    return Bounds(drift, drift if orthonormality is None else orthonormality)
