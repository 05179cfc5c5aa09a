"""Functions without branches, written once: in plain Python they run as they are, for machine code they are traced.

`trace(function)` is the function as kernels call it. It is run once with stand-ins for its arguments, `Value`, whose arithmetic
writes LLVM's instructions, so that the types of its inner functions need not be found out one by one: numba takes a tenth of a
second for each, which adds up to more than all that LLVM does. A product that is added at once is rounded once (FMA), as in
`SMALL`. Arguments and results are floats, integers, fours (`simd`) and tuples of these, named or not.
"""

from __future__ import annotations

import inspect
import math
from functools import update_wrapper

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
        return Value(self.builder, ir_value)

    def _operate(self, name, other, swapped=False):
        constant = not isinstance(other, Value)
        second = self.ir.type(other) if constant else other.ir
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

    def where_above(self, limit, x):
        """The value where x is above the limit, else 0; not a number in x gives 0."""
        above = self.builder.fcmp_ordered(">", x.ir, limit.ir if isinstance(limit, Value) else x.ir.type(limit))
        return self.make(self.builder.select(above, self.ir, self.ir.type(0.0)))

    def _call(self, name):
        return self.make(self.builder.call(self.builder.module.declare_intrinsic(name, [self.ir.type]), [self.ir]))


def root(x):
    """The square root."""
    return x.sqrt() if isinstance(x, Value) else math.sqrt(x)


def over_root(x):
    """One over the square root; inf at 0."""
    return 1.0 / x.sqrt() if isinstance(x, Value) else 1.0 / math.sqrt(x) if x else math.inf


def where_above(value, limit, x):
    """The value where x is above the limit, else 0."""
    if isinstance(value, Value):
        return value.where_above(limit, x)
    return value if x > limit else 0.0


def join(a, b, c, d):
    """Four floats as one value, of which all or none are of machine code, but for constants."""
    if not isinstance(a, Value):
        return np.array((a, b, c, d))
    value = ir.Constant(ir.VectorType(ir.DoubleType(), LANES), ir.Undefined)
    for place, each in enumerate((a, b, c, d)):
        part = each.ir if isinstance(each, Value) else ir.DoubleType()(each)
        value = a.builder.insert_element(value, part, ir.IntType(32)(place))
    return a.make(value)


def split(v):
    """The first three of four floats."""
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

    from .simd_llvm import FOUR

    _PLAIN = {FOUR: np.full(LANES, 0.7), types.float64: 0.7, types.int64: 5}

    def _stand_in(kind):
        """A value of a type, with which a function can be run in Python."""
        if not isinstance(kind, types.BaseTuple):
            return _PLAIN[types.int64 if isinstance(kind, types.Integer) else kind]
        return _assemble(kind, [_stand_in(each) for each in kind])

    def _assemble(kind, values):
        return kind.instance_class(*values) if isinstance(kind, types.BaseNamedTuple) else tuple(values)

    def _type_of(value):
        if isinstance(value, tuple):
            return types.Tuple([_type_of(each) for each in value])
        return FOUR if isinstance(value, np.ndarray) else types.float64

    def _unpack(builder, kind, value):
        if not isinstance(kind, types.BaseTuple):
            return Value(builder, value)
        values = cgutils.unpack_tuple(builder, value, len(kind))
        return _assemble(kind, [_unpack(builder, *each) for each in zip(kind, values, strict=True)])

    def _pack(context, builder, kind, value):
        if not isinstance(kind, types.BaseTuple):
            return value.ir if isinstance(value, Value) else context.get_constant(kind, value)
        parts = [_pack(context, builder, *each) for each in zip(kind, value, strict=True)]
        return context.make_tuple(builder, kind, parts)

    def trace(function):
        """The function as an intrinsic of numba's."""

        def traced(typing, *kinds):
            found = _type_of(function(*map(_stand_in, kinds)))

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
