"""The steps of `taylor` in uniform gravity for many bodies at once: every lane is a body of its own.

Coefficients are kept as (g, a, w) of every order, nine numbers, each the coefficient of a power of t/h. Lanes need no shuffles,
and order n costs 15 products for each pair of orders.
"""

from __future__ import annotations

import numpy as np

from . import kernel, small
from .lanes import choose, fill_like, fuse, load, save, some
from .lanes_emitter import emitted_orders
from .lanes_series_llvm import lane_orders
from .vector import add, cross, dot, scale, subtract, times

DEPENDENT, TINY = 1e-8, 1e-300
"""Regularisation: relative, of the gradients' Gram determinant, and added to squares that can be 0."""
ENOUGH, FAR = 2.0**-26, 0.1
"""Relative defect after which one correction is enough, and the largest that is corrected."""


@small
def shortest_move(w, L, moment, size, e, m, g):
    """Return (dL, turn of the body) that changes energy by e and vertical momentum by m, to first order, and moves least."""
    T, turn, square = cross(g, moment), cross(L, g), size * size
    ee = square * dot(w, w) + dot(T, T) + TINY
    mm = square + dot(turn, turn)
    em = square * dot(w, g) - dot(T, turn)
    over = 1.0 / ((1.0 + DEPENDENT) * (ee * mm) - em * em)
    x, y = over * (mm * e - em * m), over * (ee * m - em * e)
    return scale(square, add(scale(x, w), scale(y, g))), add(scale(-x, T), scale(y, turn))


@small
def values(J, moment, g, w):
    """Energy, J, and vertical momentum, kg m^2/s."""
    L = times(J, w)
    return 0.5 * dot(L, w) + dot(moment, g), dot(L, g)


@small
def load3(array, first, stride, width):
    """Three numbers, `stride` apart."""
    return (load(array, first, width), load(array, first + stride, width), load(array, first + 2 * stride, width))


@small
def save3(array, first, width, v):
    """Three numbers, one after the other."""
    save(array, first, v[0])
    save(array, first + width, v[1])
    save(array, first + 2 * width, v[2])


@small
def add_cross(s, x, w):
    """s + x x w"""
    return (
        fuse(x[1], w[2], fuse(-x[2], w[1], s[0])),
        fuse(x[2], w[0], fuse(-x[0], w[2], s[1])),
        fuse(x[0], w[1], fuse(-x[1], w[0], s[2])),
    )


@small
def add_mixed(s, v, w):
    """s + (v2 w3, v3 w1, v1 w2)"""
    return (fuse(v[1], w[2], s[0]), fuse(v[2], w[0], s[1]), fuse(v[0], w[1], s[2]))


@small
def series_step(p, h, K, J_inverse, moment, c, g, a, w, width):
    """What a step of order p and length h adds to g, a and w; c is room for 9 p numbers."""
    size = 9 * width
    zero = fill_like(0.0, g[0])
    zeros = (zero, zero, zero)
    save3(c, 0, width, g)
    save3(c, 3 * width, width, a)
    save3(c, 6 * width, width, w)
    gn, an, wn = g, a, w
    for n in range(p):
        sg, sa, sw = zeros, zeros, zeros
        for i in range(1, n):
            x = i * size
            wi = load3(c, (n - i) * size + 6 * width, width, width)
            sg = add_cross(sg, load3(c, x, width, width), wi)
            sa = add_cross(sa, load3(c, x + 3 * width, width, width), wi)
            sw = add_mixed(sw, load3(c, x + 6 * width, width, width), wi)
        # What the newest coefficients are in comes last.
        if n:
            sg, sa, sw = add_cross(sg, gn, w), add_cross(sa, an, w), add_mixed(sw, wn, w)
        sg, sa, sw = add_cross(sg, g, wn), add_cross(sa, a, wn), add_mixed(sw, w, wn)
        f = h * (1.0 / (n + 1))
        sw = add(times(K, sw), times(J_inverse, cross(gn, moment)))
        gn, an, wn = scale(f, sg), scale(f, sa), scale(f, sw)
        x = (n + 1) * size
        save3(c, x, width, gn)
        save3(c, x + 3 * width, width, an)
        save3(c, x + 6 * width, width, wn)
    dg, da, dw = gn, an, wn
    for n in range(p - 1, 0, -1):
        x = n * size
        dg, da = add(dg, load3(c, x, width, width)), add(da, load3(c, x + 3 * width, width, width))
        dw = add(dw, load3(c, x + 6 * width, width, width))
    return dg, da, dw


@small
def unrolled_step(p, h, K, J_inverse, moment, c, g, a, w, width):
    """As `series_step`, without loops."""
    i, m = J_inverse, moment
    d = lane_orders(p, h, g, a, w, K, (i[0] * m[2], i[1] * m[0], i[2] * m[1]), (i[0] * m[1], i[1] * m[2], i[2] * m[0]))
    return (d[0], d[1], d[2]), (d[3], d[4], d[5]), (d[6], d[7], d[8])


@small
def emitted_step(p, h, K, J_inverse, moment, c, g, a, w, width):
    """As `series_step`, by the recurrences of `series`."""
    i, m = J_inverse, moment
    d = emitted_orders(p, h, g, a, w, K, (i[0] * m[1], i[1] * m[2], i[2] * m[0]), (i[0] * m[2], i[1] * m[0], i[2] * m[1]))
    return (d[0], d[1], d[2]), (d[3], d[4], d[5]), (d[6], d[7], d[8])


@small
def correct(J, J_inverse, moment, kept, scales, g, a, w):
    """As `taylor.correct`, whose `max` is one of floats."""
    L, n = times(J, w), 1.5 - 0.5 * dot(g, g)
    e = kept[0] - (0.5 * dot(L, w) + n * dot(moment, g))
    m = kept[1] - n * dot(L, g)
    dL, turn = shortest_move(w, L, moment, scales[1], e, m, g)
    upright = subtract(scale(1.5 - 0.5 * dot(a, a), a), scale(dot(a, g), g))
    g, a = add(scale(n, g), cross(g, turn)), add(upright, cross(a, turn))
    return g, a, add(w, times(J_inverse, dL)), max(abs(e) * scales[2], abs(m) * scales[3])


@small
def choose_vector(mask, a, b):
    """a or b for each body."""
    return (choose(mask, a[0], b[0]), choose(mask, a[1], b[1]), choose(mask, a[2], b[2]))


def make_march(width, series=series_step, order=0):
    """Return the kernel for lanes of a width."""

    @kernel
    def march_lanes(p, h, n_steps, constants, states, out):
        """constants (11, n): J, 1/J, moment, two scales; states (9, n): g, a, w; out (9, n) gets the states at the end."""
        n = constants.shape[1]
        flat, state_flat, out_flat = constants.reshape(-1), states.reshape(-1), out.reshape(-1)
        c = np.empty(9 * 25 * width + 8)
        c = c[(-c.ctypes.data // 8) % 8 :]
        again = 0
        for block in range(n // width):
            b = block * width
            J, J_inverse, moment = load3(flat, b, n, width), load3(flat, b + 3 * n, n, width), load3(flat, b + 6 * n, n, width)
            s0, s1 = load(flat, b + 9 * n, width), load(flat, b + 10 * n, width)
            scales = (s0, s1, 1.0 / s0, 1.0 / s1)
            K = ((J[1] - J[2]) * J_inverse[0], (J[2] - J[0]) * J_inverse[1], (J[0] - J[1]) * J_inverse[2])
            g, a = load3(state_flat, b, n, width), load3(state_flat, b + 3 * n, n, width)
            w = load3(state_flat, b + 6 * n, n, width)
            kept = values(J, moment, g, w)
            for _ in range(n_steps):
                dg, da, dw = series(p, h, K, J_inverse, moment, c, g, a, w, width)
                g, a, w, defect = correct(J, J_inverse, moment, kept, scales, add(g, dg), add(a, da), add(w, dw))
                left = (defect > ENOUGH) & (defect < FAR)
                if some(left):
                    again += 1
                    for _ in range(7):
                        g1, a1, w1, defect = correct(J, J_inverse, moment, kept, scales, g, a, w)
                        g, a, w = choose_vector(left, g1, g), choose_vector(left, a1, a), choose_vector(left, w1, w)
                        left = left & (defect > ENOUGH) & (defect < FAR)
                        if not some(left):
                            break
            for j in range(3):
                save(out_flat, b + j * n, g[j])
                save(out_flat, b + (3 + j) * n, a[j])
                save(out_flat, b + (6 + j) * n, w[j])
        return again

    return march_lanes


march_four, march_eight = make_march(4), make_march(8)
unrolled_four, unrolled_eight = make_march(4, unrolled_step), make_march(8, unrolled_step)
MORE = {"u4": unrolled_four, "u8": unrolled_eight}

emitted_four = make_march(4, emitted_step)
MORE["e4"] = emitted_four
