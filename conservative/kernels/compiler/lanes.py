"""Lanes: numbers that contain one float for each of several bodies, or for several components of one body.

Functions of `small` and traced functions accept lanes in place of floats if they do not branch on a number. The operations are
+ - * / between lanes, and between lanes and a float, unary minus, `math.sqrt`, `abs`, `min` and `max`. Comparisons return a
truth value per lane. Combine these with & | ~, and use them in `choose`, `every` and `some` of `vector`.

Arrays in memory are contiguous, one-dimensional arrays of floats; bounds are not checked. A width is a literal number, or
another number with the same width. In plain Python there is one body at a time, so the width for bodies is 1; lanes of one
body's components are arrays.
"""

from __future__ import annotations

import math
import operator
from functools import partial, wraps

import numpy as np

from ... import arithmetic
from . import COMPILED, traced
from .traced import FOUR as FOUR
from .traced import REGISTER as REGISTER
from .traced import trace

WIDTH = 2 * FOUR if COMPILED else 1
"""Number of bodies in most kernels: two registers of most processors, so that a processor works on one while it waits for the
other. Kernels whose numbers fill the registers of a processor already use `REGISTER`."""


def _flatten(value):
    """Return the numbers of a tuple of tuples, or of one number, as a list."""
    return [x for part in value for x in _flatten(part)] if isinstance(value, tuple) else [value]


if COMPILED:
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.extending import intrinsic, lower_builtin, type_callable

    from .traced import DOUBLE, INDEX, Lanes, Mask, Symbol, floats_in_register, pack, unpack

    def _compile_for_lanes(symbol, operation, operand, result):
        """Let numba compile `symbol` for the type `operand`, Lanes or Mask, as the operation on their symbols."""
        unary = symbol in (operator.neg, operator.invert, math.sqrt, abs)

        def result_of(*kinds):
            """Return the type of the result. None refuses the arguments: lanes go with lanes of their width and with numbers,
            masks only with masks.
            """
            widths = {kind.width for kind in kinds if isinstance(kind, operand)}
            others = [kind for kind in kinds if not isinstance(kind, operand)]
            fits = (all(isinstance(kind, types.Float | types.Integer) for kind in others) and operand is Lanes) or not others
            return result(*widths) if len(widths) == 1 and fits else None

        # numba passes the arguments of a function with *kinds as one tuple
        type_callable(symbol)(lambda _: (lambda a: result_of(a)) if unary else (lambda a, b: result_of(a, b)))

        def lower(context, builder, sig, args):
            # () are the fast-math flags: those of the function that is being compiled decide whether products may be fused.
            numbers = (unpack(builder, *typed, ()) for typed in zip(sig.args, args, strict=True))
            return pack(context, builder, sig.return_type, operation(*numbers))

        pairs = ((Lanes, Lanes), (Lanes, types.Number), (types.Number, Lanes))
        for kinds in [(operand,)] if unary else [(Mask, Mask)] if operand is Mask else pairs:
            lower_builtin(symbol, *kinds)(lower)

    for _symbol in (operator.add, operator.sub, operator.mul, operator.truediv, operator.neg, abs):
        _compile_for_lanes(_symbol, _symbol, Lanes, Lanes)
    _compile_for_lanes(math.sqrt, arithmetic.root, Lanes, Lanes)
    _compile_for_lanes(min, lambda a, b: arithmetic.choose(b < a, b, a), Lanes, Lanes)
    _compile_for_lanes(max, lambda a, b: arithmetic.choose(b > a, b, a), Lanes, Lanes)
    for _comparison in (operator.lt, operator.le, operator.gt, operator.ge, operator.eq):
        _compile_for_lanes(_comparison, _comparison, Lanes, Mask)
    for _logical in (operator.and_, operator.or_, operator.invert):
        _compile_for_lanes(_logical, _logical, Mask, Mask)

    def _place(context, builder, array, index, register=DOUBLE):
        """Return the address of an element as a pointer to a register; `array` is a numba type and a value."""
        kind, value = array
        pointer = builder.gep(context.make_array(kind)(context, builder, value).data, [index])
        return builder.bitcast(pointer, register.as_pointer())

    def _move(builder, index, count):
        return builder.add(index, ir.Constant(index.type, count))

    def _read(context, builder, array, index, kind):
        """Return the LLVM value of a number of this type; `array` is its numba type and value."""
        if kind == types.float64:
            return builder.load(_place(context, builder, array, index))
        floats = floats_in_register(kind.width)
        vector, places = ir.VectorType(DOUBLE, floats), [_move(builder, index, i) for i in range(0, kind.width, floats)]
        # The array is aligned to its floats only, not to a register.
        registers = [builder.load(_place(context, builder, array, place, vector), align=8) for place in places]
        return pack(context, builder, kind, Symbol(builder, registers))

    def _of_width(width):
        """Return the type of a number with a literal width, or the type of another number."""
        if not isinstance(width, types.Literal):
            return width
        return types.float64 if width.literal_value == 1 else Lanes(width.literal_value)

    def _arrange(like, kind):
        """Return the type of a tuple of numbers: a literal count of them, or the arrangement of another tuple."""
        if isinstance(like, types.Literal):
            return types.UniTuple(kind, like.literal_value)
        if not isinstance(like, types.BaseTuple):
            return kind
        return types.BaseTuple.from_types([_arrange(part, kind) for part in like], getattr(like, "instance_class", None))

    @intrinsic(prefer_literal=True)
    def load(typing, array, index, width):
        """Return array[index : index + width] as a number."""
        kind = _of_width(width)

        def build(context, builder, sig, args):
            return _read(context, builder, (sig.args[0], args[0]), args[1], kind)

        return kind(array, types.intp, width), build

    @intrinsic(prefer_literal=True)
    def load_rows(typing, array, index, stride, like, width):
        """Return the numbers at index, index + stride and so on: `like` of them, or arranged as the tuple `like`."""
        kind = _of_width(width)
        rows = _arrange(like, kind)

        def build(context, builder, sig, args):
            at = args[1]

            def fill(part):
                nonlocal at  # the numbers of all parts follow each other
                if isinstance(part, types.BaseTuple):
                    return context.make_tuple(builder, part, [fill(inner) for inner in part])
                number, at = _read(context, builder, (sig.args[0], args[0]), at, kind), builder.add(at, args[2])
                return number

            return fill(rows)

        return rows(array, types.intp, types.intp, like, width), build

    def _write(context, builder, array, index, number):
        """Store the registers of a symbol; `array` is its numba type and value."""
        for i, register in enumerate(number.registers):
            at = _move(builder, index, i * (number.width // len(number.registers)))
            builder.store(register, _place(context, builder, array, at, register.type), align=8)

    @intrinsic
    def save(typing, array, index, value):
        """Store a number at index."""

        def build(context, builder, sig, args):
            _write(context, builder, (sig.args[0], args[0]), args[1], unpack(builder, sig.args[2], args[2]))
            return context.get_dummy_value()

        return types.none(array, types.intp, value), build

    @intrinsic
    def save_rows(typing, array, index, stride, values):
        """Store the numbers of a tuple of tuples at index, index + stride and so on.

        `array` may also have rows; the index counts its floats in order.
        """

        def build(context, builder, sig, args):
            at = args[1]
            for number in _flatten(unpack(builder, sig.args[3], args[3])):
                _write(context, builder, (sig.args[0], args[0]), at, number)
                at = builder.add(at, args[2])
            return context.get_dummy_value()

        return types.none(array, types.intp, types.intp, values), build

    def _pick(builder, a, b, at):
        return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(INDEX, len(at)), list(at)))

    def _transpose(builder, numbers):
        """Return four registers, one per lane, from up to four registers of four, one per number.

        First a with b and c with d, the even lanes apart from the odd ones, then both pairs: eight shuffles. Missing
        numbers leave parts without a value, which `save_columns` does not store.
        """
        pick, nothing = partial(_pick, builder), ir.Constant(ir.VectorType(DOUBLE, FOUR), ir.Undefined)
        a, b, c, d = [*numbers] + [nothing] * (FOUR - len(numbers))
        ab, cd = (pick(a, b, (0, 4, 2, 6)), pick(a, b, (1, 5, 3, 7))), (pick(c, d, (0, 4, 2, 6)), pick(c, d, (1, 5, 3, 7)))
        near, far = (0, 1, 4, 5), (2, 3, 6, 7)
        return pick(ab[0], cd[0], near), pick(ab[1], cd[1], near), pick(ab[0], cd[0], far), pick(ab[1], cd[1], far)

    @intrinsic
    def save_columns(typing, array, index, stride, values):
        """Store the numbers of each body one after the other: the first body at index, the next at index + stride."""

        def build(context, builder, sig, args):
            # Four numbers of four bodies are transposed at a time, so that one instruction stores four numbers of a body.
            numbers = _flatten(unpack(builder, sig.args[3], args[3]))
            parts = range(0, numbers[0].width // len(numbers[0].registers), FOUR)
            fours = [[_pick(builder, x, x, range(i, i + FOUR)) for x in number.registers for i in parts] for number in numbers]
            for first in range(0, len(numbers), FOUR):
                four, at = fours[first : first + FOUR], _move(builder, args[1], first)
                for registers in zip(*four, strict=True):
                    for lane in _transpose(builder, registers):
                        part = _pick(builder, lane, lane, range(len(four)))
                        builder.store(part, _place(context, builder, (sig.args[0], args[0]), at, part.type), align=8)
                        at = builder.add(at, args[2])
            return context.get_dummy_value()

        return types.none(array, types.intp, types.intp, values), build

    def _copy(builder, value):
        """Return the address of a copy in memory, as a pointer to the whole and to the first float."""
        memory = cgutils.alloca_once_value(builder, value)
        return memory, builder.bitcast(memory, DOUBLE.as_pointer())

    @intrinsic
    def lane_of(typing, a, index):
        """Return one of the floats."""

        def build(context, builder, sig, args):
            if a.width == floats_in_register(a.width):
                return builder.extract_element(builder.extract_value(args[0], 0), args[1])
            # Several registers: which of them is known only when the code runs, so the lane is read from memory.
            return builder.load(builder.gep(_copy(builder, args[0])[1], [args[1]]))

        return types.float64(a, types.intp), build

    @intrinsic
    def with_lane(typing, a, index, x):
        """Return the same number with x in one lane."""

        def build(context, builder, sig, args):
            memory, floats = _copy(builder, args[0])
            builder.store(args[2], builder.gep(floats, [args[1]]))
            return builder.load(memory)

        return a(a, types.intp, types.float64), build

else:

    def load(array, index, width):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Return array[index : index + width] as a number."""
        return array[index : index + width].copy() if isinstance(width, int) and width > 1 else float(array[index])

    def _fill(like, numbers):
        if not isinstance(like, tuple):
            return float(next(numbers))
        parts = [_fill(part, numbers) for part in like]
        return like._make(parts) if hasattr(like, "_make") else tuple(parts)

    def load_rows(array, index, stride, like, width):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Return the numbers at index, index + stride and so on: `like` of them, or arranged as the tuple `like`."""
        return _fill((0.0,) * like if isinstance(like, int) else like, iter(array[index::stride]))

    def save(array, index, value):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Store a number at index."""
        array.reshape(-1)[index : index + np.size(value)] = value

    def save_rows(array, index, stride, values):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Store the numbers of a tuple of tuples at index, index + stride and so on."""
        for i, value in enumerate(_flatten(values)):
            save(array, index + i * stride, value)

    def save_columns(array, index, stride, values):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Store the numbers of the only body one after the other."""
        save_rows(array, index, 1, values)

    def lane_of(a, index):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Return one of the floats."""
        return float(a[index]) if isinstance(a, np.ndarray) else a

    def with_lane(a, index, x):  # type: ignore[misc]  # the same name twice: one of them is defined
        """Return x, the only lane."""
        return x


def gather_numbers(values):
    """Return the numbers of a tuple of tuples as an array for `load_rows`, and a tuple of zeros of the same arrangement."""
    numbers = []

    def clear(value):
        if isinstance(value, tuple):
            return tuple.__new__(type(value), map(clear, value))  # for tuples and named tuples
        numbers.append(value)
        return 0.0

    like = clear(values)
    return np.array(numbers, dtype=float), like


MOST_MODELS = 64
"""Largest number of values in the cache of a function that `cache_by_identity` extends."""


def cache_by_identity(build):
    """Cache a function of a tuple by its identity: runs of a scene share their model, and comparing its numbers takes long."""
    built = {}

    @wraps(build)
    def recall(value):
        held = built.get(id(value))
        if held is None or held[0] is not value:
            if len(built) >= MOST_MODELS:
                built.clear()
            held = built[id(value)] = value, build(value)
        return held[1]

    return recall


def cache_by_types(build):
    """Cache a function of the tuple that `gather_numbers` returns.

    Named tuples of different types with equal numbers are equal, and fields of different types need code of their own.
    """
    built = {}

    def kinds(value):
        return (type(value), *map(kinds, value)) if isinstance(value, tuple) else type(value)

    @wraps(build)
    def recall(like):
        key = kinds(like)
        if key not in built:
            built[key] = build(like)
        return built[key]

    return recall


join = trace(traced.join)
"""`traced.join` as kernels call it."""


@trace
def splat(x):
    """Return the float x as a number of one register."""
    return traced.join(x, x, x, x)
