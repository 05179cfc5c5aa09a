"""Potentials: energy of a body as a function of its attitude, and the finite derivative that conserves it.

The base vectors q_j are the columns of `R_WB`, so a potential is a function of a matrix, and its gradient has the same
shape: column j of `gradient(R)` is dV/dq_j. The torque is sum_j q_j x (-dV/dq_j), world axes (the paper's (7) and (21)).
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..attitude import Array


@runtime_checkable
class Potential(Protocol):
    """What a potential offers. A frozen value; attitudes are (..., 3, 3), energies in J, gradients in J.

    There are two ways to a potential of one's own. The short one is `FunctionPotential(energy, gradient)`, two plain Python
    functions, called from the compiled loop and differentiated by differences: a thousand times slower than a compiled field.
    The fast one is a frozen class with the methods below, whose `kernel_field` returns a named tuple of its own that implements
    the functions of `conservative.kernels.fields`: follow the example of `conservative/potentials/point_to_point.py` and
    `conservative/kernels/point_fields.py`. Whatever it is, `finite_derivative` must satisfy its identity to round-off, since
    energy is conserved to no better than that.

    A potential may have one method more, `in_units(energy)`, which returns the same field with energies in units of `energy`, a
    power of two, J. With it our methods do scenes of any size, as they integrate in units in which a scene is of order one;
    without it such scenes are integrated as they are.
    """

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J; the matrix need not be a rotation, as means of rotations are not."""

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return V*, (3, 3), with sum(V* (R_1 - R_0)) = V(R_1) - V(R_0) and V* -> dV/dR as R_1 -> R_0 (paper, 21)."""

    def scale(self) -> float:
        """Return a size of V in J that is above 0 wherever the potential acts: what energy errors are relative to."""

    @property
    def axis_W(self) -> Array | None:
        """Return the unit vector (3,), world axes, about which the field is symmetric; None where there is none.

        The component of the world momentum along it is conserved.
        """

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the parameters for the compiled kernels in principal axes (see `conservative.kernels.fields`)."""


@runtime_checkable
class PotentialInTime(Protocol):
    """What a potential offers whose energy depends on the time as well: `Turning`, and functions that say so.

    Energy is then not conserved. It has no `energy` and `gradient` of the attitude alone, so that nobody takes it for a field
    that stays as it is; methods that take it say so (`conservative.Method.time_dependent`). `scale` and `kernel_field` are
    those of `Potential`. It may have `in_units(energy, time)`, with a unit of time, s, a power of two as well.
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
