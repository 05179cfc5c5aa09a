"""A field given by Python functions, called from the compiled loop through a C pointer.

For each question the loop writes what it asks about into a new array, a talk, and finds the answer behind it; all arithmetic is
done in Python, by `conservative.potentials.python_function`, so that nothing but these few lines is compiled.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ..errors import PotentialFailed
from . import COMPILED, kernel
from .fields import body_torque, energy, finite_derivative, finite_torque, implements

BODY_TORQUE, FINITE_TORQUE, FINITE_DERIVATIVE, ENERGY = 0, 1, 2, 3
FAILED = 1
STATE, GIVEN, ANSWER = 9, 27, 90
"""Where the state begins, and how many numbers are given and answered."""


class Function(NamedTuple):
    """Address of a C function int64(int64 what, int64 address of a talk), which returns FAILED or 0; rows of the frame R_BP.

    A talk is R_BP (9), the state (18) and the answer (90). BODY_TORQUE: q to T. FINITE_TORQUE: q, a to T and its derivative by
    a, column by column. FINITE_DERIVATIVE: q0, q1 to V* and its derivative by q1, row by row. ENERGY: q to V.
    """

    address: int
    first: Any
    second: Any
    third: Any


@intrinsic
def _call_compiled(typingctx, address, what, talk):
    """Call the C function at `address` with the int64 `what` and the address of a talk."""

    def code(context, builder, signature, arguments):
        function = ir.FunctionType(ir.IntType(64), [ir.IntType(64), ir.IntType(64)])
        return builder.call(builder.inttoptr(arguments[0], function.as_pointer()), arguments[1:])

    return types.int64(types.int64, types.int64, types.int64), code


def _call_plain(address, what, talk):
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)(address)(what, int(talk))


_call = _call_compiled if COMPILED else _call_plain


@kernel
def _begin(field):
    talk = np.zeros(GIVEN + ANSWER)
    talk[0], talk[1], talk[2] = field.first
    talk[3], talk[4], talk[5] = field.second
    talk[6], talk[7], talk[8] = field.third
    return talk


@kernel
def _begin_at(field, q):
    talk = _begin(field)
    talk[STATE], talk[STATE + 1], talk[STATE + 2], talk[STATE + 3] = q
    return talk


@kernel
def _ask(field, what, talk):
    """Return the answer, a view into the talk."""
    if _call(field.address, what, np.int64(talk.ctypes.data)) == FAILED:
        raise PotentialFailed
    return talk[GIVEN:]


@kernel
def _triple(v, i):
    return (v[i], v[i + 1], v[i + 2])


@implements(energy, Function)
def _energy_function(field, q):
    return _ask(field, ENERGY, _begin_at(field, q))[0]


@implements(body_torque, Function)
def _body_torque_function(field, q):
    return _triple(_ask(field, BODY_TORQUE, _begin_at(field, q)), 0)


@implements(finite_torque, Function)
def _finite_torque_function(field, q, a):
    talk = _begin_at(field, q)
    talk[STATE + 4], talk[STATE + 5], talk[STATE + 6] = a
    v = _ask(field, FINITE_TORQUE, talk)
    return _triple(v, 0), (_triple(v, 3), _triple(v, 6), _triple(v, 9))


@implements(finite_derivative, Function)
def _finite_derivative_function(field, q0, q1):
    talk = _begin(field)
    talk[STATE : STATE + 9], talk[STATE + 9 : GIVEN] = q0, q1
    v = _ask(field, FINITE_DERIVATIVE, talk)
    return v[:9].copy(), v[9:].copy().reshape(9, 9)
