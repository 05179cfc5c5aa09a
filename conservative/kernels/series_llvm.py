"""The orders of a series step in uniform gravity, unrolled as LLVM's vector code (`taylor`).

With c' the coefficients of powers of t/h, so that a step is their sum, and n = 0, 1, ...

    (n+1) g'[n+1] = h sum of g'[i] x w'[n-i]       (n+1) a'[n+1] = h sum of a'[i] x w'[n-i]
    (n+1) w'[n+1] = h (K sum of w2'[i] w3'[n-i] and its kin + J^-1 (g'[n] x m))

A vector x is kept as r = (x2, x3, x1) and s = (x3, x1, x2), so that x x y is r_x s_y - s_x r_y without shuffles. Sums run from
the middle outwards, as the newest coefficients come last; what depends on the newest is added in two short chains, with
constants that hold the factor h/(n+1). For a pull towards a point, g in the torque is replaced by P of `Pull`.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from .simd_llvm import FOUR, LANES

LOWEST, HIGHEST = 4, 20
"""Orders that code is made for: beyond the highest, it does not fit into the processor's cache of instructions."""
RECENT = 1
"""How many of the newest coefficients are used from registers."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)
_TURNED, _TWICE = (1, 2, 0, 1), (2, 0, 1, 2)


class _VolatileLoad(ir.instructions.LoadInstr):
    """A load that is made once, here: LLVM would keep all coefficients in registers otherwise, which spills them."""

    def descr(self, buf):
        (pointer,) = self.operands
        kind = pointer.type
        buf.append(f"load volatile {kind.pointee}, {kind} {pointer.get_reference()}, align 32\n")


class Emitter:
    """Vector instructions by name, and the memory of the coefficients: six vectors for each order."""

    def __init__(self, builder):
        self.builder = builder
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        self._fma = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.v{LANES}f64")
        with builder.goto_entry_block():
            self._memory = builder.alloca(_VECTOR, 6 * HIGHEST)
            self._memory.align = 32

    def add(self, c, a, b):
        """c + a b; c is None for 0."""
        return self.builder.fmul(a, b) if c is None else self.builder.call(self._fma, [a, b, c])

    def subtract(self, c, a, b):
        """c - a b"""
        return self.builder.call(self._fma, [self.builder.fneg(a), b, c])

    def shuffle(self, v, mask):
        return self.builder.shuffle_vector(v, v, ir.Constant(ir.VectorType(_INDEX, LANES), mask))

    def splat(self, x):
        first = self.builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), x, ir.Constant(_INDEX, 0))
        return self.shuffle(first, (0, 0, 0, 0))

    def scale(self, f, values):
        return [self.builder.fmul(f, v) for v in values]

    def _at(self, index):
        return self.builder.gep(self._memory, [ir.Constant(_INDEX, index)])

    def store(self, index, v):
        self.builder.store(v, self._at(index), align=32)

    def load(self, index):
        found = _VolatileLoad(self.builder.block, self._at(index), "")
        self.builder._insert(found)
        return found


class Series:
    """Coefficients so far: of each, (r, s) of g, a and w."""

    def __init__(self, emit):
        self._emit, self._newest = emit, []

    def push(self, vectors):
        emit, n = self._emit, len(self._newest)
        self._newest.append([emit.shuffle(v, mask) for v in vectors for mask in (_TURNED, _TWICE)])
        for k, v in enumerate(self._newest[n]):
            emit.store(6 * n + k, v)

    def __getitem__(self, key):
        n, k = key
        if 0 < n <= len(self._newest) - 1 - RECENT:
            return self._emit.load(6 * n + k)
        return self._newest[n][k]


def _sum_inner(emit, c, n, indices):
    """Sums over i of products of i with n - i: both halves of g x w, both of a x w, and w2 w3 and its kin."""
    sums = [None] * 5
    for i in sorted(indices, key=lambda i: (abs(2 * i - n), -i)):
        r, s = c[n - i, 4], c[n - i, 5]
        for k, other in enumerate((s, r, s, r, s)):
            sums[k] = emit.add(sums[k], c[i, k], other)
    return sums


class Linear:
    """A uniform field: J^-1 (P x m) with P = g, where M holds both halves of J^-1 m."""

    def __init__(self, M):
        self._M = M

    def accelerate(self, emit, c, n, f):
        """f times coefficient n of what the field adds to w'."""
        (r, s), (M1, M2) = self._follow(emit, c, n), self._M
        b = emit.builder
        return emit.subtract(emit.add(None, b.fmul(f, M2), r), b.fmul(f, M1), s)

    def _follow(self, emit, c, n):
        """Coefficient n of P, as (r, s)."""
        return c[n, 0], c[n, 1]


class Gradient:
    """The gradient of gravity where its inertia is diagonal: G (g2 g3, g3 g1, g1 g2), G = rate^2 J^-1 (J3 - J2) and its kin."""

    def __init__(self, G):
        self._G = G

    def accelerate(self, emit, c, n, f):
        """f times coefficient n of what the field adds to w'."""
        total = None
        for i in sorted(range(n + 1), key=lambda i: abs(2 * i - n)):
            total = emit.add(total, c[i, 0], c[n - i, 1])
        return emit.builder.fmul(emit.builder.fmul(f, self._G), total)


class Pull(Linear):
    """P = y g with y = c0 + c1 s^alpha, where s = s0 - S.g is the squared distance.

    With s[k], y[k] the coefficients of s and s^alpha, n s[0] y[n] = sum over k = 1 ... n of (alpha k - (n - k)) s[k] y[n-k].
    """

    def __init__(self, M, alpha, S, y0, over, c0, c1):
        super().__init__(M)
        self._alpha, self._S, self._over, self._c0, self._c1 = alpha, S, over, c0, c1
        self._s, self._y, self._factor = [None], [y0], []

    def _follow(self, emit, c, n):
        """Coefficient n of P, as (r, s)."""
        b, s, y = emit.builder, self._s, self._y
        if n == 0:
            self._factor.append(emit.add(self._c0, self._c1, y[0]))
        else:
            t = b.fmul(self._S, c[n, 0])
            s.append(b.fadd(b.fadd(t, emit.shuffle(t, _TURNED)), emit.shuffle(t, _TWICE)))
            total = None
            for k in sorted(range(1, n + 1), key=lambda k: abs(2 * k - n)):
                weight = -(self._alpha * k - (n - k)) / n
                total = emit.add(total, b.fmul(ir.Constant(_VECTOR, [weight] * LANES), s[k]), y[n - k])
            y.append(b.fmul(total, self._over))
            self._factor.append(b.fmul(self._c1, y[n]))
        P = [None, None]
        for i in sorted(range(n + 1), key=lambda i: abs(2 * i - n)):
            P = [emit.add(P[k], self._factor[i], c[n - i, k]) for k in range(2)]
        return P


def _next_coefficients(emit, c, n, f, K, field):
    """The coefficients n + 1; f is h/(n+1)."""
    b = emit.builder
    gp, gm, ap, am, ww = _sum_inner(emit, c, n, range(1, n))
    f1, f2, fK = *emit.scale(f, (c[0, 4], c[0, 5])), b.fmul(f, K)
    new = []
    for k, plus, minus in ((0, gp, gm), (2, ap, am)):
        r, s = c[n, k], c[n, k + 1]
        old = None if plus is None else b.fmul(f, b.fsub(plus, minus))
        two = emit.subtract(emit.add(old, r, f2), s, f1)
        if n:
            r0, s0 = emit.scale(f, (c[0, k], c[0, k + 1]))
            two = b.fadd(two, emit.subtract(emit.add(None, r0, c[n, 5]), s0, c[n, 4]))
        new.append(two)
    one = field.accelerate(emit, c, n, f)
    two = emit.add(None if ww is None else b.fmul(fK, ww), b.fmul(f1, K), c[n, 5])
    if n:
        two = emit.add(two, b.fmul(f2, K), c[n, 4])
    return [*new, b.fadd(one, two)]


def build_orders(builder, p, h, start, K, field_of):
    """Return what a step adds to g, a and w."""
    emit = Emitter(builder)
    c, h4, field = Series(emit), emit.splat(h), field_of(emit)
    c.push(start)
    end = builder.function.append_basic_block("series_end")
    exits, total = [], None
    for n in range(HIGHEST):
        f = builder.fmul(h4, ir.Constant(_VECTOR, [1.0 / (n + 1)] * LANES))
        new = _next_coefficients(emit, c, n, f, K, field)
        total = new if n == 0 else [builder.fadd(s, x) for s, x in zip(total, new, strict=True)]
        if n + 1 >= LOWEST:
            exits.append((builder.block, total))
            if n + 1 == HIGHEST:
                builder.branch(end)
                break
            proceed = builder.function.append_basic_block(f"order_{n + 2}")
            builder.cbranch(builder.icmp_signed("<=", p, ir.Constant(p.type, n + 1)), end, proceed)
            builder.position_at_end(proceed)
        c.push(new)
    builder.position_at_end(end)
    out = [builder.phi(_VECTOR) for _ in range(3)]
    for block, values in exits:
        for phi, value in zip(out, values, strict=True):
            phi.add_incoming(value, block)
    return out


@intrinsic
def orders(typing, p, h, g, a, w, K, M1, M2):
    """What a step of order p, LOWEST to HIGHEST, and length h adds to g, a and w, each (x, y, z, anything).

    K is (J2 - J3)/J1 and its kin; M1 and M2 are J^-1 times the moment m, rotated as r and s are: J^-1 (m2, m3, m1) and
    J^-1 (m3, m1, m2).
    """
    three = types.UniTuple(FOUR, 3)

    def build(context, builder, sig, args):
        p, h, g, a, w, K, M1, M2 = args
        return context.make_tuple(builder, three, build_orders(builder, p, h, (g, a, w), K, lambda _: Linear((M1, M2))))

    return three(types.intp, types.float64, FOUR, FOUR, FOUR, FOUR, FOUR, FOUR), build


def _pull_orders(alpha):
    @intrinsic
    def orders(typing, p, h, g, a, w, K, M1, M2, S, y0, over, c0, c1):
        """As `orders`, for a moment times c0 + c1 s^alpha (`Pull`); S is (S2, S3, S1, S2), y0 = s^alpha, over = 1/s."""
        three = types.UniTuple(FOUR, 3)

        def build(context, builder, sig, args):
            p, h, g, a, w, K, M1, M2, S, *numbers = args

            def field_of(emit):
                return Pull((M1, M2), alpha, S, *(emit.splat(x) for x in numbers))

            return context.make_tuple(builder, three, build_orders(builder, p, h, (g, a, w), K, field_of))

        f = types.float64
        return three(types.intp, f, *[FOUR] * 7, f, f, f, f), build

    return orders


spring_orders, attraction_orders = _pull_orders(-0.5), _pull_orders(-1.5)


@intrinsic
def gradient_orders(typing, p, h, g, a, w, K, G):
    """As `orders`, in the gradient of gravity with a diagonal inertia (`Gradient`)."""
    three = types.UniTuple(FOUR, 3)

    def build(context, builder, sig, args):
        p, h, g, a, w, K, G = args
        return context.make_tuple(builder, three, build_orders(builder, p, h, (g, a, w), K, lambda _: Gradient(G)))

    return three(types.intp, types.float64, *[FOUR] * 5), build
