"""The object that kernels call for a potential made of Python functions."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from ..attitude import Array, cayley, from_quaternion

_NEWTON_DIFFERENCE = 1e-7
"""Difference of each component of the state, by which `_derivative` differentiates."""
N_INPUTS, N_OUTPUTS = 27, 90
"""Numbers in a buffer: the inputs, which are the frame R_BP by rows and up to 18 of the state, and behind them the outputs."""


class Callback:
    """Called by kernels with the kind of evaluation and the address of a buffer (see `conservative.kernels.function_field`).

    Threads may call it at once: each has its own last inputs and outputs.
    """

    def __init__(self, potential: Any) -> None:
        self.potential, self.last = potential, threading.local()

    def __reduce__(self) -> tuple[Any, ...]:
        return Callback, (self.potential,)

    def __call__(self, what: int, address: int) -> None:
        buffer = np.ctypeslib.as_array((ctypes.c_double * (N_INPUTS + N_OUTPUTS)).from_address(address))
        inputs = bytes([what]) + buffer[:N_INPUTS].tobytes()
        last_inputs, outputs = getattr(self.last, "pair", (b"", buffer))
        if inputs != last_inputs:  # residual and tangent of one iteration need the same
            # In the order of the kinds of `kernels.function_field`.
            functions = (_body_torque, _finite_torque, _finite_derivative, _energy, _torques, _damping, _wheel)
            with np.errstate(all="ignore"):  # trial runs take steps that are too long: what overflows makes such a step fail
                outputs = functions[what](self.potential, buffer[:9].reshape(3, 3).copy(), buffer[9:N_INPUTS].copy())
            self.last.pair = inputs, outputs  # at once: an interrupt may come anywhere
        buffer[N_INPUTS : N_INPUTS + len(outputs)] = outputs


def find_address(function: Any) -> int:
    """Return the address that kernels call for a potential or a function of time. It is valid as long as that lives."""
    # Atomic: of threads that come here at once, each gets the one that stays.
    return id(function.__dict__.setdefault("_callback", Callback(function)))


def _energy(potential: Any, R_BP: Array, state: Array) -> Array:
    return np.array([potential.energy.at(_attitude(R_BP, state))])


def _torques(torque: Any, R_BP: Array, state: Array) -> Array:
    """Return the torque in body and in world axes, one of which is 0."""
    value = _value(torque, R_BP, state)
    return np.concatenate([value @ R_BP, np.zeros(3)] if torque.frame == "body" else [np.zeros(3), value])


def _damping(damping: Any, R_BP: Array, state: Array) -> Array:
    return (R_BP.T @ _value(damping, R_BP, state) @ R_BP).ravel()


def _wheel(rotor: Any, R_BP: Array, state: Array) -> Array:
    return np.asarray(_value(rotor, R_BP, state) @ R_BP)


def _value(load: Any, R_BP: Array, state: Array) -> Any:
    """Return the value of a load at the time, in the window and at the attitude of a state; the latter may be absent."""
    t, first, last = state[:3].tolist()
    return load.at(t, _attitude(R_BP, state[3:]) if state[3:7].any() else None, (first, last))


def _body_torque(potential: Any, R_BP: Array, state: Array) -> Array:
    R, t = _attitude(R_BP, state), state[4:5].tolist() if potential.time_dependent else ()
    return moment(R, R, potential.gradient.at(R, *t)) @ R_BP


def _finite_torque(potential: Any, R_BP: Array, state: Array) -> Array:
    """Return the torque, and its derivative by a, column by column."""
    R_0, a = _attitude(R_BP, state), state[4:7]
    V_0 = potential.energy.at(R_0)

    def torque(a: Array) -> Array:
        R_1 = R_0 @ R_BP @ cayley(2 * a) @ R_BP.T
        return moment(R_0, (R_0 + R_1) / 2, potential.discrete_gradient(V_0, R_0, R_1)) @ R_BP

    T = torque(a)
    return np.concatenate([T, _derivative(torque, a, T).T.ravel()])


def _finite_derivative(potential: Any, R_BP: Array, state: Array) -> Array:
    """Return V* and its derivative by q_1, both by columns of base vectors."""
    R_0 = state[:9].reshape(3, 3).T @ R_BP.T
    V_0 = potential.energy.at(R_0)

    def V_star(q_1: Array) -> Array:
        R_1 = q_1.reshape(3, 3).T @ R_BP.T
        return (potential.discrete_gradient(V_0, R_0, R_1) @ R_BP).T.ravel()

    V_star_1 = V_star(state[9:])
    return np.concatenate([V_star_1, _derivative(V_star, state[9:], V_star_1).ravel()])


def _attitude(R_BP: Array, state: Array) -> Array:
    q = state[:4]
    return from_quaternion(q / np.sqrt(q @ q)) @ R_BP.T


def moment(R_0: Array, R: Array, gradient: Array) -> Array:
    """Return the torque sum_j r_j x (-V*_j), (3,), N m, in body axes of the attitude R_0 (3, 3): the skew part of R V*'.

    R and the gradient are (3, 3), too.
    """
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
