"""Free bodies on and beside the separatrix: the polhode L^2 = 2 E J_mid through the unstable axis.

Beside it reversals come after a time that grows like log(1/disturbance) and errors grow by 1/disturbance with each; on it the
motion tends to the unstable axis and never turns over, so that in any rounded arithmetic what follows is round-off.
On the separatrix itself, with a and c the axes of the largest and the smallest moment and b the one between,

    w_a = W_a sech(k t)     w_c = W_c sech(k t)     w_b = spin tanh(k t)     J_a (J_a - J_b) W_a^2 = J_c (J_b - J_c) W_c^2
"""

from __future__ import annotations

import math

import numpy as np

from ..body import RigidBody
from ..check import finite_number
from ..scene import Scene
from .brick_flip import DEFAULT_DT, DEFAULT_INERTIA, DEFAULT_SPIN, brick_flip

DEFAULT_DISTURBANCE = 1e-6
DEFAULT_NEAR_T_END = 20.0
DEFAULT_T_END = 6.0
DEGENERATE_INERTIA = (2.0, 3.0, 3.0)
SOURCE = "separatrix of Euler's equations"


def near_separatrix(
    disturbance: float = DEFAULT_DISTURBANCE, spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_NEAR_T_END
) -> Scene:
    """Return the paper's brick with a disturbance (rad/s) far smaller than the paper's 0.05.

    First reversals, s: 4.351845, 7.227773, 10.103701, 12.979629 for disturbances of 1e-3, 1e-6, 1e-9, 1e-12.

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    return brick_flip(disturbance, spin, t_end).rename("near_separatrix", source="Krenk & Nielsen, 5.1, disturbed less")


def unstable_spin(spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the paper's brick exactly on its unstable axis: a steady spin (rad/s) that any round-off ends.

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    return brick_flip(0.0, spin, t_end).rename("unstable_spin", source=SOURCE)


def separatrix(spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END) -> Scene:
    """Return the paper's brick on the separatrix, started half-way between the two steady spins +-spin (rad/s).

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    Ja, Jc, Jb = DEFAULT_INERTIA
    speed = finite_number("spin", spin, "a finite rate, rad/s")
    Wa = speed * math.sqrt(Jb * (Jb - Jc) / (Ja * (Ja - Jc)))
    Wc = speed * math.sqrt(Jb * (Ja - Jb) / (Jc * (Ja - Jc)))
    return brick_flip(t_end=t_end).rename("separatrix", w_WB_B0=(Wa, Wc, 0.0), source=SOURCE)


def degenerate_separatrix(disturbance: float = 0.0, spin: float = DEFAULT_SPIN, t_end: float = DEFAULT_T_END) -> Scene:
    """Return a body with moments (2, 3, 3) spinning about its 3-axis, rad/s: every axis of the equal pair is a steady spin.

    A disturbance about the 1-axis makes the spin axis drift at a constant rate instead of turning over.

    Raises
    ------
    BadInput
        An argument is not finite, or t_end, s, is not above 0.
    """
    rates = (
        finite_number("disturbance", disturbance, "a finite rate, rad/s"),
        0.0,
        finite_number("spin", spin, "a finite rate, rad/s"),
    )
    return Scene(
        "degenerate_separatrix",
        RigidBody(DEGENERATE_INERTIA),
        np.eye(3),
        rates,
        t_end,
        dt=DEFAULT_DT,
        group="free body",
        source=SOURCE,
    )
