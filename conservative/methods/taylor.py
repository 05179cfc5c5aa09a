"""Taylor series of any order, projected onto the invariants."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from ..batch import Batch
from ..check import describe, positive_number, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import ROTATION, Feature
from ..grid import Grid
from ..invariants import AXIAL_MOMENTUM, JACOBI_INTEGRAL, MOMENTA
from ..method import Method, Role, Run
from ..method_info import Cost, MethodInfo, Structure
from ..potentials.turning import Turning, static_part
from ..scene import Scene
from ..trajectory import Bounds
from .bounds import within_round_off
from .many import RunMany
from .run_kernel import prepare_run
from .taylor_dense import prepare_dense
from .taylor_lanes import prepare_bodies
from .taylor_model import find_model
from .taylor_starts import bind_restart
from .units import in_own_units

LOWEST, DEFAULT, HIGHEST = 4, 14, 18
"""Orders that the kernel has code for, and the one where nobody names one."""
RIGHT_ANGLE = 1e-15
"""Cosine of an angle that is a right one."""
PARTS = 100
"""Steps between two samples that bounds allow for with a tolerance."""


@dataclass(frozen=True, init=False)
class Taylor(Method):
    """Taylor series of the motion in time, each step projected onto the invariants: the fastest general method in a field.

    The coefficients of a step follow from recurrences, because every product in the equations of motion is a product of two
    series; the powers in the torque of a spring or an attraction have a recurrence of their own (Barton, Willers & Zahar,
    1971). Energy, momenta and orthonormality are conserved to round-off by projection (Hairer, Lubich & Wanner, Geometric
    Numerical Integration, IV.4). The method is neither symmetric in time nor symplectic. Steps must be well below the period of
    the fastest rotation.

    With equal steps, the integrals of a free body, and of a symmetric top in gravity whose axis stays away from the vertical,
    leave one oscillation to integrate, and angles to compute by quadrature. No closed form is used. A step of a free body then
    takes half, and one of a top a third of the time.

    For random bodies in gravity, the fastest orders are 8 to 10 for errors of 1e-2 to 1e-4 rad, 12 to 14 for 1e-5 to 1e-9, and
    14 to 16 below. In the other fields they are about two lower.

    With a tolerance, steps have any length, and dt is only the distance of samples. Samples are values of the steps'
    polynomials, each projected onto the invariants, and as accurate as the steps. Use a tolerance for many samples: if every
    sample of the flipping brick at 100 Hz is stored, it takes 0.3 to 0.5 of the time of equal steps. Use it also for motions
    that are fast for a short time, such as a close passage of an attracting point. For a passage at a fortieth of the largest
    distance, tolerance 1e-12 takes 103 steps for an error of 2e-14 rad, while 4,000 equal steps leave 1e-8 rad. Steps are
    chosen as in Jorba & Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods
    (2005). The order is 6.5 plus three quarters of the digits of the tolerance, made even, the fastest for random bodies.
    Errors grow with time: after 12 rad, 97 % of random bodies have errors below the tolerance (1e-2 to 1e-12), and half of
    them below 0.06 times the tolerance.

    `integrate_many` integrates several bodies at once, one per lane of a vector register, with equal steps. The results differ
    from runs of single bodies only by round-off: attitudes of random heavy tops differ by 3e-15 after 100 steps and 4e-13
    after 1,000. Free bodies and symmetric tops are not reduced in lanes, so their truncation errors differ as well. With a
    tolerance, and in turning fields, bodies run one by one.

    For free bodies use `MoserVeselov`, which has no truncation error, for symmetric tops `Lame`, and for potentials given as
    Python functions `Projected`.

    Parameters
    ----------
    order
        Order of the series, 4 to 18; default 14. None with a tolerance, which determines it.
    tolerance
        None for the steps of the grid. Otherwise steps are as long as the two terms before the last are at most half of this,
        relative to 1 for the attitude matrix and to a quarter of the largest possible rate of the axis of largest inertia.

    Raises
    ------
    BadInput
        order is not an integer in that range, tolerance is not a positive number, or both are given.
    """

    order: int | None = None
    tolerance: float | None = None

    family: ClassVar[str] = "taylor"
    role: ClassVar[Role] = Role.OURS
    conserves = frozenset({"energy", JACOBI_INTEGRAL, *MOMENTA, AXIAL_MOMENTUM})
    method_info: ClassVar[MethodInfo] = MethodInfo(
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
        structure=lambda method: Structure(symmetric=False, symplectic=False, imposed=True),
        supports=ROTATION - {Feature.FUNCTION} | {Feature.TURNING, Feature.ROTOR},
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

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        if self.tolerance is not None:
            grid = Grid(grid.dt, PARTS * grid.n_steps, PARTS * grid.n_steps)
        return within_round_off(self, scene, grid)

    @property
    def terms(self) -> int:
        """Order of the series, also if a tolerance determines it."""
        if self.tolerance is None:
            return self.order or DEFAULT
        return max(LOWEST, min(HIGHEST, 2 * round(3.25 - 0.375 * math.log10(self.tolerance))))

    def unsupported(self, scene: Scene) -> str | None:
        return scene.derive(find_obstacle)

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        label, (start, model) = self.label, scene.derive(find_model, self.tolerance is None)
        if self.tolerance is None:
            kernel = kernels("taylor")
            coefficients = kernel.Coefficients(self.terms, grid.dt)
            bind = partial(bind_restart, scene, start, model, None)
            return prepare_run(scene, grid, label, start, kernel, model, coefficients, bind_restart=bind)
        return prepare_dense(scene, grid, label, start, model, self.terms, self.tolerance)

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        return prepare_bodies(bodies, grid, self.terms) if self.tolerance is None else None


def find_obstacle(scene: Scene) -> str | None:
    """Return why a scene's field is not supported, or None."""
    potential = static_part(scene.potential)
    if potential is not None and not hasattr(potential.kernel_field(scene.body.R_BP), "series"):
        return "it is for fields with a recurrence, which functions do not have"
    if isinstance(scene.potential, Turning):
        axis = potential.axis_W
        if axis is None or abs(axis @ scene.potential.orbit.normal_W) > RIGHT_ANGLE:
            return "it is for fields that turn about an axis at right angles to their own, such as the field of a satellite"
    return None
