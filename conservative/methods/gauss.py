"""Gauss collocation: any even order, conserves every quadratic invariant of momentum and vertical."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from ..attitude import axes_about, from_quaternion, triple
from ..check import choice, describe, positive_integer
from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import Feature
from ..grid import Grid
from ..method import Method, Role, Run
from ..method_info import Cost, MethodInfo, Structure
from ..scene import Scene
from .bounds import within_round_off
from .coefficients.gauss_legendre import MOST_STAGES, tableau
from .non_spinning import FRAMES, Frame, frame_unsupported, resolve_frame
from .principal_axes import PrincipalStart, principal_start, quadruple
from .run_kernel import prepare_run
from .units import in_own_units


@dataclass(frozen=True)
class Gauss(Method):
    """Collocation at s Gauss points, order 2s. Conserves energy, momenta and orthonormality to round-off with any step size.

    In the body momentum L and the vertical gamma = R' e_z (for free bodies, the direction of the world momentum) the motion is
    a closed system whose energy and momenta are quadratic. Gauss collocation conserves them (Hairer, Lubich & Wanner, Geometric
    Numerical Integration, IV.2.1). The attitude consists of gamma and an angle about the vertical, which is a quadrature; see
    `kernels/gauss.py`. One stage is the implicit midpoint rule for L and gamma; the attitude is different.

    In the frame "body", steps have to resolve the rotation of a rod about its axis. "auto" leaves it out if the body is
    symmetric.

    The method is symmetric in time, so the attitude error of a regular motion grows linearly. The errors of `Taylor` and
    `Projected` grow quadratically, except `Taylor`'s on free bodies and symmetric tops, whose integrals it restores.
    The stages are solved to round-off, because stages with larger residuals are not symmetric.

    Steps of several radians, for which the iteration does not converge, fail with `NotConverged`.

    Parameters
    ----------
    stages
        s, 1 to 10.
    frame
        "body", "non_spinning" (the spin of a symmetric body is added in closed form), or "auto": non-spinning if possible.

    Raises
    ------
    BadInput
        stages is not an integer of 1 to 10, or frame is unknown.
    """

    stages: int = 6
    frame: Frame = "auto"

    family: ClassVar[str] = "gauss"
    role: ClassVar[Role] = Role.OURS
    conserves = frozenset({"energy", "momentum", "vertical momentum", "axial momentum"})
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=("stages=2", "stages=4", "stages=6", "stages=8"),
        report=("",),
        suite=("stages=2", "stages=6"),
        rank=3,
        group="implicit",
        longest=1.5,
        cost=lambda method: Cost(step=90.0, correction=6.5 * method.stages, corrections=12.0),
        colour="indigo",
        kernel="gauss",
        structure=lambda method: Structure(symmetric=True, symplectic=False),
        supports=frozenset({Feature.GRAVITY, Feature.ROTOR, Feature.FLIGHT}),
    )

    def __post_init__(self) -> None:
        allowed = f"an integer of 1 to {MOST_STAGES}"
        if positive_integer("stages", self.stages, allowed) > MOST_STAGES:
            raise BadInput("stages", describe(self.stages), allowed)
        choice("frame", self.frame, FRAMES)

    @property
    def order(self) -> int:
        return 2 * self.stages

    bounds = within_round_off

    unsupported = frame_unsupported

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        label, start, model = scene.derive(convert, self)
        return prepare_run(scene, grid, label, start, kernels("gauss"), model, find_coefficients(self.stages, grid.dt))


def convert(scene: Scene, method: Gauss) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its initial state in principal axes, and the kernel's model."""
    frame = resolve_frame(method.frame, scene)
    start = principal_start(scene, frame)
    R_WP, L = from_quaternion(start.q), np.array(start.L)
    whole = L if start.rotor is None else L + start.rotor
    size = math.hypot(*whole)
    # The vertical is e_z. For a free body that moves, the direction of the momentum replaces it.
    has_vertical = start.field is not None or size == 0
    R_WV = np.eye(3) if has_vertical else axes_about(R_WP @ whole / size)
    moment = np.zeros(3) if start.field is None else np.array(start.field)
    # A power of two, so that scaling does not round. For a body at rest, the momentum that its field can produce.
    largest = max(size, math.hypot(*start.L), math.sqrt(max(start.J) * float(np.linalg.norm(moment))))
    unit = 2.0 ** math.ceil(math.log2(largest)) if largest > 0 else 1.0
    model = kernels("gauss").Model(
        unit,
        triple(unit * np.array(start.J_inverse)),
        triple(moment / unit),
        (1.0, 1.0, 1.0 if start.spin is None else 0.0),  # the momentum about the axis of symmetry does not change
        triple(L / unit),
        triple(R_WP[2] if has_vertical else whole / size),
        quadruple(R_WV.T @ R_WP),
        quadruple(R_WV),
        None if start.rotor is None else triple(np.array(start.rotor) / unit),
    )
    return replace(method, frame=frame).label, start, model


@lru_cache(maxsize=256)
def find_coefficients(stages: int, dt: float) -> Any:
    """Return the kernel's coefficients of a step dt, s: stages are filled up with zeros to a multiple of `FOUR`."""
    table, extra = tableau(stages), (0, -stages % kernels("compiler.lanes").FOUR)
    A, E = (np.pad(matrix.T, ((0, 0), extra)).ravel() for matrix in (table.A, table.E))
    return kernels("gauss").Coefficients(stages, A, E, np.pad(table.b, extra), np.pad(table.b_low, extra), dt)
