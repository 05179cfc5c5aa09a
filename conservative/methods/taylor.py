"""Taylor series of any order, projected onto the invariants."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ..attitude import Array, axes_about, triple
from ..batch import Batch
from ..card import Card, Cost
from ..check import describe, positive_number, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput
from ..grid import Grid
from ..invariants import JACOBI_INTEGRAL, momentum_W
from ..method import Method, Role, Run
from ..potentials.turning import Orbit, Turning, static_part
from ..scene import Scene
from ..trajectory import Bounds, Trajectory
from .bounds import bounds_of
from .many import RunMany
from .principal_axes import PrincipalStart, Triple, field_axis, invariant_scales, principal_start, quadruple
from .run_kernel import prepare_run
from .taylor_many import prepare_bodies
from .units import in_own_units

LOWEST, DEFAULT, HIGHEST = 4, 14, 18
"""Orders that the kernel has code for, and the one where nobody names one."""
RIGHT_ANGLE = 1e-15
"""Cosine of an angle that is a right one."""
PARTS = 100
"""Parts of a step that bounds allow for where a tolerance divides it."""


@dataclass(frozen=True, init=False)
class Taylor(Method):
    """Taylor series of the motion in time, each step projected onto the invariants: the fastest general method in a field.

    The coefficients of a step follow from recurrences, because every product in the equations of motion is a product of two
    series; the powers in the torque of a spring or an attraction have a recurrence of their own (Barton, Willers & Zahar,
    1971). Energy, momenta and orthonormality are conserved to round-off by projection (Hairer, Lubich & Wanner, Geometric
    Numerical Integration, IV.4). Steps must be well below the period of the fastest rotation.

    For random bodies in gravity, the fastest orders are 8 to 10 for errors of 1e-2 to 1e-4 rad, 12 to 14 for 1e-5 to 1e-9, and
    14 to 16 below. In the other fields they are about two lower.

    Use a tolerance for motions that are fast for a short time, such as a close passage of an attracting point. For a passage at
    a fortieth of the largest distance, tolerance 1e-12 takes 135 substeps for an error of 3e-13 rad, while 4,000 equal steps
    leave 1e-8 rad. For other motions equal steps are as good. Substeps are chosen as in Jorba & Zou, A software package for the
    numerical integration of ODEs by means of high-order Taylor methods (2005). The order is 6 plus two thirds of the digits of
    the tolerance, the best choice for random bodies near an attracting point.

    `integrate_many` integrates several bodies at once, one per lane of a vector register, with equal steps. The results differ
    from those of single bodies only by round-off: attitudes of random heavy tops differ by 3e-15 after 100 steps and 4e-13
    after 1,000. With a tolerance, and in turning fields, bodies run one by one.

    For free bodies use `MoserVeselov`, which has no truncation error, for symmetric tops `Lame`, and for potentials given as
    Python functions `Projected`.

    Parameters
    ----------
    order
        Order of the series, 4 to 18; default 14. None with a tolerance, which determines it.
    tolerance
        None for the steps of the grid. Otherwise each step is divided into substeps in which the last two terms of the series
        are at most this large, relative to 1 for the attitude matrix and to the largest possible rate of the axis of largest
        inertia.

    Raises
    ------
    BadInput
        order is not an integer in that range, tolerance is not a positive number, or both are given.
    """

    order: int | None = None
    tolerance: float | None = None

    family: ClassVar[str] = "taylor"
    role: ClassVar[Role] = Role.OURS
    card: ClassVar[Card] = Card(
        variants=("order=8", "order=12", "order=16", "tolerance=1e-9"),
        report=("order=12",),
        suite=("order=14",),
        many=("order=12", "order=8", "order=10", "order=14"),
        rank=1,
        group="explicit",
        candidates=("order=8", "order=12", "order=16"),
        cost=lambda method: Cost(step=60.0 + 0.55 * method.terms**2, correction=40.0),
        colour="#7B61FF",
        kernel="taylor",
        time_dependent=True,
    )

    def __init__(self, order: int | None = None, tolerance: float | None = None) -> None:
        if tolerance is not None:
            positive_number("tolerance", tolerance, "a finite number above 0, or None")
            if order is not None:
                raise BadInput("order", describe(order), "None together with tolerance, which chooses the order")
        elif order is None:
            order = DEFAULT
        elif isinstance(order, bool) or not isinstance(order, int) or not LOWEST <= order <= HIGHEST:
            raise BadInput("order", describe(order), f"an integer from {LOWEST} to {HIGHEST}")
        set_fields(self, order=order, tolerance=tolerance)

    @property
    def conserves(self) -> frozenset[str]:
        momenta = {"momentum", "vertical momentum", "momentum along the field's axis", "axial momentum"}
        return frozenset({"energy", JACOBI_INTEGRAL, *momenta})

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        parts = 1 if self.tolerance is None else PARTS
        return bounds_of(scene, Grid(grid.dt, parts * grid.n_steps, parts * grid.n_steps))

    @property
    def terms(self) -> int:
        """Order of the series, also if a tolerance determines it."""
        if self.tolerance is None:
            return self.order or DEFAULT
        return max(LOWEST, min(HIGHEST, round(6 - 2 / 3 * math.log10(self.tolerance))))

    def unsupported(self, scene: Scene) -> str | None:
        if not scene.derive(has_recurrence):
            return "it is for fields with a recurrence, which functions have not"
        if scene.derive(turning_rate) is None:
            return "it is for fields that turn about an axis at right angles to their own, as that of a satellite"
        return None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, (label, start, model) = kernels("taylor"), scene.derive(convert, self)
        coefficients = kernel.Coefficients(self.terms, grid.dt, self.tolerance or 0.0)
        run = prepare_run(scene, grid, label, start, kernel, model, coefficients)
        return turn_samples(run, scene.potential.orbit) if isinstance(scene.potential, Turning) else run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        return prepare_bodies(bodies, grid, self.terms) if self.tolerance is None else None


def turn_samples(run: Run, orbit: Orbit) -> Run:
    """Return a run whose attitudes are turned from the axes of an orbit to the world's."""

    def run_and_turn() -> Trajectory:
        found = run()
        return replace(found, R_WB=orbit.R_WO(found.t) @ found.R_WB)

    return run_and_turn


def has_recurrence(scene: Scene) -> bool:
    """Return whether a scene has no field or one with a recurrence."""
    potential = static_part(scene.potential)
    if potential is None:
        return True
    return type(potential.kernel_field(scene.body.R_BP)) in kernels("axial").start_series.registry


def turning_rate(scene: Scene) -> float | None:
    """Return the rate, rad/s, at which the field turns about an axis at right angles to its own: 0 where it does not turn.

    It is None where the axes are at another angle.
    """
    if not isinstance(scene.potential, Turning):
        return 0.0
    orbit, axis = scene.potential.orbit, scene.potential.potential.axis_W
    return orbit.rate if axis is not None and abs(axis @ orbit.normal_W) <= RIGHT_ANGLE else None


def convert(scene: Scene, method: Taylor) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its start in principal axes and the kernel's model of it."""
    start, loose = start_about_symmetry(scene)
    kernel, R_WD = kernels("taylor"), axes_of(scene)
    R_DP = R_WD.T @ scene.R_WB0 @ (np.eye(3) if start.R_BP is None else start.R_BP)
    field = start.field if field_axis(scene) else kernel.Free(math.hypot(*start.L))
    if isinstance(scene.potential, Turning):
        field = kernel.Revolving(start.field.field, scene.potential.orbit.rate)
    rows = triple(R_DP[2]), triple(R_DP[0])
    body = start.J, start.J_inverse, field, loose, invariant_scales(scene)
    return method.label, start, kernel.Model(*body, quadruple(R_WD), *rows, start.q, start.L)


def start_about_symmetry(scene: Scene) -> tuple[PrincipalStart, Triple]:
    """Return the start, and which components of L may be changed.

    Where body and field share an axis of symmetry, the frame is that which does not spin, and the third component stays.
    """
    if scene.symmetry_axis_B is None:
        return principal_start(scene), (1.0, 1.0, 1.0)
    return principal_start(scene, "non_spinning"), (1.0, 1.0, 0.0)


def axes_of(scene: Scene) -> Array:
    """Return the rotation (3, 3) to the world from axes D, of which the third is the field's and, if it turns, it turns about
    the second.
    """
    if not isinstance(scene.potential, Turning):
        return axes_about(third_axis(scene))
    second, third = scene.potential.orbit.normal_W, np.asarray(scene.potential.potential.axis_W)
    return np.stack([np.cross(second, third), second, third], axis=1)


def third_axis(scene: Scene) -> Array:
    """Return the direction (3,), a unit vector in world axes, of the field's axis; where nothing acts, of the momentum."""
    axis = field_axis(scene)
    momentum = momentum_W(scene.body, scene.R_WB0, scene.w_WB_B0)
    size = float(np.linalg.norm(momentum))
    return np.array(axis) if axis else momentum / size if size > 0 else np.array((0.0, 0.0, 1.0))
