"""A field given by Python functions, called from the compiled loop.

For each evaluation the loop writes the inputs into a new buffer, and what it calls writes the outputs behind them. All of the
arithmetic is Python's, in `conservative.potentials.callback`: nothing but these few lines is compiled.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from . import COMPILED, kernel
from .fields import body_torque, energy, finite_derivative, finite_torque, implements

BODY_TORQUE, FINITE_TORQUE, FINITE_DERIVATIVE, ENERGY = 0, 1, 2, 3
STATE, N_INPUTS, N_OUTPUTS = 9, 27, 90
"""Index of the state in a buffer, and numbers of inputs and outputs."""


class Function(NamedTuple):
    """Address of a Python object that is called with what to do and the address of a buffer; rows of the frame R_BP.

    A buffer holds R_BP (9), the state (18) and the outputs (90). BODY_TORQUE: q to T. FINITE_TORQUE: q, a to T and its
    derivative by a, column by column. FINITE_DERIVATIVE: q0, q1 to V* and its derivative by q1, row by row. ENERGY: q to V.
    """

    address: int
    first: Any
    second: Any
    third: Any


@intrinsic
def _call_compiled(typingctx, function, what, buffer):
    """Call the Python object at the address `function` with the int64 `what` and the address of a buffer.

    What it raises, or a handler of signals while it runs, ends the kernel and comes out of it as it is. A callback of ctypes
    would lose what handlers raise before its first line, and go on.
    """

    def code(context, builder, signature, arguments):
        python = context.get_python_api(builder)
        lock = python.gil_ensure()
        kind = ir.FunctionType(python.pyobj, [python.pyobj, ir.IntType(8).as_pointer()], var_arg=True)
        call = cgutils.get_or_insert_function(builder.module, kind, "PyObject_CallFunction")
        numbers = context.insert_const_string(builder.module, "LL")
        found = builder.call(call, [builder.inttoptr(arguments[0], python.pyobj), numbers, *arguments[1:]])
        with cgutils.if_unlikely(builder, cgutils.is_null(builder, found)):
            python.gil_release(lock)
            context.call_conv.return_exc(builder)
        python.decref(found)
        python.gil_release(lock)
        return context.get_dummy_value()

    return types.none(types.int64, types.int64, types.int64), code


def _call_plain(function, what, buffer):
    ctypes.cast(int(function), ctypes.py_object).value(int(what), int(buffer))


_call = _call_compiled if COMPILED else _call_plain


@kernel
def _allocate(field):
    buffer = np.zeros(N_INPUTS + N_OUTPUTS)
    buffer[0], buffer[1], buffer[2] = field.first
    buffer[3], buffer[4], buffer[5] = field.second
    buffer[6], buffer[7], buffer[8] = field.third
    return buffer


@kernel
def fill(field, q):
    """Return a new buffer with the frame and the quaternion."""
    buffer = _allocate(field)
    buffer[STATE], buffer[STATE + 1], buffer[STATE + 2], buffer[STATE + 3] = q
    return buffer


@kernel
def evaluate(field, what, buffer):
    """Return the outputs, a view into the buffer."""
    _call(np.int64(field.address), np.int64(what), np.int64(buffer.ctypes.data))
    return buffer[N_INPUTS:]


@kernel
def _triple(v, i):
    return (v[i], v[i + 1], v[i + 2])


@implements(energy, Function)
def _energy_function(field, q):
    return evaluate(field, ENERGY, fill(field, q))[0]


@implements(body_torque, Function)
def _body_torque_function(field, q):
    return _triple(evaluate(field, BODY_TORQUE, fill(field, q)), 0)


@implements(finite_torque, Function)
def _finite_torque_function(field, q, a):
    buffer = fill(field, q)
    buffer[STATE + 4], buffer[STATE + 5], buffer[STATE + 6] = a
    v = evaluate(field, FINITE_TORQUE, buffer)
    return _triple(v, 0), (_triple(v, 3), _triple(v, 6), _triple(v, 9))


@implements(finite_derivative, Function)
def _finite_derivative_function(field, q0, q1):
    buffer = _allocate(field)
    buffer[STATE : STATE + 9], buffer[STATE + 9 : N_INPUTS] = q0, q1
    v = evaluate(field, FINITE_DERIVATIVE, buffer)
    return v[:9].copy(), v[9:].copy().reshape(9, 9)
