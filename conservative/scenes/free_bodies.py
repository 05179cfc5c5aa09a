"""Free bodies: the brick of Krenk & Nielsen, motions near the separatrix, degenerate bodies, and the test boxes of engines.

Durations `t_end` are in s, rates in rad/s, moments in kg m^2. Builders raise `BadInput` for arguments that are not finite or
out of range.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import rotation_about
from ..body import RigidBody
from ..check import choice, finite_number, positive_number
from ..errors import BadInput
from ..scene import Scene
from ..shapes import MassDistribution, box
from .transforms import slow_motion, turned

_BRICK = (13.0, 5.0, 10.0)
"""Moments of the brick (Krenk & Nielsen, 5.1), kg m^2."""
_PLATE = (0.9, 1.3)
"""Moments of the plate in its plane, kg m^2; the third is their sum."""
_SEPARATRIX = "separatrix of Euler's equations"
_DEGENERATE = "Euler's equations, degenerate cases"


def _free_body(
    name: str, inertia: ArrayLike, rates: ArrayLike, t_end: float, dt: float, source: str, R_WB0: ArrayLike | None = None
) -> Scene:
    attitude = np.eye(3) if R_WB0 is None else R_WB0
    return Scene(name, RigidBody(inertia), attitude, rates, t_end, dt=dt, group="free body", source=source)


def _rate(argument: str, value: float) -> float:
    return finite_number(argument, value, "a finite rate, rad/s")


def brick_flip(disturbance: float = 0.05, spin: float = 10.0, t_end: float = 6.0) -> Scene:
    """Return the brick of Krenk & Nielsen, 5.1, which turns over at regular intervals: rates (0, disturbance, spin).

    It is a box 1 x 3 x 2 of mass 12 with J = (13, 5, 10), which spins about the unstable intermediate axis, its third. The time
    between reversals grows like log(1/disturbance): 2.723 s for 0.05 rad/s.
    """
    # The default has the plain name.
    name = "brick_flip" if disturbance == 0.05 else f"brick_flip_{_rate('disturbance', disturbance):g}"
    rates = (0.0, _rate("disturbance", disturbance), _rate("spin", spin))
    return _free_body(name, _BRICK, rates, t_end, 0.01, "Krenk & Nielsen, 5.1")


def turned_brick(angle: float = 0.7, t_end: float | None = None) -> Scene:
    """Return the brick in a body frame turned by `angle`, rad, about (1, 2, 3): an inertia with off-diagonal terms."""
    return turned(brick_flip(), angle, t_end, "turned_brick")


def _flight(
    name: str, body: MassDistribution, R_WB0: ArrayLike, rates: ArrayLike, t_end: float, source: str, **motion: Any
) -> Scene:
    return Scene(name, body, R_WB0, rates, t_end, dt=0.01, group="free flight", source=source, **motion)


def offset_brick(t_end: float = 6.0) -> Scene:
    """Return the brick with its body frame off its centre of mass, which is at rest: free flight without gravity.

    The exact centre of mass does not move. In an engine it drifts if the free joint couples translation and rotation.
    """
    body, rates = MassDistribution(12.0, (0.3, -0.2, 0.4), _BRICK), (0.0, 0.05, 10.0)
    source, v_WB0 = "Krenk & Nielsen, 5.1, in another frame", np.cross(body.com_B, rates)
    return _flight("offset_brick", body, np.eye(3), rates, t_end, source, v_WB0=v_WB0)


def thrown_box(t_end: float = 2.0) -> Scene:
    """Return a box 0.1 x 0.2 x 0.3 of 2 kg that tumbles in gravity, with its body frame off its centre of mass."""
    body = box((0.1, 0.2, 0.3), mass=2.0).rotate(rotation_about((1.0, 2.0, -1.0), 0.7)).about((0.1, 0.05, -0.02))
    R_WB0, place = rotation_about((1.0, -1.0, 0.3), 1.1), {"p_WB0": (0.3, -0.2, 1.0), "v_WB0": (3.0, 1.0, 4.0)}
    return _flight("thrown_box", body, R_WB0, (1.0, 2.0, 3.0), t_end, "ours", potential=body.gravity(9.81), **place)


def stable_spin(revolutions: float = 100.0, spin: float = 10.0, disturbance: float = 0.1) -> Scene:
    """Return the brick spinning about its stable axis of largest moment: rates (spin, disturbance, disturbance).

    The spin axis stays near its polhode. Engines that clamp |L| drift through the polhodes until any spin turns over.
    `stable_spin:revolutions=1e6` is the hard case; it takes 62.8 million steps, so store few samples.
    """
    if finite_number("spin", spin, "a finite rate other than 0, rad/s") == 0:
        raise BadInput("spin", spin, "a finite rate other than 0, rad/s")
    turns, across = positive_number("revolutions", revolutions), _rate("disturbance", disturbance)
    t_end = 2 * math.pi * turns / abs(spin)
    return _free_body("stable_spin", _BRICK, (spin, across, across), t_end, 0.01, "Euler's equations; Poinsot")


# The separatrix is the polhode L^2 = 2 E J_mid through the unstable axis. Near it, reversals come after a time that grows like
# log(1/disturbance), and each multiplies errors by 1/disturbance. On it the motion tends to the unstable axis and never turns
# over, so in rounded arithmetic everything that follows is round-off. With a and c the axes of the largest and the smallest
# moment and b the intermediate one,
#
#     w_a = W_a sech(k t)     w_c = W_c sech(k t)     w_b = spin tanh(k t)     J_a (J_a - J_b) W_a^2 = J_c (J_b - J_c) W_c^2


def near_separatrix(disturbance: float = 1e-6, spin: float = 10.0, t_end: float = 20.0) -> Scene:
    """Return the brick with a disturbance far smaller than the 0.05 rad/s of Krenk & Nielsen.

    First reversals, s: 4.351845, 7.227773, 10.103701, 12.979629 for disturbances of 1e-3, 1e-6, 1e-9, 1e-12.
    """
    return brick_flip(disturbance, spin, t_end).rename("near_separatrix", source="Krenk & Nielsen, 5.1, disturbed less")


def unstable_spin(spin: float = 10.0, t_end: float = 6.0) -> Scene:
    """Return the brick spinning exactly about its unstable axis: a steady motion that any round-off ends."""
    return brick_flip(0.0, spin, t_end).rename("unstable_spin", source=_SEPARATRIX)


def separatrix(spin: float = 10.0, t_end: float = 6.0) -> Scene:
    """Return the brick on the separatrix, started half-way between the two steady spins +-spin."""
    Ja, Jc, Jb = _BRICK
    speed = _rate("spin", spin)
    Wa = speed * math.sqrt(Jb * (Jb - Jc) / (Ja * (Ja - Jc)))
    Wc = speed * math.sqrt(Jb * (Ja - Jb) / (Jc * (Ja - Jc)))
    return brick_flip(t_end=t_end).rename("separatrix", w_WB_B0=(Wa, Wc, 0.0), source=_SEPARATRIX)


def degenerate_separatrix(disturbance: float = 0.0, spin: float = 10.0, t_end: float = 6.0) -> Scene:
    """Return a body with moments (2, 3, 3) spinning about its third axis: each axis of the equal pair is a steady spin.

    A disturbance about the first axis makes the spin axis drift at a constant rate instead of turning over.
    """
    rates = (_rate("disturbance", disturbance), 0.0, _rate("spin", spin))
    return _free_body("degenerate_separatrix", (2.0, 3.0, 3.0), rates, t_end, 0.01, _SEPARATRIX)


def symmetric_body(axial: float = 0.8, transverse: float = 1.7, t_end: float = 20.0) -> Scene:
    """Return a body with moments (transverse, transverse, axial).

    Its axis precesses about the momentum at |L|/J1, and the body turns about the axis at (1/J3 - 1/J1) L3.
    """
    J1, J3 = positive_number("transverse", transverse), positive_number("axial", axial)
    return _degenerate("symmetric_body", (J1, J1, J3), t_end)


def spherical_body(moment: float = 0.8, t_end: float = 20.0) -> Scene:
    """Return a body with three equal moments: its rates are constant in body and world."""
    J = positive_number("moment", moment)
    return _degenerate("spherical_body", (J, J, J), t_end)


def planar_body(first: float = _PLATE[0], second: float = _PLATE[1], t_end: float = 20.0) -> Scene:
    """Return a plate, moments (first, second, first + second): w1^2 + w2^2 is constant."""
    J1, J2 = positive_number("first", first), positive_number("second", second)
    return _degenerate("planar_body", (J1, J2, J1 + J2), t_end)


def axis_spin(axis: int = 1, spin: float = 2.0, t_end: float = 20.0) -> Scene:
    """Return the plate spinning about its principal axis 1, 2 or 3, at constant rates."""
    choice("axis", axis, (1, 2, 3))
    return _degenerate("axis_spin", (*_PLATE, sum(_PLATE)), t_end, _rate("spin", spin) * np.eye(3)[axis - 1])


def _degenerate(name: str, inertia: ArrayLike, t_end: float, rates: ArrayLike = (0.6, 1.1, -0.4)) -> Scene:
    return _free_body(name, inertia, rates, t_end, 0.02, _DEGENERATE, rotation_about((3.0, -1.0, 2.0), 1.2))


def hairer_vilmart(t_end: float = 10.0) -> Scene:
    """Return the body of Hairer & Vilmart (2006) for their preprocessed discrete Moser-Veselov method.

    J = (0.6, 0.8, 1), L0 = (1.8, 0.4, -0.9).
    """
    J = (0.6, 0.8, 1.0)
    return _free_body("hairer_vilmart", J, np.divide((1.8, 0.4, -0.9), J), t_end, 0.02, "Hairer & Vilmart 2006")


def gazebo_box(t_end: float = 10.0) -> Scene:
    """Return the box 0.1 x 0.4 x 0.9 of Gazebo's comparison of ODE, Bullet, Simbody and DART ("complex" case)."""
    return _box("gazebo_box", (0.1, 0.4, 0.9), 10.0, (0.1, 5.0, 0.1), t_end, "Peters & Hsu, boxes benchmark of Gazebo")


def tumbling_box(t_end: float = 5.0) -> Scene:
    """Return the box 0.1 x 0.2 x 0.3 of MuJoCo's tests with rates (1, 2, 3)."""
    return _box("tumbling_box", (0.1, 0.2, 0.3), 6.0, (1.0, 2.0, 3.0), t_end, "MuJoCo's tests of free bodies")


def near_intermediate_box(t_end: float = 100.0) -> Scene:
    """Return the box of MuJoCo's tests in a long spin close to its intermediate axis."""
    return _box("near_intermediate_box", (0.1, 0.2, 0.3), 6.0, (0.05, 5.0, 0.05), t_end, "MuJoCo's tests of free bodies")


def _box(name: str, sides: ArrayLike, mass: float, rates: ArrayLike, t_end: float, source: str) -> Scene:
    squares = np.square(sides)
    return _free_body(name, mass / 12 * (squares.sum() - squares), rates, t_end, 0.01, source)


def tiny_body(t_end: float = 1.0) -> Scene:
    """Return a body with moments of 1e-14 kg m^2. LAMMPS took moments below 1e-6 for zero until 2020, and did not turn it."""
    inertia, source = (1e-14, 9.5e-15, 1e-15), "LAMMPS, issue 1657 (size of the moments; the start is ours)"
    return _free_body("tiny_body", inertia, (1.0, 2.0, 3.0), t_end, 0.001, source)


def needle(spin: float = 100.0, t_end: float = 2.0, slow: float = 1.0) -> Scene:
    """Return a needle with rates spin (0.2, 1, 0.1), `slow` times slower (see `slow_motion`).

    One moment is a 26th of the two others, which differ by 7 parts in 10,000. In MuJoCo's issue 3553 a fast spin of this body
    diverged if its mass belonged to a fixed child of the free body, and did not if it belonged to the body itself.
    """
    inertia, rates = (1.7231e-4, 6.58e-6, 1.7243e-4), _rate("spin", spin) * np.array((0.2, 1.0, 0.1))
    source = "MuJoCo, issue 3553 (inertia; the start is ours)"
    return slow_motion(_free_body("needle", inertia, rates, t_end, 0.001, source), slow)
