"""The symmetric top without truncation error: each step is an addition theorem of elliptic functions.

A symmetric body whose centre of mass lies on its axis, seen from the frame that does not spin, has the angular velocity
w = L/J1. With k = m g l / J1, u the vertical component of its axis, and E, z, w3 the energy, vertical and axial momentum, all
divided by J1,

    x(t) = k u/2 - E/6    satisfies    x'^2 = 4 x^3 - g2 x - g3,    so    x(t) = p(t + const), Weierstrass' p;
    g2 = E^2/3 - k z w3 + k^2,    g3 = 4 a^3 - g2 a + (k (z - w3)/2)^2  at  a = k/2 - E/6.

Let q = alpha + beta be the attitude quaternion (alpha: its parts along 1 and k, beta: along i and j). From q' = w q / 2 and
w' = k e_z x n follows that alpha, beta and M = exp(i w3 t/2) (w1 + i w2) satisfy Lame's equation y'' = (2 x + B) y, with
B = -E/6 - k/2, -E/6 + k/2 and E/3 - w3^2/4. Its propagator over a step h, y1 = A y + b y', is algebraic in the state: with f
the solution that starts like t^2 at the pole of p, and S = (x' - p'(h)) / (2 (x - p(h))), the slope of the addition theorem
p(t + h) = S^2 - p(t) - p(h),

    A = [f(h) (p(h) + x + B) - f'(h) S] / 3,    b = [f'(h) - f(h) S] / 3.

Proof: b is an elliptic function of t with simple poles at 0 and -h only, so it is linear in S, and both coefficients follow
from t -> 0. A = -db/dt with the end of the step held fixed. A step of any length therefore has no truncation error. The
constants p(h), p'(h), f(h), f'(h) are computed once per run in twofold precision, from Laurent series and these theorems at
doubled arguments. No state is singular: an axis through a pole, a sleeping top, steady precession, zero spin, rest and no
gravity need no special case.

The constants belong to one energy and one momentum. Round-off would let both drift, linearly, or exponentially near a steady
precession. Each step therefore ends with the smallest change of the state that restores them. Both are measured from the
upright position, so that a top which starts within 1e-12 rad of it, falls, and stands up again loses no digits.

Alternatives on tops are slower or less accurate. `Gauss` iterates, and a Taylor series of (axis, momentum) evaluates six
products to a high order, compared with one division here. Compositions of free rotations and kicks have a truncation error and
only bound the energy error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..attitude import to_quaternion
from ..batch import Batch
from ..deferred_imports import kernels
from ..errors import BadInput
from ..features import Feature
from ..grid import Grid
from ..method import Method, Role, Run
from ..method_info import MethodInfo, Structure
from ..potentials.field import into_axes
from ..scene import Scene
from .bounds import within_round_off
from .columns import find_unit_of_time, find_units_of_moments, in_gravity_or_free, moments_of_gravity, take_pieces, turn_samples
from .many import Block, RunMany
from .principal_axes import PrincipalStart, principal_start, slow_axes, spin_rate, start_along
from .run_kernel import prepare_run
from .units import bound_rate, in_own_units

MOST_RADIANS = 1e6
"""Longest step, as the largest rotation that the energy allows, rad. Such a step loses half of the digits of the phase."""


@dataclass(frozen=True)
class Lame(Method):
    """Closed-form steps of a symmetric top in uniform gravity (centre of mass on its axis), by elliptic functions.

    The accuracy does not depend on dt: a step adds about 1e-15 rad to the attitude error. Energy, momenta and orthonormality
    are conserved to round-off, but a free body's momentum turns by 6e-19 rad a step. Steps longer than about half a period of
    nutation are divided, counted in `Counters.stages`. Steps with turns of more than 10^6 rad raise `BadInput`.

    Near the upright position round-off of the initial state grows, in every method. A top that starts d rad from there and
    falls is off by about 1e-16/d rad, or 1e-13 if its body axes are principal axes; one that passes at d later by 1e-16/d^2.

    References: F. Klein and A. Sommerfeld, Theorie des Kreisels, for alpha and beta as elliptic functions of the second kind;
    E. T. Whittaker and G. N. Watson, Modern Analysis, chapters 20 and 23, for p and Lame's equation.
    """

    family: ClassVar[str] = "lame"
    role: ClassVar[Role] = Role.OURS
    order = None
    conserves = frozenset({"energy", "vertical momentum", "axial momentum"})
    method_info: ClassVar[MethodInfo] = MethodInfo(
        many=("",),
        rank=1,
        exact=True,
        colour="olive",
        kernel="lame",
        structure=lambda method: Structure(symmetric=True, symplectic=True, imposed=True),  # up to a correction of round-off
        supports=frozenset({Feature.GRAVITY, Feature.FLIGHT}),
    )

    bounds = within_round_off

    def unsupported(self, scene: Scene) -> str | None:
        return "body and field symmetric about one axis" if scene.symmetry_axis_B is None else None

    def longest_step(self, scene: Scene) -> float:
        return MOST_RADIANS / bound_rate(scene)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Return the run of a scene. Raise `BadInput` if the step is longer than `longest_step`, s."""
        longest = self.longest_step(scene)
        if grid.dt > longest:
            raise BadInput("dt", f"{grid.dt:g}", f"a turn of {MOST_RADIANS:g} rad at most: up to {longest:g} s")
        return self._prepare(scene, grid)

    @in_own_units
    def _prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, (label, start, model) = kernels("lame"), scene.derive(convert, self)
        return prepare_run(scene, grid, label, start, kernel, model, kernel.Coefficients(grid.dt))

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        """Return the run of the supported tops in lanes; None if lanes do not support the field."""
        return prepare_lanes(self, bodies, grid) if in_gravity_or_free(bodies) else None


def convert(scene: Scene, method: Lame) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its initial state in the non-spinning frame, and the kernel's model."""
    start = principal_start(scene, "non_spinning")
    moment = start.field.z if start.field else 0.0
    return method.label, start, kernels("lame").Model(start.J[0], moment, start.q, start.L)


PART = 1.5e-8
"""Approximate time, s, of a part of a step for a body in lanes. It determines only how often a run can be stopped."""


def prepare_lanes(method: Lame, bodies: Batch, grid: Grid) -> RunMany | None:
    """Return the run of many tops (`march_lanes` of `conservative.kernels.lame`); None if no body has such a step."""
    kernel, n, time = kernels("lame"), len(bodies), find_unit_of_time(grid)
    tops, h = find_tops(method, bodies), grid.dt / time
    if tops is None:
        return None
    places, J1, J3, kappa, q0, L0, R_BP = tops
    with np.errstate(all="ignore"):  # the comparison below excludes tops whose numbers overflow
        units = find_units_of_moments(np.stack([J1, J3], axis=1))
        J1, J3, kappa, L0 = J1 / units, J3 / units, kappa / units * time * time, L0 / units[:, None] * time
        kinetic = (L0[:, 0] ** 2 + L0[:, 1] ** 2) / J1 + L0[:, 2] ** 2 / J3
        slow = h * np.sqrt((kinetic + 2 * np.abs(kappa)) / np.minimum(J1, J3)) <= MOST_RADIANS  # as in `bound_rate`
    places, J1, J3, kappa, q0, L0, R_BP = (column[slow] for column in (places, J1, J3, kappa, q0, L0, R_BP))
    k, s = len(places), grid.n_samples
    if not k:
        return None
    m = -(-k // kernel.WIDTH) * kernel.WIDTH
    table = np.empty((kernel.ROWS, m))
    kernel.prepare_lanes(J1, kappa, q0, L0, h, table)
    # Tops with equal numbers of parts per step are neighbours, so that few lanes wait.
    order = np.argsort(table[kernel.PARTS, :k], kind="stable")
    places, J1, J3, q0, L0, R_BP = (column[order] for column in (places, J1, J3, q0, L0, R_BP))
    table[:, :k] = table[:, order]
    q, L = np.empty((m, s, 4)), np.empty((m, s, 3))
    q[:k, 0], L[:k, 0] = q0, L0
    spin = np.stack([spin_rate(J1, J3, L0[:, 2]), 1 / J3], axis=1)  # the rate that the frame omits, and 1/J3
    turn = np.repeat(1 / J1 / time, 3).reshape(-1, 3), spin / time, R_BP
    cost = PART * m * float(table[kernel.PARTS].max())

    def run() -> Block:
        states = table.copy()
        take_pieces(
            grid.n_steps, cost, lambda done, last: kernel.march_lanes(states, done, last, grid.n_steps, grid.every, q, L)
        )
        return turn_samples(grid, q, L, turn, places, n)

    return run


def find_tops(method: Lame, bodies: Batch) -> tuple[Any, ...] | None:
    """Return the initial states, in the non-spinning frame, of the n tops that the method supports; None if there are none.

    They are the indices (n,) in the batch, the moments (n,) across and along the axis, kg m^2, weights times lever arms (n,),
    N m, attitudes (n, 4), scalar first, momenta (n, 3), kg m^2/s, and rotations (n, 3, 3) from the frame's to body axes.
    """
    weights, n = bodies.parameters.get("weight", np.ones(1)), len(bodies)
    one_sign = bool((weights > 0).all() or (weights < 0).all())
    if bodies.inertia is None and "com_B" not in bodies.parameters and one_sign:  # all have the same axis of symmetry
        scene = bodies.take(0)
        if method.unsupported(scene) is not None:
            return None
        axes, J1, J3 = slow_axes(scene)
        R_BP = np.tile(axes, (n, 1, 1))
        kappa = np.zeros(n) if scene.free else moments_of_gravity(bodies, R_BP)[:, 2]
        q, L = to_quaternion(bodies.R_WB0 @ R_BP), into_axes(bodies.w_WB_B0, R_BP) * (J1, J1, J3)
        return np.arange(n), np.full(n, J1), np.full(n, J3), kappa, q, L, R_BP
    tops = []
    for i in range(n):
        scene = bodies.take(i)
        if method.unsupported(scene) is None:
            axes, J1, J3 = slow_axes(scene)
            start = start_along(scene, axes, np.array((J1, J1, J3)))
            tops.append((i, J1, J3, start.field.z if start.field else 0.0, start.q, start.L, axes))
    return tuple(np.array(column) for column in zip(*tops, strict=True)) if tops else None
