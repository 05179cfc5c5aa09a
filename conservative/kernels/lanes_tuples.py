"""Tuples of lanes, one in the other and named or not, out of columns of arrays and into them.

In an array (rows, bodies) a number of one body follows the same number of the body before: a tuple is a column, row by row in
the order of its parts. `load_tuple(like, array, at)` is the one that begins at element `at` of the first row, arranged as
`like`, of floats; `save_tuple(array, at, values)` stores it; `save_samples(array, at, distance, values)` stores each body's
numbers one after the other, those of the next body `distance` elements on. `any_above(x, limit)` is whether a lane is above a
limit. In plain Python a float is the only lane.
"""

from __future__ import annotations

from . import COMPILED
from .lanes import REGISTER

if COMPILED:
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.extending import intrinsic

    from .lanes_llvm import Lanes, _address, _pack, _parts, _reduced

    _LANES, _INDEX = Lanes(REGISTER), ir.IntType(32)

    def _with_lanes(kind):
        """The type of a tuple with lanes for floats."""
        if not isinstance(kind, types.BaseTuple):
            return _LANES
        return types.BaseTuple.from_types([_with_lanes(each) for each in kind], getattr(kind, "instance_class", None))

    def _rows(context, builder, kind, array, at):
        """Where the rows of an array are that a column which begins at an element goes through."""
        stride = builder.extract_value(context.make_array(kind)(context, builder, array).shape, 1)
        while True:
            yield _address(context, builder, kind, array, at, 0)
            at = builder.add(at, stride)

    def _load(context, builder, kind, rows):
        if not isinstance(kind, types.BaseTuple):
            return _pack(builder, [builder.load(next(rows), align=8)])
        return context.make_tuple(builder, kind, [_load(context, builder, each, rows) for each in kind])

    def _flatten(builder, kind, value):
        if not isinstance(kind, types.BaseTuple):
            return [_parts(builder, value)[0][0]]
        parts = zip(kind, cgutils.unpack_tuple(builder, value, len(kind)), strict=True)
        return [register for part in parts for register in _flatten(builder, *part)]

    @intrinsic
    def load_tuple(typing, like, array, at):
        """The tuple of a column."""
        found = _with_lanes(like)

        def build(context, builder, sig, args):
            return _load(context, builder, found, _rows(context, builder, sig.args[1], args[1], args[2]))

        return found(like, array, types.intp), build

    @intrinsic
    def save_tuple(typing, array, at, values):
        """Store a tuple as a column."""

        def build(context, builder, sig, args):
            rows = _rows(context, builder, sig.args[0], args[0], args[1])
            for register, place in zip(_flatten(builder, sig.args[2], args[2]), rows, strict=False):
                builder.store(register, place, align=8)
            return context.get_dummy_value()

        return types.none(array, types.intp, values), build

    @intrinsic
    def save_samples(typing, array, at, distance, values):
        """Store the numbers of each body one after the other."""

        def build(context, builder, sig, args):
            data = context.make_array(sig.args[0])(context, builder, args[0]).data
            registers, start = _flatten(builder, sig.args[3], args[3]), args[1]
            for lane in range(REGISTER):
                for k, register in enumerate(registers):
                    number = builder.extract_element(register, ir.Constant(_INDEX, lane))
                    builder.store(number, builder.gep(data, [builder.add(start, ir.Constant(start.type, k))]))
                start = builder.add(start, args[2])
            return context.get_dummy_value()

        return types.none(array, types.intp, types.intp, values), build

    @intrinsic
    def any_above(typing, x, limit):
        """Whether a lane is above a limit."""

        def build(context, builder, sig, args):
            limits = ir.Constant(ir.VectorType(ir.DoubleType(), REGISTER), ir.Undefined)
            for lane in range(REGISTER):
                limits = builder.insert_element(limits, args[1], ir.Constant(_INDEX, lane))
            above = builder.fcmp_ordered(">", _parts(builder, args[0])[0][0], limits)
            return _reduced(builder, _pack(builder, [above]), "or")

        return types.boolean(x, types.float64), build

else:
    from collections.abc import Iterator

    def _arrange(like, numbers: Iterator[float]):
        if not isinstance(like, tuple):
            return next(numbers)
        parts = [_arrange(each, numbers) for each in like]
        return like._make(parts) if hasattr(like, "_make") else tuple(parts)

    def _flatten_plain(values):
        return [x for each in values for x in _flatten_plain(each)] if isinstance(values, tuple) else [values]

    def load_tuple(like, array, at):  # type: ignore[misc]  # the same name twice, of which one is made
        """The tuple of a column."""
        return _arrange(like, map(float, array[:, at]))

    def save_tuple(array, at, values):  # type: ignore[misc]  # the same name twice, of which one is made
        """Store a tuple as a column."""
        array[:, at] = _flatten_plain(values)

    def save_samples(array, at, distance, values):  # type: ignore[misc]  # the same name twice, of which one is made
        """Store the numbers of a body one after the other."""
        found = _flatten_plain(values)
        array[at : at + len(found)] = found

    def any_above(x, limit):  # type: ignore[misc]  # the same name twice, of which one is made
        """Whether a number is above a limit."""
        return x > limit
