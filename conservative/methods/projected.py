"""Explicit steps of order 8, projected onto the invariants: the cheapest accuracy for a body in a field."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from ..attitude import triple
from ..declarations import Candidacy, Cost
from ..errors import NotConverged
from ..lazy_kernels import kernels
from ..method import Grid, Method, Role, Run
from ..scene import Scene
from ..trajectory import Counters, Trajectory
from .coefficients.explicit import DORMAND_PRINCE_8
from .principal_axes import principal_start

TOO_LONG = "the step ends too far from the invariants to be projected onto them"


@dataclass(frozen=True)
class Projected(Method):
    """Dormand and Prince's explicit method of order 8 on quaternion and momentum, each step projected onto the invariants.

    Energy, the momentum about the field's axis (the vertical one under gravity) and orthonormality are kept to round-off, since
    whatever a step loses of them is put back (Hairer, Lubich & Wanner, Geometric Numerical Integration, IV.4): they are
    imposed, where the other methods here inherit them. It is neither symmetric in time nor symplectic, and needs steps well
    below the fastest turn; but no equations are solved, so that a step costs twelve evaluations of the torque and little more.
    Near a steady precession, where energy and momentum depend on each other, what a step loses of them is put back to the
    square of its error only.

    Free bodies have `MoserVeselov`, which has no truncation error at all.
    """

    family: ClassVar[str] = "projected"
    role: ClassVar[Role] = Role.OURS
    candidacy: ClassVar[Candidacy] = Candidacy(2)
    colour: ClassVar[str] = "teal"
    kernel: ClassVar[str] = "projected"

    @property
    def order(self) -> int:
        return DORMAND_PRINCE_8.order

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "vertical momentum", "momentum along the field's axis"})

    @property
    def cost(self) -> Cost:
        return Cost(step=340.0, correction=80.0)

    def unsupported(self, scene: Scene) -> str | None:
        return "it is for bodies in a field" if scene.free else None

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        march, start = kernels("projected").march, principal_start(scene)
        model = (start.J_inverse, start.field, field_axis(scene), invariant_scales(scene))
        coefficients, stages = DORMAND_PRINCE_8.packed, len(DORMAND_PRINCE_8.b)

        def run() -> Trajectory:
            q, L = np.empty((grid.n_samples, 4)), np.empty((grid.n_samples, 3))
            done, corrections, defect = march(coefficients, grid.dt, grid.n_steps, grid.every, *model, start.q, start.L, q, L)
            failure = None if done == grid.n_steps else NotConverged(done + 1, done * grid.dt, defect, TOO_LONG)
            work = Counters(steps=done, stages=done * stages, iterations=corrections, evaluations=done * stages)
            return start.trajectory(self.label, grid, done, q, L, work, failure)

        return run


@lru_cache(maxsize=256)
def field_axis(scene: Scene) -> Any:
    """Return the axis about which the field is symmetric, three floats in world axes, or None."""
    axis = None if scene.potential is None else scene.potential.axis_W
    return None if axis is None else triple(axis / np.linalg.norm(axis))


@lru_cache(maxsize=256)
def invariant_scales(scene: Scene) -> tuple[float, float]:
    """Return what errors of energy, J, and momentum, kg m^2/s, are relative to: the latter is what all that energy makes."""
    return scene.energy_scale, math.sqrt(2 * scene.energy_scale * float(scene.body.moments.max()))
