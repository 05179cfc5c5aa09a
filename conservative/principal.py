"""To principal axes and back: the one conversion that all compiled methods share.

Kernels see a diagonal inertia, the attitude `R_WP` as a quaternion (scalar first) and the momentum `L_P`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .attitude import Array, from_quaternion, to_quaternion
from .attitude import Triple as Triple
from .errors import Diverged, IntegrationFailed
from .method import Grid
from .scene import Scene
from .trajectory import Counters, Trajectory, finite_prefix

Quadruple = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class PrincipalStart:
    """A scene's start as kernels take it: floats in tuples, principal axes."""

    scene: Scene
    J: Triple
    J_inverse: Triple
    q: Quadruple
    L: Triple
    field: Any

    def trajectory(
        self, label: str, grid: Grid, done: int, q: Array, L: Array, work: Counters, failure: IntegrationFailed | None
    ) -> Trajectory:
        """Return samples in body axes from quaternions (n, 4) and momenta (n, 3) after `done` steps.

        The quaternion is normalised here: its length carries no information, as the kernels' products are homogeneous in it.
        """
        kept = grid.kept(done)
        q, L = q[:kept], L[:kept]
        R_BP = self.scene.body.R_BP
        R_WB = from_quaternion(q / np.sqrt(np.einsum("ij,ij->i", q, q))[:, None]) @ R_BP.T
        w_WB_B = (L * self.J_inverse) @ R_BP.T
        finite = finite_prefix(R_WB, w_WB_B)
        if finite < kept:
            failure = Diverged(float(grid.t[max(finite - 1, 0)]))
        return Trajectory(self.scene, grid.t[:finite], R_WB[:finite], w_WB_B[:finite], label, work, failure)


def principal_start(scene: Scene) -> PrincipalStart:
    """Return the scene's start in principal axes."""
    body = scene.body
    J = body.moments
    q = to_quaternion(scene.R_WB0 @ body.R_BP)
    L = (scene.w_WB_B0 @ body.R_BP) * J
    field = None if scene.potential is None else scene.potential.kernel_field(body.R_BP)
    return PrincipalStart(scene, _floats(J), _floats(1 / J), _floats(q), _floats(L), field)


def _floats(values: Array) -> Any:
    return tuple(float(value) for value in values)
