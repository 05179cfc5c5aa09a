"""Gauss collocation: any even order, and every quadratic invariant kept."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np

from .attitude import Array, from_quaternion
from .check import choice, positive_integer
from .errors import BadInput, NotConverged
from .frames import FRAMES, Frame, frame_unsupported, resolved, without_spin
from .method import Grid, Method, Run
from .potential import UniformGravity
from .principal import PrincipalStart, Quadruple, Triple, principal_start
from .scene import Scene
from .tableau import MOST_STAGES, tableau
from .trajectory import Counters, Trajectory


@dataclass(frozen=True)
class Gauss(Method):
    """Collocation at s Gauss points: order 2s; energy, momenta and orthonormality to round-off, whatever the step.

    In the body momentum L and the vertical gamma = R' e_z (of a free body: the direction of the world momentum) the motion is a
    closed system with quadratic invariants only, and collocation at Gauss points keeps all of those (Hairer, Lubich & Wanner,
    IV.2.1). The attitude is gamma and one angle about the vertical, which is a quadrature; see `kernels/gauss.py`. One stage is
    the implicit midpoint rule.

    Parameters
    ----------
    stages
        s, 1 to 10.
    frame
        "body", "non_spinning" (the spin of a symmetric body is added in closed form), or "auto": non-spinning where it can be.

    Raises
    ------
    BadInput
        stages is not an integer of 1 to 10, or frame is none of the three.
    """

    stages: int = 6
    frame: Frame = "auto"

    family: ClassVar[str] = "gauss"
    room: ClassVar[Literal["ours", "engine", "truth"]] = "ours"

    def __post_init__(self) -> None:
        allowed = f"an integer of 1 to {MOST_STAGES}"
        if positive_integer("stages", self.stages, allowed) > MOST_STAGES:
            raise BadInput("stages", self.stages, allowed)
        choice("frame", self.frame, FRAMES)

    @property
    def order(self) -> int:
        return 2 * self.stages

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "momentum", "vertical momentum", "axial momentum"})

    def unsupported(self, scene: Scene) -> str | None:
        if not isinstance(scene.potential, UniformGravity | None):
            return "collocation keeps quadratic invariants, so a free body or uniform gravity"
        return frame_unsupported(self.frame, scene)

    @classmethod
    def variants(cls) -> tuple[Gauss, ...]:
        return tuple(cls(stages) for stages in (2, 4, 6, 8))

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        frame = resolved(self.frame, scene)
        label = self.label if frame == self.frame else replace(self, frame=frame).label
        if frame == "body":
            return _prepared(self.stages, scene, grid, label)
        slow = without_spin(scene)
        run = _prepared(self.stages, slow.scene, grid, label)
        return lambda: slow.trajectory(run(), label)


def _prepared(stages: int, scene: Scene, grid: Grid, label: str) -> Run:
    from .kernels.gauss import march
    from .kernels.simd import LANES

    start = principal_start(scene)
    coefficients = padded(stages, LANES)
    model = closed_system(start)

    def run() -> Trajectory:
        q, L = np.empty((grid.n_samples, 4)), np.empty((grid.n_samples, 3))
        done, work, change = march(stages, *coefficients, grid.dt, grid.n_steps, grid.every, *model.arguments, q, L)
        failure = None if done == grid.n_steps else NotConverged(done + 1, done * grid.dt, change)
        counters = Counters(steps=done, stages=done * stages, iterations=work)
        return start.trajectory(label, grid, done, turned_to(start.q, q), L * model.unit, counters, failure)

    return run


@lru_cache(maxsize=2 * MOST_STAGES)
def padded(stages: int, lanes: int) -> tuple[Array, ...]:
    """Return A, E by columns and b, b_low, each in one dimension, stages filled up with zeros to a multiple of `lanes`."""
    table = tableau(stages)
    extra = (0, -len(table.b) % lanes)
    rows = [np.pad(matrix.T, ((0, 0), extra)).ravel() for matrix in (table.A, table.E)]
    return (*rows, np.pad(table.b, extra), np.pad(table.b_low, extra))


@dataclass(frozen=True)
class ClosedSystem:
    """Momentum and vertical as the kernel takes them: floats in tuples, principal axes, momenta in units of `unit` kg m^2/s."""

    unit: float
    J_inverse: Triple
    torque: Triple
    L: Triple
    gamma: Triple

    @property
    def arguments(self) -> tuple[Triple, Triple, Triple, Triple]:
        """What `march` takes of it, in its order."""
        return self.J_inverse, self.torque, self.L, self.gamma


@lru_cache(maxsize=256)
def closed_system(start: PrincipalStart) -> ClosedSystem:
    """Return the closed system of a start; the vertical of a free body is the direction of its momentum."""
    size = math.hypot(*start.L)
    if start.field is not None:
        gamma = from_quaternion(start.q)[2]
    else:
        gamma = np.array(start.L) / size if size > 0 else np.array([0.0, 0.0, 1.0])
    moment = np.zeros(3) if start.field is None else np.array(start.field)
    # A power of two, so that scaling rounds nothing; a body at rest gets the size of what its field can make of it.
    largest = max(size, math.sqrt(max(start.J) * float(np.linalg.norm(moment))))
    unit = 2.0 ** math.ceil(math.log2(largest)) if largest > 0 else 1.0
    return ClosedSystem(
        unit, triple(unit * np.array(start.J_inverse)), triple(moment / unit), triple(np.array(start.L) / unit), triple(gamma)
    )


def triple(values: Array) -> Triple:
    """Return three numbers as a tuple of floats."""
    x, y, z = values.tolist()
    return x, y, z


def turned_to(q0: Quadruple, q: Array) -> Array:
    """Return the quaternions (n, 4) turned in the world by the one rotation that takes the first of them to `q0`.

    The kernel starts from an angle of zero about its vertical, whatever the world's axes are.
    """
    a = left_matrix(np.array(q0)) @ (q[0] * (1, -1, -1, -1))
    return q @ left_matrix(a).T


def left_matrix(q: Array) -> Array:
    """Return the matrix (4, 4) with `left_matrix(q) @ p` the quaternion product q p."""
    w, x, y, z = q
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
