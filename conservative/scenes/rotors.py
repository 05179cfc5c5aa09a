"""Gyrostats: free bodies with a rotor of constant momentum, which keep the energy and the length of J w + h.

Durations are in s, rates in rad/s, momenta in kg m^2/s. Builders raise `BadInput` for arguments that are not finite.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import rotation_about
from ..body import RigidBody
from ..check import finite_number
from ..scene import Scene

_SOURCE = "Volterra, Sur la théorie des variations des latitudes, Acta Math. 22 (1899)"


def volterra_gyrostat(t_end: float = 20.0) -> Scene:
    """Return a gyrostat whose rotor is along none of its axes, with off-diagonal inertia: Volterra's general case."""
    inertia = ((1.2, -0.1, 0.05), (-0.1, 0.9, 0.15), (0.05, 0.15, 0.7))
    return _gyrostat("volterra_gyrostat", inertia, (0.8, -0.5, 0.6), (0.6, 1.5, -0.9), t_end, 0.02)


def dual_spin_turn(rotor: float = 30.0, t_end: float = 600.0) -> Scene:
    """Return a satellite that spins about its first axis when the wheel along its third has been spun up.

    The momentum J w + h circulates about the wheel's axis. Without the wheel (`rotor=0`) it circulates about the first axis.
    """
    return _gyrostat("dual_spin_turn", (60.0, 80.0, 100.0), (0.0, 0.0, _momentum(rotor)), (0.5, 0.0, 0.02), t_end, 0.1)


def flat_spin_recovery(rotor: float = 150.0, t_end: float = 120.0) -> Scene:
    """Return a long satellite in a flat spin about its third axis, with a wheel along its first, the axis of least moment.

    The momentum J w + h circulates about the wheel's axis, which nutates. Without the wheel (`rotor=0`) it circulates about the
    third axis.
    """
    return _gyrostat("flat_spin_recovery", (20.0, 90.0, 100.0), (_momentum(rotor), 0.0, 0.0), (0.02, 0.05, 1.0), t_end, 0.05)


def stabilised_brick(rotor: float = 60.0, t_end: float = 6.0) -> Scene:
    """Return the scene `brick_flip` with a rotor along the spin, about the intermediate axis. Above 30 kg m^2/s it is stable.

    A spin w about the third axis is stable if (J3 w + h - J1 w) (J3 w + h - J2 w) > 0.
    """
    return _gyrostat("stabilised_brick", (13.0, 5.0, 10.0), (0.0, 0.0, _momentum(rotor)), (0.0, 0.05, 10.0), t_end, 0.01)


def _momentum(rotor: float) -> float:
    return finite_number("rotor", rotor, "a finite momentum, kg m^2/s")


def _gyrostat(name: str, inertia: ArrayLike, rotor: ArrayLike, rates: ArrayLike, t_end: float, dt: float) -> Scene:
    body = RigidBody(np.array(inertia), rotor)
    return Scene(name, body, rotation_about((1.0, -2.0, 0.5), 0.9), rates, t_end, dt=dt, group="gyrostat", source=_SOURCE)
