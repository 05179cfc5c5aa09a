"""The paper's cone out of steady precession: its axis nutates, and draws cusps, loops or waves.

Between the two tilts at which it turns back the axis precesses at phidot = (Lz - L3 cos(tilt)) / (J1 sin(tilt)^2). Let go at
the upper one, it precesses faster further down, so that the sign of the rate at release decides the figure:

    0           cusps
    against it  loops
    along it    waves (unduloid), as long as it is below the steady rate

Each can be told `slow` times slower; see `slow_motion`.
"""

from __future__ import annotations

import math

import numpy as np

from ..check import finite_number
from ..errors import BadInput
from ..scene import Scene
from .lagrange_top import DEFAULT_TILT, lagrange_top
from .slow_motion import slow_motion

DEFAULT_DISTURBANCE = (0.003, 0.001, 0.0)
DEFAULT_LOOP_RATE = -4.0
DEFAULT_WAVE_RATE = 4.0
DEFAULT_T_END = 2.0
DEFAULT_DT = 0.0025


def nutating_top(t_end: float = DEFAULT_T_END, slow: float = 1.0) -> Scene:
    """Return the paper's top with (0.003, 0.001, 0) kg m^2/s, body axes, added to its momentum at the start.

    Raises
    ------
    BadInput
        t_end, s, or slow is not a finite number above 0.
    """
    steady = lagrange_top(t_end=t_end)
    rates = steady.w_WB_B0 + steady.body.inverse @ np.array(DEFAULT_DISTURBANCE)
    top = steady.rename("nutating_top", w_WB_B0=rates, dt=DEFAULT_DT, source="Krenk & Nielsen, 5.2, disturbed")
    return slow_motion(top, slow)


def cusped_top(t_end: float = DEFAULT_T_END, slow: float = 1.0) -> Scene:
    """Return the paper's top let go with its axis at rest: the axis draws cusps.

    Raises
    ------
    BadInput
        t_end, s, or slow is not a finite number above 0.
    """
    return _release("cusped_top", 0.0, t_end, slow)


def looping_top(precession: float = DEFAULT_LOOP_RATE, t_end: float = DEFAULT_T_END, slow: float = 1.0) -> Scene:
    """Return the paper's top let go with its axis precessing backwards, rad/s: the axis draws loops.

    Raises
    ------
    BadInput
        precession is not below 0, or t_end, s, or slow is not above 0.
    """
    if finite_number("precession", precession, "a finite rate below 0, rad/s") >= 0:
        raise BadInput("precession", precession, "a finite rate below 0, rad/s")
    return _release("looping_top", precession, t_end, slow)


def unduloid_top(precession: float = DEFAULT_WAVE_RATE, t_end: float = DEFAULT_T_END, slow: float = 1.0) -> Scene:
    """Return the paper's top let go with its axis precessing forwards, rad/s, more slowly than steadily: it draws waves.

    Raises
    ------
    BadInput
        precession is not between 0 and the steady rate of 10 rad/s, or t_end, s, or slow is not above 0.
    """
    if not 0 < finite_number("precession", precession, "a rate between 0 and 10, rad/s") < 10:
        raise BadInput("precession", precession, "a rate between 0 and 10, rad/s")
    return _release("unduloid_top", precession, t_end, slow)


def _release(name: str, precession: float, t_end: float, slow: float) -> Scene:
    """The top with the spin L3/J3 of the steady one, its tilt stationary, precessing at a rate of its own."""
    steady = lagrange_top(t_end=t_end)
    rates = (0.0, precession * math.sin(DEFAULT_TILT), steady.w_WB_B0[2])
    top = steady.rename(name, w_WB_B0=rates, dt=DEFAULT_DT, source="Goldstein, Classical Mechanics, 5.7")
    return slow_motion(top, slow)
