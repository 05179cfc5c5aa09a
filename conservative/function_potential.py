"""A potential from two plain Python functions."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .attitude import Array, from_quaternion, rotation_about
from .check import positive_number
from .errors import BadInput, PotentialFailed

EnergyFunction = Callable[[Array], float]
GradientFunction = Callable[[Array], Array]

_PROBE = rotation_about((1.0, -2.0, 0.5), 0.9)
_DIFFERENCE = 1e-5
_AGREEMENT = 1e-4
_ROUND_OFF = 16 * 2.0**-53
_Callback = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)


@dataclass(frozen=True, eq=False, init=False)
class FunctionPotential:
    """A user's own potential, given by its energy and its gradient as functions of the matrix R_WB.

    The compiled loop calls them through a pointer, some 15 times a step, so that a step costs tens of microseconds and not tens
    of nanoseconds. The finite derivative is the discrete gradient of Gonzalez (1996), with Rbar the mean of both attitudes and
    D their difference:

        V* = G + (V(R1) - V(R0) - <G, D>) / <D, D> D        G = dV/dR at Rbar

    It conserves energy to round-off for any V. Where the numerator is nothing but round-off, as it is for tiny steps, V* = G.

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

    energy_function: EnergyFunction
    gradient_function: GradientFunction
    size: float
    axis_W: Array | None
    _fields: dict[Any, Any] = field(repr=False)

    def __init__(
        self, energy: EnergyFunction, gradient: GradientFunction, scale: float | None = None, axis_W: Array | None = None
    ) -> None:
        for name, function in (("energy", energy), ("gradient", gradient)):
            if not callable(function):
                raise BadInput(name, repr(function), "a function of a matrix (3, 3)")
        object.__setattr__(self, "energy_function", energy)
        object.__setattr__(self, "gradient_function", gradient)
        object.__setattr__(self, "axis_W", None if axis_W is None else np.asarray(axis_W, dtype=float))
        object.__setattr__(self, "_fields", {})
        self._check()
        size = self._usual_scale() if scale is None else positive_number("scale", scale, "a finite energy above 0, J")
        object.__setattr__(self, "size", size)

    def _check(self) -> None:
        """Compare the gradient with differences of the energy at one attitude."""
        gradient = self._gradient_at(_PROBE)
        differences = np.empty((3, 3))
        for index in np.ndindex(3, 3):
            aside = np.zeros((3, 3))
            aside[index] = _DIFFERENCE
            differences[index] = (self._energy_at(_PROBE + aside) - self._energy_at(_PROBE - aside)) / (2 * _DIFFERENCE)
        off = np.abs(differences - gradient).max()
        if not off <= _AGREEMENT * max(np.abs(gradient).max(), np.abs(differences).max()):
            raise BadInput(
                "gradient", f"a matrix off by {off:.3g} J from differences of the energy", "the derivative of `energy`"
            )

    def _usual_scale(self) -> float:
        half_turns = from_quaternion(np.eye(4))
        return max(float(np.linalg.norm(self._gradient_at(R))) for R in (_PROBE, *half_turns, *(half_turns @ _PROBE))) or 1.0

    def _energy_at(self, R: Array) -> float:
        return float(self.energy_function(R.copy()))

    def _gradient_at(self, R: Array) -> Array:
        gradient = np.asarray(self.gradient_function(R.copy()), dtype=float)
        if gradient.shape != (3, 3):
            raise BadInput("gradient", f"shape {gradient.shape}", "a function that returns a matrix (3, 3)")
        return gradient

    def energy(self, R_WB: Array) -> Array:
        """Return V, (...), in J."""
        R = np.asarray(R_WB, dtype=float)
        return np.array([self._energy_at(each) for each in R.reshape(-1, 3, 3)]).reshape(R.shape[:-2])

    def gradient(self, R_WB: Array) -> Array:
        """Return dV/dR, (..., 3, 3), in J."""
        R = np.asarray(R_WB, dtype=float)
        return np.array([self._gradient_at(each) for each in R.reshape(-1, 3, 3)]).reshape(R.shape)

    def finite_derivative(self, R_0: Array, R_1: Array) -> Array:
        """Return Gonzalez's discrete gradient V*, (3, 3), in J."""
        V_0, V_1 = self._energy_at(R_0), self._energy_at(R_1)
        gradient, step = self._gradient_at((R_0 + R_1) / 2), R_1 - R_0
        along = float(np.sum(gradient * step))
        lacking = V_1 - V_0 - along
        if abs(lacking) <= _ROUND_OFF * (abs(V_0) + abs(V_1) + abs(along)):
            return gradient
        return gradient + lacking / np.sum(step * step) * step

    def scale(self) -> float:
        """Return the size of V, J."""
        return self.size

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the pointer to a C function and the arrays it shares with the kernels; one of them a thread and a frame."""
        from .kernels.function_field import Function

        key = (threading.get_ident(), R_BP.tobytes())
        if key not in self._fields:
            R, out = np.zeros((3, 3)), np.zeros((3, 3))
            callback = _Callback(self._answer(R, out, R_BP.copy()))
            address = ctypes.cast(callback, ctypes.c_void_p).value or 0
            self._fields[key] = callback, Function(address, R, out)  # the callback lives as long as the potential
        return self._fields[key][1]

    def _answer(self, R: Array, out: Array, R_BP: Array) -> Callable[[int], int]:
        """Return what the kernels call: 0 writes the energy, 1 the gradient; the answer is `FAILED` or 0."""
        from .kernels.function_field import ENERGY, FAILED

        def answer(what: int) -> int:
            try:
                R_WB = R @ R_BP.T
                if what == ENERGY:
                    out[0, 0] = self._energy_at(R_WB)
                else:
                    out[:] = self._gradient_at(R_WB) @ R_BP
            except BaseException as error:  # none may pass through C, KeyboardInterrupt neither
                PotentialFailed.pending.cause = error
                return FAILED
            return 0

        return answer
