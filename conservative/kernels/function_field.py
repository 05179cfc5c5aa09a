"""A field given by Python functions, called from the compiled loop through a C pointer.

Energy and gradient are exchanged through two arrays that Python and the kernel share. The finite derivative is Gonzalez's
discrete gradient; its derivative, which Newton's method wants, is taken by differences.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from ..errors import PotentialFailed
from . import kernel
from .fields import body_torque, finite_derivative, finite_torque, in_body, is_field

ENERGY, GRADIENT = 0, 1
FAILED = 1
DIFFERENCE = 1e-7
"""Step of the differences: it makes derivatives good to about 1e-7, so that Newton's method is all but quadratic."""

ROUND_OFF = 16 * 2.0**-53
"""Part of the energies below which their difference says nothing: there the discrete gradient is the gradient at the mean."""


class Function(NamedTuple):
    """Address of a C function int64(int64) that reads `R` (3, 3) and writes `out` (3, 3): V in out[0, 0], or dV/dR."""

    address: int
    R: Any
    out: Any


@intrinsic
def _call(typingctx, address, what):
    """Call the C function at `address` with the int64 `what`."""

    def code(context, builder, signature, arguments):
        function = ir.FunctionType(ir.IntType(64), [ir.IntType(64)])
        return builder.call(builder.inttoptr(arguments[0], function.as_pointer()), [arguments[1]])

    return types.int64(types.int64, types.int64), code


@kernel
def _ask(field, what, R):
    field.R[:, :] = R
    if _call(field.address, what) == FAILED:
        raise PotentialFailed


@kernel
def _energy(field, R):
    _ask(field, ENERGY, R)
    return field.out[0, 0]


@kernel
def _gradient(field, R):
    _ask(field, GRADIENT, R)
    return field.out.copy()


@kernel
def _discrete_gradient(field, V0, R0, R1):
    """V* (3, 3) in J from R0, where the energy is V0, to R1: the gradient at the mean plus what it lacks, along the step."""
    V_star = _gradient(field, 0.5 * (R0 + R1))
    V1 = _energy(field, R1)
    step = R1 - R0
    along = np.sum(V_star * step)
    lacking = V1 - V0 - along
    if abs(lacking) > ROUND_OFF * (abs(V0) + abs(V1) + abs(along)):
        V_star += (lacking / np.sum(step * step)) * step
    return V_star


@kernel
def _matrix(q):
    """The matrix of the quaternion q, of any length."""
    R = np.empty((3, 3))
    for i in range(3):
        e = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
        R[i, 0], R[i, 1], R[i, 2] = in_body(q, e)
    return R


@kernel
def _cayley(a):
    """Cay(2a), (3, 3)."""
    hat = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.eye(3) + 2.0 / (1.0 + np.sum(a * a)) * (hat + hat @ hat)


@kernel
def _torque_between(R, V_star):
    """sum_j r_j x (-V*_j), with columns r_j and V*_j (3, 3)."""
    T = np.zeros(3)
    for j in range(3):
        T[0] += R[2, j] * V_star[1, j] - R[1, j] * V_star[2, j]
        T[1] += R[0, j] * V_star[2, j] - R[2, j] * V_star[0, j]
        T[2] += R[1, j] * V_star[0, j] - R[0, j] * V_star[1, j]
    return T


@kernel
def _torque_over(field, V0, R0, a):
    turn = _cayley(a)
    V_star = _discrete_gradient(field, V0, R0, R0 @ turn)
    return _torque_between(0.5 * (np.eye(3) + turn), R0.T @ V_star)


@kernel
def _triple(v):
    return (v[0], v[1], v[2])


@overload(finite_torque)
def _finite_torque_function(field, q, a):
    if not is_field(field, Function):
        return None

    def torque(field, q, a):
        R0 = _matrix(q)
        V0 = _energy(field, R0)
        at = np.array(a)
        T = _torque_over(field, V0, R0, at)
        columns = np.empty((3, 3))
        for k in range(3):
            beside = at.copy()
            beside[k] += DIFFERENCE
            columns[k] = (_torque_over(field, V0, R0, beside) - T) / (beside[k] - at[k])
        return _triple(T), (_triple(columns[0]), _triple(columns[1]), _triple(columns[2]))

    return torque


@overload(body_torque)
def _body_torque_function(field, q):
    if not is_field(field, Function):
        return None

    def torque(field, q):
        R = _matrix(q)
        return _triple(_torque_between(np.eye(3), R.T @ _gradient(field, R)))

    return torque


@kernel
def _base_vectors(R):
    """The columns of R one after the other, (9,)."""
    return R.T.copy().reshape(9)


@overload(finite_derivative)
def _finite_derivative_function(field, q0, q1):
    if not is_field(field, Function):
        return None

    def derivative(field, q0, q1):
        R0 = q0.copy().reshape(3, 3).T.copy()
        V0 = _energy(field, R0)
        V_star = _base_vectors(_discrete_gradient(field, V0, R0, q1.copy().reshape(3, 3).T.copy()))
        dV_star = np.empty((9, 9))
        for k in range(9):
            beside = q1.copy()
            beside[k] += DIFFERENCE
            there = _base_vectors(_discrete_gradient(field, V0, R0, beside.reshape(3, 3).T.copy()))
            dV_star[:, k] = (there - V_star) / (beside[k] - q1[k])
        return V_star, dV_star

    return derivative
