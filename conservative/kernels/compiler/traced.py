"""Compiled functions without branches, made from plain Python by tracing.

`trace(function)` runs a function once with `Symbol`s in place of its arguments; their arithmetic emits LLVM instructions. Numba
then has no types of inner functions to infer, which takes a tenth of a second each. Arguments and results are floats, integers,
truth values, `Lanes`, and tuples of these, named or not. One source therefore serves one body and several: `Lanes` contain one
float per body. With plain Python kernels, `trace` returns the function itself.

A product and the sum after it are rounded once (the flag "contract"), as in `kernels.SMALL`.
"""

from __future__ import annotations

import inspect
from functools import cache

import numpy as np

from ...arithmetic import Traced
from . import COMPILED

FOUR = 4
"""Floats of a register that belong to one body."""

if not COMPILED:
    REGISTER = 1

    def trace(function):
        """Return the function itself."""
        return function

else:
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.core.registry import cpu_target
    from numba.extending import lower_builtin, models, register_model, type_callable

    DOUBLE, BIT, INTEGER, INDEX = ir.DoubleType(), ir.IntType(1), ir.IntType(64), ir.IntType(32)
    REGISTER = 2 * FOUR if "+avx512f" in str(cpu_target.target_context.codegen().magic_tuple()) else FOUR
    """Floats of several bodies in a register: all of AVX-512's eight, otherwise four. Eight take 0.53 of the time of four for a
    body's step of `Taylor`, and 0.74 for one of `Reduced` (measured on Zen 5). Shorter registers take several operations."""

    def floats_in_register(width):
        """Return the floats in each register of a number with `width` floats."""
        return FOUR if width % REGISTER else REGISTER

    class Lanes(types.Type):
        """The numba type of a number with `width` floats."""

        def __init__(self, width):
            self.width = width
            super().__init__(name=f"Lanes({width})")

    class Mask(types.Type):
        """The numba type of `width` truth values."""

        def __init__(self, width):
            self.width = width
            super().__init__(name=f"Mask({width})")

    @register_model(Lanes)
    @register_model(Mask)
    class _RegistersModel(models.PrimitiveModel):
        """Lanes and masks in memory: whole registers."""

        def __init__(self, manager, kind):
            element, floats = DOUBLE if isinstance(kind, Lanes) else BIT, floats_in_register(kind.width)
            super().__init__(manager, kind, ir.LiteralStructType([ir.VectorType(element, floats)] * (kind.width // floats)))

    class Symbol(Traced):
        """A number of compiled code: a float, an integer, a truth value, or lanes of floats or truth values.

        `registers` are its LLVM values: one, or for lanes one per `REGISTER` floats. Every operation is emitted once per
        register, so that results do not depend on the number of lanes.
        """

        def __init__(self, builder, registers, flags=("contract",)):
            self.builder, self.registers, self.flags = builder, tuple(registers), flags

        __hash__ = object.__hash__

        @property
        def width(self):
            """Number of lanes; 0 for a single number."""
            kind = self.registers[0].type
            return kind.count * len(self.registers) if isinstance(kind, ir.VectorType) else 0

        def broadcast(self, x):
            """Return the registers of a number x with as many lanes as this one."""
            floats = self.width // len(self.registers)
            if not isinstance(x, Symbol):
                kind = ir.VectorType(DOUBLE, floats) if floats else DOUBLE
                return [ir.Constant(kind, [float(x)] * floats if floats else float(x))] * len(self.registers)
            value = x.registers[0]
            if value.type == INTEGER:
                value = self.builder.sitofp(value, DOUBLE)
            if x.width or not self.width:
                return x.registers if x.width else (value,)
            vector = ir.VectorType(value.type, floats)
            first = self.builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(INDEX, 0))
            everywhere = ir.Constant(ir.VectorType(INDEX, floats), [0] * floats)
            return [self.builder.shuffle_vector(first, first, everywhere)] * len(self.registers)

        def emit(self, operation, *numbers):
            """Return the result of an operation on registers, for numbers that may be lanes, single numbers or constants."""
            widest = max((x for x in numbers if isinstance(x, Symbol)), key=lambda x: x.width)
            registers = zip(*(widest.broadcast(x) for x in numbers), strict=True)
            return Symbol(self.builder, [operation(*register) for register in registers], self.flags)

        def call(self, name, *numbers):
            """Return the result of an LLVM intrinsic such as "sqrt"."""

            def operation(*registers):
                kind = registers[0].type
                suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
                function_type = ir.FunctionType(kind, [kind] * len(registers))
                module = self.builder.module
                return self.builder.call(
                    cgutils.get_or_insert_function(module, function_type, f"llvm.{name}.{suffix}"), registers
                )

            return self.emit(operation, *numbers)

        @staticmethod
        def _arithmetic(name):
            """Return the methods of an operation for a number that is its left and its right operand."""

            def left(self, other):
                return self.emit(lambda a, b: getattr(self.builder, name)(a, b, flags=self.flags), self, other)

            def right(self, other):
                return self.emit(lambda a, b: getattr(self.builder, name)(b, a, flags=self.flags), self, other)

            return left, right

        @staticmethod
        def _comparison(sign):
            return lambda self, other: self.emit(lambda a, b: self.builder.fcmp_ordered(sign, a, b), self, other)

        __add__, __radd__ = _arithmetic("fadd")
        __sub__, __rsub__ = _arithmetic("fsub")
        __mul__, __rmul__ = _arithmetic("fmul")
        __truediv__, __rtruediv__ = _arithmetic("fdiv")
        __gt__, __ge__, __lt__, __le__, __eq__ = map(_comparison, (">", ">=", "<", "<=", "=="))

        def __neg__(self):
            return self.emit(self.builder.fneg, self)

        def __abs__(self):
            return self.call("fabs", self)

        def __and__(self, other):
            return self.emit(self.builder.and_, self, other)

        def __or__(self, other):
            return self.emit(self.builder.or_, self, other)

        def __invert__(self):
            return self.emit(self.builder.not_, self)

        def __bool__(self):
            raise TypeError("a traced function cannot branch on a number")

        def fuse(self, a, b, c):
            """Return a b + c, rounded once."""
            return self.call("fma", a, b, c)

        def root(self):
            """Return the square root."""
            return self.call("sqrt", self)

        def choose(self, a, b):
            """Return a where this mask is true and b elsewhere."""
            return self.emit(self.builder.select, self, a, b)

        def split(self):
            """Return the floats of one register."""
            (register,) = self.registers
            places = (ir.Constant(INDEX, i) for i in range(FOUR))
            return tuple(Symbol(self.builder, [self.builder.extract_element(register, i)], self.flags) for i in places)

        def shuffle(self, places):
            """Return the floats of a register at these places."""
            at = ir.Constant(ir.VectorType(INDEX, FOUR), places)
            return self.emit(lambda register: self.builder.shuffle_vector(register, register, at), self)

        def reduce(self, name):
            """Return whether every ("and") or some ("or") truth value is true."""
            whole, *rest = self.registers
            for part in rest:
                whole = getattr(self.builder, f"{name}_")(whole, part)
            if self.width:
                function_type = ir.FunctionType(BIT, [whole.type])
                name = f"llvm.vector.reduce.{name}.v{whole.type.count}i1"
                whole = self.builder.call(cgutils.get_or_insert_function(self.builder.module, function_type, name), [whole])
            return Symbol(self.builder, [whole], self.flags)

    def unpack(builder, kind, value, flags=("contract",)):
        """Return the symbols of an LLVM value of a numba type: one, or a tuple of them."""
        if isinstance(kind, types.NoneType):
            return None
        if isinstance(kind, types.BaseTuple):
            parts = cgutils.unpack_tuple(builder, value, len(kind))
            numbers = [unpack(builder, *typed, flags) for typed in zip(kind, parts, strict=True)]
            return kind.instance_class(*numbers) if isinstance(kind, types.BaseNamedTuple) else tuple(numbers)
        if isinstance(kind, Lanes | Mask):
            count = kind.width // floats_in_register(kind.width)
            return Symbol(builder, [builder.extract_value(value, i) for i in range(count)], flags)
        return Symbol(builder, [value], flags)

    def pack(context, builder, kind, value):
        """Return the LLVM value of a numba type of a symbol, a constant or a tuple of them."""
        if isinstance(kind, types.BaseTuple):
            parts = [pack(context, builder, *typed) for typed in zip(kind, value, strict=True)]
            return context.make_tuple(builder, kind, parts)
        if value is None:
            return context.get_dummy_value()
        if not isinstance(value, Symbol):
            return context.get_constant(kind, value)
        if not value.width:
            return value.registers[0]
        whole = ir.Constant(ir.LiteralStructType([part.type for part in value.registers]), ir.Undefined)
        for i, part in enumerate(value.registers):
            whole = builder.insert_value(whole, part, i)
        return whole

    def type_of(value):
        """Return the numba type of a symbol, a constant or a tuple of them."""
        if value is None:
            return types.none
        if isinstance(value, tuple):
            named = type(value) if hasattr(value, "_fields") else None
            return types.BaseTuple.from_types([type_of(part) for part in value], named)
        if not isinstance(value, Symbol):
            return types.boolean if isinstance(value, bool) else types.int64 if isinstance(value, int) else types.float64
        kind = value.registers[0].type
        if value.width:
            return (Lanes if kind.element == DOUBLE else Mask)(value.width)
        return {DOUBLE: types.float64, BIT: types.boolean, INTEGER: types.int64}[kind]

    @cache
    def _find_type(function, kinds):
        """Return the type of a function's result. The function is traced into a temporary module."""
        context = cpu_target.target_context
        arguments = [context.get_value_type(kind) for kind in kinds]
        whole = ir.Function(ir.Module(), ir.FunctionType(INDEX, arguments), "trial")
        builder = ir.IRBuilder(whole.append_basic_block())
        return type_of(function(*(unpack(builder, *typed) for typed in zip(kinds, whole.args, strict=True))))

    def trace(function):
        """Register a function with numba and return it unchanged."""

        @type_callable(function)
        def find_type(_):
            def signature_of(*kinds):
                # A value that may be None by its type is not None here: numba's cast checks it.
                kinds = tuple(kind.type if isinstance(kind, types.Optional) else kind for kind in kinds)
                kinds = tuple(types.int64 if isinstance(kind, types.Integer) else kind for kind in kinds)
                return _find_type(function, kinds)(*kinds)

            signature_of.pysig = inspect.signature(function)
            return signature_of

        @lower_builtin(function, types.VarArg(types.Any))
        def build(context, builder, signature, arguments):
            numbers = (unpack(builder, *typed) for typed in zip(signature.args, arguments, strict=True))
            return pack(context, builder, signature.return_type, function(*numbers))

        return function


def fast_log2(x):
    """Return log2 of a float above 0, at most 0.087 too small: interpolated between powers of 2. That of 0 is -1023."""
    if not isinstance(x, Traced):
        return float(np.float64(x).view(np.int64)) * 2.0**-52 - 1023.0
    return Symbol(x.builder, [x.builder.sitofp(x.builder.bitcast(x.registers[0], INTEGER), DOUBLE)]) * 2.0**-52 - 1023.0


def fast_exp2(x):
    """Return the inverse of `fast_log2`: at most 1.062 times too large."""
    bits = (x + 1023.0) * 2.0**52
    if not isinstance(x, Traced):
        return float(np.int64(bits).view(np.float64))
    return Symbol(x.builder, [x.builder.bitcast(x.builder.fptosi(bits.registers[0], INTEGER), DOUBLE)])


def lanes_like(number, values):
    """Return floats as a number with a lane for each if `number` is of compiled code, otherwise as they are: an array."""
    if not isinstance(number, Traced):
        return values
    floats = floats_in_register(len(values))
    parts = (values[i : i + floats].tolist() for i in range(0, len(values), floats))
    return Symbol(number.builder, [ir.Constant(ir.VectorType(DOUBLE, floats), part) for part in parts])


def add_lanes(x):
    """Return the sum of the lanes, added in any order."""
    if not isinstance(x, Traced):
        return float(sum(x))
    whole, *rest = x.registers
    for part in rest:
        whole = x.builder.fadd(whole, part)
    function_type = ir.FunctionType(DOUBLE, [DOUBLE, whole.type])
    name = f"llvm.vector.reduce.fadd.v{whole.type.count}f64"
    function = cgutils.get_or_insert_function(x.builder.module, function_type, name)
    # -0.0 is the neutral element of sums. With "reassoc" LLVM adds halves, instead of one float after the other.
    return Symbol(x.builder, [x.builder.call(function, [ir.Constant(DOUBLE, -0.0), whole], fastmath=("reassoc",))])


def join(a, b, c, d):
    """Return four floats as one number with a lane per component; in plain Python an array."""
    symbol = next((x for x in (a, b, c, d) if isinstance(x, Traced)), None)
    if symbol is None:
        return np.array((a, b, c, d))
    value = ir.Constant(ir.VectorType(DOUBLE, FOUR), ir.Undefined)
    for place, x in enumerate((a, b, c, d)):
        value = symbol.builder.insert_element(value, *symbol.broadcast(x), ir.Constant(INDEX, place))
    return Symbol(symbol.builder, [value], symbol.flags)
