"""The gradient of gravity, as a satellite feels it. Source: P. C. Hughes, Spacecraft Attitude Dynamics (1986), 9.3."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import Array, triple
from ..body import RigidBody
from ..check import build_unchecked, positive_number, set_fields
from .direction import unit_vector
from .varied import VariedGradient, fill


@dataclass(frozen=True, eq=False, init=False)
class GravityGradient:
    """Gravity gradient of a distant centre on a body that rotates about its centre of mass: V = 3/2 rate^2 u'J u, u = R' e.

    This is the second-order term in size over distance (Hughes, Spacecraft Attitude Dynamics, 9.3). The torque in body axes is
    3 rate^2 u x J u. The direction e to the centre is fixed in the world; for a satellite use `Orbit.gravity_gradient`.

    Parameters
    ----------
    rate
        sqrt(G M / r^3), rad/s, positive: the rate of a circular orbit at the distance r.
    inertia
        That of the body: moments (3,) or the tensor (3, 3) in body axes, kg m^2.
    direction_W
        Direction (3,) of the centre, world axes; any length above 0.

    Raises
    ------
    BadInput
        A parameter is not finite, not positive, not an inertia, or has the wrong shape.
    """

    rate: float
    inertia: Array
    direction_W: Array

    def __init__(self, rate: float, inertia: ArrayLike, direction_W: ArrayLike = (0, 0, 1)) -> None:
        set_fields(
            self,
            rate=positive_number("rate", rate, "a finite rate above 0, rad/s"),
            inertia=RigidBody(inertia).inertia,
            direction_W=unit_vector("direction_W", direction_W),
        )

    @property
    def factor(self) -> float:
        """Return 3 rate^2, 1/s^2: what u x J u is multiplied by."""
        return 3 * self.rate**2

    def _towards(self, R_WB: Array) -> Array:
        """Return u = R' e, (..., 3)."""
        return np.swapaxes(R_WB, -1, -2) @ self.direction_W

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""
        u = self._towards(R_WB)
        return self.factor / 2 * np.sum(u @ self.inertia * u, axis=-1)

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR = 3 rate^2 e (J u)', (..., 3, 3), in J."""
        return self.factor * self.direction_W[:, None] * (self._towards(R_WB) @ self.inertia)[..., None, :]

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return V*, (..., 3, 3), in J: the gradient at the mean, exact for a quadratic V."""
        return self.gradient((R_0 + R_1) / 2)

    def scale(self) -> float:
        """Return the largest V, J."""
        return self.factor / 2 * float(np.linalg.eigvalsh(self.inertia)[-1])

    def in_units(self, energy: float) -> GravityGradient:
        """Return the field with energies in units of `energy`, a power of two, J."""
        inertia = self.inertia / energy
        return build_unchecked(GravityGradient, rate=self.rate, inertia=inertia, direction_W=self.direction_W)

    @property
    def axis_W(self) -> Array:
        """Return the direction of the centre, (3,)."""
        return self.direction_W

    def vary(self, parameters: Mapping[str, Array]) -> VariedGradient:
        """Return the fields of n bodies with these numbers (n, ...), rad/s, kg m^2 and of no unit, in place of its own."""
        rates, inertia, directions_W = fill(self, parameters, "rate", "inertia", "direction_W")
        return VariedGradient(3 * rates**2, inertia, directions_W)

    def kernel_field(self, R_BP: Array) -> Any:
        """Return 3 rate^2 J in principal axes, row by row, and the direction as the kernels want them."""
        from ..kernels.gradient_field import Gradient

        first, second, third = self.factor * (R_BP.T @ self.inertia @ R_BP)
        return Gradient(triple(first), triple(second), triple(third), triple(self.direction_W))
