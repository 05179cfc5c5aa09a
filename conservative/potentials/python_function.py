"""A potential from two plain Python functions."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..attitude import Array, cayley, from_quaternion, rotation_about
from ..check import positive_number
from ..errors import BadInput, PotentialFailed

EnergyFunction = Callable[[Array], float]
GradientFunction = Callable[[Array], Array]

_PROBE = rotation_about((1.0, -2.0, 0.5), 0.9)
_DIFFERENCE = 1e-5
_NEWTON_DIFFERENCE = 1e-7
_AGREEMENT = 1e-4
_ROUND_OFF = 8 * 2.0**-53
_Callback = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)


@dataclass(frozen=True, eq=False, init=False)
class FunctionPotential:
    """A user's own potential, given by its energy and its gradient as functions of the matrix R_WB.

    The compiled loop calls them through a pointer, dozens of times a step, so that a step costs one or two milliseconds, not a
    fraction of a microsecond. The finite derivative is the discrete gradient of Gonzalez (1996), with Rbar the mean of both
    attitudes and D their difference:

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
        return self._discrete_gradient(self._energy_at(R_0), R_0, R_1)

    def _discrete_gradient(self, V_0: float, R_0: Array, R_1: Array) -> Array:
        V_1 = self._energy_at(R_1)
        mean, step = (R_0 + R_1) / 2, R_1 - R_0
        gradient = self._gradient_at(mean)
        along = float(np.sum(gradient * step))
        lacking = V_1 - V_0 - along
        # The last is what rounding the attitude changes V by, which is more than V where V is small by cancellation.
        if abs(lacking) <= _ROUND_OFF * (abs(V_0) + abs(V_1) + abs(along) + float(np.abs(gradient * mean).sum())):
            return gradient
        return gradient + lacking / np.sum(step * step) * step

    def scale(self) -> float:
        """Return the size of V, J."""
        return self.size

    def kernel_field(self, R_BP: Array) -> Any:
        """Return the pointer to a C function and the arrays it shares with the kernels: their own for each thread and frame."""
        from ..kernels.function_field import Function

        key = (threading.get_ident(), R_BP.tobytes())
        if key not in self._fields:
            answers = _Answers(self, R_BP.copy())
            callback = _Callback(answers)
            address = ctypes.cast(callback, ctypes.c_void_p).value or 0
            self._fields[key] = callback, Function(address, answers.given, answers.answer)  # keeps the callback alive
        return self._fields[key][1]


class _Answers:
    """What the kernels call: they put a question into `given` and read `answer` (see `kernels.function_field`)."""

    def __init__(self, potential: FunctionPotential, R_BP: Array) -> None:
        self.potential, self.R_BP = potential, R_BP
        self.given, self.answer = np.zeros(18), np.zeros(90)
        self.answered = b""

    def __call__(self, what: int) -> int:
        question = bytes([what]) + self.given.tobytes()
        if question == self.answered:  # residual and tangent of one iteration ask the same
            return 0
        try:
            (self._body_torque, self._finite_torque, self._finite_derivative, self._energy)[what]()
        except BaseException as error:  # none may pass through C, KeyboardInterrupt neither
            PotentialFailed.pending.cause = error
            return 1
        self.answered = question
        return 0

    def _attitude(self) -> Array:
        q = self.given[:4]
        return from_quaternion(q / np.sqrt(q @ q)) @ self.R_BP.T

    def _body_torque(self) -> None:
        R = self._attitude()
        self.answer[:3] = self._moment(R, R, self.potential._gradient_at(R))

    def _energy(self) -> None:
        self.answer[0] = self.potential._energy_at(self._attitude())

    def _finite_torque(self) -> None:
        R_0, a = self._attitude(), self.given[4:7].copy()
        V_0 = self.potential._energy_at(R_0)

        def torque(a: Array) -> Array:
            R_1 = R_0 @ self.R_BP @ cayley(2 * a) @ self.R_BP.T
            return self._moment(R_0, (R_0 + R_1) / 2, self.potential._discrete_gradient(V_0, R_0, R_1))

        self.answer[:3] = torque(a)
        self.answer[3:12] = _derivative(torque, a, self.answer[:3]).T.ravel()

    def _finite_derivative(self) -> None:
        R_0 = self.given[:9].reshape(3, 3).T @ self.R_BP.T
        V_0 = self.potential._energy_at(R_0)

        def V_star(q_1: Array) -> Array:
            R_1 = q_1.reshape(3, 3).T @ self.R_BP.T
            return (self.potential._discrete_gradient(V_0, R_0, R_1) @ self.R_BP).T.ravel()

        q_1 = self.given[9:].copy()
        self.answer[:9] = V_star(q_1)
        self.answer[9:] = _derivative(V_star, q_1, self.answer[:9]).ravel()

    def _moment(self, R_0: Array, R: Array, gradient: Array) -> Array:
        """Return the torque sum_j r_j x (-V*_j) in principal axes of the attitude R_0: the skew part of R V*'."""
        product = R @ gradient.T
        torque_W = [product[2, 1] - product[1, 2], product[0, 2] - product[2, 0], product[1, 0] - product[0, 1]]
        return np.array(torque_W) @ R_0 @ self.R_BP


def _derivative(function: Callable[[Array], Array], x: Array, value: Array) -> Array:
    """Return d function/dx at x, where it is `value`, by differences: good to 1e-7, so that Newton is all but quadratic."""
    columns = []
    for k in range(len(x)):
        beside = x.copy()
        beside[k] += _NEWTON_DIFFERENCE
        columns.append((function(beside) - value) / (beside[k] - x[k]))
    return np.stack(columns, axis=1)
