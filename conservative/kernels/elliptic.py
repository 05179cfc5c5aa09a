"""Sine, cosine and Jacobi's functions of a body's number or of lanes: one source, no branch that depends on a lane.

Sums are rounded as they are written (`kernel`) or fused by name, so that a body gets the same numbers alone and in any lane.
"""

from __future__ import annotations

import math

import numpy as np

from . import kernel
from .compiler.lanes import WIDTH, load, save
from .compiler.vector import choose, fill_like, fuse, some

ROUND = 6755399441055744.0
"""1.5 2^52: adding and subtracting it rounds to the nearest integer."""
PI_1, PI_2, PI_3 = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33
"""pi / 2 in three parts."""
SINE = (
    1.58969099521155010221e-10,
    -2.50507602534068634195e-8,
    2.75573137070700676789e-6,
    -1.98412698298579493134e-4,
    8.33333333332248946124e-3,
    -1.66666666666666324348e-1,
)
COSINE = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-9,
    -2.75573143513906633035e-7,
    2.48015872894767294178e-5,
    -1.38888888888741095749e-3,
    4.16666666666666019037e-2,
)
"""Polynomials in x^2, |x| <= pi / 4, of the highest power first (fdlibm, Sun Microsystems 1993)."""
LEVELS = 16
"""Largest number of levels of the arithmetic-geometric mean."""
TINIEST = 1e-60
"""Smaller values of mc count as 0: their effect is far below round-off."""


@kernel
def polynomial(z, terms):
    """Horner's rule, six terms of the highest power first."""
    total = fuse(fill_like(terms[0], z), z, terms[1])
    for term in terms[2:]:
        total = fuse(total, z, term)
    return total


@kernel
def sine_and_cosine(x):
    """Return sin x and cos x for |x| below about 1e5, with errors of about one unit in the last place."""
    n = (x * (2.0 / math.pi) + ROUND) - ROUND
    # Cody and Waite (1980): the parts of pi/2 are subtracted one by one, so that r keeps its digits near multiples of it.
    r = fuse(-n, PI_3, fuse(-n, PI_2, fuse(-n, PI_1, x)))
    z = r * r
    s = fuse(z * r, polynomial(z, SINE), r)
    c = fuse(z * z, polynomial(z, COSINE), fuse(z, -0.5, 1.0))
    # the quadrant, as a float: lanes have no integers
    k = n - 4.0 * ((0.25 * n + ROUND) - ROUND)  # -2, -1, 0, 1 or 2
    odd = k * k == 1.0
    sine, cosine = choose(odd, c, s), choose(odd, s, c)
    return choose((k < 0.0) | (k > 1.5), -sine, sine), choose((k > 0.5) | (k < -1.5), -cosine, cosine)


@kernel
def find_means(mc):
    """Return the data of `jacobi` for the complementary parameter mc in [0, 1]: means of 1 and sqrt(mc), and their limit.

    Of every level `means` has the arithmetic mean, one over it, and the geometric mean; `last` is the level, a float, at which
    both agree. Each lane stops at a level of its own, so that none changes with its neighbours.
    """
    means = np.empty(3 * LEVELS * WIDTH)
    one = fill_like(1.0, mc)
    a, b, limit, last, levels = one, max(mc, TINIEST), one, -1.0 * one, 0
    going = one > 0.0
    for i in range(LEVELS):
        levels = i
        # b is the square of the geometric mean between the end of a pass and here.
        b = math.sqrt(b)
        save(means, 3 * i * WIDTH, a)
        save(means, (3 * i + 1) * WIDTH, 1.0 / a)
        save(means, (3 * i + 2) * WIDTH, b)
        last, limit = choose(going, float(i) * one, last), choose(going, 0.5 * (a + b), limit)
        # The means agree to twice as many digits after each pass, so 1e-9 leaves nothing in the next.
        going = going & (abs(a - b) > 1e-9 * a)
        if not some(going):
            break
        b = b * a
        a = limit
    return means, levels, last, limit


@kernel
def jacobi(u, means_and_levels):
    """Return sn, cn, dn of u from the result of `find_means` (Bulirsch 1965, sncndn), without computing 1 - m."""
    means, levels, last, limit = means_and_levels
    sine, cosine = sine_and_cosine(limit * u)
    at_rest = sine == 0.0
    one = fill_like(1.0, u)
    a = cosine / choose(at_rest, one, sine)
    c, dn = limit * a, one
    for i in range(levels, -1, -1):
        larger, over, smaller = (
            load(means, 3 * i * WIDTH, u),
            load(means, (3 * i + 1) * WIDTH, u),
            load(means, (3 * i + 2) * WIDTH, u),
        )
        # A lane does not change at levels beyond its own last one.
        passed = last >= float(i)
        a_new = a * c
        c, dn = choose(passed, c * dn, c), choose(passed, (smaller + a_new) / (larger + a_new), dn)
        a = choose(passed, c * over, a)
    n = 1.0 / math.sqrt(c * c + 1.0)
    sn = choose(sine >= 0.0, n, -n)
    return choose(at_rest, 0.0 * one, sn), choose(at_rest, one, c * sn), choose(at_rest, one, dn)
