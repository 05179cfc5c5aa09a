"""Bodies from simple shapes: mass, centre of mass and inertia of homogeneous solids.

    top = shapes.cone(radius=0.05, height=0.1, density=2700).about(com_B=(0, 0, 0.075))     # standing on its tip
    scene = Scene("top", top.body, R_WB0, w_WB_B0, t_end, top.gravity(9.81))

The centre of mass of a shape is its fixed point and its own axes S are the body axes. `rotate` and `about` change that. Each
shape takes either its `mass`, kg, or its `density`, kg/m^3, and raises `BadInput` for lengths, masses and densities that are
not finite numbers above 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .attitude import Array
from .body import RigidBody
from .check import describe, finite_array, finite_number, positive_number, rotation, set_fields
from .errors import BadInput
from .potentials.uniform_gravity import UniformGravity

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_SIZES = "three finite lengths (3,) above 0, m"
_LENGTH = "a finite length above 0, m"


@dataclass(frozen=True, eq=False, init=False)
class MassDistribution:
    """Mass, centre of mass, and inertia about the centre of mass.

    Parameters
    ----------
    mass
        Mass, kg.
    com_B
        Centre of mass (3,) from the fixed point, m, body axes.
    inertia_com
        Inertia (3, 3), or principal moments (3,), about the centre of mass, kg m^2, body axes.

    Raises
    ------
    BadInput
        The mass is not a positive number, `com_B` is not three finite numbers, or the inertia is not valid for `RigidBody`.
    """

    mass: float
    com_B: Array
    inertia_com: Array

    def __init__(self, mass: float, com_B: ArrayLike, inertia_com: ArrayLike) -> None:
        set_fields(
            self,
            mass=positive_number("mass", mass, "a finite mass above 0, kg"),
            com_B=finite_array("com_B", com_B, ((3,),), "three finite numbers (3,), m"),
            inertia_com=RigidBody(inertia_com).inertia,
        )

    @property
    def inertia(self) -> Array:
        """Inertia (3, 3) about the fixed point, kg m^2, body axes: J = J_com + m (c.c 1 - c c') (Steiner)."""
        c = self.com_B
        return self.inertia_com + self.mass * (c @ c * np.eye(3) - np.outer(c, c))

    @property
    def body(self) -> RigidBody:
        """The body that turns about the fixed point."""
        return RigidBody(self.inertia)

    def gravity(self, g: float = 9.81) -> UniformGravity:
        """Return uniform gravity on this mass with the downward acceleration `g`, m/s^2."""
        return UniformGravity(self.mass * finite_number("g", g, "a finite acceleration, m/s^2"), self.com_B)

    def rotate(self, R_BS: ArrayLike | Rotation) -> MassDistribution:
        """Return the distribution rotated by `R_BS` (3, 3), which maps its present axes S to body axes."""
        R = rotation("R_BS", R_BS)
        inertia_com = R @ self.inertia_com @ R.T
        return MassDistribution(self.mass, R @ self.com_B, (inertia_com + inertia_com.T) / 2)  # symmetric in spite of rounding

    def about(self, com_B: ArrayLike) -> MassDistribution:
        """Return the distribution with its centre of mass `com_B` (3,) from the fixed point, m, body axes."""
        return MassDistribution(self.mass, com_B, self.inertia_com)


def box(size: ArrayLike, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid box with edges `size` (3,), m, along its axes.

    J = m/12 (b^2 + c^2, c^2 + a^2, a^2 + b^2) for edges a, b, c, from the second moments a^2/12 of an interval.
    """
    a, b, c = _lengths("size", size)
    return _solid(_mass(a * b * c, mass, density), (a * a / 12, b * b / 12, c * c / 12))


def ellipsoid(semi_axes: ArrayLike, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid ellipsoid with `semi_axes` (3,), m, along its axes.

    J = m/5 (b^2 + c^2, c^2 + a^2, a^2 + b^2).
    """
    a, b, c = _lengths("semi_axes", semi_axes)
    return _solid(_mass(4 / 3 * math.pi * a * b * c, mass, density), (a * a / 5, b * b / 5, c * c / 5))


def cylinder(radius: float, height: float, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid cylinder about its third axis, with `radius` and `height` in m.

    J1 = J2 = m/12 (3 r^2 + h^2), J3 = m r^2/2.
    """
    r, h = positive_number("radius", radius, _LENGTH), positive_number("height", height, _LENGTH)
    return _solid(_mass(math.pi * r * r * h, mass, density), (r * r / 4, r * r / 4, h * h / 12))


def cone(radius: float, height: float, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid circular cone about its third axis, with the `radius` of its base and its `height` in m.

    The tip is 3/4 of the height below the centre of mass and the base 1/4 above it. `about((0, 0, 3/4 height))` moves the fixed
    point to the tip. J1 = J2 = 3/80 m (4 r^2 + h^2), J3 = 3/10 m r^2 about the centre of mass.
    """
    r, h = positive_number("radius", radius, _LENGTH), positive_number("height", height, _LENGTH)
    return _solid(_mass(math.pi / 3 * r * r * h, mass, density), (3 / 20 * r * r, 3 / 20 * r * r, 3 / 80 * h * h))


SHAPES: dict[str, Callable[..., MassDistribution]] = {"box": box, "cylinder": cylinder, "cone": cone, "ellipsoid": ellipsoid}
"""Shapes by their names in scene files."""


def _solid(mass: float, second: tuple[float, float, float]) -> MassDistribution:
    """Return a solid from the means of x^2, y^2, z^2 about its centre, m^2: J1 = m (<y^2> + <z^2>) and so on."""
    x, y, z = second
    return MassDistribution(mass, np.zeros(3), mass * np.array([y + z, z + x, x + y]))


def _lengths(argument: str, value: ArrayLike) -> list[float]:
    lengths = finite_array(argument, value, ((3,),), _SIZES)
    if lengths.min() <= 0:
        raise BadInput(argument, describe(lengths.tolist()), _SIZES)
    return lengths.tolist()


def _mass(volume: float, mass: float | None, density: float | None) -> float:
    if mass is not None and density is not None:
        raise BadInput("density", f"{describe(density)} together with mass = {describe(mass)}", "mass or density, not both")
    if mass is not None:
        return positive_number("mass", mass, "a finite mass above 0, kg")
    if density is None:
        raise BadInput("mass", "neither mass nor density", "mass, kg, or density, kg/m^3")
    return volume * positive_number("density", density, "a finite density above 0, kg/m^3")
