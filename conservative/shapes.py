"""Bodies from simple shapes: mass, centre of mass and inertia of homogeneous solids, turned and moved where they belong.

    top = shapes.cone(radius=0.05, height=0.1, density=2700).about(com_B=(0, 0, 0.075))     # standing on its tip
    scene = Scene("top", top.body, R_WB0, w_WB_B0, t_end, top.gravity(9.81))

A shape comes with its centre of mass as the fixed point, in its own axes S; `rotate` says how they lie in the body. Source of
the moments: textbook integrals, each beside its shape.
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
        """Return uniform gravity on this mass with the downward acceleration `g`, m/s^2.

        Raises
        ------
        BadInput
            g is not a finite number.
        """
        return UniformGravity(self.mass * finite_number("g", g, "a finite acceleration, m/s^2"), self.com_B)

    def rotate(self, R_BS: ArrayLike | Rotation) -> MassDistribution:
        """Return the distribution whose axes so far, S, lie in the body as `R_BS`, a rotation (3, 3), says.

        Raises
        ------
        BadInput
            R_BS is not a rotation.
        """
        R = rotation("R_BS", R_BS)
        inertia_com = R @ self.inertia_com @ R.T
        return MassDistribution(self.mass, R @ self.com_B, (inertia_com + inertia_com.T) / 2)

    def about(self, com_B: ArrayLike) -> MassDistribution:
        """Return the distribution with its centre of mass `com_B` (3,), m, body axes, from the fixed point.

        Raises
        ------
        BadInput
            com_B is not three finite numbers.
        """
        return MassDistribution(self.mass, com_B, self.inertia_com)


def box(size: ArrayLike, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid box with edges `size` (3,), m, along its axes.

    J = m/12 (b^2 + c^2, c^2 + a^2, a^2 + b^2) for edges a, b, c, from the second moments a^2/12 of an interval.

    Parameters
    ----------
    size
        Edges (3,), m.
    mass, density
        One of them: mass in kg, or density in kg/m^3.

    Raises
    ------
    BadInput
        A length, the mass or the density is not a finite number above 0; mass and density are both given, or neither.
    """
    a, b, c = _lengths("size", size)
    return _solid(_mass(a * b * c, mass, density), (a * a / 12, b * b / 12, c * c / 12))


def ellipsoid(semi_axes: ArrayLike, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid ellipsoid with half its diameters `semi_axes` (3,), m, along its axes; a ball where they are equal.

    J = m/5 (b^2 + c^2, c^2 + a^2, a^2 + b^2).

    Parameters
    ----------
    semi_axes
        Semi-axes (3,), m.
    mass, density
        One of them: mass in kg, or density in kg/m^3.

    Raises
    ------
    BadInput
        A length, the mass or the density is not a finite number above 0; mass and density are both given, or neither.
    """
    a, b, c = _lengths("semi_axes", semi_axes)
    return _solid(_mass(4 / 3 * math.pi * a * b * c, mass, density), (a * a / 5, b * b / 5, c * c / 5))


def cylinder(radius: float, height: float, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid cylinder about its third axis.

    J1 = J2 = m/12 (3 r^2 + h^2), J3 = m r^2/2.

    Parameters
    ----------
    radius, height
        Lengths, m.
    mass, density
        One of them: mass in kg, or density in kg/m^3.

    Raises
    ------
    BadInput
        A length, the mass or the density is not a finite number above 0; mass and density are both given, or neither.
    """
    r, h = positive_number("radius", radius, _LENGTH), positive_number("height", height, _LENGTH)
    return _solid(_mass(math.pi * r * r * h, mass, density), (r * r / 4, r * r / 4, h * h / 12))


def cone(radius: float, height: float, *, mass: float | None = None, density: float | None = None) -> MassDistribution:
    """Return a solid circular cone about its third axis.

    The tip is 3/4 of the height below the centre of mass along that axis, and the base is 1/4 above it. `about((0, 0, 3/4
    height))` moves the fixed point to the tip. J1 = J2 = 3/80 m (4 r^2 + h^2), J3 = 3/10 m r^2 about the centre of mass.

    Parameters
    ----------
    radius, height
        Radius of the base, and distance from tip to base, m.
    mass, density
        One of them: mass in kg, or density in kg/m^3.

    Raises
    ------
    BadInput
        A length, the mass or the density is not a finite number above 0; mass and density are both given, or neither.
    """
    r, h = positive_number("radius", radius, _LENGTH), positive_number("height", height, _LENGTH)
    return _solid(_mass(math.pi / 3 * r * r * h, mass, density), (3 / 20 * r * r, 3 / 20 * r * r, 3 / 80 * h * h))


SHAPES: dict[str, Callable[..., MassDistribution]] = {"box": box, "cylinder": cylinder, "cone": cone, "ellipsoid": ellipsoid}
"""Shapes by the name that a scene file gives them."""


def _solid(mass: float, second: tuple[float, float, float]) -> MassDistribution:
    """Return a solid from its mean squares of x, y, z about its centre, m^2: J1 = m (<y^2> + <z^2>) and so on."""
    x, y, z = second
    return MassDistribution(mass, np.zeros(3), mass * np.array([y + z, z + x, x + y]))


def _lengths(argument: str, value: ArrayLike) -> list[float]:
    lengths = finite_array(argument, value, ((3,),), _SIZES)
    if lengths.min() <= 0:
        raise BadInput(argument, describe(lengths.tolist()), _SIZES)
    return lengths.tolist()


def _mass(volume: float, mass: float | None, density: float | None) -> float:
    if mass is not None and density is not None:
        raise BadInput("density", f"{describe(density)} beside mass = {describe(mass)}", "mass or density, not both")
    if mass is not None:
        return positive_number("mass", mass, "a finite mass above 0, kg")
    if density is None:
        raise BadInput("mass", "neither mass nor density", "one of them: mass, kg, or density, kg/m^3")
    return volume * positive_number("density", density, "a finite density above 0, kg/m^3")
