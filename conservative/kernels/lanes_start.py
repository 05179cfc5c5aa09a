"""Polhodes, exact steps and starts of many free bodies at once, as `moser_veselov` makes them for one; three different moments.

Principal axes are in the order of their moments, right-handed. What `methods.moser_veselov.polhode_axes` decides for one body,
which axis L keeps to one side of, is a mask here.
"""

from __future__ import annotations

import math

import numpy as np

from . import kernel, small
from .lanes import choose, fill_like, fuse, load, save
from .lanes_functions import LEVELS, jacobi, means, sine_and_cosine
from .lanes_moser_veselov import initial_left, whole_shift
from .moser_veselov import NODES, WEIGHTS, Polhode, Step
from .vector import product

HALF = math.sqrt(0.5)


@small
def axes(J, L, q):
    """Return moments, momentum and attitude in the axes of the polhode; J, L, q in principal axes, J ascending."""
    low, middle, high = J
    above = L[2] * L[2] * (high - middle) / high - L[0] * L[0] * (middle - low) / low
    to_high = (above > 0.0) | ((above == 0.0) & (high - middle >= middle - low))
    along = choose(to_high, L[2], L[0])
    sign = choose(along < 0.0, fill_like(-1.0, along), fill_like(1.0, along))
    J1, J3 = choose(to_high, low, high), choose(to_high, high, low)
    turned = (choose(to_high, sign * L[0], -(sign * L[2])), L[1], sign * along)
    # Turns about the intermediate axis: by 0 or a half, or by a quarter to either side.
    zero = fill_like(0.0, along)
    c = choose(to_high, choose(sign > 0.0, zero + 1.0, zero), zero + HALF)
    s = choose(to_high, choose(sign > 0.0, zero, zero + 1.0), HALF * sign)
    return (J1, middle, J3), turned, product(q, (c, zero, s, zero))


@small
def polhode(J, L):
    """As `moser_veselov.polhode` for three different moments and a body that turns."""
    J1, J2, J3 = J
    l = math.sqrt(L[0] * L[0] + L[1] * L[1] + L[2] * L[2])  # noqa: E741
    E = 0.5 * (L[0] * L[0] / J1 + L[1] * L[1] / J2 + L[2] * L[2] / J3)
    one = fill_like(1.0, l)
    sign = choose(J3 > J1, one, -one)
    no1 = sign * (L[2] * L[2] * (J3 - J1) / J3 + L[1] * L[1] * (J2 - J1) / J2)
    no3 = sign * (L[0] * L[0] * (J3 - J1) / J1 + L[1] * L[1] * (J3 - J2) / J2)
    no2 = sign * (L[2] * L[2] * (J3 - J2) / J3 - L[0] * L[0] * (J2 - J1) / J1)
    gap31, gap32, gap21 = sign * (J3 - J1), sign * (J3 - J2), sign * (J2 - J1)
    A1, A2, A3 = math.sqrt(no3 * J1 / gap31), math.sqrt(no3 * J2 / gap32), math.sqrt(no1 * J3 / gap31)
    below = 1.0 / (gap32 * no1)
    m, mc = gap21 * no3 * below, max(gap31 * no2 * below, 0.0)
    nu = sign * math.sqrt(gap32 * no1 / (J1 * J2 * J3))
    still = no3 == 0.0
    s, c = choose(still, 0.0 * one, L[1] / A2), choose(still, one, L[0] / A1)
    return Polhode(J1, J2, J3, A1, A2, A3, l, E, m, mc, nu, s, c, math.sqrt(mc + m * c * c))


@small
def exact_step(p, h, larger, smaller, width):
    """As `moser_veselov.exact_step`, normalised; the means of Jacobi's functions are formed once."""
    n, mean = means(p.mc, larger, smaller, width)
    S, C, D = jacobi(0.5 * h * p.nu, n, mean, larger, smaller, width)
    a3, rate = p.A3 / p.l, 2.0 * p.E / p.l
    f, pull = 0.0 * a3, p.A3 / p.J3
    for k in range(16):
        t = 0.25 * h * (1.0 + NODES[k])
        d = jacobi(p.nu * t, n, mean, larger, smaller, width)[2]
        f = f + 0.25 * h * WEIGHTS[k] * (rate + pull * d) / (1.0 + a3 * d)
    x, y, z = p.A1 * C / p.l, p.A2 * S / p.l, a3 * D
    sine, cosine = sine_and_cosine(f)
    r0 = fuse(x * x + z + z * z, cosine, -(x * y * sine))
    r1 = (1.0 + z) * fuse(x, sine, y * cosine)
    r3 = z * (1.0 + z) * sine - fuse(x, cosine, -(y * sine)) * y
    gap = p.J2 * (p.J3 - p.J1)
    r2 = p.J1 * (p.J3 - p.J2) / gap * D * math.sqrt(gap / (p.J1 * (p.J3 - p.J2))) * r1
    r2 = r2 + p.J3 * (p.J2 - p.J1) / gap * C * p.A2 / p.A3 * r3
    over = 1.0 / math.sqrt(r0 * r0 + r1 * r1 + r3 * r3)
    return Step(S, C, D, r0 * over, r1 * over, r2 * over, r3 * over)


@small
def directions(p):
    """Amplitudes of L/l of a body that turns."""
    return (p.A1 / p.l, p.A2 / p.l, p.A3 / p.l)


WIDTH = 8


@kernel
def prepare(J, L, q, h, constants, states, left):
    """Fill constants (15, n), states (5, n) and left (4, n) from J (3, n), L (3, n) and q (4, n)."""
    n = J.shape[1]
    larger, smaller = np.empty(LEVELS * WIDTH), np.empty(LEVELS * WIDTH)
    Jf, Lf, qf, kf, sf, lf = (
        J.reshape(-1),
        L.reshape(-1),
        q.reshape(-1),
        constants.reshape(-1),
        states.reshape(-1),
        left.reshape(-1),
    )
    for i in range(0, n, WIDTH):
        J_own, L_own, q_own = axes(
            (load(Jf, i, WIDTH), load(Jf, i + n, WIDTH), load(Jf, i + 2 * n, WIDTH)),
            (load(Lf, i, WIDTH), load(Lf, i + n, WIDTH), load(Lf, i + 2 * n, WIDTH)),
            (load(qf, i, WIDTH), load(qf, i + n, WIDTH), load(qf, i + 2 * n, WIDTH), load(qf, i + 3 * n, WIDTH)),
        )
        p = polhode(J_own, L_own)
        k = whole_shift(p, exact_step(p, h, larger, smaller, WIDTH), directions(p))
        turn = initial_left(k, p, q_own)
        one = fill_like(1.0, p.s)
        start = (p.s, p.c, p.d, one, 0.0 * one)
        for j in range(15):
            save(kf, i + j * n, k[j])
        for j in range(5):
            save(sf, i + j * n, start[j])
        for j in range(4):
            save(lf, i + j * n, turn[j])
