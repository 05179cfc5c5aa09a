"""Explicit steps of order 8, projected onto the invariants: for a body in any field, also one of Python functions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ..attitude import Array, triple
from ..check import positive_number
from ..deferred_imports import kernels
from ..features import Feature
from ..grid import Grid
from ..invariants import JACOBI_INTEGRAL, with_balances
from ..method import Method, Role, Run
from ..method_info import Cost, MethodInfo, Structure
from ..potentials.turning import Turning
from ..scene import Scene
from ..trajectory import Bounds, Trajectory, cut_at_failure
from .adaptive import MOST_TRIES, run_adaptively, trajectory_of, walk
from .bounds import within_round_off
from .coefficients.explicit import DORMAND_PRINCE_8
from .principal_axes import PrincipalStart, field_axis, invariant_scales, principal_start
from .run_kernel import prepare_run
from .units import SI, convert_scene, find_units, in_own_units


@dataclass(frozen=True)
class Projected(Method):
    """Dormand and Prince's explicit method of order 8 on quaternion and momentum, each step projected onto the invariants.

    Each step is projected onto energy, momentum about the field's axis and orthonormality, which are conserved to round-off
    (Hairer, Lubich & Wanner, Geometric Numerical Integration, IV.4). The method is neither symmetric in time nor symplectic,
    and its steps must be well below the period of the fastest rotation. It is explicit: a step costs twelve evaluations of the
    torque and little more. Near a steady precession, where energy and momentum depend on each other, the projection restores
    them only to the square of the step's error.

    Fields may depend on time. In a turning field the Jacobi integral replaces the energy. In a field given as functions of
    attitude and time no energy is conserved.

    With a tolerance, steps have any length, and dt is only the distance of samples. A corner or a jump of a function of Python,
    at a time that depends on the motion, then costs some dozen short steps. Each step is computed twice, the second time as two
    of half its length, and repeated with a shorter length until both agree (`conservative.methods.adaptive`).

    For free bodies use `MoserVeselov`, which has no truncation error.

    Parameters
    ----------
    tolerance
        None for the steps of the grid. Otherwise the largest local error of a step, rad, and relative to the largest momentum
        that the energy allows.

    Raises
    ------
    BadInput
        tolerance is not a positive number or None.
    """

    tolerance: float | None = None

    family: ClassVar[str] = "projected"
    role: ClassVar[Role] = Role.OURS
    conserves = with_balances("energy", JACOBI_INTEGRAL, "vertical momentum", "momentum along the field's axis")
    method_info: ClassVar[MethodInfo] = MethodInfo(
        rank=2,
        group="explicit",
        cost=lambda method: Cost(step=340.0, correction=80.0),
        colour="teal",
        kernel="projected",
        structure=lambda method: Structure(symmetric=False, symplectic=False, imposed=True),
        supports=frozenset(Feature) - {Feature.FLIGHT},  # free flight is a free body
    )

    def __post_init__(self) -> None:
        if self.tolerance is not None:
            positive_number("tolerance", self.tolerance, "a finite number above 0, or None")

    @property
    def order(self) -> int | None:
        return DORMAND_PRINCE_8.order if self.tolerance is None else None

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        # A try has three steps. Long motions can take more, but round-off grows with the root of their number only.
        return within_round_off(self, scene, grid, n_steps=None if self.tolerance is None else grid.n_steps + 3 * MOST_TRIES)

    def unsupported(self, scene: Scene) -> str | None:
        return "it is for bodies in a field" if scene.free else None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, (label, start, model) = kernels("projected"), scene.derive(convert, self)
        find = partial(kernel.Coefficients, *DORMAND_PRINCE_8.packed, np.array(DORMAND_PRINCE_8.c))
        if self.tolerance is not None:
            return run_adaptively(scene, grid, label, start, model, find, self.tolerance)
        return prepare_run(scene, grid, label, start, kernel, model, find(grid.dt), find)

    def solve_at(self, scene: Scene, grid: Grid, t: Array) -> Trajectory:
        """Return the checked trajectory with samples at increasing times t (n,), s, of a run with a tolerance.

        The grid of a run of the same length has the bounds.
        """
        units = find_units(scene, grid.dt)
        other = scene.derive(convert_scene, units)
        kernel, (label, start, model) = kernels("projected"), other.derive(convert, self)
        find = partial(kernel.Coefficients, *DORMAND_PRINCE_8.packed, np.array(DORMAND_PRINCE_8.c))
        assert self.tolerance is not None
        first = t[0] == 0
        times = t / units.time if first else np.append(0.0, t / units.time)
        run = trajectory_of(other, label, start, walk(other, model, find, self.tolerance, times))
        run = run if units is SI else units.restore(run, scene, Grid(grid.dt, len(times)))
        kept = slice(0 if first else 1, len(run))
        supplied = None if run.supplied is None else run.supplied[kept]
        samples: dict[str, Any] = {"t": t[: len(run.t[kept])].copy(), "R_WB": run.R_WB[kept], "w_WB_B": run.w_WB_B[kept]}
        run = replace(run, scene=scene, supplied=supplied, **samples)
        return cut_at_failure(run, self.conserves, self.bounds(scene, grid))


def convert(scene: Scene, method: Projected) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its initial state in principal axes, and the kernel's model."""
    start, field = principal_start(scene), scene.potential
    axis, scales = field_axis(scene), invariant_scales(scene)
    turn = triple(field.orbit.rate * field.orbit.normal_W) if isinstance(field, Turning) else None
    model = kernels("projected").Model(start.J_inverse, start.field, axis, turn, scales, start.q, start.L, start.rotor)
    return method.label, start, model
