"""Series steps (`series`) as LLVM's vector code: all orders unrolled, with one way out for each."""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils

from .series import HIGHEST, LOWEST, sum_orders
from .simd_llvm import LANES

MOST_STORED = 12 * HIGHEST
"""Vectors that a step may keep in memory."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)


class _VolatileLoad(ir.instructions.LoadInstr):  # type: ignore[misc]  # llvmlite has no types
    """A load that is made once, here: LLVM would keep all coefficients in registers otherwise, which spills them."""

    def descr(self, buf):
        (pointer,) = self.operands
        kind = pointer.type
        buf.append(f"load volatile {kind.pointee}, {kind} {pointer.get_reference()}, align 32\n")


class Emitter:
    """Vector instructions by name, and memory for vectors."""

    def __init__(self, builder):
        self._builder, self._stored = builder, 0
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        self._fma = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.v{LANES}f64")
        with builder.goto_entry_block():
            self._memory = builder.alloca(_VECTOR, MOST_STORED)
            self._memory.align = 32

    def constant(self, x):
        """The number x in all lanes."""
        return ir.Constant(_VECTOR, [x] * LANES)

    def splat(self, x):
        """The value x in all lanes."""
        first = self._builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), x, ir.Constant(_INDEX, 0))
        return self.shuffle(first, (0, 0, 0, 0))

    def plus(self, a, b):
        """a + b"""
        return self._builder.fadd(a, b)

    def minus(self, a, b):
        """a - b"""
        return self._builder.fsub(a, b)

    def times(self, a, b):
        """a b"""
        return self._builder.fmul(a, b)

    def add(self, c, a, b):
        """c + a b; c is None for 0."""
        return self.times(a, b) if c is None else self._builder.call(self._fma, [a, b, c])

    def subtract(self, c, a, b):
        """c - a b"""
        return self._builder.call(self._fma, [self._builder.fneg(a), b, c])

    def shuffle(self, v, places):
        """The lanes of v at these places."""
        return self._builder.shuffle_vector(v, v, ir.Constant(ir.VectorType(_INDEX, LANES), places))

    def store(self, v):
        """Keep v; returns where."""
        at = self._builder.gep(self._memory, [ir.Constant(_INDEX, self._stored)])
        self._stored += 1
        self._builder.store(v, at, align=32)
        return at

    def load(self, at):
        """What was stored there."""
        found = _VolatileLoad(self._builder.block, at, "")
        self._builder._insert(found)
        return found


def sum_to_order(series, numbers, p, h, start, K):
    """What a step of order p, LOWEST to HIGHEST, and length h adds to g, a and w, its last term and the one before.

    Each of them is three fours (x, y, z, anything). `series` forms the coefficients of J^-1 T, of `numbers`, floats and fours.
    All are of `traced`.
    """
    builder, emit = p.builder, Emitter(p.builder)
    field = series(emit, *(each.ir if each.ir.type == _VECTOR else emit.splat(each.ir) for each in numbers))
    end = builder.function.append_basic_block("series_end")
    exits = []
    for order, found in enumerate(sum_orders(emit, emit.splat(h.ir), tuple(each.ir for each in start), K.ir, field), 1):
        if order < LOWEST:
            continue
        exits.append((builder.block, found))
        if order == HIGHEST:
            builder.branch(end)
            break
        proceed = builder.function.append_basic_block(f"order_{order + 1}")
        builder.cbranch(builder.icmp_signed("<=", p.ir, p.ir.type(order)), end, proceed)
        builder.position_at_end(proceed)
    builder.position_at_end(end)
    return tuple(tuple(_join_exits(p, exits, k, i) for i in range(3)) for k in range(3))


def _join_exits(p, exits, k, i):
    """Value i of part k of what the exits found."""
    phi = p.builder.phi(_VECTOR)
    for block, found in exits:
        phi.add_incoming(found[k][i], block)
    return p.make(phi)
