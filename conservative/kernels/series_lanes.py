"""Series steps (`series`) for several bodies at once: LLVM's vector code in which every lane is a body.

A value is the registers of x, y and z, or one register where it is a scalar, so that shuffles are other names and no
instructions. A processor that has nothing to wait for wants few operations: sums have one total for products that are added and
for those that are taken away, and are multiplied by h/(n+1) as a whole. So they round otherwise than for one body. Of 32 random
heavy tops the attitudes differ by 3e-16 from those of one body after 10 steps, by 1e-15 to 3e-15 after 100 (the worst by
6e-14), by 4e-14 to 4e-13 after 1,000; from then on chaotic motions part, as those of any two starts that round-off tells apart.

Straight code for all orders would not fit into the processor's cache of instructions: from `LOOPS_FROM` on each order has a
loop of its own, whose end the processor learns.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils

from .lanes_llvm import REGISTER
from .series import HIGHEST, LOWEST, TurningSeries, find_terms, list_products, load_once, outwards, turn_rows
from .series_llvm import VolatileLoad
from .traced import Axes

LOOPS_FROM = 6
MOST_STORED = 24 * (HIGHEST + 1)
"""Registers that a step may keep in memory."""

_VECTOR = ir.VectorType(ir.DoubleType(), REGISTER)
_BYTES = 8 * REGISTER
_INDEX = ir.IntType(64)


class Emitter:
    """Vector instructions by name, and memory for registers."""

    def __init__(self, builder):
        self._builder, self._stored, self._places = builder, 0, {}
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        self._fma = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.v{REGISTER}f64")
        with builder.goto_entry_block():
            memory = builder.alloca(_VECTOR, MOST_STORED)
            memory.align = _BYTES
            self._memory = builder.bitcast(memory, ir.IntType(8).as_pointer())

    def find_next(self, c, n, h, K, field):
        """The coefficients n + 1 of g, a and w, with few operations in all."""
        f = self.times(h, self.constant(1.0 / (n + 1)))
        gw, aw, ww = self.convolve(n, 0, n, *list_products(c))
        torque = field.accelerate(c, n)
        rates = self.times(K, ww) if torque is None else self.add(torque, K, ww)
        g, a = self.times(f, gw), self.times(f, aw)
        if isinstance(field, TurningSeries):
            g, a = turn_rows(self, c, f, field, g, a)
        return g, a, self.times(f, rates)

    def _each(self, build, *values):
        """What `build` makes of every component; a scalar has one for all of them."""
        count = max(map(len, values))
        return tuple(build(*parts) for parts in zip(*(v * (count // len(v)) for v in values), strict=True))

    def constant(self, x):
        """The number x."""
        return (ir.Constant(_VECTOR, [x] * REGISTER),)

    def plus(self, a, b):
        """a + b"""
        return self._each(self._builder.fadd, a, b)

    def minus(self, a, b):
        """a - b"""
        return self._each(self._builder.fsub, a, b)

    def times(self, a, b):
        """a b"""
        return self._each(self._builder.fmul, a, b)

    def _fuse(self, a, b, c):
        return self._builder.call(self._fma, [a, b, c])

    def add(self, c, a, b):
        """c + a b; c is None for 0."""
        return self.times(a, b) if c is None else self._each(self._fuse, a, b, c)

    def subtract(self, c, a, b):
        """c - a b"""
        return self._each(lambda a, b, c: self._fuse(self._builder.fneg(a), b, c), a, b, c)

    def shuffle(self, v, places):
        """The components of v at the first three of these places."""
        return tuple(v[place] for place in places[:3])

    def add_up(self, v):
        """The sum of the components."""
        x, y, z = ((part,) for part in v)
        return self.plus(self.plus(x, y), z)

    def store(self, v):
        """Keep v; returns where: a place for each component, however often it is stored."""
        return tuple(self._keep(part) for part in v)

    def _keep(self, part):
        if id(part) not in self._places:
            place = self._stored
            self._stored += 1
            assert self._stored <= MOST_STORED
            self._builder.store(part, self._address(_bytes(place * _BYTES)), align=_BYTES)
            self._places[id(part)] = place, part
        return self._places[id(part)][0]

    def _address(self, byte):
        return self._builder.bitcast(self._builder.gep(self._memory, [byte]), _VECTOR.as_pointer())

    def load(self, places):
        """What was stored there."""
        return tuple(self._load_once(place) for place in places)

    def _load_once(self, place):
        found = VolatileLoad(self._builder.block, self._address(_bytes(place * _BYTES)), "")
        self._builder._insert(found)
        return found

    def convolve(self, n, first, last, *sums, start=None):
        """As `Straight.convolve`, with one total for both pairs of a sum, and old coefficients in a loop."""
        totals, rest = [start] + [None] * (len(sums) - 1), outwards(n, first, last)
        if n >= LOOPS_FROM:
            totals, rest = self._sum_old(n, sums, totals), [i for i in (n, 0) if first <= i <= last]
        for i in rest:
            loaded = {}
            totals = [
                self._add_product(total, [tuple(load_once(loaded, *each) for each in ((x, i), (y, n - i))) for x, y in pairs])
                for total, pairs in zip(totals, sums, strict=True)
            ]
        return totals

    def _add_product(self, total, pairs):
        total = self.add(total, *pairs[0])
        return total if len(pairs) == 1 else self.subtract(total, *pairs[1])

    def _sum_old(self, n, sums, totals):
        """The totals with the products of i and n - i for i = 1 ... n-1."""
        builder, step = self._builder, _line(sums[0][0][0])[1] * _BYTES
        totals = [total or self.constant(0.0) * _width(*pairs[0]) for total, pairs in zip(totals, sums, strict=True)]
        before, body = builder.block, builder.append_basic_block(f"loop_{n}")
        after = builder.append_basic_block(f"after_{n}")
        builder.branch(body)
        builder.position_at_end(body)
        i, phis = self._phi(_bytes(step), before), [self._phis(total, before) for total in totals]
        j, loaded = builder.sub(_bytes(n * step), i), {}
        found = [
            self._add_product(total, [(self._load_at(loaded, x, i), self._load_at(loaded, y, j)) for x, y in pairs])
            for total, pairs in zip(phis, sums, strict=True)
        ]
        following = builder.add(i, _bytes(step))
        for phi, value in ((i, following), *zip(sum(phis, ()), sum(found, ()), strict=True)):
            phi.add_incoming(value, body)
        _keep_rolled(builder.module, builder.cbranch(builder.icmp_unsigned("<", following, _bytes(n * step)), body, after))
        builder.position_at_end(after)
        return found

    def _phi(self, value, block):
        phi = self._builder.phi(value.type)
        phi.add_incoming(value, block)
        return phi

    def _phis(self, values, block):
        return tuple(self._phi(value, block) for value in values)

    def _load_at(self, loaded, history, byte):
        """The coefficient of an order that varies, of which `byte` is the place behind order 0."""
        return self.load_places(loaded, _line(history)[0], byte)

    def load_places(self, loaded, places, byte):
        """What lies behind the places by a number of bytes that varies; `loaded` has what was loaded before."""
        for key in ((place, id(byte)) for place in places):
            if key not in loaded:
                at = self._address(self._builder.add(byte, _bytes(key[0] * _BYTES)))
                loaded[key] = self._builder.load(at, align=_BYTES)
        return tuple(loaded[place, id(byte)] for place in places)

    def merge(self, *ways):
        """The values of a block that can be come to in several ways, each (values, block they come from)."""
        phis = tuple(self._builder.phi(_VECTOR) for _ in ways[0][0])
        for values, block in ways:
            for phi, value in zip(phis, values, strict=True):
                phi.add_incoming(value, block)
        return phis

    def load_term(self, p, first, second):
        """Term number p, which varies; the places of two terms are given."""
        step = second[0] - first[0]
        byte = self._builder.mul(p, _bytes(step * _BYTES))
        return self.load_places({}, tuple(place - step for place in first), byte)


def _bytes(count):
    return ir.Constant(_INDEX, count)


def _width(x, y):
    """How many components a product of two histories has."""
    return max(len(x.places[1]), len(y.places[1]))


def _line(history):
    """Where order 0 of a history would lie if it lay like the others, and the distance of two orders."""
    step = history.places[2][0] - history.places[1][0]
    zero = tuple(place - step for place in history.places[1])
    assert all(places == tuple(k + i * step for k in zero) for i, places in enumerate(history.places) if i)
    return zero, step


def _keep_rolled(module, branch):
    """Let LLVM leave the loop that this branch ends as it is."""
    rolled = module.add_metadata([ir.MetaDataString(module, "llvm.loop.unroll.disable")])
    branch.set_metadata("llvm.loop", _Distinct(module, [rolled]))


class _Distinct(ir.MDValue):  # type: ignore[misc]  # llvmlite has no types
    """Metadata whose first operand is itself, as LLVM's loops have it."""

    def __init__(self, module, rest):
        super().__init__(module, rest, name=str(len(module.metadata)))

    def descr(self, buf):
        operands = ", ".join([f"!{self.name}", *(each.get_reference() for each in self.operands)])
        buf += (f"distinct !{{ {operands} }}", "\n")


def sum_to_order(series, numbers, p, h, start, K):
    """What a step of order p and length h adds to g, a and w, and its last two terms (`series_llvm`); all of `traced`."""
    builder, emit = p.builder, Emitter(p.builder)
    field = series(emit, *map(_registers, numbers))
    orders, places = enumerate(find_terms(emit, _registers(h), tuple(map(_registers, start)), _registers(K), field), 1), []
    sums = {order: builder.append_basic_block(f"sum_{order}") for order in range(LOWEST, HIGHEST + 1)}
    terms = {}
    for order, term in orders:
        places.append(tuple(place for v in term for place in emit.store(v)))
        if order == HIGHEST:
            break
        if order >= LOWEST:
            terms[order] = sum(term, ()), builder.block
            proceed = builder.append_basic_block(f"order_{order + 1}")
            builder.cbranch(builder.icmp_signed("<=", p.ir, p.ir.type(order)), sums[order], proceed)
            builder.position_at_end(proceed)
    total = sum(term, ())
    builder.branch(sums[HIGHEST])
    # Straight code, which every order enters where its own terms begin: loops would fill what the processor learns of branches.
    for order in range(HIGHEST, 0, -1):
        if order in sums:
            before = builder.block
            builder.position_at_end(sums[order])
            total = emit.merge((total, before), *([terms[order]] if order in terms else []))
        if order > 1:
            total = emit.plus(total, emit.load(places[order - 2]))
            if order - 1 in sums:
                builder.branch(sums[order - 1])
    found = total, *(emit.load_term(builder.sub(p.ir, _bytes(back)), *places[:2]) for back in (0, 1))
    return tuple(tuple(Axes(*map(h.make, nine[k : k + 3])) for k in (0, 3, 6)) for nine in found)


def _registers(v):
    return tuple(part.ir for part in v) if isinstance(v, Axes) else (v.ir,)
