"""The paper's map in three unknowns: the default method for a given step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, ClassVar

import numpy as np

from ..attitude import to_quaternion
from ..batch import Batch
from ..check import choice
from ..deferred_imports import kernels
from ..features import LOADS, ROTATION, Feature
from ..grid import Grid
from ..invariants import MOMENTA, with_balances
from ..method import Method, Role, Run
from ..method_info import Cost, MethodInfo, Structure
from ..potentials.field import into_axes
from ..scene import Scene
from .bounds import within_round_off
from .coefficients.compositions import COMPOSED, COMPOSITIONS, composition_of
from .columns import (
    find_unit_of_time,
    find_units_of_moments,
    in_gravity_or_free,
    make_room,
    moments_of_gravity,
    stack_columns,
    take_pieces,
    turn_samples,
)
from .many import Block, RunMany
from .non_spinning import FRAMES, Frame, frame_unsupported, resolve_frame
from .principal_axes import PrincipalStart, principal_start
from .run_kernel import prepare_run
from .units import in_own_units

TOLERANCE = 1e-20
"""Relative tolerance of the solver in a stage: below round-off, because even a small systematic error becomes a drift after
10^8 steps."""
_MOMENTA = with_balances(*MOMENTA)
_MOMENTA_AND_ENERGY = _MOMENTA | with_balances("energy")


@dataclass(frozen=True)
class Reduced(Method):
    """The integrator of Krenk & Nielsen, reduced to three unknowns and compiled; equal to `Convected` to round-off.

    With w* = J^-1 (L_n + L_n+1)/2, from the mean of the two body momenta, each in its own body axes,

        Q_n+1 = Q_n Cay(dt w*)
        Q_n+1 L_n+1 = Q_n L_n + dt tau*        tau* = sum_j qbar_j x (-V*_j)

    follows from the paper's (22) to (26) without approximation. Energy, world momentum (in a field, its component along the
    field's axis) and orthonormality are conserved to round-off. The axial momentum of a top is not: with steps of 0.01 s it
    changes by 1.2 % on `lagrange_top`.

    This map has order 2. Symmetric compositions of it have order 4 to 10 and conserve the same quantities.

    In a field, rods need short steps: if the smallest moment is a fraction r of the others, the error is proportional to
    dt^2/r. `integrate` warns (`RotationNotResolved`) if the energy allows a rotation of more than 0.5 rad in a step.

    Parameters
    ----------
    order
        2, 4, 6, 8 or 10.
    frame
        "body": the paper's integrator. "non_spinning": the spin of a symmetric body is added in closed form; "auto":
        non-spinning if possible. Energy and momentum of a top are then conserved only to the order of the method, because the
        method conserves them for the slow motion. For free bodies they are conserved to round-off.

    Raises
    ------
    BadInput
        An argument has another value.
    """

    order: int = 2
    frame: Frame = "body"

    family: ClassVar[str] = "reduced"
    role: ClassVar[Role] = Role.OURS
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=tuple(f"order={order}" for order in COMPOSITIONS),
        report=("", "order=8"),
        suite=("order=2", "order=4", "order=6"),
        many=("order=2", "order=4", "order=6"),
        pictures=("",),
        rank=4,
        group="implicit",
        candidates=("order=2", "order=4", "order=6", "order=8"),
        cost=lambda method: Cost(step=10.0, correction=50.0, corrections=method.stages),
        colour="blue",
        kernel="reduced",
        structure=lambda method: Structure(symmetric=True, symplectic=False),
        supports=ROTATION | LOADS | {Feature.ROTOR},
        removed={"composition": COMPOSED, "tol": "settings without tol: the solver stops below round-off"},
    )

    def __post_init__(self) -> None:
        composition_of(self.order)
        choice("frame", self.frame, FRAMES)

    @property
    def conserves(self) -> frozenset[str]:
        return _MOMENTA_AND_ENERGY if self.frame == "body" else _MOMENTA

    bounds = within_round_off

    @property
    def stages(self) -> int:
        """Number of substeps of order 2 in a step."""
        return composition_of(self.order).stages

    unsupported = frame_unsupported

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        label, start, model = scene.derive(convert, self)
        find = partial(find_coefficients, self.order)
        return prepare_run(scene, grid, label, start, kernels("reduced"), model, find(grid.dt), find)

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Return the run of free bodies, or bodies in uniform gravity, in lanes; None for others."""
        return prepare_lanes(self, bodies, grid) if self.frame == "body" and in_gravity_or_free(bodies) else None


def convert(scene: Scene, method: Reduced) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its initial state in principal axes, and the kernel's model."""
    frame = resolve_frame(method.frame, scene)
    start = principal_start(scene, frame)
    model = kernels("reduced").Model(start.J, start.J_inverse, start.field, start.q, start.L, start.rotor)
    return replace(method, frame=frame).label, start, model


@lru_cache(maxsize=256)
def find_coefficients(order: int, dt: float) -> Any:
    """Return the kernel's coefficients of a step dt, s."""
    return kernels("reduced").Coefficients(np.array(composition_of(order).lengths(dt)), TOLERANCE)


BODY_STEP = 2e-8
"""Approximate time, s, of a stage for a body in lanes. It determines only how often a run can be stopped."""


def prepare_lanes(method: Reduced, bodies: Batch, grid: Grid) -> RunMany:
    """Return the run of many bodies with `march_lanes` of `conservative.kernels.reduced`."""
    kernel, n, s = kernels("reduced"), len(bodies), grid.n_samples
    moments, R_BP = bodies.principal
    time, units = find_unit_of_time(grid), find_units_of_moments(moments)[:, None]
    lengths, tol = find_coefficients(method.order, grid.dt / time)
    J, q0 = moments / units, to_quaternion(bodies.R_WB0 @ R_BP)
    L0 = into_axes(bodies.w_WB_B0, R_BP) * moments / units * time
    columns = stack_columns([J, 1 / J], kernel.WIDTH)
    field = None if bodies.scene.free else stack_columns([moments_of_gravity(bodies, R_BP) / units * time * time], kernel.WIDTH)
    starts, room = np.zeros((kernel.ROWS, columns.shape[1])), make_room(kernel.ROOM, kernel.WIDTH)
    starts[:7] = stack_columns([q0, L0], kernel.WIDTH)
    q, L = np.empty((columns.shape[1], s, 4)), np.empty((columns.shape[1], s, 3))
    q[:n, 0], L[:n, 0] = q0, L0

    def run() -> Block:
        states, finished = starts.copy(), np.ones(columns.shape[1], dtype=bool)

        def take(done: int, last: int) -> None:
            kernel.march_lanes(lengths, tol, columns, field, states, room, done, last, grid.n_steps, grid.every, q, L, finished)

        take_pieces(grid.n_steps, BODY_STEP * len(lengths) * n, take)
        return replace(turn_samples(grid, q, L, (1 / J / time, None, R_BP), np.arange(n), n), finished=finished[:n])

    return run
