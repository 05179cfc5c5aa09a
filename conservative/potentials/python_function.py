"""A potential from two plain Python functions."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..attitude import ROTATION_TOLERANCE, Array, cayley, from_quaternion, rotation_about, triple
from ..check import build_unchecked, describe, finite_array, positive_number
from ..errors import BadInput, PotentialFailed
from .pointwise import Energy, EnergyFunction, Gradient, GradientFunction, Product, Size

_PROBE = rotation_about((1.0, -2.0, 0.5), 0.9)
_DIFFERENCE = 1e-5
_NEWTON_DIFFERENCE = 1e-7
_AGREEMENT = 1e-4
_AXIS = "a unit vector (3,), world axes, about which the field is symmetric"
_ROUND_OFF = 8 * 2.0**-53
N_INPUTS, N_OUTPUTS = 27, 90
"""Numbers in a buffer: the inputs, which are the frame R_BP by rows and up to 18 of the state, and behind them the outputs."""


@dataclass(frozen=True, eq=False)
class _Fields:
    energy: Energy
    gradient: Gradient
    scale: Size
    axis_W: Array | None


@dataclass(frozen=True, eq=False, init=False)
class FunctionPotential(_Fields):
    """A user's own potential, given by its energy and its gradient as functions of the matrix R_WB.

    The compiled loop calls them through a pointer, dozens of times a step, so that a step costs one or two milliseconds, not a
    fraction of a microsecond. The finite derivative is the discrete gradient of Gonzalez (1996), with Rbar the mean of both
    attitudes and D their difference:

        V* = G + (V(R1) - V(R0) - <G, D>) / <D, D> D        G = dV/dR at Rbar

    It conserves energy to round-off for any V. Where the numerator is nothing but round-off, as it is for tiny steps, V* = G.
    The attributes `energy`, `gradient` and `scale` are what every potential has: functions of attitudes (..., 3, 3).

    Parameters
    ----------
    energy
        V in J of a matrix (3, 3); it is also asked for matrices near a rotation, as means of rotations are.
    gradient
        dV/dR (3, 3) in J of such a matrix: entry i, j is the derivative by R[i, j].
    scale
        A size of V in J, above 0, that energy errors are relative to; default the largest of a few gradients.
    axis_W
        Unit vector (3,), world axes, about which the field is symmetric, if there is one.

    Raises
    ------
    BadInput
        A function cannot be called, does not give finite numbers of the right shape, or the gradient is not that of the energy
        (compared with differences at one attitude).
    PotentialFailed
        While integrating, one of the functions raised an exception, which is the cause.

    Examples
    --------
    >>> hook = np.array([0.0, 0.1, 0.4])
    >>> quartic = FunctionPotential(lambda R: (R[2] @ hook) ** 4, lambda R: np.outer([0, 0, 1], 4 * (R[2] @ hook) ** 3 * hook))
    """

    def __init__(
        self,
        energy: EnergyFunction | Energy,
        gradient: GradientFunction | Gradient,
        scale: float | Size | None = None,
        axis_W: ArrayLike | None = None,
    ) -> None:
        for name, function in (("energy", energy), ("gradient", gradient)):
            if not callable(function):
                raise BadInput(name, describe(function), "a function of a matrix (3, 3)")
        V = energy if isinstance(energy, Energy) else Energy(energy)
        G = gradient if isinstance(gradient, Gradient) else Gradient(gradient)
        _check_gradient(V, G)
        super().__init__(V, G, _size(scale, G), None if axis_W is None else _check_axis(axis_W, G))

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return Gonzalez's discrete gradient V*, (3, 3), in J."""
        return self.discrete_gradient(self.energy.at(R_0), R_0, R_1)

    def discrete_gradient(self, V_0: float, R_0: Array, R_1: Array) -> Array:
        """Return Gonzalez's discrete gradient V*, (3, 3), in J, where V at R_0 is V_0, J."""
        V_1 = self.energy.at(R_1)
        mean, step = (R_0 + R_1) / 2, R_1 - R_0
        gradient = self.gradient.at(mean)
        along = float(np.sum(gradient * step))
        lacking = V_1 - V_0 - along
        # The last is what rounding the attitude changes V by, which is more than V where V is small by cancellation.
        if abs(lacking) <= _ROUND_OFF * (abs(V_0) + abs(V_1) + abs(along) + float(np.abs(gradient * mean).sum())):
            return gradient
        return gradient + lacking / np.sum(step * step) * step

    def in_units(self, energy: float) -> FunctionPotential:
        """Return the field with energies in units of `energy`, a power of two, J."""
        V, G = Energy(Product(self.energy.at, 1 / energy)), Gradient(Product(self.gradient.at, 1 / energy))
        return build_unchecked(FunctionPotential, energy=V, gradient=G, scale=Size(self.scale() / energy), axis_W=self.axis_W)

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the address of what kernels call, which lives as long as the potential, and the frame, row by row."""
        from ..kernels.function_field import Function

        # Atomic: of threads that come here at once, each gets the one that stays.
        callback = self.__dict__.setdefault("_callback", _Callback(self))
        return Function(id(callback), *(triple(row) for row in R_BP))


def _check_gradient(energy: Energy, gradient: Gradient) -> None:
    """Compare the gradient with differences of the energy at one attitude."""
    found, differences = _probe("gradient", gradient, _PROBE), np.empty((3, 3))
    for index in np.ndindex(3, 3):
        aside = np.zeros((3, 3))
        aside[index] = _DIFFERENCE
        ahead, behind = (float(_probe("energy", energy, _PROBE + sign * aside)) for sign in (1, -1))
        differences[index] = (ahead - behind) / (2 * _DIFFERENCE)
    off = np.abs(differences - found).max()
    if not off <= _AGREEMENT * max(np.abs(found).max(), np.abs(differences).max()):
        raise BadInput("gradient", f"a matrix off by {off:.3g} J from differences of the energy", "the derivative of `energy`")


def _probe(argument: str, function: Energy | Gradient, R: Array) -> Array:
    """Return what a function gives at one attitude (3, 3); what it raises, and what is not finite, is bad input."""
    allowed = "a function that gives a real number, J" if argument == "energy" else "a function that gives a matrix (3, 3), J"
    try:
        found = function.at(R)
    except PotentialFailed as failure:
        raise BadInput(argument, f"a function that fails: {describe(failure.__cause__)}", allowed) from failure.__cause__
    return finite_array(argument, found, ((), (3, 3)), f"{allowed}, at every attitude")


def _check_axis(axis_W: ArrayLike, gradient: Gradient) -> Array:
    """Return the axis, if it is one: a unit vector (3,) along which the field has no torque."""
    axis = finite_array("axis_W", axis_W, ((3,),), _AXIS)
    if abs(np.linalg.norm(axis) - 1) > ROTATION_TOLERANCE:
        raise BadInput("axis_W", describe(axis.tolist()), _AXIS)
    found = _probe("gradient", gradient, _PROBE)
    torque, size = abs(_moment(np.eye(3), _PROBE, found) @ axis), np.abs(found).max()
    if torque > _AGREEMENT * size:
        raise BadInput("axis_W", f"{axis.tolist()}, about which the field has a torque of {torque:.3g} N m", _AXIS)
    return axis


def _size(scale: float | Size | None, gradient: Gradient) -> Size:
    """Return the size of V that is given, or the largest of a few gradients."""
    if scale is not None:
        value = scale.value if isinstance(scale, Size) else scale
        return Size(positive_number("scale", value, "a finite energy above 0, J"))
    half_turns = from_quaternion(np.eye(4))
    attitudes = (_PROBE, *half_turns, *(half_turns @ _PROBE))
    return Size(max(float(np.linalg.norm(_probe("gradient", gradient, R))) for R in attitudes) or 1.0)


class _Callback:
    """What kernels call with the kind of evaluation and the address of a buffer (see `conservative.kernels.function_field`).

    Threads may call it at once: each has its own last inputs and outputs.
    """

    def __init__(self, potential: FunctionPotential) -> None:
        self.potential, self.last = potential, threading.local()

    def __call__(self, what: int, address: int) -> None:
        buffer = np.ctypeslib.as_array((ctypes.c_double * (N_INPUTS + N_OUTPUTS)).from_address(address))
        inputs = bytes([what]) + buffer[:N_INPUTS].tobytes()
        known, outputs = getattr(self.last, "pair", (b"", buffer))
        if inputs != known:  # residual and tangent of one iteration need the same
            outputs = self._evaluate(what, buffer[:9].reshape(3, 3), buffer[9:N_INPUTS])
            self.last.pair = inputs, outputs  # at once: an interrupt may come anywhere
        buffer[N_INPUTS : N_INPUTS + len(outputs)] = outputs

    def _evaluate(self, what: int, R_BP: Array, state: Array) -> Array:
        functions = (_body_torque, _finite_torque, _finite_derivative, _energy)
        return functions[what](self.potential, R_BP.copy(), state.copy())


def _energy(potential: FunctionPotential, R_BP: Array, state: Array) -> Array:
    return np.array([potential.energy.at(_attitude(R_BP, state))])


def _body_torque(potential: FunctionPotential, R_BP: Array, state: Array) -> Array:
    R = _attitude(R_BP, state)
    return _moment(R, R, potential.gradient.at(R)) @ R_BP


def _finite_torque(potential: FunctionPotential, R_BP: Array, state: Array) -> Array:
    """Return the torque, and its derivative by a, column by column."""
    R_0, a = _attitude(R_BP, state), state[4:7]
    V_0 = potential.energy.at(R_0)

    def torque(a: Array) -> Array:
        R_1 = R_0 @ R_BP @ cayley(2 * a) @ R_BP.T
        return _moment(R_0, (R_0 + R_1) / 2, potential.discrete_gradient(V_0, R_0, R_1)) @ R_BP

    found = torque(a)
    return np.concatenate([found, _derivative(torque, a, found).T.ravel()])


def _finite_derivative(potential: FunctionPotential, R_BP: Array, state: Array) -> Array:
    """Return V* and its derivative by q_1, both by columns of base vectors."""
    R_0 = state[:9].reshape(3, 3).T @ R_BP.T
    V_0 = potential.energy.at(R_0)

    def V_star(q_1: Array) -> Array:
        R_1 = q_1.reshape(3, 3).T @ R_BP.T
        return (potential.discrete_gradient(V_0, R_0, R_1) @ R_BP).T.ravel()

    found = V_star(state[9:])
    return np.concatenate([found, _derivative(V_star, state[9:], found).ravel()])


def _attitude(R_BP: Array, state: Array) -> Array:
    q = state[:4]
    return from_quaternion(q / np.sqrt(q @ q)) @ R_BP.T


def _moment(R_0: Array, R: Array, gradient: Array) -> Array:
    """Return the torque sum_j r_j x (-V*_j) in body axes of the attitude R_0: the skew part of R V*'."""
    product = R @ gradient.T
    torque_W = [product[2, 1] - product[1, 2], product[0, 2] - product[2, 0], product[1, 0] - product[0, 1]]
    return np.array(torque_W) @ R_0


def _derivative(function: Callable[[Array], Array], x: Array, value: Array) -> Array:
    """Return d function/dx at x, where it is `value`, by differences: good to 1e-7, so that Newton is all but quadratic."""
    columns = []
    for k in range(len(x)):
        beside = x.copy()
        beside[k] += _NEWTON_DIFFERENCE
        columns.append((function(beside) - value) / (beside[k] - x[k]))
    return np.stack(columns, axis=1)
