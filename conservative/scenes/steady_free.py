"""Free bodies whose formulas degenerate: symmetric, spherical and planar ones, and spins about a principal axis.

* symmetric, J1 = J2: the axis precesses about the momentum at |L|/J1, the body turns about it at (1/J3 - 1/J1) L3
* spherical: the rates are constant in body and world
* planar, J1 + J2 = J3, as any plate has it: w1^2 + w2^2 is constant
* axis spin: the rates are constant, about whichever principal axis
"""

from __future__ import annotations

import numpy as np

from ..attitude import rotation_about
from ..body import RigidBody
from ..check import choice, finite_number, positive_number
from ..scene import Scene

DEFAULT_AXIAL = 0.8
DEFAULT_TRANSVERSE = 1.7
DEFAULT_PLATE = (0.9, 1.3)
DEFAULT_RATES = (0.6, 1.1, -0.4)
DEFAULT_SPIN = 2.0
DEFAULT_START = rotation_about((3.0, -1.0, 2.0), 1.2)
DEFAULT_T_END = 20.0
DEFAULT_DT = 0.02
SOURCE = "Euler's equations, degenerate cases"


def symmetric_body(axial: float = DEFAULT_AXIAL, transverse: float = DEFAULT_TRANSVERSE, t_end: float = DEFAULT_T_END) -> Scene:
    """Return a free body with two equal moments (transverse, transverse, axial), kg m^2.

    Raises
    ------
    BadInput
        An argument, such as t_end, s, is not a finite number above 0.
    """
    J1, J3 = positive_number("transverse", transverse), positive_number("axial", axial)
    return _free("symmetric_body", (J1, J1, J3), DEFAULT_RATES, t_end)


def spherical_body(moment: float = DEFAULT_AXIAL, t_end: float = DEFAULT_T_END) -> Scene:
    """Return a free body with three equal moments, kg m^2.

    Raises
    ------
    BadInput
        An argument, such as t_end, s, is not a finite number above 0.
    """
    J = positive_number("moment", moment)
    return _free("spherical_body", (J, J, J), DEFAULT_RATES, t_end)


def planar_body(first: float = DEFAULT_PLATE[0], second: float = DEFAULT_PLATE[1], t_end: float = DEFAULT_T_END) -> Scene:
    """Return a free plate: moments (first, second, first + second), kg m^2.

    Raises
    ------
    BadInput
        An argument, such as t_end, s, is not a finite number above 0.
    """
    J1, J2 = positive_number("first", first), positive_number("second", second)
    return _free("planar_body", (J1, J2, J1 + J2), DEFAULT_RATES, t_end)


def axis_spin(axis: int = 1, spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the plate spinning, rad/s, about its principal axis 1, 2 or 3.

    Raises
    ------
    BadInput
        axis is not 1, 2 or 3, spin is not finite, or t_end, s, is not above 0.
    """
    choice("axis", axis, (1, 2, 3))
    J1, J2 = DEFAULT_PLATE
    rates = finite_number("spin", spin, "a finite rate, rad/s") * np.eye(3)[axis - 1]
    return _free("axis_spin", (J1, J2, J1 + J2), tuple(rates), t_end)


def _free(name: str, inertia: tuple[float, float, float], rates: tuple[float, ...], t_end: float) -> Scene:
    return Scene(name, RigidBody(inertia), DEFAULT_START, rates, t_end, dt=DEFAULT_DT, group="free body", source=SOURCE)
