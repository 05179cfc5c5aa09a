"""Discrete Moser-Veselov steps of a free body: explicit, conservative, and optionally without truncation error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from ..batch import Batch
from ..check import choice, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import Feature
from ..grid import Grid
from ..method import Method, Role, Run
from ..method_info import MethodInfo, Structure
from ..scene import Scene
from .bounds import within_round_off
from .columns import find_unit_of_time, find_units_of_moments, take_pieces
from .many import Block, RunMany
from .principal_axes import PrincipalStart, start_along
from .run_kernel import prepare_run
from .units import convert_scene, find_units, in_own_units

ORDERS: tuple[int | Literal["exact"], ...] = (2, 4, 6, 8, 10, "exact")
LONGEST, LONGEST_EXACT = 1.5, 6.0
"""Limits of the initial |w| dt, rad: for orders 2 to 10, which have short steps only, and for the exact step."""
SMALLEST_CN = 0.2
"""Lower limit of cn at half a step. At cn = 0, after half a period of the polhode, the quaternion form is singular."""
BODY_STEP, BODY_SAMPLE = 3e-9, 25e-9
"""Approximate time, s, of a step and of a sample for a body in lanes. They determine how often a run can be stopped."""
UNIT_VECTORS = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
LONGEST_SHIFT = 2 * math.acos(SMALLEST_CN)
"""Limit of nu dt of the exact step, with the polhode's frequency nu: cn is above SMALLEST_CN for shorter steps."""


@dataclass(frozen=True, init=False)
class MoserVeselov(Method):
    """The discrete Moser-Veselov (DMV) map with a calibrated inertia, for free bodies of any inertia.

    With the Cayley vector c of a step h and the inertia B, where 1/B_i = css/J_i + cdd in principal axes,

        L0 = (2/h) (B c + c x B c) / (1 + |c|^2)
        L1 = L0 - (4/h) c x B c / (1 + |c|^2)
        R1 = R0 Cay(2 c)

    conserves energy and world momentum for any constants css and cdd. These are series in h^2 that depend only on energy and
    |L| (Hairer & Vilmart 2006, J. Phys. A 39, 13225). css = 1 and cdd = 0 is the map of Moser & Veselov (1991), of order 2;
    order/2 terms give an even order, and the complete sum, order "exact", has no truncation error. The step has a closed form:
    see `kernels/moser_veselov.py`. Energy, momentum and orthonormality do not drift; round-off affects only the phase. An exact
    step can be longer than a half turn, where c is infinite, because it uses the quaternion.

    Parameters
    ----------
    order
        2, 4, 6, 8, 10 or "exact". For "exact" the attribute `order` is None.

    Raises
    ------
    BadInput
        order is unknown; when running, the step is too long (see `longest_step`).
    """

    order: int | None = None

    family: ClassVar[str] = "moser_veselov"
    role: ClassVar[Role] = Role.OURS
    conserves = frozenset({"energy", "momentum", "axial momentum"})
    method_info: ClassVar[MethodInfo] = MethodInfo(
        variants=tuple(f"order={order}" for order in ORDERS),
        report=("",),
        suite=("order=2", "order=exact"),
        many=("order=2", "order=exact"),
        rank=0,
        exact=True,
        candidates=("order=exact",),
        colour="wine",
        kernel="moser_veselov",
        structure=lambda method: Structure(symmetric=True, symplectic=method.order in (None, 2)),  # see DERIVATION.md, 8
        supports=frozenset({Feature.FLIGHT}),
    )

    def __init__(self, order: int | Literal["exact"] | None = "exact") -> None:
        if order is not None:
            choice("order", order, ORDERS)
        set_fields(self, order=None if order == "exact" else order)

    bounds = within_round_off

    def longest_step(self, scene: Scene) -> float:
        return 0.99 * step_limit(scene, exact=self.order is None)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        exact = self.order is None
        if grid.dt >= (bound := step_limit(scene, exact)):
            turn = float(np.linalg.norm(scene.w_WB_B0)) * grid.dt
            rule = f"{LONGEST_EXACT:g} and shorter than half a period of the polhode" if exact else f"{LONGEST:g}"
            raise BadInput("dt", f"{grid.dt:g}, |w| dt = {turn:.3g} rad", f"a step with |w| dt < {rule}: below {bound:.6g} s")
        try:
            return self._prepare(scene, grid)
        except BadInput:  # its numbers are in our own units
            raise BadInput("dt", f"{grid.dt:g}, for which {self.name} has no step", "a shorter step") from None

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        return prepare_lanes(self, bodies, grid)

    @in_own_units
    def _prepare(self, scene: Scene, grid: Grid) -> Run:
        label, start, model, coefficients = scene.derive(calibrate, self, grid.dt)
        return prepare_run(scene, grid, label, start, kernels("moser_veselov"), model, coefficients)


def calibrate(scene: Scene, method: MoserVeselov, dt: float) -> tuple[str, PrincipalStart, Any, Any]:
    """Return the label of a run, its start along the polhode's axes, the kernel's model, and coefficients of a step dt, s.

    Raise `BadInput` if the quaternion form has no step of this length.
    """
    kernel, (start, polhode) = kernels("polhode"), scene.derive(find_polhode)
    step = kernel.exact_step(polhode, dt) if method.order is None else kernel.preprocessed_step(polhode, dt, method.order)
    if not (math.isfinite(step.r0) and step.C > SMALLEST_CN):
        raise BadInput("dt", f"{dt:g}", "a shorter step")
    return method.label, start, kernels("moser_veselov").Model(tuple(polhode), start.q), kernel.normalise(step)


def prepare_lanes(method: MoserVeselov, bodies: Batch, grid: Grid) -> RunMany | None:
    """Return the run of many bodies with `march_lanes` of `conservative.kernels.moser_veselov_lanes`."""
    kernel, n, s = kernels("moser_veselov_lanes"), len(bodies), grid.n_samples
    time = find_unit_of_time(grid)
    longest = LONGEST_EXACT if method.order is None else LONGEST
    limits = longest, (LONGEST_SHIFT if method.order is None else math.inf), SMALLEST_CN
    columns = -(-n // kernel.WIDTH) * kernel.WIDTH
    table, start = np.empty((kernel.ROWS, columns)), np.empty((kernel.STATE_ROWS, columns))
    body = bodies.scene.body  # one row of moments and axes if all bodies share them
    moments, R_BP = (body.moments[None], body.R_BP[None]) if bodies.inertia is None else bodies.principal
    # Kernels are compiled for contiguous and writable arrays.
    arrays = (np.require(array, np.float64, ("C", "W")) for array in (R_BP, bodies.R_WB0, bodies.w_WB_B0))
    moments = moments / find_units_of_moments(moments)[:, None]
    try:
        kernel.prepare_lanes(moments, *arrays, time, grid.dt / time, method.order or 0, limits, table, start)
    except (ArithmeticError, ValueError):  # without compilation only; compiled code returns nan for a body without a step
        return None
    finished = table[kernel.FINISHED, :n] == 1

    def run() -> Block:
        states, R_WB, w_WB_B = start.copy(), np.empty((columns, s, 3, 3)), np.empty((columns, s, 3))

        def take(done: int, last: int) -> None:
            kernel.march_lanes(table, states, done, last, grid.n_steps, grid.every, R_WB, w_WB_B)

        take_pieces(grid.n_steps, n * (BODY_STEP + BODY_SAMPLE / grid.every), take)
        return Block(R_WB[:n], w_WB_B[:n], finished)

    return run


def step_limit(scene: Scene, exact: bool) -> float:
    """Return the smallest step, s, that is too long; infinite for a body at rest."""
    speed = float(np.linalg.norm(scene.w_WB_B0))
    if speed == 0:
        return math.inf
    if not exact:
        return LONGEST / speed
    units = find_units(scene, scene.dt)
    nu = abs(scene.derive(convert_scene, units).derive(find_polhode)[1].nu) / units.time
    return min(LONGEST_EXACT / speed, LONGEST_SHIFT / nu if nu > 0 else math.inf)


def find_polhode(scene: Scene) -> tuple[PrincipalStart, Any]:
    """Return the initial state of a scene along its polhode's axes, and its polhode."""
    kernel, R_BP, moments = kernels("polhode"), scene.body.R_BP, scene.body.moments
    principal = zip(moments.tolist(), ((scene.w_WB_B0 @ R_BP) * moments).tolist(), UNIT_VECTORS, strict=True)
    R_PS = np.column_stack([axis[2:] for axis in kernel.polhode_axes(*((J, L, *e) for J, L, e in principal))])
    start = start_along(scene, R_BP @ R_PS, moments @ np.abs(R_PS))
    return start, kernel.polhode(*start.J, *start.L)
