"""A uniform field, such as gravity near the ground. Source: definitions of any mechanics textbook."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array
from ..check import build_unchecked, finite_array, finite_number, set_fields
from .varied import VariedGravity, fill


@dataclass(frozen=True, eq=False, init=False)
class UniformGravity:
    """A uniform field along the world's -z axis: V = weight (R_WB com_B).e_z.

    Parameters
    ----------
    weight
        m g, N; negative values reverse the field.
    com_B
        Centre of mass (3,) from the fixed point, m, body axes.

    Raises
    ------
    BadInput
        A parameter is not finite or of another shape.
    """

    weight: float
    com_B: Array

    def __init__(self, weight: float, com_B: ArrayLike) -> None:
        set_fields(
            self,
            weight=finite_number("weight", weight, "a finite number, N"),
            com_B=finite_array("com_B", com_B, ((3,),), "three finite numbers (3,), m"),
        )

    @property
    def moment_B(self) -> Array:
        """Weight times centre of mass (3,), N m, body axes. The motion depends on nothing else."""
        return self.weight * self.com_B

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""
        return R_WB[..., 2, :] @ self.moment_B

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J: constant, with `moment_B` in its last row."""
        out = np.zeros(np.shape(R_WB))
        out[..., 2, :] = self.moment_B
        return out

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return V*, (3, 3), in J: the gradient, which is exact because V is linear in the base vectors."""
        return self.gradient(R_0)

    @property
    def axis_W(self) -> Array:
        """Return the vertical, (3,)."""
        return np.array([0.0, 0.0, 1.0])

    def scale(self) -> float:
        """Return weight times lever arm, J."""
        return float(np.linalg.norm(self.moment_B))

    def in_units(self, energy: float) -> UniformGravity:
        """Return the field with energies in units of `energy`, a power of two, J."""
        return build_unchecked(UniformGravity, weight=self.weight / energy, com_B=self.com_B)

    def vary(self, parameters: Mapping[str, Array]) -> VariedGravity:
        """Return the fields of n bodies with these numbers (n, ...), N and m, in place of its own."""
        weights, coms_B = fill(self, parameters, "weight", "com_B")
        return VariedGravity(weights[:, None] * coms_B)

    @staticmethod
    def suspects(parameters: Mapping[str, Array]) -> bool:
        """Return which of n bodies' numbers (n, ...), N and m, might not be taken as they are: none."""
        return False

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the moment in principal axes as the kernels want it."""
        from ..kernels.fields import Uniform

        return Uniform(*(self.moment_B @ R_BP))
