"""The recurrences of a series step, order by order.

With g and a two rows of the attitude's matrix, w the rates, and c' the coefficients of powers of t/h, so that a step is their
sum, for n = 0, 1, ...

    (n+1) g'[n+1] = h sum of g'[i] x w'[n-i]       (n+1) a'[n+1] = h sum of a'[i] x w'[n-i]
    (n+1) w'[n+1] = h (K sum of w2'[i] w3'[n-i] and its kin + J^-1 T'[n])        K = (J2 - J3)/J1 and its kin

A vector x is stored as r = (x2, x3, x1) and s = (x3, x1, x2), so that x x y is r_x s_y - s_x r_y without shuffles. If the axes
of the rows turn at a rate u about their second one, g' gains u a, and a' loses u g. A field adds J^-1 T'[n], which its `series`
forms.

One body and several bodies use different arrangements of the same sums:

* One body: a vector is a register of components. The processor mostly waits for results. Sums therefore run from the middle
  outwards, because the newest coefficients come last. Added and subtracted products have separate totals. Terms with the newest
  coefficients are added in two short chains, with constants that contain the factor h/(n+1).
* Several bodies: a vector is three numbers (`Axes`) with a lane per body, and shuffles cost nothing. The processor does not
  wait, so the fewest operations are best: one total per sum, multiplied by h/(n+1) at the end.

The two round differently. For 32 random heavy tops, the attitudes differ by 3e-16 after 10 steps, by 1e-15 to 3e-15 after 100
(at most 6e-14), and by 4e-14 to 4e-13 after 1,000. In plain Python, vectors are `Axes` of floats.

Unrolled code for several bodies and all orders does not fit into the processor's instruction cache, so each order from
`LOOPS_FROM` on is a loop. Source: D. Barton, I. M. Willers and R. V. M. Zahar, The automatic solution of systems of ordinary
differential equations by the method of Taylor series (1971).
"""

from __future__ import annotations

import numpy as np

from ...arithmetic import Axes, Traced, fuse
from . import COMPILED
from .traced import join, lanes_like

LOWEST, HIGHEST = 4, 18
"""Lowest and highest order. Code for higher orders does not fit into the processor's instruction cache."""
LOOPS_FROM = 6
"""Lowest order whose sums of many bodies are loops instead of unrolled code."""
TURNED, TWICE = (1, 2, 0, 1), (2, 0, 1, 2)
"""Indices that turn (x1, x2, x3) into (x2, x3, x1) and (x3, x1, x2), or back: each undoes the other."""

if COMPILED:
    from llvmlite import ir

    from .traced import DOUBLE, FOUR, INTEGER, Symbol

    MOST_STORED = 24 * (HIGHEST + 1)
    """Registers that a step may store."""

    def hide(builder, value):
        """Return a value through machine code without instructions, so that LLVM does not see what it is."""
        return builder.asm(ir.FunctionType(value.type, [value.type]), "", "=r,0", [value], False)

    class Memory:
        """Registers like the register of a number, on the stack of the function that is compiled, in places 0, 1, ..."""

        def __init__(self, number):
            self.builder, self._places, self.register = number.builder, {}, ir.VectorType(DOUBLE, number.width or FOUR)
            self._bytes = 8 * self.register.count
            with self.builder.goto_entry_block():
                memory = self.builder.alloca(self.register, MOST_STORED)
                memory.align = self._bytes
                self._start = self.builder.bitcast(memory, ir.IntType(8).as_pointer())
                # Otherwise LLVM keeps all coefficients of one body in registers and spills them: up to 1.24 times as long.
                self._start_of_loads = self._start if number.width else hide(self.builder, self._start)

        def store(self, number):
            """Store a number, unless it is stored already, and return its place."""
            (register,) = number.registers
            if id(register) not in self._places:
                place = len(self._places)
                assert place < MOST_STORED
                self.builder.store(register, self._address(self.count_bytes(place)), align=self._bytes)
                self._places[id(register)] = place, register
            return self._places[id(register)][0]

        def locate(self, place):
            """Return the address of a place as a number."""
            return Symbol(self.builder, [self.builder.ptrtoint(self._address(self.count_bytes(place)), INTEGER)])

        def _address(self, byte, start=None):
            start = self._start if start is None else start
            return self.builder.bitcast(self.builder.gep(start, [byte]), self.register.as_pointer())

        def load(self, place):
            """Return the number at a place."""
            at = self._address(self.count_bytes(place), self._start_of_loads)
            return Symbol(self.builder, [self.builder.load(at, align=self._bytes)])

        def load_behind(self, place, byte):
            """Return the number at a place plus a variable number of bytes."""
            at = self._address(self.builder.add(byte, self.count_bytes(place)))
            return Symbol(self.builder, [self.builder.load(at, align=self._bytes)])

        def count_bytes(self, registers):
            """Return the bytes of a number of registers as a constant of machine code."""
            return ir.Constant(INTEGER, registers * self._bytes)

    def gather(numbers):
        """Return three numbers as `Axes`, and one as it is."""
        numbers = tuple(numbers)
        return Axes(*numbers) if len(numbers) == 3 else numbers[0]


class History:
    """Coefficients of one quantity. The newest and the first are in registers, the others in memory at `places`."""

    def __init__(self, memory):
        self._memory, self._values, self.places = memory, [], []

    def push(self, value):
        """Add the next coefficient."""
        self._values.append(value)
        if self._memory is not None:
            self.places.append(tuple(map(self._memory.store, value if isinstance(value, Axes) else (value,))))

    def __getitem__(self, n):
        if self._memory is None or not 0 < n < len(self._values) - 1:
            return self._values[n]
        return gather(map(self._memory.load, self.places[n]))


class Vectors:
    """Coefficients of vectors as (r, s): vector k has `[n, 2 k]` and `[n, 2 k + 1]`. `newest` are the last ones, unshuffled."""

    def __init__(self, series, count):
        self._series, self._parts, self.newest = series, [series.history() for _ in range(2 * count)], ()

    def push(self, vectors):
        """Add the next coefficients, one of each vector."""
        self.newest = vectors
        turned = (self._series.shuffle(v, places) for v in vectors for places in (TURNED, TWICE))
        for part, value in zip(self._parts, turned, strict=True):
            part.push(value)

    def __getitem__(self, key):
        n, part = key
        return self._parts[part][n]

    def turned(self, k):
        """Return the histories of r and s of vector k."""
        return self._parts[2 * k], self._parts[2 * k + 1]

    def locate(self):
        """Return the argument of `recall`: for one body, the address of the first r of order 1 and the bytes of an order."""
        memory, places = self._series.memory, self._parts[0].places
        if not self._series.one_body:
            return self if memory is None else 0
        return memory.locate(*places[1]), 8 * FOUR * (places[2][0] - places[1][0])


def recall(terms, n, series):
    """Return the coefficients n = 1, 2, ... of g, a and w of one body as r, from `Vectors.locate`: vectors of a `Series`."""
    if isinstance(terms, Vectors):
        return tuple(terms[n, part] for part in (0, 2, 4))
    builder, (start, step, number), register = n.builder, (x.registers[0] for x in (*terms, n)), ir.VectorType(DOUBLE, FOUR)
    at = builder.add(start, builder.mul(builder.sub(number, ir.Constant(INTEGER, 1)), step))
    places = (builder.add(at, ir.Constant(INTEGER, 8 * 2 * FOUR * k)) for k in range(3))
    pointers = (builder.inttoptr(place, register.as_pointer()) for place in places)
    vectors = [Symbol(builder, [builder.load(pointer, align=8 * FOUR)]) for pointer in pointers]
    return tuple(v if series.one_body else Axes(*v.split()[:3]) for v in vectors)


class Series:
    """Vectors, memory and sums of products for one body or several. The kind follows from one number of the state."""

    def __init__(self, number):
        traced = isinstance(number, Traced)
        self.one_body = traced and not number.width
        self.memory = Memory(number) if traced else None

    def vector(self, x, y, z):
        """Return a vector."""
        return join(x, y, z, x) if self.one_body else Axes(x, y, z)

    def broadcast(self, x):
        """Return a number by which vectors are multiplied."""
        return join(x, x, x, x) if self.one_body else x

    def split(self, v):
        """Return the three numbers of a vector."""
        return v.split()[:3] if self.one_body else tuple(v)

    def shuffle(self, v, places):
        """Return the vector of the components of v at the first three of these places."""
        return v.shuffle(places) if self.one_body else Axes(*(v[place] for place in places[:3]))

    def add_up(self, v):
        """Return the sum of the components, by which vectors can be multiplied."""
        return v + v.shuffle(TURNED) + v.shuffle(TWICE) if self.one_body else v[0] + v[1] + v[2]

    def pair(self, x, a, b):
        """Return a x and b x for a number that is the same for all components: for one body in one number."""
        return (x * lanes_like(x, np.array((a, b, 0.0, 0.0))),) if self.one_body else (x * a, x * b)

    def add_pair(self, pair, a, b):
        """Return the sum of the numbers of a pair, times a and b."""
        return self.add_up(*self.pair(*pair, a, b)) if self.one_body else pair[0] * a + pair[1] * b

    def history(self):
        """Return an empty history."""
        return History(self.memory)

    def convolve(self, n, first, last, *sums, start=None):
        """Return sums over i = first ... last of x[i] y[n-i], each minus the sum over a second pair (x, y) if there is one.

        The first begins with `start`. A sum without terms is None.
        """
        totals = [[None] * (len(pairs) if self.one_body else 1) for pairs in sums]
        totals[0][0] = start
        # From the middle, and large i first.
        orders = sorted(range(first, last + 1), key=lambda i: (abs(2 * i - n), -i))
        if self.memory is not None and not self.one_body and n >= LOOPS_FROM:
            totals, orders = self._loop(n, sums, totals), [i for i in (n, 0) if first <= i <= last]
        for i in orders:
            loaded = {}

            def read(history, n, loaded=loaded):
                key = id(history), n
                if key not in loaded:
                    loaded[key] = history[n]
                return loaded[key]

            values = [[(read(x, i), read(y, n - i)) for x, y in pairs] for pairs in sums]
            totals = list(map(self._add, totals, values))
        return [total[0] if len(total) == 1 or total[0] is None else total[0] - total[1] for total in totals]

    def _add(self, total, pairs):
        if self.one_body:
            return [add(term, *pair) for term, pair in zip(total, pairs, strict=True)]
        added = add(total[0], *pairs[0])
        return [added if len(pairs) == 1 else fuse(-pairs[1][0], pairs[1][1], added)]

    def _loop(self, n, sums, totals):
        """Return the totals with the products of i and n - i for i = 1 ... n-1, added by a loop of machine code."""
        memory, builder = self.memory, self.memory.builder
        widths = [max(len(history.places[1]) for history in pairs[0]) for pairs in sums]
        zero = Symbol(builder, [ir.Constant(memory.register, [0.0] * memory.register.count)])
        starts = [(zero,) * width if total is None else total for (total,), width in zip(totals, widths, strict=True)]
        places = sums[0][0][0].places
        step = places[2][0] - places[1][0]  # the same in all histories, which store the same values for every order
        # A loop with a constant end is unrolled, and a step of order 12 or 16 then takes 1.3 to 1.4 times as long.
        end = hide(builder, memory.count_bytes(n * step))
        before, body = builder.block, builder.append_basic_block(f"loop_{n}")
        after = builder.append_basic_block(f"after_{n}")
        builder.branch(body)
        builder.position_at_end(body)
        i = builder.phi(INTEGER)
        i.add_incoming(memory.count_bytes(step), before)
        phis = [[builder.phi(x.registers[0].type) for x in start] for start in starts]
        j, loaded = builder.sub(memory.count_bytes(n * step), i), {}

        def read(history, byte):
            first = history.places[1]
            assert all(place == tuple(k + m * step for k in first) for m, place in enumerate(history.places[1:]))
            for key in ((place - step, id(byte)) for place in first):
                if key not in loaded:
                    loaded[key] = memory.load_behind(key[0], byte)
            return gather(loaded[place - step, id(byte)] for place in first)

        added = []
        for pairs, numbers in zip(sums, phis, strict=True):
            total = gather(Symbol(builder, [phi]) for phi in numbers)
            added.append(self._add([total], [(read(x, i), read(y, j)) for x, y in pairs])[0])
        following = builder.add(i, memory.count_bytes(step))
        i.add_incoming(following, body)
        for numbers, begin, total in zip(phis, starts, added, strict=True):
            for phi, x, y in zip(numbers, begin, total if isinstance(total, Axes) else (total,), strict=True):
                phi.add_incoming(x.registers[0], before)
                phi.add_incoming(y.registers[0], body)
        builder.cbranch(builder.icmp_unsigned("<", following, end), body, after)
        builder.position_at_end(after)
        return [[total] for total in added]


def add(c, a, b):
    """Return c + a b, where None stands for c = 0."""
    if c is not None:
        return fuse(a, b, c)
    return b * a if isinstance(b, Axes) else a * b


def find_next(series, c, n, h, K, accelerate, ratio):
    """Return the coefficients n + 1 of g, a and w for fixed axes."""
    f = h * (1.0 / (n + 1))
    (g_r, g_s), (a_r, a_s), (w_r, w_s) = (c.turned(k) for k in range(3))
    products = ((a_r, w_s), (a_s, w_r)), ((w_r, w_s),)
    if ratio is None:
        products = *products, ((g_r, w_s), (g_s, w_r))
    if not series.one_body:
        aw, ww, *gw = series.convolve(n, 0, n, *products)
        w = add(accelerate(c, n), K, ww) * f
        return gw[0] * f if gw else w * ratio, aw * f, w
    aw, ww, *gw = series.convolve(n, 1, n - 1, *products)
    f1, f2 = f * c[0, 4], f * c[0, 5]

    def find_row(k, old):
        """Return f times the cross product with w of the vector whose r is number k; `old` is its sum without the newest."""
        new = fuse(-c[n, k + 1], f1, add(None if old is None else f * old, c[n, k], f2))
        if n == 0:
            return new
        r, s = f * c[0, k], f * c[0, k + 1]
        return new + fuse(-s, c[n, 4], r * c[n, 5])

    w = add(None if ww is None else f * K * ww, f1 * K, c[n, 5])
    w = fuse(f2 * K, c[n, 4], w) if n else w
    torque = accelerate(c, n)
    w = w if torque is None else fuse(torque, f, w)  # the torque is late
    return find_row(0, gw[0]) if gw else w * ratio, find_row(2, aw), w


def sum_orders(series, c, h, start, K, accelerate, turn, ratio):
    """Yield, for each order up to the highest, three times (g, a, w): the sum of a step, and the two terms before its last.

    The coefficients are added to c. `turn` is the rate of the axes of g and a, None if they are fixed. `ratio` is g/w, by
    components, of a free body, which saves a product; otherwise None.
    """
    c.push(start)
    total = term = before = None
    for n in range(HIGHEST):
        g, a, w = find_next(series, c, n, h, K, accelerate, ratio)
        if turn is not None:
            by = h * (1.0 / (n + 1)) * turn
            g, a = fuse(c.newest[1], by, g), fuse(-c.newest[0], by, a)
        earlier, before, term = before, term, (g, a, w)
        total = term if total is None else tuple(s + x for s, x in zip(total, term, strict=True))
        c.push(term)
        yield total, before, earlier


def sum_to_order(order, sums):
    """Return the tuple of numbers that `sums` yields for an order; it yields one for each order 1, 2, ... up to the highest."""
    sums = enumerate(sums, 1)
    if not isinstance(order, Traced):
        return next(number for n, number in sums if n == order)
    builder, exits = order.builder, []
    end = builder.append_basic_block("series_end")
    for n, number in sums:
        if n < LOWEST:
            continue
        exits.append((builder.block, number))
        if n == HIGHEST:
            builder.branch(end)
            break
        proceed = builder.append_basic_block(f"order_{n + 1}")
        builder.cbranch(builder.icmp_signed("<=", order.registers[0], ir.Constant(INTEGER, n)), end, proceed)
        builder.position_at_end(proceed)
    builder.position_at_end(end)

    def merge(values):
        """Return the number, or tuple of numbers, of the exit that was taken."""
        if isinstance(values[0], tuple):
            parts = [merge(parts_of_exits) for parts_of_exits in zip(*values, strict=True)]
            return Axes(*parts) if isinstance(values[0], Axes) else tuple(parts)
        phis = [builder.phi(register.type) for register in values[0].registers]
        for (block, _), value in zip(exits, values, strict=True):
            for phi, register in zip(phis, value.registers, strict=True):
                phi.add_incoming(register, block)
        return Symbol(builder, phis)

    return merge([number for _, number in exits])
