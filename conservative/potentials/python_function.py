"""A potential from two plain Python functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import ROTATION_TOLERANCE, Array, from_quaternion, hat, rotation_about, triple
from ..check import describe, finite_array, positive_number, replace_unchecked, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput, PotentialFailed
from .callback import find_address, moment
from .pointwise import Energy, EnergyFunction, Gradient, GradientFunction, Size

_PROBE = rotation_about((1.0, -2.0, 0.5), 0.9)
"""Attitude, along no axis, at which functions are tried."""
_LATER = 0.7, 0.07, 0.007, 0.0007
"""Times, s. Functions of time are tried at 0 and at the first of these at which they have a value: a recording may be short."""
_DIFFERENCE = 1e-5
"""Step of the finite differences that the gradient is compared with."""
_AGREEMENT = 1e-4
"""Largest error of the gradient that is accepted, and torque about a symmetry axis, relative to its largest entry."""
_AXIS = "a unit vector (3,), world axes, about which the field is symmetric"
_ROUND_OFF = 8 * 2.0**-53
"""Share of its terms below which the numerator of V* is only round-off."""


@dataclass(frozen=True, eq=False, init=False)
class FunctionPotential:
    """A potential given by Python functions for its energy and gradient, of the matrix R_WB and optionally of time.

    The compiled loop calls the functions dozens of times per step, so a step takes one to two milliseconds instead of a
    fraction of a microsecond. The finite derivative is the discrete gradient of Gonzalez (1996), with Rbar the mean of both
    attitudes and D their difference:

        V* = G + (V(R1) - V(R0) - <G, D>) / <D, D> D        G = dV/dR at Rbar

    It conserves energy to round-off for any V. For tiny steps, where the numerator is only round-off, V* = G. With
    `axis_W` the last D is the part of D that changes R' axis_W. The momentum about the axis is then conserved to round-off as
    well (DERIVATION.md, section 5).

    If the functions depend on time, energy is not conserved, and the only invariant is the momentum about `axis_W`.

    Parameters
    ----------
    energy
        Function that returns V in J for a matrix (3, 3). The matrix can be the mean of two rotations.
    gradient
        Function that returns dV/dR (3, 3) in J for such a matrix: entry i, j is the derivative with respect to R[i, j].
    scale
        Reference scale of energy drifts, J, positive; default: the largest of a few gradients.
    axis_W
        Symmetry axis of the field, if there is one: unit vector (3,), world axes.
    time_dependent
        Whether both are functions of matrix and time (s): energy(R, t), gradient(R, t).

    Raises
    ------
    BadInput
        A function cannot be called with these arguments or does not return finite numbers of the right shape; or the gradient
        is not the derivative of the energy (checked by finite differences).
    PotentialFailed
        A function raised an exception during integration, which is the cause.

    Examples
    --------
    >>> hook = np.array([0.0, 0.1, 0.4])
    >>> quartic = FunctionPotential(lambda R: (R[2] @ hook) ** 4, lambda R: np.outer([0, 0, 1], 4 * (R[2] @ hook) ** 3 * hook))
    """

    energy: Energy
    gradient: Gradient
    scale: Size
    axis_W: Array | None
    time_dependent: bool = False

    def __init__(
        self,
        energy: EnergyFunction | Energy,
        gradient: GradientFunction | Gradient,
        scale: float | Size | None = None,
        axis_W: ArrayLike | None = None,
        time_dependent: bool = False,
    ) -> None:
        if not isinstance(time_dependent, bool):
            raise BadInput("time_dependent", describe(time_dependent), "True or False")
        for name, function in (("energy", energy), ("gradient", gradient)):
            if not callable(function):
                raise BadInput(name, describe(function), "a function of a matrix (3, 3)")
        V = energy if isinstance(energy, Energy) else Energy(energy, time_dependent)
        G = gradient if isinstance(gradient, Gradient) else Gradient(gradient, time_dependent)
        # Without time the functions are tried once. In time, also at a later time: at t = 0 a factor of time may be 0.
        times = ((0.0,), *((t,) for t in _LATER if _has_values(V, G, t)))[:2] if time_dependent else ((),)
        for t in times:
            _check_gradient(V, G, t)
        axis = None if axis_W is None else _check_axis(axis_W, G, times[-1])
        set_fields(self, energy=V, gradient=G, scale=_size(scale, G, times), axis_W=axis, time_dependent=time_dependent)

    def energy_at(self, R_WB: Array, t: Array) -> Array:
        """Return V, (...), in J at attitudes (..., 3, 3) and times (...), s."""
        return self.energy(R_WB, t) if self.time_dependent else self.energy(R_WB)

    def gradient_at(self, R_WB: Array, t: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J at matrices (..., 3, 3) and times (...), s."""
        return self.gradient(R_WB, t) if self.time_dependent else self.gradient(R_WB)

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return Gonzalez's discrete gradient V*, (3, 3), in J."""
        return self.discrete_gradient(self.energy.at(R_0), R_0, R_1)

    def discrete_gradient(self, V_0: float, R_0: Array, R_1: Array) -> Array:
        """Return Gonzalez's discrete gradient V*, (3, 3), in J, where V at R_0 is V_0, J."""
        V_1 = self.energy.at(R_1)
        mean, step = (R_0 + R_1) / 2, R_1 - R_0
        gradient = self.gradient.at(mean)
        along_step = step
        if self.axis_W is not None:
            # Neither part of V* may have a torque about the axis e. The gradient has one if the functions are symmetric on
            # rotations only: the mean is not a rotation.
            e = self.axis_W
            turn = hat(e) @ mean
            gradient = gradient - np.sum(gradient * turn) / np.sum(turn * turn) * turn
            along_step = np.outer(e, e @ step)
        along, square = float(np.sum(gradient * step)), float(np.sum(along_step * step))
        numerator = V_1 - V_0 - along
        # The last part of `size` is the change of V by the rounding of the attitude. It exceeds V if the terms of V cancel. In
        # a spin about the axis the numerator has no other part, and the square is 0 or round-off.
        size = abs(V_0) + abs(V_1) + abs(along) + float(np.abs(gradient * mean).sum())
        if square == 0 or abs(numerator) <= _ROUND_OFF * size:
            return gradient
        return gradient + numerator / square * along_step

    def in_units(self, energy: float, time: float = 1.0) -> FunctionPotential:
        """Return the field with energies in units of `energy`, J, and times in units of `time`, s, powers of two."""

        def convert(function: Callable[..., Any]) -> Callable[..., Any]:
            return lambda R, *t: function(R, *(now * time for now in t)) / energy

        V = Energy(convert(self.energy.at), self.time_dependent)
        G = Gradient(convert(self.gradient.at), self.time_dependent)
        return replace_unchecked(self, energy=V, gradient=G, scale=Size(self.scale() / energy))

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the field of kernels: the address of a callback, valid while the potential lives, and the rows of R_BP."""
        kernel, address, rows = kernels("function_field"), find_address(self), tuple(triple(row) for row in R_BP)
        return kernel.FunctionInTime(address, rows, 0.0) if self.time_dependent else kernel.Function(address, rows)


Time = tuple[()] | tuple[float]
"""A time, s, for functions that depend on it."""


def _has_values(energy: Energy, gradient: Gradient, t: float) -> bool:
    """Return whether both functions return a value at a time, s."""
    try:
        energy.at(_PROBE, t), gradient.at(_PROBE, t)
    except PotentialFailed:
        return False
    return True


def _check_gradient(energy: Energy, gradient: Gradient, t: Time) -> None:
    """Compare the gradient with differences of the energy at one attitude, and at a time if they depend on it."""
    dV_dR, differences = _probe("gradient", gradient, _PROBE, *t), np.empty((3, 3))
    for index in np.ndindex(3, 3):
        aside = np.zeros((3, 3))
        aside[index] = _DIFFERENCE
        ahead, behind = (float(_probe("energy", energy, _PROBE + sign * aside, *t)) for sign in (1, -1))
        differences[index] = (ahead - behind) / (2 * _DIFFERENCE)
    off = np.abs(differences - dV_dR).max()
    if not off <= _AGREEMENT * max(np.abs(dV_dR).max(), np.abs(differences).max()):
        raise BadInput("gradient", f"a matrix off by {off:.3g} J from differences of the energy", "the derivative of `energy`")


def _probe(argument: str, function: Energy | Gradient, R: Array, *t: float) -> Array:
    """Return the value of a function at one attitude (3, 3). Raise `BadInput` if it fails, or the value is not finite."""
    allowed = "a function that gives a real number, J" if argument == "energy" else "a function that gives a matrix (3, 3), J"
    try:
        value = function.at(R, *t)
    except PotentialFailed as failure:
        raise BadInput(argument, f"a function that fails: {describe(failure.__cause__)}", allowed) from failure.__cause__
    return finite_array(argument, value, ((), (3, 3)), f"{allowed}, at every attitude")


def _check_axis(axis_W: ArrayLike, gradient: Gradient, t: Time) -> Array:
    """Return a symmetry axis as an array (3,). Raise `BadInput` if its length is not 1, or the field has a torque along it."""
    axis = finite_array("axis_W", axis_W, ((3,),), _AXIS)
    if abs(np.linalg.norm(axis) - 1) > ROTATION_TOLERANCE:
        raise BadInput("axis_W", describe(axis.tolist()), _AXIS)
    dV_dR = _probe("gradient", gradient, _PROBE, *t)
    torque, size = abs(moment(np.eye(3), _PROBE, dV_dR) @ axis), np.abs(dV_dR).max()
    if torque > _AGREEMENT * size:
        raise BadInput("axis_W", f"{axis.tolist()}, about which the field has a torque of {torque:.3g} N m", _AXIS)
    return axis


def _size(scale: float | Size | None, gradient: Gradient, times: tuple[Time, ...]) -> Size:
    """Return `scale` if it is given, otherwise the largest gradient of a few attitudes and times."""
    if scale is not None:
        value = scale.value if isinstance(scale, Size) else scale
        return Size(positive_number("scale", value, "a finite energy above 0, J"))
    half_turns = from_quaternion(np.eye(4))
    attitudes = (_PROBE, *half_turns, *(half_turns @ _PROBE))
    return Size(max(float(np.linalg.norm(_probe("gradient", gradient, R, *t))) for R in attitudes for t in times) or 1.0)
