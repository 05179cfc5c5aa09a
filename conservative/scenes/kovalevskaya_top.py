"""The Kovalevskaya top: J1 = J2 = 2 J3, centre of mass in the plane of the equal moments, and a fourth integral.

With gamma = R_WB' e_z and k = weight com / J3,

    K = (w1^2 - w2^2 - k gamma1)^2 + (2 w1 w2 - k gamma2)^2

is constant: of degree four, so that methods which keep energy and momentum do not keep it.
"""

from __future__ import annotations

import numpy as np

from ..attitude import Array
from ..body import RigidBody
from ..check import positive_number
from ..invariants import Invariant
from ..potentials.uniform_gravity import UniformGravity
from ..scene import Scene

DEFAULT_AXIAL = 1.0
DEFAULT_MOMENT = 1.0
DEFAULT_RATES = (0.5, 1.0, 2.0)
DEFAULT_T_END = 30.0
DEFAULT_DT = 0.02


def kovalevskaya_top(axial: float = DEFAULT_AXIAL, moment: float = DEFAULT_MOMENT, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the top with moments (2 axial, 2 axial, axial), kg m^2, and weight times lever arm `moment`, N m.

    Raises
    ------
    BadInput
        An argument, such as t_end, s, is not a finite number above 0.
    """
    J3 = positive_number("axial", axial)
    k = positive_number("moment", moment) / J3
    return Scene(
        "kovalevskaya_top",
        RigidBody((2 * J3, 2 * J3, J3)),
        np.eye(3),
        DEFAULT_RATES,
        t_end,
        UniformGravity(moment, (1, 0, 0)),
        dt=DEFAULT_DT,
        extra_invariants=(kovalevskaya_integral(k, DEFAULT_RATES),),
        group="top",
        source="Kovalevskaya 1889",
    )


def kovalevskaya_integral(k: float, w0: tuple[float, float, float]) -> Invariant:
    """Return K, 1/s^4, of a top with k = weight com / J3, 1/s^2, along its 1-axis; `w0`, rad/s, gives the scale."""

    def evaluate(R_WB: Array, w_WB_B: Array) -> Array:
        gamma, w = R_WB[..., 2, :], w_WB_B
        real = w[..., 0] ** 2 - w[..., 1] ** 2 - k * gamma[..., 0]
        imaginary = 2 * w[..., 0] * w[..., 1] - k * gamma[..., 1]
        return real**2 + imaginary**2

    return Invariant("Kovalevskaya integral", "1/s^4", (w0[0] ** 2 + w0[1] ** 2 + k) ** 2, evaluate)
