"""Functions without branches, written once: in plain Python they run as they are, for machine code they are traced.

`trace(function)` is the function as kernels call it. It is run once with stand-ins for its arguments, `Value`, whose arithmetic
writes LLVM's instructions, so that the types of its inner functions need not be found out one by one: numba takes a tenth of a
second for each, which adds up to more than all that LLVM does. A product that is added at once is rounded once (FMA), as in
`SMALL`. Arguments and results are floats, integers, fours (`simd`) and tuples of these, named or not. Where an argument is
lanes (`lanes`), each of another body, floats are lanes and fours are `Axes`, three of these.
"""

from __future__ import annotations

import inspect
import math
from functools import update_wrapper
from typing import Any, NamedTuple

import numpy as np

from . import COMPILED
from . import vector as _vector
from .simd_numpy import LANES


class Value:
    """A float, an integer or a four of machine code."""

    def __init__(self, builder, ir_value):
        self.builder, self.ir = builder, ir_value

    def make(self, ir_value):
        """Another value of the same code."""
        return type(self)(self.builder, ir_value)

    def constant(self, x):
        """The machine code of the number x, as a value of this type."""
        return self.ir.type(x)

    def _read(self, x):
        return x.ir if isinstance(x, Value) else self.constant(x)

    def _operate(self, name, other, swapped=False):
        second = self._read(other)
        pair = (second, self.ir) if swapped else (self.ir, second)
        return self.make(getattr(self.builder, name)(*pair, flags=("contract",)))

    def __add__(self, other):
        return self._operate("fadd", other)

    def __radd__(self, other):
        return self._operate("fadd", other, swapped=True)

    def __sub__(self, other):
        return self._operate("fsub", other)

    def __rsub__(self, other):
        return self._operate("fsub", other, swapped=True)

    def __mul__(self, other):
        return self._operate("fmul", other)

    def __rmul__(self, other):
        return self._operate("fmul", other, swapped=True)

    def __truediv__(self, other):
        return self._operate("fdiv", other)

    def __rtruediv__(self, other):
        return self._operate("fdiv", other, swapped=True)

    def __neg__(self):
        return self.make(self.builder.fneg(self.ir))

    def __abs__(self):
        return self._call("llvm.fabs")

    def sqrt(self):
        """The square root."""
        return self._call("llvm.sqrt")

    def where_above(self, limit, x, other=0.0):
        """The value where x is above the limit, else the other; so also where x is not a number."""
        above = self.builder.fcmp_ordered(">", self._read(x), self._read(limit))
        return self.make(self.builder.select(above, self.ir, self._read(other)))

    def _call(self, name):
        return self.make(self.builder.call(self.builder.module.declare_intrinsic(name, [self.ir.type]), [self.ir]))


class Lanes(Value):
    """A float of each of several bodies, in one register."""

    def constant(self, x):
        """The machine code of the number x in every lane."""
        return ir.Constant(self.ir.type, [x] * self.ir.type.count)

    def _call(self, name):
        kind, module = self.ir.type, self.builder.module  # llvmlite has no names of intrinsics for vectors
        function = cgutils.get_or_insert_function(module, ir.FunctionType(kind, [kind]), f"{name}.v{kind.count}f64")
        return self.make(self.builder.call(function, [self.ir]))


class Axes(NamedTuple):
    """Three floats, or lanes, in place of a four."""

    x: Any
    y: Any
    z: Any

    def __add__(self, other):
        return Axes(*(a + b for a, b in zip(self, other, strict=True)))


def root(x):
    """The square root."""
    return x.sqrt() if isinstance(x, Value) else math.sqrt(x)


def over_root(x):
    """One over the square root; inf at 0."""
    return 1.0 / x.sqrt() if isinstance(x, Value) else 1.0 / math.sqrt(x) if x else math.inf


def where_above(value, limit, x, other=0.0):
    """The value where x is above the limit, else the other."""
    if isinstance(value, Value):
        return value.where_above(limit, x, other)
    return value if x > limit else other


def join(a, b, c, d):
    """Four floats as one value, of which all or none are of machine code, but for constants."""
    if isinstance(a, Lanes):
        return Axes(a, b, c)
    if not isinstance(a, Value):
        return np.array((a, b, c, d))
    value = ir.Constant(ir.VectorType(ir.DoubleType(), LANES), ir.Undefined)
    for place, each in enumerate((a, b, c, d)):
        part = each.ir if isinstance(each, Value) else ir.DoubleType()(each)
        value = a.builder.insert_element(value, part, ir.IntType(32)(place))
    return a.make(value)


def split(v):
    """The first three of four floats."""
    if isinstance(v, Axes):
        return tuple(v)
    if not isinstance(v, Value):
        return (float(v[0]), float(v[1]), float(v[2]))
    return tuple(v.make(v.builder.extract_element(v.ir, ir.IntType(32)(place))) for place in range(3))


add, cross, dot, scale, subtract, times = (
    getattr(f, "py_func", f) for f in (_vector.add, _vector.cross, _vector.dot, _vector.scale, _vector.subtract, _vector.times)
)
"""Those of `vector`."""

if COMPILED:
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.extending import intrinsic

    from .lanes_llvm import REGISTER
    from .lanes_llvm import Lanes as LanesType
    from .simd_llvm import FOUR

    LANES_TYPE = LanesType(REGISTER)
    _PLAIN = {FOUR: np.full(LANES, 0.7), types.float64: 0.7, types.int64: 5, LANES_TYPE: 0.7}

    def _stand_in(kind):
        """A value of a type, with which a function can be run in Python."""
        if not isinstance(kind, types.BaseTuple):
            return _PLAIN[types.int64 if isinstance(kind, types.Integer) else kind]
        return _PLAIN[FOUR] if _is_axes(kind) else _assemble(kind, [_stand_in(each) for each in kind])

    def _is_axes(kind):
        return getattr(kind, "instance_class", None) is Axes

    def _assemble(kind, values):
        return kind.instance_class(*values) if isinstance(kind, types.BaseNamedTuple) else tuple(values)

    def _has_lanes(kind):
        return any(map(_has_lanes, kind)) if isinstance(kind, types.BaseTuple) else kind == LANES_TYPE

    def _type_of(value, lanes):
        if isinstance(value, tuple):
            return types.Tuple([_type_of(each, lanes) for each in value])
        four, number = (types.NamedUniTuple(LANES_TYPE, 3, Axes), LANES_TYPE) if lanes else (FOUR, types.float64)
        return four if isinstance(value, np.ndarray) else number

    def _unpack(builder, kind, value):
        if kind == LANES_TYPE:
            return Lanes(builder, builder.extract_value(value, 0))
        if not isinstance(kind, types.BaseTuple):
            return Value(builder, value)
        values = cgutils.unpack_tuple(builder, value, len(kind))
        return _assemble(kind, [_unpack(builder, *each) for each in zip(kind, values, strict=True)])

    def _pack(context, builder, kind, value):
        if isinstance(kind, types.BaseTuple):
            return context.make_tuple(builder, kind, [_pack(context, builder, *each) for each in zip(kind, value, strict=True)])
        if kind == LANES_TYPE:
            whole = ir.Constant(context.get_value_type(kind), ir.Undefined)
            part = value.ir if isinstance(value, Value) else ir.Constant(whole.type.elements[0], [value] * REGISTER)
            return builder.insert_value(whole, part, 0)
        return value.ir if isinstance(value, Value) else context.get_constant(kind, value)

    def trace(function):
        """The function as an intrinsic of numba's."""

        def traced(typing, *kinds):
            found = _type_of(function(*map(_stand_in, kinds)), any(map(_has_lanes, kinds)))

            def build(context, builder, sig, args):
                pairs = zip(sig.args, args, strict=True)
                return _pack(context, builder, found, function(*(_unpack(builder, *pair) for pair in pairs)))

            return found(*kinds), build

        parameters = inspect.signature(function).parameters.values()
        context = inspect.Parameter("typing", inspect.Parameter.POSITIONAL_OR_KEYWORD)
        traced.__signature__ = inspect.Signature([context, *(each.replace(annotation=each.empty) for each in parameters)])
        return intrinsic(update_wrapper(traced, function, ("__module__", "__name__", "__qualname__", "__doc__"), ()))

else:

    def trace(function):
        """The function itself."""
        return function
