"""Fields that turn at a constant rate, as gravity does about a satellite in a circular orbit.

Source: P. C. Hughes, Spacecraft Attitude Dynamics (1986), 9.2; the integral is C. G. J. Jacobi's (1836).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic import cosine, product, scale, sine
from ..attitude import Array, from_quaternion, triple
from ..check import describe, numbers, positive_number, replace_unchecked, set_fields, unit_vector
from ..errors import BadInput
from ..features import Feature, Features, features_of
from .gravity_gradient import GravityGradient
from .potential import Potential, depends_on_time

_ACROSS = 1e-9
"""Cosine of the angle to the normal at which a direction still lies in the plane of the orbit."""


@dataclass(frozen=True, eq=False, init=False)
class Orbit:
    """Axes O that turn at a constant rate, rad/s, about a normal fixed in the world, as in a circular orbit; O = W at t = 0.

    Parameters
    ----------
    rate
        rad/s, above 0.
    normal_W
        Axis of rotation (3,), right-handed, world axes; any length above 0.

    Raises
    ------
    BadInput
        rate is not a positive number, or normal_W is not finite, is 0, or has the wrong shape.
    """

    rate: float
    normal_W: Array

    def __init__(self, rate: float, normal_W: ArrayLike) -> None:
        speed = positive_number("rate", rate, "a finite rate above 0, rad/s")
        set_fields(self, rate=speed, normal_W=unit_vector("normal_W", normal_W))

    def R_WO(self, t: ArrayLike) -> Array:
        """Return the attitudes of the axes O in the world, (..., 3, 3), at times (...), s."""
        half = np.asarray(self.rate / 2 * numbers("t", t))[..., None]
        return from_quaternion(np.concatenate([np.cos(half), np.sin(half) * self.normal_W], axis=-1))

    def gravity_gradient(self, inertia: ArrayLike, direction_W: ArrayLike) -> Turning:
        """Return the gravity gradient of a planet on a satellite in this orbit.

        Parameters
        ----------
        inertia
            Inertia of the satellite: moments (3,) or tensor (3, 3), body axes, kg m^2.
        direction_W
            Direction (3,) of the planet, or the opposite direction, at t = 0, world axes. It must be perpendicular to
            `normal_W`; a relative deviation up to 1e-9 is removed.

        Raises
        ------
        BadInput
            direction_W is not perpendicular to `normal_W`; or a parameter is not finite, not positive, not an inertia, or has
            the wrong shape.
        """
        fixed = GravityGradient(self.rate, inertia, direction_W)
        nearest = fixed.direction_W - fixed.direction_W @ self.normal_W * self.normal_W
        if abs(fixed.direction_W @ self.normal_W) > _ACROSS:
            hint = f", such as {nearest.tolist()}" if np.linalg.norm(nearest) > _ACROSS else ""
            allowed = f"a direction in the plane of the orbit, at right angles to {self.normal_W.tolist()}{hint}"
            raise BadInput("direction_W", describe(fixed.direction_W.tolist()), allowed)
        return Turning(GravityGradient(self.rate, inertia, nearest), self)


class Turned(NamedTuple):
    """A field that is fixed in axes O: that field; rate, rad/s, and normal of O; the quaternion of W in O at the time."""

    field: Any
    rate: Any
    normal: Any
    back: Any

    def at_time(self, t: Any) -> Any:
        """Return the field at a time t, s."""
        half = 0.5 * self.rate * t
        return self._replace(back=(cosine(half), *scale(-sine(half), self.normal)))

    def energy(self, q: Any) -> Any:
        """Return V in J of the fixed field at the attitude in axes O."""
        return self.field.energy(product(self.back, q))

    def body_torque(self, q: Any) -> Any:
        """Return the torque in N m."""
        return self.field.body_torque(product(self.back, q))

    def find_constants(self, J_inverse: Any) -> Any:
        """Return the axes of the fixed field."""
        return self.field.find_constants(J_inverse)

    def slope(self, constants: Any, g: Any) -> Any:
        """Return V and dV/dg of the fixed field."""
        return self.field.slope(constants, g)

    def series(self, constants: Any, g: Any, series: Any) -> Any:
        """Return the recurrence of the fixed field."""
        return self.field.series(constants, g, series)


@dataclass(frozen=True, eq=False, init=False)
class Turning:
    """A field that is fixed in turning axes O: V(R_WB, t) = V_0(R_OB), R_OB = R_WO(t)' R_WB.

    The Jacobi integral E - rate n.l is conserved instead of the energy, with the normal n and the world momentum l.

    Parameters
    ----------
    potential
        V_0, a potential that does not depend on time. At t = 0 the axes O are the world axes.
    orbit
        The axes O.

    Raises
    ------
    BadInput
        potential is not a potential, or depends on time; or orbit is not an `Orbit`.
    """

    potential: Potential
    orbit: Orbit

    time_dependent: ClassVar[bool] = True
    axis_W: ClassVar[None] = None

    def __init__(self, potential: Potential, orbit: Orbit) -> None:
        if isinstance(potential, type) or depends_on_time(potential) or not isinstance(potential, Potential):
            allowed = "a potential that does not depend on the time, such as GravityGradient"
            raise BadInput("potential", describe(potential), allowed)
        if not isinstance(orbit, Orbit):
            raise BadInput("orbit", describe(orbit), "an Orbit")
        set_fields(self, potential=potential, orbit=orbit)

    @property
    def features(self) -> Features:
        """Members of `Feature` for scenes with it."""
        return features_of(self.potential) | {Feature.TURNING}

    def in_orbit(self, R_WB: Array, t: Array) -> Array:
        """Return R_OB, (..., 3, 3), of attitudes (..., 3, 3) at times (...), s."""
        return np.swapaxes(self.orbit.R_WO(t), -1, -2) @ R_WB

    def energy_at(self, R_WB: Array, t: Array) -> Array:
        """Return V, (...), in J at attitudes (..., 3, 3) and times (...), s."""
        return self.potential.energy(self.in_orbit(R_WB, t))

    def gradient_at(self, R_WB: Array, t: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J at matrices (..., 3, 3) and times (...), s."""
        return self.orbit.R_WO(t) @ self.potential.gradient(self.in_orbit(R_WB, t))

    def scale(self) -> float:
        """Return the size of the field that turns, J."""
        return self.potential.scale()

    def in_units(self, energy: float, time: float) -> Turning:
        """Return the field with energies in units of `energy`, J, and times in units of `time`, s, powers of two."""
        potential: Any = self.potential  # one with `in_units`, as `conservative.methods.units.find_units` requires
        orbit = replace_unchecked(self.orbit, rate=self.orbit.rate * time)
        return replace_unchecked(self, potential=potential.in_units(energy), orbit=orbit)

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the field as the kernels want it, in axes that the rotation R_BP (3, 3) takes to the body's, and O."""
        field = self.potential.kernel_field(R_BP)
        return Turned(field, self.orbit.rate, triple(self.orbit.normal_W), (1.0, 0.0, 0.0, 0.0))


def static_part(potential: Any) -> Any:
    """Return the potential of a `Turning` in its turning axes, and any other potential, or None, unchanged."""
    return potential.potential if isinstance(potential, Turning) else potential
