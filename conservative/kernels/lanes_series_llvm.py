"""The orders of a series step in uniform gravity for lanes, unrolled as LLVM's vector code (`lanes_taylor`).

As `lanes_taylor.series_step`: no loop has an end that a processor must guess, and old coefficients come first, so that what
depends on the newest waits at the end of a sum only.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from .lanes_llvm import REGISTER, _pack, _parts, _splat
from .series_llvm import _VolatileLoad

LOWEST, HIGHEST = 4, 20
_VECTOR, _INDEX = ir.VectorType(ir.DoubleType(), REGISTER), ir.IntType(32)
LOOPS_FROM = 6
"""Orders from here on sum their old coefficients in a loop: straight code for all does not fit into the processor's caches."""


class _Memory:
    """Coefficients of one register's bodies: nine vectors for each order."""

    def __init__(self, builder):
        self._builder = builder
        with builder.goto_entry_block():
            self._memory = builder.alloca(_VECTOR, 9 * HIGHEST)
            self._memory.align = 32

    def _at(self, index):
        return self._builder.gep(self._memory, [ir.Constant(_INDEX, index)])

    def store(self, n, values):
        for k, v in enumerate(values):
            self._builder.store(v, self._at(9 * n + k), align=32)

    def load_at(self, byte, k):
        """Number k of the order that begins at a variable byte."""
        base = self._builder.bitcast(self._memory, ir.IntType(8).as_pointer())
        at = self._builder.gep(base, [self._builder.add(byte, ir.Constant(byte.type, 32 * k))])
        return self._builder.load(self._builder.bitcast(at, _VECTOR.as_pointer()), align=32)

    def load(self, n, k):
        found = _VolatileLoad(self._builder.block, self._at(9 * n + k), "")
        self._builder._insert(found)
        return found


class _Emitter:
    def __init__(self, builder):
        self.b = builder
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        self._fma = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.v{REGISTER}f64")

    def add(self, c, a, b):
        return self.b.fmul(a, b) if c is None else self.b.call(self._fma, [a, b, c])

    def subtract(self, c, a, b):
        if c is None:
            return self.b.fneg(self.b.fmul(a, b))
        return self.b.call(self._fma, [self.b.fneg(a), b, c])

    def cross(self, s, x, w):
        """s + x x w, in place"""
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            s[k] = self.add(s[k], x[i], w[j])
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            s[k] = self.subtract(s[k], x[j], w[i])

    def mixed(self, s, v, w):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            s[k] = self.add(s[k], v[i], w[j])


def _sum_old(e, memory, n):
    """The nine sums over i = 1 ... n-1, in a loop whose end the processor learns, since each order has its own."""
    b, step, index = e.b, 9 * 32, ir.IntType(64)
    before, body = b.block, b.function.append_basic_block(f"loop_{n}")
    after = b.function.append_basic_block(f"after_{n}")
    b.branch(body)
    b.position_at_end(body)
    at = b.phi(index)
    sums = [b.phi(_VECTOR) for _ in range(9)]
    at.add_incoming(ir.Constant(index, step), before)
    for phi in sums:
        phi.add_incoming(ir.Constant(_VECTOR, [0.0] * REGISTER), before)
    other = b.sub(ir.Constant(index, n * step), at)
    w = [memory.load_at(other, 6 + k) for k in range(3)]
    sg, sa, sw = sums[:3], sums[3:6], sums[6:]
    for s, first, how in ((sg, 0, e.cross), (sa, 3, e.cross), (sw, 6, e.mixed)):
        how(s, [memory.load_at(at, first + k) for k in range(3)], w)
    following = b.add(at, ir.Constant(index, step))
    at.add_incoming(following, body)
    for phi, value in zip(sums, (*sg, *sa, *sw), strict=True):
        phi.add_incoming(value, body)
    branch = b.cbranch(b.icmp_unsigned("<", following, ir.Constant(index, n * step)), body, after)
    module = b.module
    keep = module.add_metadata([ir.MetaDataString(module, "llvm.loop.unroll.disable")])
    loop = _SelfReference(module, [keep])
    branch.set_metadata("llvm.loop", loop)
    b.position_at_end(after)
    return sg, sa, sw


class _SelfReference(ir.MDValue):
    """Distinct metadata whose first operand is itself, as LLVM's loops have it."""

    def __init__(self, module, rest):
        super().__init__(module, rest, name=str(len(module.metadata)))

    def descr(self, buf):
        operands = ", ".join([f"!{self.name}", *(op.get_reference() for op in self.operands)])
        buf += (f"distinct !{{ {operands} }}", "\n")


def _order(e, memory, n, f, newest, K, M):
    """The coefficients of order n + 1; f is h/(n+1), `newest` those of order n, M holds both factors of J^-1 (g x m)."""
    b = e.b
    sg, sa, sw = [None] * 3, [None] * 3, [None] * 3
    rest = range(n + 1)
    if n >= LOOPS_FROM:
        (sg, sa, sw), rest = _sum_old(e, memory, n), (n, 0)
    for i in sorted(rest, key=lambda i: (abs(2 * i - n), -i)):
        first = i == n
        w = newest[6:] if i == 0 else [memory.load(n - i, 6 + k) for k in range(3)]
        x = newest if first else None
        for s, at, how in ((sg, 0, e.cross), (sa, 3, e.cross), (sw, 6, e.mixed)):
            how(s, x[at : at + 3] if first else [memory.load(i, at + k) for k in range(3)], w)
    new = [b.fmul(f, v) for v in (*sg, *sa)]
    g, M1, M2 = newest[:3], *M
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        total = e.subtract(e.add(b.fmul(K[k], sw[k]), g[i], M1[k]), g[j], M2[k])
        new.append(b.fmul(f, total))
    return new


def build(builder, p, h, start, K, M, width):
    """Return what a step adds to g, a and w: nine numbers, each a struct of registers."""
    count = width // REGISTER
    e, memories = _Emitter(builder), [_Memory(builder) for _ in range(count)]
    parts = lambda v: [part for (part,) in _parts(builder, v)]  # noqa: E731
    newest = [list(x) for x in zip(*(parts(v) for v in start), strict=True)]
    Ks = [list(x) for x in zip(*(parts(v) for v in K), strict=True)]
    Ms = [[x[:3], x[3:]] for x in (list(x) for x in zip(*(parts(v) for v in M), strict=True))]
    (h4,) = _parts(builder, _splat(builder, h, REGISTER))[0]
    end = builder.function.append_basic_block("series_end")
    exits = []
    for r in range(count):
        memories[r].store(0, newest[r])
    for n in range(HIGHEST):
        f = builder.fmul(h4, ir.Constant(_VECTOR, [1.0 / (n + 1)] * REGISTER))
        newest = [_order(e, memories[r], n, f, newest[r], Ks[r], Ms[r]) for r in range(count)]
        for r in range(count):
            memories[r].store(n + 1, newest[r]) if n + 1 < HIGHEST else None
        if n + 1 >= LOWEST:
            # The sum is formed at the end: as a running sum it would take registers from the orders.
            leave = builder.function.append_basic_block(f"sum_{n + 1}")
            last = n + 1 == HIGHEST
            if last:
                builder.branch(leave)
            else:
                proceed = builder.function.append_basic_block(f"order_{n + 2}")
                builder.cbranch(builder.icmp_signed("<=", p, ir.Constant(p.type, n + 1)), leave, proceed)
            builder.position_at_end(leave)
            total = []
            for r in range(count):
                s = newest[r]
                for i in range(n, 0, -1):
                    s = [builder.fadd(x, memories[r].load(i, k)) for k, x in enumerate(s)]
                total.append(s)
            exits.append((builder.block, total))
            builder.branch(end)
            if not last:
                builder.position_at_end(proceed)
    builder.position_at_end(end)
    out = []
    for k in range(9):
        phis = []
        for r in range(count):
            phi = builder.phi(_VECTOR)
            for block, totals in exits:
                phi.add_incoming(totals[r][k], block)
            phis.append(phi)
        out.append(phis)
    return [_pack(builder, phis) for phis in out]


@intrinsic
def lane_orders(typing, p, h, g, a, w, K, M1, M2):
    """What a step of order p and length h adds to g, a and w, triples of lanes, one after the other.

    K is (J2 - J3)/J1 and its kin, M1 = J^-1 (m3, m1, m2), M2 = J^-1 (m2, m3, m1).
    """
    lanes = g.dtype
    nine = types.UniTuple(lanes, 9)

    def code(context, builder, sig, args):
        p, h, *vectors = args
        g, a, w, K, M1, M2 = (cgutils.unpack_tuple(builder, v) for v in vectors)
        return context.make_tuple(builder, nine, build(builder, p, h, (*g, *a, *w), K, (*M1, *M2), lanes.width))

    return nine(types.intp, types.float64, g, a, w, K, M1, M2), code
