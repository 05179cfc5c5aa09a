"""A uniform field, such as gravity near the ground. Source: definitions of any mechanics textbook."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import cross, dot, fuse, halfway, vertical
from ..attitude import Array
from ..check import finite_array, finite_number, replace_unchecked, set_fields
from ..features import Feature, Features
from .field import FieldPotential, into_axes, lengths, turned_moment

ZERO = (0.0, 0.0, 0.0)


class UniformField(NamedTuple):
    """Weight times centre of mass, N m: V is its component along the vertical (`conservative.potentials.field`)."""

    x: Any
    y: Any
    z: Any

    def energy(self, q: Any) -> Any:
        """Return V in J."""
        return dot(vertical(q), self)

    def body_torque(self, q: Any) -> Any:
        """Return the torque in N m."""
        return cross(vertical(q), self)

    def finite_torque(self, q: Any, a: Any) -> Any:
        """Return T = (M c) x (-gamma) and its derivative: c on average over the step."""
        g = vertical(q)
        m, dm = halfway(a, self)
        return cross(g, m), tuple(cross(g, column) for column in dm)

    def finite_derivative(self, q0: Any, q1: Any) -> Any:
        """Return the gradient as (c, d): V is linear in the base vectors."""
        return (0.0, 0.0, 1.0), tuple(self)

    def finite_slope(self, q0: Any, q1: Any) -> Any:
        """Return no change."""
        return (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO)

    def find_constants(self, J_inverse: Any) -> Any:
        """Return two vectors with which J^-1 (g x m) is a difference of two products."""
        return turned_moment(J_inverse, self)

    def slope(self, constants: Any, g: Any) -> Any:
        """Return V and dV/dg in J."""
        return dot(g, self), tuple(self)

    def series(self, constants: Any, g: Any, series: Any) -> Any:
        """Return the recurrence of J^-1 (g x m)."""
        M1, M2 = (series.vector(*moment) for moment in constants)
        return lambda c, n: fuse(-M1, c[n, 1], M2 * c[n, 0])

    def in_units(self, energy: Any) -> Any:
        """Return the field with energies in units of `energy`, J."""
        return UniformField(self.x / energy, self.y / energy, self.z / energy)

    def energies(self, R_WB: Any) -> Any:
        """Return V, (...), in J."""
        return dot((R_WB[..., 2, 0], R_WB[..., 2, 1], R_WB[..., 2, 2]), self)

    def scale(self) -> Any:
        """Return weight times lever arm, J."""
        return lengths(np.stack(self, axis=-1))

    def axis_W(self) -> Any:
        """Return the vertical."""
        return np.broadcast_to((0.0, 0.0, 1.0), (*np.shape(self.x), 3))


@dataclass(frozen=True, eq=False, init=False)
class UniformGravity(FieldPotential):
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

    features: ClassVar[Features] = frozenset({Feature.GRAVITY})
    NUMBERS: ClassVar[tuple[str, ...]] = ("weight", "com_B")

    @staticmethod
    def build_field(R_BP: Array | None, weight: Any, com_B: Any) -> UniformField:
        """Return the field in axes R_BP."""
        return UniformField(*np.moveaxis(into_axes(np.asarray(weight)[..., None] * com_B, R_BP), -1, 0))

    # Every run of one body calls these three. The functions of the field take 10 us each.

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J at attitudes (..., 3, 3)."""
        return R_WB[..., 2, :] @ self.moment_B

    def scale(self) -> float:
        """Return weight times lever arm, J."""
        return float(np.linalg.norm(self.moment_B))

    @property
    def axis_W(self) -> Array:
        """Return the vertical, (3,)."""
        return np.array([0.0, 0.0, 1.0])

    def in_units(self, energy: float) -> UniformGravity:
        """Return the field with energies in units of `energy`, a power of two, J."""
        return replace_unchecked(self, weight=self.weight / energy)

    @staticmethod
    def suspects(parameters: Mapping[str, Array]) -> bool:
        """Return False: any numbers (n, ...), N and m, are valid for n bodies."""
        return False
