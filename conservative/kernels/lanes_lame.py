"""The steps of `lame` for many symmetric tops at once; constants of each body are formed one by one, by `lame` itself."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from . import kernel, small
from .lame import DAMPING, curve, scale_of, split_step, unit_vertical
from .lanes import load, save
from .vector import add, cross, product, scale


class Part(NamedTuple):
    """Constants of a part of a step."""

    E: Any
    z: Any
    k: Any
    rate: Any
    nu: Any
    x0: Any
    w2: Any
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


FIELDS = 20


@small
def turn(a, b, gamma, w):
    """As `lame.turn`, which is no small function."""
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
def restore(E, z, k, rate, gamma, w):
    """As `lame.restore_invariants`, which is no small function."""
    w0, w1, w2 = w
    g0, g1, g2 = gamma
    r = z - (w0 * g0 + w1 * g1 + w2 * g2)
    i = 1.0 / rate
    s = i * (E - 0.5 * (w0 * w0 + w1 * w1 + w2 * w2) - k * g2)
    a0, a1 = rate * g0, rate * g1
    a2, a3, a4 = w1 * g2 - w2 * g1, w2 * g0 - w0 * g2, w0 * g1 - w1 * g0
    f = i * k
    b2, b3 = -f * g1, f * g0
    damping = DAMPING * rate * rate
    aa = a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3 + a4 * a4 + damping
    ab = a0 * w0 + a1 * w1 + a2 * b2 + a3 * b3
    bb = w0 * w0 + w1 * w1 + b2 * b2 + b3 * b3 + damping
    inverse = 1.0 / (aa * bb - ab * ab)
    m, n = inverse * (bb * r - ab * s), inverse * (aa * s - ab * r)
    return (rate * (m * a0 + n * w0), rate * (m * a1 + n * w1)), (m * a2 + n * b2, m * a3 + n * b3, m * a4)


@small
def vertical_of_unit(q):
    """As `lame.unit_vertical`."""
    return (
        2.0 * (q[1] * q[3] - q[0] * q[2]),
        2.0 * (q[2] * q[3] + q[0] * q[1]),
        q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
    )


@small
def advance(c, q, gamma, w0, w1):
    """One part of a step: (q, gamma, w0, w1)."""
    third, half = 1.0 / 3.0, 0.5 * c.w2
    g0, g1, g2 = gamma
    x = c.nu * g2 + c.x0
    S = 0.5 * (c.nu * (g0 * w1 - g1 * w0) - c.dp_h) / (x - c.p_h)
    a = ((c.ya * (c.ca + x) - c.da * S) * third, (c.yb * (c.cb + x) - c.db * S) * third)
    b = ((c.da - c.ya * S) * third, (c.db - c.yb * S) * third)
    d = turn(a, b, gamma, (w0, w1, c.w2))
    am, bm = (c.ym * (c.cm + x) - c.dm * S) * third, (c.dm - c.ym * S) * third
    m0, m1 = am * w0 + bm * (c.k * g1 - half * w1), am * w1 + bm * (half * w0 - c.k * g0)
    w0, w1 = c.cos * m0 + c.sin * m1, c.cos * m1 - c.sin * m0
    q = product(q, d)
    gamma = vertical_of_unit(q)
    dw, t = restore(c.E, c.z, c.k, c.rate, gamma, (w0, w1, c.w2))
    w0, w1 = w0 + dw[0], w1 + dw[1]
    size = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    half_size = 0.5 * size
    q = product(q, (size, half_size * t[0], half_size * t[1], half_size * t[2]))
    return q, scale(size * size, add(gamma, cross(gamma, t))), w0, w1


@kernel
def prepare(J, kappa, q, L, h, constants):
    """Fill constants (20, n) for bodies q (n, 4), L (n, 3); return the largest number of parts (all need the same here)."""
    most = 1
    for i in range(len(q)):
        q0, L0 = (q[i, 0], q[i, 1], q[i, 2], q[i, 3]), (L[i, 0], L[i, 1], L[i, 2])
        E_, z_, spin_, nu_, x0_, g2, g3, B = curve(J, kappa, unit_vertical(q0), L0)
        parts, p_h, dp_h, f = split_step(g2, g3, B, h)
        most = max(most, parts)
        rate = scale_of(g2, g3, B)
        half = 0.5 * spin_[0] * h / parts
        c = (
            E_[0],
            z_[0],
            kappa / J,
            rate,
            nu_[0],
            x0_[0],
            spin_[0],
            p_h,
            dp_h,
            f[0, 0],
            f[0, 1],
            f[1, 0],
            f[1, 1],
            f[2, 0],
            f[2, 1],
            p_h + B[0, 0],
            p_h + B[1, 0],
            p_h + B[2, 0],
            math.cos(half),
            math.sin(half),
        )
        for j in range(20):
            constants[j, i] = c[j]
    return most


def _make_march(width):
    @kernel
    def march_lanes(constants, states, n_steps, out):
        """states (9, n): q, gamma, w0, w1; out (9, n) at the end."""
        n = constants.shape[1]
        k, s, o = constants.reshape(-1), states.reshape(-1), out.reshape(-1)
        for i in range(0, n, width):
            c = Part(
                load(k, i, width),
                load(k, i + n, width),
                load(k, i + 2 * n, width),
                load(k, i + 3 * n, width),
                load(k, i + 4 * n, width),
                load(k, i + 5 * n, width),
                load(k, i + 6 * n, width),
                load(k, i + 7 * n, width),
                load(k, i + 8 * n, width),
                load(k, i + 9 * n, width),
                load(k, i + 10 * n, width),
                load(k, i + 11 * n, width),
                load(k, i + 12 * n, width),
                load(k, i + 13 * n, width),
                load(k, i + 14 * n, width),
                load(k, i + 15 * n, width),
                load(k, i + 16 * n, width),
                load(k, i + 17 * n, width),
                load(k, i + 18 * n, width),
                load(k, i + 19 * n, width),
            )
            q = (load(s, i, width), load(s, i + n, width), load(s, i + 2 * n, width), load(s, i + 3 * n, width))
            gamma = (load(s, i + 4 * n, width), load(s, i + 5 * n, width), load(s, i + 6 * n, width))
            w0, w1 = load(s, i + 7 * n, width), load(s, i + 8 * n, width)
            for _ in range(n_steps):
                q, gamma, w0, w1 = advance(c, q, gamma, w0, w1)
            end = (q[0], q[1], q[2], q[3], gamma[0], gamma[1], gamma[2], w0, w1)
            for j in range(9):
                save(o, i + j * n, end[j])

    return march_lanes


march_four, march_eight = _make_march(4), _make_march(8)
