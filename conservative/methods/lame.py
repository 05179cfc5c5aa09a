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
from t -> 0; A = -db/dt with the end of the step held fixed. So no step has a truncation error, however long. The constants
p(h), p'(h), f(h), f'(h) are found once per run in twofold precision, from Laurent series and these theorems at doubled
arguments. Nothing is singular: an axis through a pole, a sleeping top, steady precession, zero spin, rest and no gravity are
ordinary states.

The constants belong to one energy and one momentum, so round-off alone would let both wander, linearly, and near a steady
precession exponentially. Each step therefore ends with the smallest change of the state that restores them.

Why not something else on tops: `Gauss` needs some thirty times the work and stays for bodies without symmetry; a Taylor
series of (axis, momentum) evaluates six products to order 20, where this takes one division and no series; compositions of free
rotations and kicks have a truncation error and bound the energy only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..attitude import Array, to_quaternion
from ..declarations import README, Candidacy, Claims
from ..deferred_imports import kernels
from ..errors import BadInput
from ..method import Grid, Method, Role, Run
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene
from ..trajectory import Bounds
from .bounds import bounds_of
from .columns import fill_columns, find_unit_of_time, find_units_of_moments, in_gravity_or_free, make_room, moments_of_gravity
from .columns import take_pieces, turn_samples
from .many import Block, Bodies, RunMany
from .non_spinning import frame_unsupported
from .principal_axes import PrincipalStart, principal_start
from .run_kernel import prepare_run
from .units import bound_rate, in_own_units

MOST_RADIANS = 1e6
"""Largest turn in a step, rad, by all the energy there is: it takes as many parts, and half of the digits of the phase."""


@dataclass(frozen=True)
class Lame(Method):
    """The exact step of a symmetric body in uniform gravity, its centre of mass on its axis; see the module for the equations.

    Accuracy does not depend on dt: one step is about 1e-15 off in attitude, and such errors add up. Energy, momenta and
    orthonormality are kept to round-off. A step longer than about half a period of nutation is taken in equal parts, which
    `Counters.stages` counts; one in which the body could turn by more than 10^6 rad is refused with `BadInput`.

    References: F. Klein and A. Sommerfeld, Theorie des Kreisels, for alpha and beta as elliptic functions of the second kind;
    E. T. Whittaker and G. N. Watson, Modern Analysis, chapters 20 and 23, for p and Lame's equation.
    """

    family: ClassVar[str] = "lame"
    role: ClassVar[Role] = Role.OURS
    candidacy: ClassVar[Candidacy] = Candidacy(1, exact=True)
    claims: ClassVar[Claims] = Claims(README)
    colour: ClassVar[str] = "olive"
    kernel: ClassVar[str] = "lame"

    @property
    def order(self) -> None:
        return None

    @property
    def conserves(self) -> frozenset[str]:
        return frozenset({"energy", "vertical momentum", "axial momentum"})

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        return bounds_of(scene, grid)

    def unsupported(self, scene: Scene) -> str | None:
        if not isinstance(scene.potential, UniformGravity | None):
            return "needs uniform gravity"
        return frame_unsupported("non_spinning", scene) and "body and field symmetric about one axis"

    def longest_step(self, scene: Scene) -> float:
        return MOST_RADIANS / bound_rate(scene)

    def prepare(self, scene: Scene, grid: Grid) -> Run:
        """Return the run of a scene, as `Method.prepare` has it.

        Raises
        ------
        BadInput
            The step is longer than `longest_step`, s.
        """
        longest = self.longest_step(scene)
        if grid.dt > longest:
            raise BadInput("dt", f"{grid.dt:g}", f"a turn of {MOST_RADIANS:g} rad at most: up to {longest:g} s")
        return self._prepare(scene, grid)

    @in_own_units
    def _prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, (label, start, model) = kernels("lame"), scene.derive(convert, self)
        return prepare_run(scene, grid, label, start, kernel, model, kernel.Coefficients(grid.dt))

    def prepare_many(self, bodies: Bodies, grid: Grid) -> RunMany | None:
        """Lanes for all tops that it has a step for."""
        return prepare_lanes(self, bodies, grid) if in_gravity_or_free(bodies) else None


def convert(scene: Scene, method: Lame) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its start in the frame that does not spin and the kernel's model of it."""
    start = principal_start(scene, "non_spinning")
    moment = start.field.z if start.field else 0.0
    return method.label, start, kernels("lame").Model(start.J[0], moment, start.q, start.L)


PART = 1.5e-8
"""Seconds that a part of a step takes for a body among many, about: only how often a run can be stopped follows from it."""


@dataclass(frozen=True, eq=False)
class Tops:
    """Starts of n tops in the frame that does not spin, as `PrincipalStart` has them, and the weight times lever arm, N m."""

    J: Array
    kappa: Array
    q: Array
    L: Array
    R_BP: Array
    spin: Array


def prepare_lanes(method: Lame, bodies: Bodies, grid: Grid) -> RunMany | None:
    """Return the run of many tops with `conservative.kernels.lame_many`; None where none of them has such a step."""
    kernel, n, s = kernels("lame_many"), len(bodies), grid.n_samples
    chosen, tops = find_tops(bodies, method, grid)
    if not len(chosen):
        return None
    time, units = find_unit_of_time(grid), find_units_of_moments(tops.J[:, None])
    J, L0, m = tops.J / units, tops.L / units[:, None] * time, -(-len(chosen) // kernel.WIDTH) * kernel.WIDTH
    table = np.empty((kernel.ROWS, m))
    most = kernel.prepare(J, tops.kappa / units * time * time, tops.q, L0, grid.dt / time, table)
    q, L = np.empty((m, s, 4)), np.empty((m, s, 3))
    q[: len(chosen), 0], L[: len(chosen), 0] = tops.q, L0
    finished = np.isin(np.arange(n), chosen)

    def run() -> Block:
        states = table.copy()

        def take(done: int, last: int) -> None:
            kernel.march(states, done, last, grid.n_steps, grid.every, q, L)

        take_pieces(grid.n_steps, PART * most * n, take)
        rates = np.repeat(1 / J / time, 3).reshape(-1, 3)
        return spread(turn_samples(grid, q, L, rates, tops.spin, tops.R_BP), finished)

    return run
