"""Several bodies in one number: `Lanes`, a vector of floats that a kernel takes for a float, each lane of another body.

Functions of `small` that are written for floats and branch on nothing compile for lanes as they are: + - * / between lanes, and
between lanes and a float, unary minus, `math.sqrt`, `abs`, `min` and `max` are LLVM's vector instructions. Comparisons give a
`Mask`, a truth value for each lane, joined by & | ~; `choose(mask, a, b)` takes a or b, numbers or tuples of lanes, in each
lane, `every(mask)` and `some(mask)` are truth values of the whole. These three take a plain truth value as well, so that one
source serves a single body and lanes.

A number is made of whole registers, `REGISTER` floats each, and every operation is written once for each of them, so that
results do not depend on the width: in a wider vector LLVM fuses other products with sums.

`load(array, index, width)` and `save(array, index, lanes)` are for contiguous arrays of one dimension, without bounds checks;
`load_rows` and `save_rows` do the same for several numbers, each `stride` floats after the last.
"""

from __future__ import annotations

import math
import operator

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, overload, register_model

from . import SMALL
from .lanes_plain import choose, every, fill_like, some

_DOUBLE, _BIT, _INDEX = ir.DoubleType(), ir.IntType(1), ir.IntType(32)


REGISTER = 4
"""Floats in a register; a width is a multiple of it. It is 4 on every processor: where registers are shorter LLVM takes several
for each, and where they are longer results would depend on the processor, for the reason above."""


class Lanes(types.Type):
    """The type of `width` floats, one for each body."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lanes({width})")


class Mask(types.Type):
    """The type of `width` truth values."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Mask({width})")


def _number(kind, of=_DOUBLE):
    return ir.LiteralStructType([ir.VectorType(of, REGISTER)] * (kind.width // REGISTER))


def _parts(builder, *values):
    """For each register, what it holds of all values."""
    count = len(values[0].type.elements)
    return [tuple(builder.extract_value(v, i) for v in values) for i in range(count)]


def _pack(builder, parts):
    whole = ir.Constant(ir.LiteralStructType([part.type for part in parts]), ir.Undefined)
    for i, part in enumerate(parts):
        whole = builder.insert_value(whole, part, i)
    return whole


def _each(builder, build, *values):
    """What `build` makes of every register."""
    return _pack(builder, [build(builder, *part) for part in _parts(builder, *values)])


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type) -> None:
        super().__init__(manager, fe_type, _number(fe_type))


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type) -> None:
        super().__init__(manager, fe_type, _number(fe_type, _BIT))


def _splat(builder, x, width):
    first = builder.insert_element(ir.Constant(ir.VectorType(x.type, REGISTER), ir.Undefined), x, ir.Constant(_INDEX, 0))
    part = builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_INDEX, REGISTER), [0] * REGISTER))
    return _pack(builder, [part] * (width // REGISTER))


def _common(args):
    """The type that two arguments, lanes and lanes or a number, are brought to; None if they are not of that kind."""
    found = [a for a in args if isinstance(a, Lanes)]
    fits = all(a == found[0] or isinstance(a, (types.Float, types.Integer)) for a in args) if found else False
    return found[0] if fits else None


def _as_lanes(context, builder, kind, value, to):
    if isinstance(kind, Lanes):
        return value
    return _splat(builder, context.cast(builder, value, kind, types.float64), to.width)


def _binary(symbol, build, result=lambda lanes: lanes) -> None:
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            lanes = _common(args) if len(args) == 2 and not kws else None
            return None if lanes is None else signature(result(lanes), *args)

    def lower(context, builder, sig, args):
        to = _common(sig.args)
        return _each(builder, build, *(_as_lanes(context, builder, k, a, to) for k, a in zip(sig.args, args, strict=True)))

    infer_global(symbol)(Template)
    for left, right in ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes)):
        lower_builtin(symbol, left, right)(lower)


def _unary(symbol, build, kind=Lanes) -> None:
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            return signature(args[0], args[0]) if len(args) == 1 and isinstance(args[0], kind) else None

    infer_global(symbol)(Template)
    lower_builtin(symbol, kind)(lambda context, builder, sig, args: _each(builder, build, args[0]))


def _call(builder, name, *args):
    kind = args[0].type
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(kind, [kind] * len(args)), f"llvm.{name}.v{kind.count}f64"
    )
    return builder.call(function, args)


_binary(operator.add, lambda b, x, y: b.fadd(x, y))
_binary(operator.sub, lambda b, x, y: b.fsub(x, y))
_binary(operator.mul, lambda b, x, y: b.fmul(x, y))
_binary(operator.truediv, lambda b, x, y: b.fdiv(x, y))
_binary(max, lambda b, x, y: b.select(b.fcmp_ordered(">", y, x), y, x))
_binary(min, lambda b, x, y: b.select(b.fcmp_ordered("<", y, x), y, x))
for _symbol, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="), (operator.eq, "==")):
    _binary(_symbol, lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y), lambda lanes: Mask(lanes.width))
_unary(operator.neg, lambda b, x: b.fneg(x))
_unary(math.sqrt, lambda b, x: _call(b, "sqrt", x))
_unary(abs, lambda b, x: _call(b, "fabs", x))
_unary(operator.invert, lambda b, x: b.not_(x), Mask)


def _logical(symbol, build) -> None:
    class Template(AbstractTemplate):
        def generic(self, args, kws):
            fits = len(args) == 2 and isinstance(args[0], Mask) and args[0] == args[1]
            return signature(args[0], *args) if fits else None

    infer_global(symbol)(Template)
    lower_builtin(symbol, Mask, Mask)(lambda context, builder, sig, args: _each(builder, build, *args))


_logical(operator.and_, lambda b, x, y: b.and_(x, y))
_logical(operator.or_, lambda b, x, y: b.or_(x, y))


@intrinsic
def _choose_tuple(typing, mask, a, b):
    def build(context, builder, sig, args):
        pairs = zip(cgutils.unpack_tuple(builder, args[1]), cgutils.unpack_tuple(builder, args[2]), strict=True)
        chosen = [_each(builder, lambda b, m, x, y: b.select(m, x, y), args[0], *pair) for pair in pairs]
        return context.make_tuple(builder, sig.return_type, chosen)

    return a(mask, a, b), build


@intrinsic
def _choose_lanes(typing, mask, a, b):
    lanes = _common((a, b)) or Lanes(mask.width)

    def build(context, builder, sig, args):
        one, other = (_as_lanes(context, builder, k, x, lanes) for k, x in zip(sig.args[1:], args[1:], strict=True))
        return _each(builder, lambda b, m, x, y: b.select(m, x, y), args[0], one, other)

    return lanes(mask, a, b), build


@overload(choose, inline="never", jit_options=SMALL)
def _choose(mask, a, b):
    if isinstance(mask, Mask):
        if isinstance(a, types.BaseTuple) and a == b:
            return lambda mask, a, b: _choose_tuple(mask, a, b)
        return lambda mask, a, b: _choose_lanes(mask, a, b)
    return lambda mask, a, b: a if mask else b


def _reduced(builder, whole, name):
    """llvm.vector.reduce.and or .or"""
    mask, *rest = (part for (part,) in _parts(builder, whole))
    for part in rest:
        mask = getattr(builder, f"{name}_")(mask, part)
    kind = mask.type
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(_BIT, [kind]), f"llvm.vector.reduce.{name}.v{kind.count}i1"
    )
    return builder.call(function, [mask])


@intrinsic
def _every_lane(typing, mask):
    return types.boolean(mask), lambda context, builder, sig, args: _reduced(builder, args[0], "and")


@intrinsic
def _some_lane(typing, mask):
    return types.boolean(mask), lambda context, builder, sig, args: _reduced(builder, args[0], "or")


@overload(every, jit_options=SMALL)
def _every(mask):
    return (lambda mask: _every_lane(mask)) if isinstance(mask, Mask) else (lambda mask: mask)


@overload(some, jit_options=SMALL)
def _some(mask):
    return (lambda mask: _some_lane(mask)) if isinstance(mask, Mask) else (lambda mask: mask)


@intrinsic
def _splat_like(typing, x, like):
    def build(context, builder, sig, args):
        return _as_lanes(context, builder, sig.args[0], args[0], like)

    return like(x, like), build


@intrinsic
def fuse(typing, a, b, c):
    """a b + c with one rounding, of floats or lanes; for sums of two products, of which the compiler may fuse either."""
    lanes = _common([x for x in (a, b, c) if isinstance(x, Lanes)])
    kind = types.float64 if lanes is None else lanes

    def build(context, builder, sig, args):
        if lanes is None:
            return builder.fma(*args)
        values = (_as_lanes(context, builder, k, x, lanes) for k, x in zip(sig.args, args, strict=True))
        return _each(builder, lambda b, x, y, z: _call(b, "fma", x, y, z), *values)

    return kind(a, b, c), build


@overload(fill_like, jit_options=SMALL)
def _fill_like(x, like):
    return (lambda x, like: _splat_like(x, like)) if isinstance(like, Lanes) else (lambda x, like: x)


def _stack(builder, value):
    """The address of a copy in memory, and how its element at an index is addressed."""
    memory = cgutils.alloca_once_value(builder, value)
    return memory, builder.bitcast(memory, _DOUBLE.as_pointer())


@intrinsic
def lane_of(typing, a, index):
    """One of the floats."""

    def build(context, builder, sig, args):
        _, data = _stack(builder, args[0])
        return builder.load(builder.gep(data, [args[1]]))

    return types.float64(a, types.intp), build


@intrinsic
def with_lane(typing, a, index, x):
    """The same with x in one lane."""

    def build(context, builder, sig, args):
        memory, data = _stack(builder, args[0])
        builder.store(args[2], builder.gep(data, [args[1]]))
        return builder.load(memory)

    return a(a, types.intp, types.float64), build


def _float_address(context, builder, array_type, array, index):
    return builder.gep(context.make_array(array_type)(context, builder, array).data, [index])


def _address(context, builder, array_type, array, index, part):
    place = builder.add(index, ir.Constant(index.type, part * REGISTER))
    first = _float_address(context, builder, array_type, array, place)
    return builder.bitcast(first, ir.VectorType(_DOUBLE, REGISTER).as_pointer())


def _load(context, builder, array_type, array, index, kind):
    if kind == types.float64:
        return builder.load(_float_address(context, builder, array_type, array, index))
    at = [_address(context, builder, array_type, array, index, i) for i in range(kind.width // REGISTER)]
    return _pack(builder, [builder.load(pointer, align=8) for pointer in at])


def _save(context, builder, array_type, array, index, kind, value) -> None:
    if kind == types.float64:
        builder.store(value, _float_address(context, builder, array_type, array, index))
        return
    for i, (part,) in enumerate(_parts(builder, value)):
        builder.store(part, _address(context, builder, array_type, array, index, i), align=8)


@intrinsic(prefer_literal=True)
def load(typing, array, index, width):
    """array[index : index + width], the width a number in the source; or as many as another number has: lanes or a float."""
    kind = Lanes(width.literal_value) if isinstance(width, types.Literal) else width

    def build(context, builder, sig, args):
        return _load(context, builder, sig.args[0], *args[:2], kind)

    return kind(array, types.intp, width), build


@intrinsic
def save(typing, array, index, value):
    """array[index : index + width] = value"""

    def build(context, builder, sig, args):
        _save(context, builder, sig.args[0], *args[:2], sig.args[2], args[2])
        return context.get_dummy_value()

    return types.none(array, types.intp, value), build


@intrinsic(prefer_literal=True)
def load_rows(typing, array, index, stride, count, width):
    """The tuple of `count` numbers at index, index + stride and so on; count and width are numbers in the source."""
    kind = Lanes(width.literal_value)
    rows = types.UniTuple(kind, count.literal_value)

    def build(context, builder, sig, args):
        found, at = [], args[1]
        for _ in range(rows.count):
            found.append(_load(context, builder, sig.args[0], args[0], at, kind))
            at = builder.add(at, args[2])
        return context.make_tuple(builder, rows, found)

    return rows(array, types.intp, types.intp, count, width), build


@intrinsic
def save_rows(typing, array, index, stride, values):
    """Store a tuple of numbers at index, index + stride and so on."""

    def build(context, builder, sig, args):
        at = args[1]
        for number in cgutils.unpack_tuple(builder, args[3]):
            _save(context, builder, sig.args[0], args[0], at, sig.args[3][0], number)
            at = builder.add(at, args[2])
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, values), build


def _transpose(builder, numbers):
    """Out of up to four registers, one for each number, four registers, one for each lane."""
    pick = lambda a, b, at: builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_INDEX, REGISTER), at))  # noqa: E731
    nothing = ir.Constant(numbers[0].type, ir.Undefined)
    a, b, c, d = [*numbers] + [nothing] * (REGISTER - len(numbers))
    ab, cd = (pick(a, b, (0, 4, 2, 6)), pick(a, b, (1, 5, 3, 7))), (pick(c, d, (0, 4, 2, 6)), pick(c, d, (1, 5, 3, 7)))
    near, far = (0, 1, 4, 5), (2, 3, 6, 7)
    return pick(ab[0], cd[0], near), pick(ab[1], cd[1], near), pick(ab[0], cd[0], far), pick(ab[1], cd[1], far)


@intrinsic
def save_columns(typing, array, index, stride, values):
    """Store up to four numbers, those of a body one after the other: of the first at index, of the next at index + stride."""

    def build(context, builder, sig, args):
        numbers, at = cgutils.unpack_tuple(builder, args[3]), args[1]
        kept = ir.Constant(ir.VectorType(_INDEX, len(numbers)), list(range(len(numbers))))
        for registers in _parts(builder, *numbers):
            for lane in _transpose(builder, registers):
                place = _float_address(context, builder, sig.args[0], args[0], at)
                found = builder.shuffle_vector(lane, lane, kept)
                builder.store(found, builder.bitcast(place, found.type.as_pointer()), align=8)
                at = builder.add(at, args[2])
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, values), build
