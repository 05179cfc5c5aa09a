"""Sine, cosine and Jacobi's functions of floats or lanes, without a branch that depends on a lane."""

from __future__ import annotations

import math

from . import small
from .lanes import choose, every, fill_like, fuse, load, save

ROUND = 6755399441055744.0  # 1.5 2^52: added and taken away again, it rounds to the nearest integer
PI_1, PI_2, PI_3 = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33
"""pi / 2 in three parts."""
LEVELS = 16
TINIEST = 1e-60
"""mc below this is as good as 0."""


@small
def sine_and_cosine(x):
    """sin x and cos x, |x| below 1e5 or so, with errors of about one unit in the last place (kernels of Sun's fdlibm)."""
    n = (x * (2.0 / math.pi) + ROUND) - ROUND
    r = fuse(-n, PI_3, fuse(-n, PI_2, fuse(-n, PI_1, x)))
    z = r * r
    s = fuse(
        fuse(
            fuse(
                fuse(fuse(z, 1.58969099521155010221e-10, -2.50507602534068634195e-8), z, 2.75573137070700676789e-6),
                z,
                -1.98412698298579493134e-4,
            ),
            z,
            8.33333333332248946124e-3,
        ),
        z,
        -1.66666666666666324348e-1,
    )
    s = fuse(z * r, s, r)
    c = fuse(
        fuse(
            fuse(
                fuse(fuse(z, -1.13596475577881948265e-11, 2.08757232129817482790e-9), z, -2.75573143513906633035e-7),
                z,
                2.48015872894767294178e-5,
            ),
            z,
            -1.38888888888741095749e-3,
        ),
        z,
        4.16666666666666019037e-2,
    )
    c = fuse(z * z, c, fuse(z, -0.5, 1.0))
    k = n - 4.0 * ((0.25 * n + ROUND) - ROUND)  # -2, -1, 0, 1 or 2
    odd = k * k == 1.0
    sine, cosine = choose(odd, c, s), choose(odd, s, c)
    return choose((k < 0.0) | (k > 1.5), -sine, sine), choose((k > 0.5) | (k < -1.5), -cosine, cosine)


@small
def means(mc, larger, smaller, width):
    """Fill both arrays with the arithmetic and geometric means of 1 and sqrt(mc); return how many, and the last mean.

    Once a lane's means agree, more of them change nothing.
    """
    mc = max(mc, TINIEST)
    a, c, n = fill_like(1.0, mc), fill_like(1.0, mc), 0
    for i in range(LEVELS):
        n = i
        mc = math.sqrt(mc)
        save(larger, i * width, a)
        save(smaller, i * width, mc)
        c = 0.5 * (a + mc)
        if every(abs(a - mc) <= 1e-9 * a):
            break
        mc = mc * a
        a = c
    return n, c


@small
def jacobi(u, n, c, larger, smaller, width):
    """sn, cn, dn of u (Bulirsch 1965), given `means`."""
    sine, cosine = sine_and_cosine(c * u)
    at_rest = sine == 0.0
    sine = choose(at_rest, fill_like(1.0, u), sine)
    a = cosine / sine
    c = c * a
    dn = fill_like(1.0, u)
    for i in range(n, -1, -1):
        a = a * c
        c = c * dn
        top = load(larger, i * width, width)
        dn = (load(smaller, i * width, width) + a) / (top + a)
        a = c / top
    a = 1.0 / math.sqrt(fuse(c, c, 1.0))
    sn = choose(sine >= 0.0, a, -a)
    return choose(at_rest, sine * 0.0, sn), choose(at_rest, fill_like(1.0, u), c * sn), choose(at_rest, fill_like(1.0, u), dn)
