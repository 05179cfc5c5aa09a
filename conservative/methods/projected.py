"""Explicit steps of order 8, projected onto the invariants: for a body in any field, also one of Python functions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ..attitude import triple
from ..card import Card, Cost, Structure
from ..deferred_imports import kernels
from ..grid import Grid
from ..invariants import JACOBI_INTEGRAL, with_balances
from ..method import Method, Role, Run
from ..needs import Need
from ..potentials.turning import Turning
from ..scene import Scene
from .bounds import within_round_off
from .coefficients.explicit import DORMAND_PRINCE_8
from .principal_axes import PrincipalStart, field_axis, invariant_scales, principal_start
from .run_kernel import prepare_run
from .units import in_own_units


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

    For free bodies use `MoserVeselov`, which has no truncation error.
    """

    family: ClassVar[str] = "projected"
    role: ClassVar[Role] = Role.OURS
    order = DORMAND_PRINCE_8.order
    conserves = with_balances("energy", JACOBI_INTEGRAL, "vertical momentum", "momentum along the field's axis")
    card: ClassVar[Card] = Card(
        rank=2,
        group="explicit",
        cost=lambda method: Cost(step=340.0, correction=80.0),
        colour="teal",
        kernel="projected",
        structure=lambda method: Structure(symmetric=False, symplectic=False, imposed=True),
        takes=frozenset(Need) - {Need.FLIGHT},  # free flight is a free body
    )

    bounds = within_round_off

    def unsupported(self, scene: Scene) -> str | None:
        return "it is for bodies in a field" if scene.free else None

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        kernel, (label, start, model) = kernels("projected"), scene.derive(convert, self)
        find = partial(kernel.Coefficients, *DORMAND_PRINCE_8.packed, np.array(DORMAND_PRINCE_8.c))
        return prepare_run(scene, grid, label, start, kernel, model, find(grid.dt), find)


def convert(scene: Scene, method: Projected) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its initial state in principal axes, and the kernel's model."""
    start, field = principal_start(scene), scene.potential
    axis, scales = field_axis(scene), invariant_scales(scene)
    turn = triple(field.orbit.rate * field.orbit.normal_W) if isinstance(field, Turning) else None
    model = kernels("projected").Model(start.J_inverse, start.field, axis, turn, scales, start.q, start.L, start.rotor)
    return method.label, start, model
