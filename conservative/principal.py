"""To principal axes and back: the one conversion that all compiled methods share.

Kernels see a diagonal inertia, the attitude `R_WP` as a quaternion (scalar first) and the momentum `L_P`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from .attitude import Array, to_quaternion
from .attitude import Triple as Triple
from .errors import Diverged, IntegrationFailed
from .method import Grid
from .scene import Scene
from .trajectory import Counters, Trajectory

Quadruple = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class PrincipalStart:
    """A scene's start as kernels take it: floats in tuples, principal axes; `R_BP` is None where those are the body's axes."""

    scene: Scene
    J: Triple
    J_inverse: Triple
    q: Quadruple
    L: Triple
    R_BP: Array | None
    field: Any

    def trajectory(
        self, label: str, grid: Grid, done: int, q: Array, L: Array, work: Counters, failure: IntegrationFailed | None
    ) -> Trajectory:
        """Return samples in body axes from quaternions (n, 4) and momenta (n, 3) after `done` steps.

        The quaternion is normalised here: its length carries no information, as the kernels' products are homogeneous in it.
        """
        from .kernels.samples import to_body_axes

        kept = grid.kept(done)
        R_WB, w_WB_B = np.empty((kept, 3, 3)), np.empty((kept, 3))
        finite = to_body_axes(q[:kept], L[:kept], self.J_inverse, self.R_BP, R_WB, w_WB_B)
        if finite < kept:
            failure = Diverged(float(grid.t[max(finite - 1, 0)]))
        return Trajectory(self.scene, grid.t[:finite], R_WB[:finite], w_WB_B[:finite], label, work, failure)


@lru_cache(maxsize=256)
def principal_start(scene: Scene) -> PrincipalStart:
    """Return the scene's start in principal axes. A scene never changes, so its start is converted once."""
    body = scene.body
    J = body.moments
    q = to_quaternion(scene.R_WB0 @ body.R_BP)
    L = (scene.w_WB_B0 @ body.R_BP) * J
    field = None if scene.potential is None else scene.potential.kernel_field(body.R_BP)
    R_BP = None if np.array_equal(body.R_BP, np.eye(3)) else np.ascontiguousarray(body.R_BP)
    return PrincipalStart(scene, _floats(J), _floats(1 / J), _floats(q), _floats(L), R_BP, field)


def _floats(values: Array) -> Any:
    return tuple(float(value) for value in values)
