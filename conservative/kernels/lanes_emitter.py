"""The recurrences of `series` for lanes: its `emit` with three registers in place of one that holds x, y and z.

Fields need nothing of their own for that, and every component sees the operations that it sees for one body.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from .lanes_llvm import REGISTER, _pack, _parts, _splat
from .series import HIGHEST, LOWEST, sum_orders
from .series_llvm import _VolatileLoad

_VECTOR, _INDEX = ir.VectorType(ir.DoubleType(), REGISTER), ir.IntType(32)


class LaneEmitter:
    """What `series` calls an emit: a value is the three registers of x, y and z."""

    def __init__(self, builder):
        self._builder, self._stored, self._places = builder, 0, {}
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        self._fma = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.v{REGISTER}f64")
        with builder.goto_entry_block():
            self._memory = builder.alloca(_VECTOR, 9 * (HIGHEST + 1))
            self._memory.align = 32

    def constant(self, x):
        """The number x."""
        return (ir.Constant(_VECTOR, [x] * REGISTER),) * 3

    def plus(self, a, b):
        """a + b"""
        return tuple(self._builder.fadd(x, y) for x, y in zip(a, b, strict=True))

    def minus(self, a, b):
        """a - b"""
        return tuple(self._builder.fsub(x, y) for x, y in zip(a, b, strict=True))

    def times(self, a, b):
        """a b"""
        return tuple(self._builder.fmul(x, y) for x, y in zip(a, b, strict=True))

    def add(self, c, a, b):
        """c + a b; c is None for 0."""
        if c is None:
            return self.times(a, b)
        return tuple(self._builder.call(self._fma, [x, y, z]) for x, y, z in zip(a, b, c, strict=True))

    def subtract(self, c, a, b):
        """c - a b"""
        return tuple(self._builder.call(self._fma, [self._builder.fneg(x), y, z]) for x, y, z in zip(a, b, c, strict=True))

    def shuffle(self, v, places):
        """The components of v at these places: other names, no instruction."""
        return tuple(v[i] for i in places[:3])

    def store(self, v):
        """Keep v; returns where. A component is kept once, whatever the order it is asked for in."""
        return tuple(self._place(x) for x in v)

    def _place(self, x):
        if id(x) not in self._places:
            at = self._builder.gep(self._memory, [ir.Constant(_INDEX, self._stored)])
            self._stored += 1
            self._builder.store(x, at, align=32)
            self._places[id(x)] = (at, x)
        return self._places[id(x)][0]

    def load(self, places):
        """What was stored there."""
        return tuple(self._load(at) for at in places)

    def _load(self, at):
        found = _VolatileLoad(self._builder.block, at, "")
        self._builder._insert(found)
        return found


class Uniform:
    """J^-1 (g x m) with M1 = J^-1 (m2, m3, m1) and M2 = J^-1 (m3, m1, m2)."""

    def __init__(self, emit, M1, M2):
        self._emit, self._M = emit, (M1, M2)

    def accelerate(self, c, n):
        """Coefficient n of what the field adds to w'."""
        return self._emit.subtract(self._emit.add(None, self._M[1], c[n, 0]), self._M[0], c[n, 1])


@intrinsic
def emitted_orders(typing, p, h, g, a, w, K, M1, M2):
    """What a step adds to g, a and w, triples of lanes of one register, one after the other."""
    nine = types.UniTuple(g.dtype, 9)

    def code(context, builder, sig, args):
        p, h, *vectors = args
        g, a, w, K, M1, M2 = (tuple(_parts(builder, x)[0][0] for x in cgutils.unpack_tuple(builder, v)) for v in vectors)
        emit = LaneEmitter(builder)
        (h4,) = _parts(builder, _splat(builder, h, REGISTER))[0]
        end, exits = builder.function.append_basic_block("series_end"), []
        for order, found in enumerate(sum_orders(emit, (h4,) * 3, (g, a, w), K, Uniform(emit, M1, M2)), 1):
            if order < LOWEST:
                continue
            exits.append((builder.block, [x for v in found[0] for x in v]))
            if order == HIGHEST:
                builder.branch(end)
                break
            proceed = builder.function.append_basic_block(f"order_{order + 1}")
            builder.cbranch(builder.icmp_signed("<=", p, ir.Constant(p.type, order)), end, proceed)
            builder.position_at_end(proceed)
        builder.position_at_end(end)
        out = []
        for k in range(9):
            phi = builder.phi(_VECTOR)
            for block, values in exits:
                phi.add_incoming(values[k], block)
            out.append(phi)
        return context.make_tuple(builder, nine, [_pack(builder, [phi]) for phi in out])

    return nine(types.intp, types.float64, g, a, w, K, M1, M2), code
