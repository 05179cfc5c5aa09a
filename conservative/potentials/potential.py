"""Potentials: energy of a body as a function of its attitude, and the finite derivative that conserves it.

The base vectors q_j are the columns of `R_WB`, so a potential is a function of a matrix, and its gradient has the same
shape: column j of `gradient(R)` is dV/dq_j. The torque is sum_j q_j x (-dV/dq_j), world axes, because of the
paper's (20): d/dt sum_j q_j x p_j has no other term (DERIVATION.md, 4).
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..attitude import Array


@runtime_checkable
class Potential(Protocol):
    """Base of all potentials: frozen values. Attitudes are (..., 3, 3), energies and gradients are in J.

    For a potential of your own, `FunctionPotential(energy, gradient)` with two Python functions is simple, and a thousand times
    slower than a compiled field. For speed, write a subclass of `conservative.potentials.field.FieldPotential`, which needs the
    law once. `finite_derivative` must satisfy its identity to round-off, because energy is conserved only as well as that.

    An optional method `in_units(energy)` returns the field with energies in units of `energy` (J, a power of two). Our methods
    need it to integrate very large and very small scenes in units in which they are of order one.
    """

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J. The matrix can be the mean of two rotations."""

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return V*, (3, 3), with sum(V* (R_1 - R_0)) = V(R_1) - V(R_0) and V* -> dV/dR as R_1 -> R_0 (paper, 21)."""

    def scale(self) -> float:
        """Return the reference scale of energy drifts in J, positive if the potential acts on the body."""

    @property
    def axis_W(self) -> Array | None:
        """Return the unit vector (3,) of the field's symmetry axis, world axes; None if there is none.

        The component of the world momentum along it is conserved.
        """

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the parameters for the compiled kernels in principal axes (see `conservative.kernels.fields`)."""


@runtime_checkable
class PotentialInTime(Protocol):
    """A potential whose energy also depends on time: `Turning`, and functions declared as time-dependent.

    The energy is then not conserved. There is no `energy` or `gradient` of the attitude only, so it cannot be mistaken for a
    constant field. Methods that support it take `Feature.TIME` or `Feature.TURNING`. `scale` and `kernel_field` are as in
    `Potential`. It may have `in_units(energy, time)`, with a unit of time, s, a power of two as well.
    """

    @property
    def time_dependent(self) -> bool:
        """Return True."""

    def energy_at(self, R_WB: Array, t: Array) -> Array:
        """Return V, (...), in J at attitudes (..., 3, 3) and times (...), s."""

    def gradient_at(self, R_WB: Array, t: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J at matrices (..., 3, 3) and times (...), s."""

    def scale(self) -> float:
        """Return a size of V in J that is above 0."""

    @property
    def axis_W(self) -> Array | None:
        """Return the unit vector (3,), world axes, about which the field is symmetric at all times; None without one."""

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the parameters for the compiled kernels in principal axes, which R_BP (3, 3) takes to the body's."""


AnyPotential = Potential | PotentialInTime


def depends_on_time(potential: object) -> bool:
    """Return whether the energy of a potential, or of None, depends on the time as well as on the attitude."""
    return bool(getattr(potential, "time_dependent", False))


def energy_at(potential: AnyPotential, R_WB: Array, t: Array) -> Array:
    """Return V, (...), in J of any potential at attitudes (..., 3, 3) and times (...), s."""
    of_any_kind: Any = potential
    return of_any_kind.energy_at(R_WB, t) if depends_on_time(potential) else of_any_kind.energy(R_WB)


def torque_W(potential: AnyPotential, R_WB: Array, t: Array | None = None) -> Array:
    """Return the torque (..., 3) about the fixed point, N m, world axes.

    Attitudes (..., 3, 3) are body to world, times (...) in s, of a potential that depends on the time.
    """
    of_any_kind: Any = potential
    gradient = of_any_kind.gradient_at(R_WB, t) if depends_on_time(potential) else of_any_kind.gradient(R_WB)
    return -np.sum(np.cross(R_WB, gradient, axisa=-2, axisb=-2, axisc=-2), axis=-1)
