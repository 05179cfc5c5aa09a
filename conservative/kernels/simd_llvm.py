"""Four floats at once as a numba type. On processors without 256-bit registers LLVM splits the operations."""

from __future__ import annotations

import operator

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

LANES = 4
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)


class Four(types.Type):
    """The type of four floats."""

    def __init__(self) -> None:
        super().__init__(name="Four")


FOUR = Four()


@register_model(Four)
class _FourModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type) -> None:
        super().__init__(manager, fe_type, _VECTOR)


def _operation(symbol, build) -> None:
    class Template(ConcreteTemplate):
        cases = [signature(FOUR, FOUR, FOUR)]  # noqa: RUF012  (numba's protocol)

    infer_global(symbol)(Template)
    lower_builtin(symbol, FOUR, FOUR)(lambda context, builder, sig, args: build(builder, *args))


_operation(operator.add, lambda builder, a, b: builder.fadd(a, b))
_operation(operator.sub, lambda builder, a, b: builder.fsub(a, b))
_operation(operator.mul, lambda builder, a, b: builder.fmul(a, b))
_operation(operator.truediv, lambda builder, a, b: builder.fdiv(a, b))


def _splat(builder, x):
    first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), x, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


@infer_global(operator.mul)
class _FloatTimesFour(ConcreteTemplate):
    cases = [signature(FOUR, types.float64, FOUR)]  # noqa: RUF012  (numba's protocol)


@lower_builtin(operator.mul, types.float64, FOUR)
def _float_times_four(context, builder, sig, args):
    return builder.fmul(_splat(builder, args[0]), args[1])


@intrinsic
def splat(typing, x):
    """The same float four times."""
    return FOUR(types.float64), lambda context, builder, sig, args: _splat(builder, args[0])


def _address(context, builder, array_type, array, index):
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


@intrinsic
def four(typing, array, index):
    """array[index : index + 4] of a contiguous array of floats of one dimension; no bounds are checked."""

    def build(context, builder, sig, args):
        return builder.load(_address(context, builder, sig.args[0], *args), align=8)

    return FOUR(array, types.intp), build


@intrinsic
def spread(typing, array, index):
    """array[index] four times; no bounds are checked."""

    def build(context, builder, sig, args):
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        return _splat(builder, builder.load(builder.gep(data, [args[1]])))

    return FOUR(array, types.intp), build


@intrinsic
def put(typing, array, index, value):
    """array[index : index + 4] = value"""

    def build(context, builder, sig, args):
        builder.store(args[2], _address(context, builder, sig.args[0], *args[:2]), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, FOUR), build


def _call(builder, name, *args):
    kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(args))
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{LANES}f64"), args)


@intrinsic
def fuse(typing, a, b, c):
    """a b + c"""
    return FOUR(FOUR, FOUR, FOUR), lambda context, builder, sig, args: _call(builder, "llvm.fma", *args)


@intrinsic
def lane(typing, a, index):
    """One of the four floats."""
    return types.float64(FOUR, types.intp), lambda context, builder, sig, args: builder.extract_element(*args)


@intrinsic
def join(typing, a, b, c, d):
    """Four floats as one value."""

    def build(context, builder, sig, args):
        value = ir.Constant(_VECTOR, ir.Undefined)
        for index, each in enumerate(args):
            value = builder.insert_element(value, each, ir.Constant(ir.IntType(32), index))
        return value

    return FOUR(types.float64, types.float64, types.float64, types.float64), build
