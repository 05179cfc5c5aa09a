"""The polhode of a free body, the curve of its momentum in the body, and the Moser-Veselov steps along it.

Symbols are as in `moser_veselov`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import brief, kernel
from .compiler.vector import choose, fill_like
from .elliptic import find_means, jacobi, sine_and_cosine

NODES = tuple((float(x), float(weight)) for x, weight in zip(*np.polynomial.legendre.leggauss(16), strict=True) if x > 0)
"""Nodes and weights of Gauss's quadrature with 16 nodes on [-1, 1], those above 0."""
TERMS = 12
"""Terms of the Taylor series of half a step."""


class Polhode(NamedTuple):
    """The curve of L: moments in this module's axes, amplitudes, momentum, energy, parameter, frequency, s, c, d at t = 0."""

    J1: Any
    J2: Any
    J3: Any
    A1: Any
    A2: Any
    A3: Any
    l: Any  # noqa: E741
    E: Any
    m: Any
    mc: Any
    nu: Any
    s: Any
    c: Any
    d: Any


class Step(NamedTuple):
    """One step: half its shift (S, C, D) and its quaternion (r0, r1, r2, r3); r0 is nan if there is no step."""

    S: Any
    C: Any
    D: Any
    r0: Any
    r1: Any
    r2: Any
    r3: Any


@kernel
def sort(a, b, parity):
    """Two axes in the order of their moments, which come first, and the parity of all exchanges, 1.0 or -1.0."""
    wrong = a[0] > b[0]
    return choose(wrong, b, a), choose(wrong, a, b), choose(wrong, -parity, parity)


@kernel
def turn_over(sign, a):
    """Return the axis times 1.0 or -1.0."""
    return (a[0], sign * a[1], sign * a[2], sign * a[3], sign * a[4])


@brief
def polhode_axes(a, b, c):
    """Return the axes e1, e2, e3 of the polhode from principal axes: e2 is the intermediate axis, and L circles e3.

    An axis is its moment, the momentum along it, and the components of its direction. e3 is the axis of the largest moment if
    L^2 > 2 E J2, and of the smallest if L^2 < 2 E J2. On the separatrix both are possible.
    """
    one = fill_like(1.0, a[0])
    a, b, parity = sort(a, b, one)
    b, c, parity = sort(b, c, parity)
    a, b, parity = sort(a, b, parity)
    low, middle, high = a[0], b[0], c[0]
    above = c[1] * c[1] * (high - middle) / high - a[1] * a[1] * (middle - low) / low
    to_high = (above > 0.0) | ((above == 0.0) & (high - middle >= middle - low))
    along, other = choose(to_high, c, a), choose(to_high, a, c)
    sign = choose(along[1] < 0.0, -one, one)
    return turn_over(sign * choose(to_high, parity, -parity), other), b, turn_over(sign, along)


@brief
def polhode(J1, J2, J3, L1, L2, L3):
    """Return the polhode for J2 intermediate, L3 >= 0 and L^2 - 2 E J2 not below 0 for J3 > J1, not above for J3 < J1.

    All differences are of given moments, and every sum is of terms of one sign except D = L^2 - 2 E J2 in mc, which is what
    tells both sides of the separatrix apart. Where L stays, as in a spherical body or one at rest, it is the phase of L. A
    body with J3 = J2 alone is given with its axes exchanged.
    """
    l = math.sqrt(L1 * L1 + L2 * L2 + L3 * L3)  # noqa: E741
    E = 0.5 * (L1 * L1 / J1 + L2 * L2 / J2 + L3 * L3 / J3)
    one, zero = fill_like(1.0, l), fill_like(0.0, l)
    # Lanes compute both sides of a choice: divisors and arguments of roots on the side that is not taken are replaced.
    stays = (J3 == J2) | (l == 0.0)
    sign = choose(J3 > J1, one, -one)
    no1 = sign * (L3 * L3 * (J3 - J1) / J3 + L2 * L2 * (J2 - J1) / J2)
    no3 = sign * (L1 * L1 * (J3 - J1) / J1 + L2 * L2 * (J3 - J2) / J2)
    no2 = sign * (L3 * L3 * (J3 - J2) / J3 - L1 * L1 * (J2 - J1) / J1)
    gap31, gap32 = choose(stays, one, sign * (J3 - J1)), choose(stays, one, sign * (J3 - J2))
    gap21 = sign * (J2 - J1)
    across = math.sqrt(L1 * L1 + L2 * L2)
    A1, A2 = choose(stays, across, math.sqrt(no3 * J1 / gap31)), choose(stays, across, math.sqrt(no3 * J2 / gap32))
    A3 = choose(stays, L3, math.sqrt(no1 * J3 / gap31))
    flat = stays | (no1 <= 0.0)
    below = choose(flat, one, gap32 * no1)
    # Near the separatrix, where mc is 0, round-off can give no2 the wrong sign.
    m, mc = choose(flat, zero, gap21 * no3 / below), choose(flat, one, max(gap31 * no2 / below, 0.0))
    nu = choose(stays, zero, sign * math.sqrt(gap32 * no1 / (J1 * J2 * J3)))
    still = (A1 == 0.0) | (A2 == 0.0)
    s, c = choose(still, zero, L2 / choose(still, one, A2)), choose(still, one, L1 / choose(still, one, A1))
    # d from c and mc: 1 - m s^2 would cancel near the separatrix, where d can be small.
    return Polhode(J1, J2, J3, A1, A2, A3, l, E, m, mc, nu, s, c, math.sqrt(mc + m * c * c))


@kernel
def intermediate(p, C, D, r1, r3):
    """Return r2. The factors r1/C, r2/(C D), r3/D, divided by their amplitudes, are affine in 1/J, as K = css/J + cdd is."""
    same = p.J3 == p.J2
    one = fill_like(1.0, p.l)
    gap = choose(same, one, p.J2 * (p.J3 - p.J1))
    ratio = p.J1 * (p.J3 - p.J2) / gap
    r2 = ratio * D * math.sqrt(1.0 / choose(same, one, ratio)) * r1
    r2 = r2 + p.J3 * (p.J2 - p.J1) / gap * C * p.A2 / choose(p.A3 > 0.0, p.A3, one) * r3
    return choose(same, r1, r2)


@brief
def exact_step(p, h):
    """Return the step without truncation error, calibrated on the one that is symmetric about s = 0.

    About its momentum the body turns by 2 f, f = int_0^(h/2) (2 E/l + w3) / (1 + L3/l) dt, which no motion makes singular. With
    (x, y, z) = (A1 C, A2 S, A3 D)/l the ends of the step are (x, -y, z) and (x, y, z), and its quaternion follows.
    """
    means = find_means(p.mc)
    S, C, D = jacobi(0.5 * h * p.nu, means)
    one = fill_like(1.0, p.l)
    rests = p.l == 0.0
    size = choose(rests, one, p.l)
    a3, rate, w3 = p.A3 / size, 2.0 * p.E / size, p.A3 / p.J3
    middle = 0.25 * h
    s, c, d = jacobi(p.nu * middle, means)
    f = 0.0 * one
    for x, weight in NODES:
        # Two nodes, as far before the middle as after it, by the addition theorem.
        s_x, c_x, d_x = jacobi(p.nu * (middle * x), means)
        below, shift = 1.0 / (1.0 - p.m * (s * s) * (s_x * s_x)), p.m * (s * s_x) * (c * c_x)
        d0, d1 = (d * d_x + shift) * below, (d * d_x - shift) * below
        f = f + middle * weight * ((rate + w3 * d0) / (1.0 + a3 * d0) + (rate + w3 * d1) / (1.0 + a3 * d1))
    x, y, z = p.A1 * C / size, p.A2 * S / size, a3 * D
    sine, cosine = sine_and_cosine(f)
    r0 = (x * x + z + z * z) * cosine - x * y * sine
    r1 = (1.0 + z) * (x * sine + y * cosine)
    r3 = z * (1.0 + z) * sine - (x * cosine - y * sine) * y
    return Step(S, C, D, choose(rests, one, r0), r1, intermediate(p, C, D, r1, r3), r3)


@kernel
def multiply(a, b, n):
    """Coefficient n of the product of two power series."""
    total = 0.0
    for k in range(n + 1):
        total += a[k] * b[n - k]
    return total


@kernel
def divide(a, b):
    """Power series a / b, b[0] not 0."""
    out = np.zeros(TERMS)
    for n in range(TERMS):
        out[n] = (a[n] - multiply(out, b, n)) / b[0]
    return out


@kernel
def half_step_series(p, A3, nu, tau):
    """Taylor series of s, c, d and of the Cayley vector e of half a step, e' = (w + e x w + e (e.w)) / 2."""
    s, c, d, e, w = np.zeros(TERMS), np.zeros(TERMS), np.zeros(TERMS), np.zeros((3, TERMS)), np.zeros((3, TERMS))
    ew = np.zeros(TERMS)
    c[0], d[0] = 1.0, 1.0
    for n in range(TERMS):
        w[0, n], w[1, n], w[2, n] = p.A1 / p.J1 * tau * c[n], p.A2 / p.J2 * tau * s[n], A3 / p.J3 * tau * d[n]
        ew[n] = multiply(e[0], w[0], n) + multiply(e[1], w[1], n) + multiply(e[2], w[2], n)
        if n == TERMS - 1:
            break
        over = 1.0 / (n + 1)
        s[n + 1] = nu * over * multiply(c, d, n)
        c[n + 1] = -nu * over * multiply(s, d, n)
        d[n + 1] = -nu * p.m * over * multiply(s, c, n)
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            turn = multiply(e[j], w[k], n) - multiply(e[k], w[j], n)
            e[i, n + 1] = 0.5 * over * (w[i, n] + turn + multiply(e[i], ew, n))
    return s, c, d, e


@kernel
def calibration_series(p, tau):
    """Coefficients of css and of cdd in powers of (h / 2 tau)^2: Taylor series of the exact step that is symmetric about s = 0.

    If its second half has the Cayley vector e, the whole has 2 (e1 - e2 e3, 0, e3 + e1 e2) / (1 - e1^2 + e2^2 - e3^2).
    """
    # On a symmetric body whose momentum lies across the axis both sides of K3 = c3 / (...) vanish; the limit is even in A3.
    A3 = max(p.A3, 1e-8 * p.l)
    nu = p.nu * tau
    if p.A3 < A3 and p.J3 != p.J2:
        nu = (1.0 / p.J1 - 1.0 / p.J3) * A3 * tau
    s, c, d, e = half_step_series(p, A3, nu, tau)
    below, c1, c3 = np.zeros(TERMS), np.zeros(TERMS), np.zeros(TERMS)
    for n in range(TERMS):
        squares = multiply(e[1], e[1], n) - multiply(e[0], e[0], n) - multiply(e[2], e[2], n)
        below[n] = squares + (1.0 if n == 0 else 0.0)
        c1[n] = 2.0 * (e[0, n] - multiply(e[1], e[2], n))
        c3[n] = 2.0 * (e[2, n] + multiply(e[0], e[1], n))
    c1, c3 = divide(c1, below), divide(c3, below)
    norm, cd = np.zeros(TERMS), np.zeros(TERMS)
    for n in range(TERMS):
        norm[n] = multiply(c1, c1, n) + multiply(c3, c3, n) + (1.0 if n == 0 else 0.0)
        cd[n] = multiply(c, d, n)
    # css = (sn(nu tau) / (nu tau)) / ((1 + |c|^2) cn dn), K3 = c3 / (tau (1 + |c|^2) A3 dn)
    over_nu = np.zeros(TERMS)
    for n in range(TERMS - 1):
        over_nu[n] = s[n + 1] / nu if nu != 0.0 else (1.0 if n == 0 else 0.0)
    K3 = np.zeros(TERMS)
    for n in range(TERMS - 1):
        K3[n] = c3[n + 1] / (tau * A3)
    css = divide(divide(over_nu, cd), norm)
    cdd = divide(divide(K3, d), norm) - css / p.J3
    return css[: TERMS - 2 : 2], cdd[: TERMS - 2 : 2]


@brief
def preprocessed_step(p, h, order):
    """Return the DMV step of an even order with the first order/2 terms of the exact inertia (Hairer & Vilmart 2006).

    On the step that is symmetric about s = 0: c_i = K_i (h/2) A_i (C, D) g with g = 1 + |c|^2, and S = nu (h/2) css g C D.
    """
    tau = 0.5 * h
    if p.l == 0.0:
        return Step(0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    terms = calibration_series(p, tau)
    css, cdd = 0.0, 0.0
    for k in range(order // 2):
        css += terms[0][k]
        cdd += terms[1][k]
    k1, k3 = tau * p.A1 * (css / p.J1 + cdd), tau * p.A3 * (css / p.J3 + cdd)
    # Fixed point for S, accelerated by the secant of its defect.
    S, last_S, last_defect = p.nu * tau, 0.0, -p.nu * tau
    C, D, g = 1.0, 1.0, 1.0
    for _ in range(60):
        C = math.sqrt(1.0 - S * S)
        D = math.sqrt(p.mc + p.m * C * C)
        g = 2.0 / (1.0 + math.sqrt(1.0 - 4.0 * (k1 * k1 * C * C + k3 * k3 * D * D)))
        defect = S - p.nu * tau * css * g * C * D
        change = defect - last_defect
        if abs(defect) <= 1e-16 * abs(S) or change == 0.0 or not math.isfinite(defect):
            break
        slope = (S - last_S) / change
        last_S, last_defect = S, defect
        S -= defect * slope
    r1, r3 = k1 * C * g, k3 * D * g
    # S, sn of half the shift, is below 1 for a shift below half a period. g is nan if there is no Cayley vector.
    r0 = 1.0 if math.isfinite(g) and abs(S) < 1.0 else math.nan
    return Step(S, C, D, r0, r1, intermediate(p, C, D, r1, r3), r3)


@brief
def normalise(step):
    """Return the same step with r0^2 + r1^2 + r3^2 = 1, so that products of many steps stay in range."""
    size = math.sqrt(step.r0 * step.r0 + step.r1 * step.r1 + step.r3 * step.r3)
    return Step(step.S, step.C, step.D, step.r0 / size, step.r1 / size, step.r2 / size, step.r3 / size)
