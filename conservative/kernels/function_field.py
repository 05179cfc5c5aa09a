"""A field given by Python functions, called from compiled code.

Each evaluation writes the inputs into a buffer and calls a Python object, which writes the outputs behind them. All of the
arithmetic is in `conservative.potentials.callback`.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from ..arithmetic import Traced
from ..potentials.callback import N_INPUTS, N_OUTPUTS
from . import COMPILED

if COMPILED:
    from llvmlite import ir
    from numba.core import cgutils
    from numba.core.registry import cpu_target

    from .compiler.traced import DOUBLE, INDEX, INTEGER, Symbol

BODY_TORQUE, FINITE_TORQUE, FINITE_DERIVATIVE, ENERGY, TORQUES, DAMPING, WHEEL = range(7)


def evaluate(field, what, *state):
    """Return the outputs of an evaluation of this kind.

    The inputs are R_BP (9) and the state (18). BODY_TORQUE: q, and t if the field depends on time, to T. FINITE_TORQUE: q, a to
    T and its derivative by a, column by column. FINITE_DERIVATIVE: q0, q1 to V* and its derivative by q1, row by row. ENERGY: q
    to V. The last three take t, the window (`conservative.potentials.load`), and q if they depend on the attitude. TORQUES: to
    the torques in body and world axes. DAMPING: to the rows of the matrix. WHEEL: to the momentum of the rotor.
    """
    inputs = [x for row in field.rows for x in row] + [x for part in state for x in part]
    inputs += [0.0] * (N_INPUTS - len(inputs))
    if not isinstance(field.address, Traced):
        buffer = np.array(inputs + [0.0] * N_OUTPUTS)
        ctypes.cast(int(field.address), ctypes.py_object).value(what, buffer.ctypes.data)
        return buffer[N_INPUTS:].tolist()
    builder, context = field.address.builder, cpu_target.target_context
    buffer = cgutils.alloca_once(builder, DOUBLE, size=N_INPUTS + N_OUTPUTS)
    places = [builder.gep(buffer, [ir.Constant(INDEX, i)]) for i in range(N_INPUTS + N_OUTPUTS)]
    for x, place in zip(inputs, places, strict=False):
        builder.store(x.registers[0] if isinstance(x, Symbol) else ir.Constant(DOUBLE, x), place)
    # PyObject_CallFunction, because what Python raises, or a handler of signals while it runs, ends the kernel and comes out of
    # it as it is. A callback of ctypes would lose what handlers raise before its first line, and go on.
    python = context.get_python_api(builder)
    lock = python.gil_ensure()
    kind = ir.FunctionType(python.pyobj, [python.pyobj, ir.IntType(8).as_pointer()], var_arg=True)
    call = cgutils.get_or_insert_function(builder.module, kind, "PyObject_CallFunction")
    function = builder.inttoptr(field.address.registers[0], python.pyobj)
    arguments = ir.Constant(INTEGER, what), builder.ptrtoint(buffer, INTEGER)
    result = builder.call(call, [function, context.insert_const_string(builder.module, "LL"), *arguments])
    with cgutils.if_unlikely(builder, cgutils.is_null(builder, result)):
        python.gil_release(lock)
        context.call_conv.return_exc(builder)
    python.decref(result)
    python.gil_release(lock)
    return [Symbol(builder, [builder.load(place)]) for place in places[N_INPUTS:]]


class Function(NamedTuple):
    """Address of the Python object that is called, and the rows of the frame R_BP (`conservative.potentials.field`)."""

    address: Any
    rows: Any

    def energy(self, q):
        """Return V in J."""
        return evaluate(self, ENERGY, q)[0]

    def body_torque(self, q):
        """Return the torque in N m."""
        return tuple(evaluate(self, BODY_TORQUE, q)[:3])

    def finite_torque(self, q, a):
        """Return the torque of a step and its derivative by a."""
        v = evaluate(self, FINITE_TORQUE, q, a)
        return tuple(v[:3]), (tuple(v[3:6]), tuple(v[6:9]), tuple(v[9:12]))

    def all_finite_derivatives(self, q0, q1):
        """Return V* (9) and its derivative by q1 (81)."""
        v = evaluate(self, FINITE_DERIVATIVE, *q0, *q1)
        return tuple(v[:9]), tuple(v[9:])


class Torques(NamedTuple):
    """Address of the Python object that is called for a torque (`conservative.potentials.load`), and the rows of R_BP."""

    address: Any
    rows: Any

    def at(self, t, first, last, *q):
        """Return the torques in body and in world axes, N m, at a time, s, in a window."""
        v = evaluate(self, TORQUES, (t, first, last), *q)
        return tuple(v[:3]), tuple(v[3:6])


class DampingInTime(NamedTuple):
    """Address of the Python object that is called for a damping, and the rows of R_BP."""

    address: Any
    rows: Any

    def at(self, t, first, last, *q):
        """Return the rows of the matrix, N m s, at a time, s, in a window."""
        v = evaluate(self, DAMPING, (t, first, last), *q)
        return tuple(v[:3]), tuple(v[3:6]), tuple(v[6:9])


class TorquesOfAttitude(NamedTuple):
    """As `Torques`, for a function of time and attitude; `now` has the time and its window, s."""

    address: Any
    rows: Any
    now: Any = (0.0, 0.0, 0.0)

    def at(self, t, first, last, *q):
        """Return the torques as `Torques.at`."""
        return Torques.at(self, t, first, last, *q)


class DampingOfAttitude(NamedTuple):
    """As `DampingInTime`, for a function of time and attitude; `now` has the time and its window, s."""

    address: Any
    rows: Any
    now: Any = (0.0, 0.0, 0.0)

    def at(self, t, first, last, *q):
        """Return the rows of the matrix as `DampingInTime.at`."""
        return DampingInTime.at(self, t, first, last, *q)


class Wheel(NamedTuple):
    """Address of the Python object that is called for the momentum of a rotor with a motor, and the rows of R_BP."""

    address: Any
    rows: Any

    def at(self, t, first, last):
        """Return the momentum, kg m^2/s, at a time, s, in a window."""
        return tuple(evaluate(self, WHEEL, (t, first, last))[:3])


class FunctionInTime(NamedTuple):
    """A `Function` at a time, s. The energy is 0: no invariant of such a field needs it."""

    address: Any
    rows: Any
    t: Any

    def at_time(self, t):
        """Return the field at a time t, s."""
        return self._replace(t=t)

    def energy(self, q):
        """Return 0."""
        return 0.0

    def body_torque(self, q):
        """Return the torque in N m."""
        return tuple(evaluate(self, BODY_TORQUE, q, (self.t,))[:3])
