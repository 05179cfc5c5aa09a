"""A field given by Python functions, called from the compiled loop through a C pointer.

The loop writes what it asks about into one array and finds the answer in another; all arithmetic is done in Python, by
`conservative.potentials.python_function`, so that nothing but these few lines is compiled.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ..errors import PotentialFailed
from . import COMPILED, kernel
from .fields import body_torque, energy, finite_derivative, finite_torque, implements

BODY_TORQUE, FINITE_TORQUE, FINITE_DERIVATIVE, ENERGY = 0, 1, 2, 3
FAILED = 1


class Function(NamedTuple):
    """Address of a C function int64(int64) that reads `given` (18,) and writes `answer` (90,); it returns FAILED or 0.

    BODY_TORQUE: q to T. FINITE_TORQUE: q, a to T and its derivative by a, column by column. FINITE_DERIVATIVE: q0, q1 to V* and
    its derivative by q1, row by row. ENERGY: q to V.
    """

    address: int
    given: Any
    answer: Any


@intrinsic
def _call_compiled(typingctx, address, what):
    """Call the C function at `address` with the int64 `what`."""

    def code(context, builder, signature, arguments):
        function = ir.FunctionType(ir.IntType(64), [ir.IntType(64)])
        return builder.call(builder.inttoptr(arguments[0], function.as_pointer()), [arguments[1]])

    return types.int64(types.int64, types.int64), code


def _call_plain(address, what):
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(address)(what)


_call = _call_compiled if COMPILED else _call_plain


@kernel
def _ask(field, what):
    if _call(field.address, what) == FAILED:
        raise PotentialFailed


@kernel
def _triple(v, i):
    return (v[i], v[i + 1], v[i + 2])


@implements(energy, Function)
def _energy_function(field, q):
    field.given[0], field.given[1], field.given[2], field.given[3] = q
    _ask(field, ENERGY)
    return field.answer[0]


@implements(body_torque, Function)
def _body_torque_function(field, q):
    field.given[0], field.given[1], field.given[2], field.given[3] = q
    _ask(field, BODY_TORQUE)
    return _triple(field.answer, 0)


@implements(finite_torque, Function)
def _finite_torque_function(field, q, a):
    field.given[0], field.given[1], field.given[2], field.given[3] = q
    field.given[4], field.given[5], field.given[6] = a
    _ask(field, FINITE_TORQUE)
    v = field.answer
    return _triple(v, 0), (_triple(v, 3), _triple(v, 6), _triple(v, 9))


@implements(finite_derivative, Function)
def _finite_derivative_function(field, q0, q1):
    field.given[:9], field.given[9:] = q0, q1
    _ask(field, FINITE_DERIVATIVE)
    return field.answer[:9].copy(), field.answer[9:].copy().reshape(9, 9)
