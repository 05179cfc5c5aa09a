"""The step of the symmetric top by addition theorems, and its constants; derivation and symbols: `conservative.methods.lame`.

State: attitude q of the slow frame, whose third axis is the body's, and momentum L in its axes. Quaternions are scalar first.

Many tops take the same steps in the same arithmetic, each in a lane (`march_lanes`). The constants are found one body after the
other, because they need twofold arithmetic and decisions. Steps of tops can have different numbers of parts: a lane with fewer
parts waits for its neighbours unchanged.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel, small
from .compiler.lanes import WIDTH, load, load_rows, save_rows
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import add, choose, cross, product
from .compiler.vector import scale as scale_vector
from .protocol import Output, Result, Workspace, deliver, find_ends, record, record_lanes
from .twofold import minus, over, plus, scale, times, two

TERMS = 22
"""Number of terms of `series`."""
SERIES_RADIUS = 0.125
"""Largest product of a time of `series` and the rate `scale_of`; constants of longer times come by doubling it."""
DAMPING = 0.3
"""Damping of a correction, relative to the square of the tilt."""
NOWHERE = 1e-40
"""Square of a distance from the upright position that counts as none, rad^2."""
LARGEST_POLE, LONGEST_FALL = 1.7, 1.0
"""Largest p(h) h^2 of a part of a step, and largest product of its length and the rate of a fall (`split_step`)."""
NEARLY_UPRIGHT = 0.01
"""Energy above the upright top's, relative to the potential one, below which a top passes by that position."""
PAUSE = 2**18
"""Parts of steps between two calls of handlers of signals."""
PARTS_AT_ONCE = 1024
"""Numbers of parts tried between two such calls."""
PARTS, CONSTANTS, ROWS = 21, 23, 33
"""Numbers of a body: constants (first the fields of `Part`, then the number of parts of a step and the moment across the axis),
then attitude (4), vertical (3), rates across the axis (2), and momentum along it. The number of parts, all of the
constants, and all."""


class Model(NamedTuple):
    """Moment across the axis, kg m^2; weight times lever arm, N m; q and L at the start, third axis along the body's."""

    J: float
    kappa: float
    q: Any
    L: Any


class Coefficients(NamedTuple):
    """Length of a step, s."""

    h: float


@kernel
def curve(J, kappa, gamma, L):
    """Twofold k/2, -E/6, g2, g3 and the three B (alpha, beta, M); gamma need be a unit vector to round-off only."""
    Ji = over(two(1.0), two(J))
    square = plus(
        plus(times(two(gamma[0]), two(gamma[0])), times(two(gamma[1]), two(gamma[1]))), times(two(gamma[2]), two(gamma[2]))
    )
    # 1/|gamma| = 1 - (|gamma|^2 - 1)/2 up to the square of a rounding error
    inverse = minus(two(1.5), scale(0.5, square))
    g = (times(inverse, two(gamma[0])), times(inverse, two(gamma[1])), times(inverse, two(gamma[2])))
    w = (scale(L[0], Ji), scale(L[1], Ji), scale(L[2], Ji))
    k = scale(kappa, Ji)
    ww = plus(plus(times(w[0], w[0]), times(w[1], w[1])), times(w[2], w[2]))
    E = plus(scale(0.5, ww), times(k, g[2]))
    z = plus(plus(times(w[0], g[0]), times(w[1], g[1])), times(w[2], g[2]))
    # nu = k/2, x0 = -E/6 and upper = nu + x0. In these, g2 and g3 are as in `conservative.methods.lame`.
    nu, x0 = scale(0.5, k), times(E, over(two(-1.0), two(6.0)))
    upper = plus(x0, nu)
    g2 = minus(scale(12.0, times(x0, x0)), scale(2.0, times(nu, minus(times(z, w[2]), scale(2.0, nu)))))
    slip = times(nu, minus(z, w[2]))
    g3 = plus(minus(scale(4.0, times(upper, times(upper, upper))), times(g2, upper)), times(slip, slip))
    B_M = minus(scale(-2.0, x0), scale(0.25, times(w[2], w[2])))
    return nu, x0, g2, g3, np.array((minus(x0, nu), upper, B_M))


@kernel
def scale_of(g2, g3, B):
    """A rate, 1/s, above which the series of this curve have nothing left to resolve."""
    # g2, g3 and B have the dimensions of a fourth, a sixth and a second power of a rate.
    size = max(math.sqrt(abs(g2[0])), abs(g3[0]) ** (1.0 / 3.0))
    for n in range(3):
        size = max(size, abs(B[n, 0]))
    return math.sqrt(size)


@kernel
def series(g2, g3, B, t):
    """Return p, p' and, for each of three B, the regular solution f of f'' = (2 p + B) f and f' at a short time t (twofold)."""
    c = np.zeros((TERMS, 2))
    T = times(t, t)
    # p = 1/t^2 + sum of c_k t^(2k-2): Abramowitz and Stegun, 18.5.1 to 18.5.3
    c[2, 0], c[2, 1] = over(g2, two(20.0))
    c[3, 0], c[3, 1] = over(g3, two(28.0))
    for k in range(4, TERMS):
        total = (0.0, 0.0)
        for i in range(2, k - 1):
            total = plus(total, times((c[i, 0], c[i, 1]), (c[k - i, 0], c[k - i, 1])))
        c[k, 0], c[k, 1] = over(scale(3.0, total), two((2.0 * k + 1.0) * (k - 3.0)))
    p, dp = (0.0, 0.0), (0.0, 0.0)
    for k in range(TERMS - 1, 0, -1):
        ck = (c[k, 0], c[k, 1])
        p, dp = plus(times(p, T), ck), plus(times(dp, T), scale(2.0 * k - 2.0, ck))
    # p = 1/T + sum_k c_k T^(k-1), with k = 1 empty
    inverse = over(two(1.0), T)
    p, dp = plus(inverse, p), over(plus(scale(-2.0, inverse), dp), t)
    f = np.empty((3, 2, 2))
    a = np.empty((TERMS, 2))
    for n in range(3):
        b = (B[n, 0], B[n, 1])
        # f = t^2 times the sum of a_j t^(2j). The -2 below is of the pole of 2 p.
        a[0, 0], a[0, 1] = 1.0, 0.0
        for j in range(1, TERMS):
            total = times(b, (a[j - 1, 0], a[j - 1, 1]))
            for k in range(2, j + 1):
                total = plus(total, scale(2.0, times((c[k, 0], c[k, 1]), (a[j - k, 0], a[j - k, 1]))))
            a[j, 0], a[j, 1] = over(total, two((2.0 * j + 2.0) * (2.0 * j + 1.0) - 2.0))
        y, dy = (0.0, 0.0), (0.0, 0.0)
        for j in range(TERMS - 1, -1, -1):
            aj = (a[j, 0], a[j, 1])
            y, dy = plus(times(y, T), aj), plus(times(dy, T), scale(2.0 * j + 2.0, aj))
        (f[n, 0, 0], f[n, 0, 1]), (f[n, 1, 0], f[n, 1, 1]) = times(y, T), times(dy, t)
    return p, dp, f


@kernel
def constants(g2, g3, B, h):
    """Return p(h), p'(h) and (f, f') for each B as floats: the series at h / 2^m, doubled m times by addition theorems."""
    halvings = 0
    size = scale_of(g2, g3, B)
    while h * size > SERIES_RADIUS * 2.0**halvings:
        halvings += 1
    p, dp, f = series(g2, g3, B, two(h * 0.5**halvings))
    for _ in range(halvings):
        # p''/(2 p'), the limit of the slope of the addition theorem for equal arguments
        S = over(minus(scale(6.0, times(p, p)), scale(0.5, g2)), scale(2.0, dp))
        p2 = minus(times(S, S), scale(2.0, p))
        dp2 = minus(scale(2.0, times(S, minus(p, p2))), dp)
        for n in range(3):
            b = (B[n, 0], B[n, 1])
            y, dy = (f[n, 0, 0], f[n, 0, 1]), (f[n, 1, 0], f[n, 1, 1])
            third = over(two(1.0), two(3.0))
            slope = times(dy, S)
            A = times(third, minus(times(y, plus(scale(2.0, p), b)), slope))
            D = times(third, minus(times(y, plus(plus(p, p2), b)), slope))
            b_ = times(third, minus(dy, times(y, S)))
            # The propagator ((A, b), (C, D)) of an equation without a term in y' has determinant 1.
            C = over(minus(times(A, D), two(1.0)), b_)
            f[n, 0, 0], f[n, 0, 1] = plus(times(A, y), times(b_, dy))
            f[n, 1, 0], f[n, 1, 1] = plus(times(C, y), times(D, dy))
        p, dp = p2, dp2
    return p[0] + p[1], dp[0] + dp[1], f[:, :, 0] + f[:, :, 1]


@kernel
def split_step(g2, g3, B, h, falling):
    """Return the number of equal parts of a step, and the constants of a part.

    Multiples of the period of nutation are poles of p, where the formulas cancel, and beyond about half of it the map amplifies
    what leaves the motion that its constants belong to. p(h) h^2 grows from 1 at h = 0 to about 2 there; unstable runs were
    seen from 3 on. A top that passes by the upright position, which it leaves at the rate `falling`, 1/s, needs a few parts on
    its way there to correct its energy, which then is nearly nothing.
    """
    parts = 1 + int(falling * h / LONGEST_FALL)
    while True:
        part = h / parts
        p, dp, f = constants(g2, g3, B, part)
        if p * part * part <= LARGEST_POLE and falling * part <= LONGEST_FALL:
            return parts, p, dp, f
        # One more, not twice as many: a step takes as long as it has parts.
        parts += 1
        if parts % PARTS_AT_ONCE == 0:
            call_handlers()


@small
def turn(a, b, gamma, w):
    """Quaternion d of the step, q1 = q d, where alpha1 = a[0] alpha + b[0] alpha' and beta1 = a[1] beta + b[1] beta'.

    d = (mean a) + (mean b) w/2 - (half difference of a) gamma k - (half difference of b) gamma w k / 2
    """
    m, d = 0.5 * (a[0] + a[1]), 0.5 * (a[0] - a[1])
    n, e = 0.25 * (b[0] + b[1]), 0.25 * (b[0] - b[1])
    g0, g1, g2 = gamma
    w0, w1, w2 = w
    r = -e * (g0 * w0 + g1 * w1 + g2 * w2)
    x = d * g0 + e * (g1 * w2 - g2 * w1)
    y = d * g1 + e * (g2 * w0 - g0 * w2)
    z = d * g2 + e * (g0 * w1 - g1 * w0)
    return (m + z, n * w0 - y, n * w1 + x, n * w2 - r)


@small
def unit_vertical(q):
    """Return the last row of the matrix of a unit quaternion."""
    return (
        2.0 * (q[1] * q[3] - q[0] * q[2]),
        2.0 * (q[2] * q[3] + q[0] * q[1]),
        q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
    )


@small
def invariants(k, spin, q, gamma, w0, w1):
    """Vertical momentum and energy relative to a top that stands at rest with the same spin, and sin^2 of half the tilt.

    Near there they are sums of small numbers, known to all digits, which decide when a top that falls stands up again: an
    absolute error of 1e-16 of the energy would be all of it at 1e-8 rad. `spin` is as in `Part`.
    """
    low = choose(k < 0.0, q[0] * q[0] + q[3] * q[3], q[1] * q[1] + q[2] * q[2])
    return w0 * gamma[0] + w1 * gamma[1] - 2.0 * spin * low, 0.5 * (w0 * w0 + w1 * w1) - 2.0 * abs(k) * low, low


@small
def restore_invariants(c, q, gamma, w0, w1):
    """Smallest change (dw0, dw1) of w and small turn (3,) of the attitude that bring the `invariants` back to c.z and c.E.

    One Gauss-Newton correction, damped so much that it takes back a good part of what was lost, step by step, but never turns
    the rounding error of a residual into a larger one of the state where the gradients are small (a hanging top) or parallel
    (steady precession). The damping falls with the square of the tilt, as gradients and rounding errors do.
    """
    rate, k = c.rate, c.k
    g0, g1, g2 = gamma
    z, E, low = invariants(k, c.spin, q, gamma, w0, w1)
    r = c.z - z
    i = 1.0 / rate
    s = i * (c.E - E)
    a0, a1 = rate * g0, rate * g1
    a2, a3, a4 = w1 * g2 - c.w2 * g1, c.w2 * g0 - w0 * g2, w0 * g1 - w1 * g0
    f = i * k
    b2, b3 = -f * g1, f * g0
    aa = a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3 + a4 * a4
    ab = a0 * w0 + a1 * w1 + a2 * b2 + a3 * b3
    bb = w0 * w0 + w1 * w1 + b2 * b2 + b3 * b3
    damping = DAMPING * rate * rate * (low + NOWHERE)
    aa, bb = aa + damping, bb + damping
    inverse = 1.0 / (aa * bb - ab * ab)
    m, n = inverse * (bb * r - ab * s), inverse * (aa * s - ab * r)
    return (rate * (m * a0 + n * w0), rate * (m * a1 + n * w1)), (m * a2 + n * b2, m * a3 + n * b3, m * a4)


class Part(NamedTuple):
    """Constants of a part of a step: of the motion (E to w2, and `rate`, which residuals are scaled by), then of the length.

    E and z are relative to the upright top with the same spin; `spin` is w2, or -w2 if the axis points down there.
    """

    E: Any
    z: Any
    spin: Any
    k: Any
    nu: Any
    x0: Any
    w2: Any
    rate: Any
    p_h: Any
    dp_h: Any
    ya: Any
    da: Any
    yb: Any
    db: Any
    ym: Any
    dm: Any
    ca: Any
    cb: Any
    cm: Any
    cos: Any
    sin: Any


@kernel
def divide_step(model, h):
    """Return the number of equal parts of a step (`split_step`), and the constants of a part."""
    J, kappa, q, L = model
    nu, x0, g2, g3, B = curve(J, kappa, unit_vertical(q), L)
    w2, k = L[2] / J, kappa / J
    spin = -w2 if kappa < 0.0 else w2
    kept = invariants(k, spin, q, unit_vertical(q), L[0] / J, L[1] / J)
    falling = math.sqrt(max(0.0, abs(k) - 0.25 * w2 * w2)) if abs(kept[1]) < NEARLY_UPRIGHT * abs(k) else 0.0
    parts, p_h, dp_h, f = split_step(g2, g3, B, h, falling)
    h /= parts
    rate = scale_of(g2, g3, B)
    rate = rate if rate > 0.0 else 1.0 / h
    (ya, da), (yb, db), (ym, dm) = (f[0, 0], f[0, 1]), (f[1, 0], f[1, 1]), (f[2, 0], f[2, 1])
    ca, cb, cm = p_h + B[0, 0], p_h + B[1, 0], p_h + B[2, 0]
    half = 0.5 * w2
    cos, sin = math.cos(half * h), math.sin(half * h)
    of_motion = kept[1], kept[0], spin, k, nu[0], x0[0], w2, rate
    return parts, Part(*of_motion, p_h, dp_h, ya, da, yb, db, ym, dm, ca, cb, cm, cos, sin)


@small
def advance(c, q, gamma, w0, w1):
    """Take a part of a step: of the attitude q, the vertical gamma in its axes, and the rates across the axis."""
    third, half = 1.0 / 3.0, 0.5 * c.w2
    g0, g1, g2 = gamma
    x = c.nu * g2 + c.x0
    S = 0.5 * (c.nu * (g0 * w1 - g1 * w0) - c.dp_h) / (x - c.p_h)
    a = ((c.ya * (c.ca + x) - c.da * S) * third, (c.yb * (c.cb + x) - c.db * S) * third)
    b = ((c.da - c.ya * S) * third, (c.db - c.yb * S) * third)
    d = turn(a, b, gamma, (w0, w1, c.w2))
    am, bm = (c.ym * (c.cm + x) - c.dm * S) * third, (c.dm - c.ym * S) * third
    # M = exp(i w3 t/2) (w1 + i w2) starts at w1 + i w2 in each part. The next line turns it back.
    m0, m1 = am * w0 + bm * (c.k * g1 - half * w1), am * w1 + bm * (half * w0 - c.k * g0)
    w0, w1 = c.cos * m0 + c.sin * m1, c.cos * m1 - c.sin * m0
    q = product(q, d)
    gamma = unit_vertical(q)
    dw, t = restore_invariants(c, q, gamma, w0, w1)
    w0, w1 = w0 + dw[0], w1 + dw[1]
    # Normalised and turned at once, and gamma turned along: t is a rounding error, its square is nothing.
    # gamma must be of unit length: left alone, an error of its length would grow from step to step.
    size = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    half_size = 0.5 * size
    q = product(q, (size, half_size * t[0], half_size * t[1], half_size * t[2]))
    return q, scale_vector(size * size, add(gamma, cross(gamma, t))), w0, w1


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`), each in as many equal parts as `split_step` says, which count as stages."""
    J, _, q, L0 = model
    n_steps, every, pause, q_out, L_out = workspace
    gamma = unit_vertical(q)
    parts, c = divide_step(model, coefficients.h)
    w0, w1 = L0[0] / J, L0[1] / J
    record(0, q, L0, q_out, L_out)
    row = 0
    done, block = 0, -(-pause // parts)
    while done < n_steps:
        last = end_of_block(done, n_steps, block)
        for step in range(done + 1, last + 1):
            for _ in range(parts):
                q, gamma, w0, w1 = advance(c, q, gamma, w0, w1)
            if step % every == 0 or step == n_steps:
                row += 1
                record(row, q, (J * w0, J * w1, L0[2]), q_out, L_out)
        done = last
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps * parts, 0, None, 0.0, False)


MODEL_END, COEFFICIENTS_END, WORKSPACE_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    workspace = Workspace(*loose[COEFFICIENTS_END:WORKSPACE_END])
    return deliver(march(model, coefficients, workspace), workspace, Output(*loose[WORKSPACE_END:]))


@entry
def prepare_lanes(J, kappa, q, L, h, table):
    """Fill the table (ROWS, m) of n bodies, m not below n: moments J (n,), kappa (n,), q (n, 4) and L (n, 3) as in `Model`.

    The columns that are left repeat the last body.
    """
    n = len(J)
    for i in range(n):
        q0, L0 = (q[i, 0], q[i, 1], q[i, 2], q[i, 3]), (L[i, 0], L[i, 1], L[i, 2])
        parts, part = divide_step(Model(J[i], kappa[i], q0, L0), h)
        gamma = unit_vertical(q0)
        state = q0 + gamma + (L0[0] / J[i], L0[1] / J[i], L0[2])
        for row, x in enumerate((*part[:], float(parts), J[i], *state)):
            table[row, i] = x
    for i in range(n, table.shape[1]):
        for row in range(ROWS):
            table[row, i] = table[row, n - 1]


@small
def take_step(c, parts, least, most, q, gamma, w0, w1):
    """Take a step of so many parts, which differ from lane to lane: `least` of them at least, `most` at most."""
    for part in range(most):
        q1, gamma1, v0, v1 = advance(c, q, gamma, w0, w1)
        # All lanes take these parts, without a choice.
        if part < least:
            q, gamma, w0, w1 = q1, gamma1, v0, v1
        else:
            left = parts > float(part)
            q, gamma, w0, w1 = choose(left, q1, q), choose(left, gamma1, gamma), choose(left, v0, w0), choose(left, v1, w1)
    return q, gamma, w0, w1


@entry
def march_lanes(table, done, last, n_steps, every, q_out, L_out):
    """Take the steps after `done` up to `last` of n_steps: of all bodies of the table of `prepare_lanes`, WIDTH at a time.

    Samples go to q_out (n, samples, 4) and L_out (n, samples, 3).
    """
    n, flat = table.shape[1], table.reshape(-1)
    q_flat, L_flat, samples = q_out.reshape(-1), L_out.reshape(-1), q_out.shape[1]
    for i in range(0, n, WIDTH):
        c = Part(*load_rows(flat, i, n, PARTS, WIDTH))
        parts, J = load(flat, i + PARTS * n, WIDTH), load(flat, i + (PARTS + 1) * n, WIDTH)
        least, most = table[PARTS, i], table[PARTS, i]
        for lane in range(1, WIDTH):
            least, most = min(least, table[PARTS, i + lane]), max(most, table[PARTS, i + lane])
        state = load_rows(flat, i + CONSTANTS * n, n, 10, WIDTH)
        q, gamma, w0, w1, L2 = state[:4], state[4:7], state[7], state[8], state[9]
        row, until_sample = done // every, every - done % every
        for step in range(done + 1, last + 1):
            q, gamma, w0, w1 = take_step(c, parts, int(least), int(most), q, gamma, w0, w1)
            until_sample -= 1
            if until_sample == 0 or step == n_steps:
                until_sample = every
                row += 1
                record_lanes(i, row, samples, q, q_flat)
                record_lanes(i, row, samples, (J * w0, J * w1, L2), L_flat)
        save_rows(flat, i + CONSTANTS * n, n, q + gamma + (w0, w1, L2))
