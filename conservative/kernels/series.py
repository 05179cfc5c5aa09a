"""The recurrences of a series step, order by order, for both ways of running kernels (`series_llvm`, `series_numpy`).

With g and a two rows of the attitude's matrix, w the rates, and c' the coefficients of powers of t/h, so that a step is their
sum, for n = 0, 1, ...

    (n+1) g'[n+1] = h sum of g'[i] x w'[n-i]       (n+1) a'[n+1] = h sum of a'[i] x w'[n-i]
    (n+1) w'[n+1] = h (K sum of w2'[i] w3'[n-i] and its kin + J^-1 T'[n])        K = (J2 - J3)/J1 and its kin

A vector x is kept as r = (x2, x3, x1) and s = (x3, x1, x2), so that x x y is r_x s_y - s_x r_y without shuffles. Sums run from
the middle outwards, as the newest coefficients come last; what depends on the newest is added in two short chains, with
constants that hold the factor h/(n+1). Where the axes of the rows turn at a rate u about their second one, g' gains u a, and
a' loses u g.

What a field adds is its own: an object whose `accelerate` returns J^-1 T'[n], made next to the field's torque. All arithmetic
is that of an `emit`: `add(c, a, b)` is c + a b, where c may be None for 0, `subtract(c, a, b)` is c - a b, and `store` and
`load` keep old coefficients in memory. Source: D. Barton, I. M. Willers and R. V. M. Zahar, The automatic solution of systems
of ordinary differential equations by the method of Taylor series (1971); the arrangement is our own.
"""

from __future__ import annotations

LOWEST, HIGHEST = 4, 18
"""Orders that code is made for: beyond the highest, it does not fit into the processor's cache of instructions."""
TURNED, TWICE = (1, 2, 0, 1), (2, 0, 1, 2)
"""The places of (x2, x3, x1) and (x3, x1, x2) in (x1, x2, x3)."""


class History:
    """Coefficients of one quantity: the newest and the first are at hand, all others come out of memory."""

    def __init__(self, emit):
        self._emit, self._values, self._places = emit, [], []

    def push(self, value):
        self._values.append(value)
        self._places.append(self._emit.store(value))

    def __getitem__(self, n):
        return self._emit.load(self._places[n]) if 0 < n < len(self._values) - 1 else self._values[n]


class Vectors:
    """Coefficients of vectors, of each as (r, s): `[n, 2 k]` and `[n, 2 k + 1]` are those of vector k; `newest` as they are."""

    def __init__(self, emit):
        self._emit, self._parts, self.newest = emit, [], ()

    def push(self, vectors):
        self.newest = vectors
        turned = [self._emit.shuffle(v, places) for v in vectors for places in (TURNED, TWICE)]
        if not self._parts:
            self._parts = [History(self._emit) for _ in turned]
        for part, value in zip(self._parts, turned, strict=True):
            part.push(value)

    def __getitem__(self, key):
        n, part = key
        return self._parts[part][n]


def outwards(n, first=0):
    """The indices i = first ... n - first of a sum over products of i with n - i: from the middle, and large i first."""
    return sorted(range(first, n + 1 - first), key=lambda i: (abs(2 * i - n), -i))


class FreeSeries:
    """No field."""

    def __init__(self, emit):
        pass

    def accelerate(self, c, n):
        """None: no torque."""
        return None


class TurningSeries:
    """A field that turns with the axes of g and a: its own recurrence, of the class `inner`, and the rate `turn`."""

    def __init__(self, inner, emit, turn, *numbers):
        self.turn, self._inner = turn, inner(emit, *numbers)

    def accelerate(self, c, n):
        """Coefficient n of J^-1 T."""
        return self._inner.accelerate(c, n)


def _sum_inner(emit, c, n):
    """Sums without the newest: both halves of g x w, both of a x w, and w2 w3 and its kin; None where there are no terms."""
    sums = [None] * 5
    for i in outwards(n, 1):
        r, s = c[n - i, 4], c[n - i, 5]
        for k, other in enumerate((s, r, s, r, s)):
            sums[k] = emit.add(sums[k], c[i, k], other)
    return sums


def _add_optional(emit, a, b):
    return b if a is None else a if b is None else emit.plus(a, b)


def _next_row(emit, c, n, k, plus, minus, f, f1, f2):
    """f times coefficient n of the cross product with w of the vector whose r is number k."""
    old = None if plus is None else emit.times(f, emit.minus(plus, minus))
    new = emit.subtract(emit.add(old, c[n, k], f2), c[n, k + 1], f1)
    if n == 0:
        return new
    r, s = emit.times(f, c[0, k]), emit.times(f, c[0, k + 1])
    return emit.plus(new, emit.subtract(emit.add(None, r, c[n, 5]), s, c[n, 4]))


def _next_rates(emit, c, n, sums, f, f1, f2, K, field):
    torque = field.accelerate(c, n)
    old = None if torque is None else emit.times(f, torque)
    old = _add_optional(emit, old, None if sums is None else emit.times(emit.times(f, K), sums))
    new = emit.add(old, emit.times(f1, K), c[n, 5])
    return emit.add(new, emit.times(f2, K), c[n, 4]) if n else new


def next_coefficients(emit, c, n, h, K, field):
    """The coefficients n + 1 of g, a and w."""
    f = emit.times(h, emit.constant(1.0 / (n + 1)))
    g_plus, g_minus, a_plus, a_minus, ww = _sum_inner(emit, c, n)
    f1, f2 = emit.times(f, c[0, 4]), emit.times(f, c[0, 5])
    g = _next_row(emit, c, n, 0, g_plus, g_minus, f, f1, f2)
    a = _next_row(emit, c, n, 2, a_plus, a_minus, f, f1, f2)
    if isinstance(field, TurningSeries):
        by = emit.times(f, field.turn)
        g, a = emit.add(g, by, c.newest[1]), emit.subtract(a, by, c.newest[0])
    return g, a, _next_rates(emit, c, n, ww, f, f1, f2, K, field)


def sum_orders(emit, h, start, K, field):
    """Yield, for each order up to the highest, three times (g, a, w): what a step adds, the last term of it, the one before."""
    c, total, before = Vectors(emit), None, None
    c.push(start)
    for n in range(HIGHEST):
        term = next_coefficients(emit, c, n, h, K, field)
        total = term if total is None else tuple(emit.plus(s, x) for s, x in zip(total, term, strict=True))
        yield total, term, before
        c.push(term)
        before = term
