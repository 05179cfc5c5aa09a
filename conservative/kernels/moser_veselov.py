"""Discrete Moser-Veselov steps of a free body, explicit: every one is a shift along the polhode.

Symbols, in axes e1, e2, e3 of the principal frame that `polhode` chooses (e2 is the intermediate axis, L never leaves the side
of +e3), for a step h:

    L = (A1 c, A2 s, A3 d)               s, c, d = sn, cn, dn of u = nu t, m = 1 - mc;  s^2 + c^2 = 1, d^2 = mc + m c^2
    S, C, D                              sn, cn, dn of HALF the shift that one step makes of u
    (r0, r1 c, r2 s, r3 d)               direction of the quaternion of one step, with s, c, d at the middle of the step
    q = z (1 + L3/l, L2/l, -L1/l, 0)     attitude against axes with e_z along the momentum, l = |L|; z is a complex number

A DMV step with inertia B, 1/B = css/J + cdd, keeps the quadrics of energy and |L|, and a map of that curve to itself without
fixed points is a shift (Moser & Veselov 1991): so the addition theorem of Jacobi's functions gives L_n+1 from L_n without
solving an equation. The Cayley vector of the step is proportional, component by component, to (c, s, d) at its middle; as the
sum of both ends is too, with 1 / (1 - m S^2 s^2) in common, it costs no square root either. Tests check both against the DMV
equations.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import entry, kernel
from .protocol import Result, Workspace, find_ends, loosen
from .signals import call_handlers, end_of_block
from .vector import product

NODES, WEIGHTS = (tuple(float(x) for x in part) for part in np.polynomial.legendre.leggauss(16))
TERMS = 12
PAUSE = 2**20
"""Steps between two calls of handlers of signals."""
RESCALE = 32
"""Steps between two rescalings of z, whose modulus changes by a factor in [1/2, 2] or so a step."""


class Polhode(NamedTuple):
    """Where L moves: moments in this module's axes, amplitudes, momentum, energy, parameter, frequency, s, c, d at t = 0."""

    J1: float
    J2: float
    J3: float
    A1: float
    A2: float
    A3: float
    l: float  # noqa: E741
    E: float
    m: float
    mc: float
    nu: float
    s: float
    c: float
    d: float


class Step(NamedTuple):
    """What one step does: half its shift (S, C, D) and its quaternion (r0, r1, r2, r3); r0 is nan where there is none."""

    S: float
    C: float
    D: float
    r0: float
    r1: float
    r2: float
    r3: float


class Model(NamedTuple):
    """Where L moves, the values of a `Polhode`, and the attitude at the start, both in this module's axes."""

    polhode: Any
    q: Any


Coefficients = Step
"""All that a step is made of."""


@kernel
def polhode(J1, J2, J3, L1, L2, L3):
    """Return the polhode for J2 intermediate, L3 >= 0 and L^2 - 2 E J2 not below 0 for J3 > J1, not above for J3 < J1.

    All differences are of given moments, and every sum is of terms of one sign except D = L^2 - 2 E J2 in mc, which is what
    tells both sides of the separatrix apart.
    """
    l = math.sqrt(L1 * L1 + L2 * L2 + L3 * L3)  # noqa: E741
    E = 0.5 * (L1 * L1 / J1 + L2 * L2 / J2 + L3 * L3 / J3)
    if J3 == J2 or l == 0.0:
        # Spherical, or at rest: L stays. A body with J3 = J2 alone is given with its axes exchanged.
        across = math.hypot(L1, L2)
        s, c = (L2 / across, L1 / across) if across > 0.0 else (0.0, 1.0)
        return Polhode(J1, J2, J3, across, across, L3, l, E, 0.0, 1.0, 0.0, s, c, 1.0)
    sign = 1.0 if J3 > J1 else -1.0
    no1 = sign * (L3 * L3 * (J3 - J1) / J3 + L2 * L2 * (J2 - J1) / J2)
    no3 = sign * (L1 * L1 * (J3 - J1) / J1 + L2 * L2 * (J3 - J2) / J2)
    no2 = sign * (L3 * L3 * (J3 - J2) / J3 - L1 * L1 * (J2 - J1) / J1)
    gap31, gap32, gap21 = sign * (J3 - J1), sign * (J3 - J2), sign * (J2 - J1)
    A1, A2, A3 = math.sqrt(no3 * J1 / gap31), math.sqrt(no3 * J2 / gap32), math.sqrt(no1 * J3 / gap31)
    m, mc = (gap21 * no3 / (gap32 * no1), gap31 * no2 / (gap32 * no1)) if no1 > 0.0 else (0.0, 1.0)
    nu = sign * math.sqrt(gap32 * no1 / (J1 * J2 * J3))
    s, c = (L2 / A2, L1 / A1) if no3 > 0.0 else (0.0, 1.0)
    return Polhode(J1, J2, J3, A1, A2, A3, l, E, m, max(mc, 0.0), nu, s, c, math.sqrt(max(mc, 0.0) + m * c * c))


@kernel
def jacobi(u, mc):
    """sn, cn, dn of u for the complementary parameter mc in [0, 1] (Bulirsch 1965, sncndn): no 1 - m is ever formed."""
    if mc == 0.0:
        sech = 1.0 / math.cosh(u)
        return math.tanh(u), sech, sech
    a, dn, c, n = 1.0, 1.0, 1.0, 0
    larger, smaller = np.empty(16), np.empty(16)
    for i in range(16):
        n = i
        larger[i] = a
        mc = math.sqrt(mc)
        smaller[i] = mc
        c = 0.5 * (a + mc)
        if abs(a - mc) <= 1e-9 * a:
            break
        mc *= a
        a = c
    sn, cn = math.sin(c * u), math.cos(c * u)
    if sn == 0.0:
        return sn, cn, 1.0
    a = cn / sn
    c *= a
    for i in range(n, -1, -1):
        a *= c
        c *= dn
        dn = (smaller[i] + a) / (larger[i] + a)
        a = c / larger[i]
    a = 1.0 / math.sqrt(c * c + 1.0)
    sn = a if sn >= 0.0 else -a
    return sn, c * sn, dn


@kernel
def intermediate(p, C, D, r1, r3):
    """r2: the factors r1/C, r2/(C D), r3/D, each over its amplitude, are affine in 1/J, as K = css/J + cdd is."""
    if p.J3 == p.J2:
        return r1
    gap = p.J2 * (p.J3 - p.J1)
    r2 = p.J1 * (p.J3 - p.J2) / gap * D * math.sqrt(p.J2 * (p.J3 - p.J1) / (p.J1 * (p.J3 - p.J2))) * r1
    if p.J2 != p.J1:
        r2 += p.J3 * (p.J2 - p.J1) / gap * C * p.A2 / p.A3 * r3
    return r2


@kernel
def exact_step(p, h):
    """The step without truncation error, calibrated on the one that is symmetric about s = 0.

    About its momentum the body turns by 2 f, f = int_0^(h/2) (2 E/l + w3) / (1 + L3/l) dt, which no motion makes singular. With
    (x, y, z) = (A1 C, A2 S, A3 D)/l the ends of the step are (x, -y, z) and (x, y, z), and its quaternion follows.
    """
    S, C, D = jacobi(0.5 * h * p.nu, p.mc)
    if p.l == 0.0:
        return Step(S, C, D, 1.0, 0.0, 0.0, 0.0)
    a3, rate = p.A3 / p.l, 2.0 * p.E / p.l
    f = 0.0
    for k in range(16):
        t = 0.25 * h * (1.0 + NODES[k])
        d = jacobi(p.nu * t, p.mc)[2]
        f += 0.25 * h * WEIGHTS[k] * (rate + p.A3 * d / p.J3) / (1.0 + a3 * d)
    x, y, z = p.A1 * C / p.l, p.A2 * S / p.l, a3 * D
    cos, sin = math.cos(f), math.sin(f)
    r0 = (x * x + z + z * z) * cos - x * y * sin
    r1 = (1.0 + z) * (x * sin + y * cos)
    r3 = z * (1.0 + z) * sin - (x * cos - y * sin) * y
    return Step(S, C, D, r0, r1, intermediate(p, C, D, r1, r3), r3)


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

    With the Cayley vector e of its second half, that of the whole is 2 (e1 - e2 e3, 0, e3 + e1 e2) / (1 - e1^2 + e2^2 - e3^2).
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


@kernel
def preprocessed_step(p, h, order):
    """The DMV step of an even order, its inertia from the first order/2 terms of the exact one (Hairer & Vilmart 2006).

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
    r0 = 1.0 if math.isfinite(g) and abs(S) < 1.0 else math.nan
    return Step(S, C, D, r0, r1, intermediate(p, C, D, r1, r3), r3)


@kernel
def normalise(step):
    """The same step with r0^2 + r1^2 + r3^2 = 1, so that products of many steps stay in range."""
    size = math.sqrt(step.r0 * step.r0 + step.r1 * step.r1 + step.r3 * step.r3)
    return Step(step.S, step.C, step.D, step.r0 / size, step.r1 / size, step.r2 / size, step.r3 / size)


@kernel
def directions(p):
    """Amplitudes of L/l; a body at rest has no direction of its own and gets e3."""
    return (p.A1 / p.l, p.A2 / p.l, p.A3 / p.l) if p.l > 0.0 else (0.0, 0.0, 1.0)


@kernel
def store(row, p, a, s, c, d, z_re, z_im, left, q_out, L_out):
    """Write a state: its momentum and its quaternion, turned in the world by what is constant."""
    x, y, up = a[0] * c, a[1] * s, 1.0 + a[2] * d
    own = (z_re * up, z_re * y + z_im * x, z_im * y - z_re * x, z_im * up)
    q_out[row, :] = product(left, own)
    L_out[row, 0], L_out[row, 1], L_out[row, 2] = p.A1 * c, p.A2 * s, p.A3 * d


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`).

    After the addition theorem c and s are brought back to s^2 + c^2 = 1 and d is formed from c, so that energy and momentum
    cannot drift, and mc is not lost near the separatrix, where it is far below the round-off of L.
    """
    p, step = Polhode(*model.polhode), coefficients
    n_steps, every, pause, q_out, L_out = workspace
    S, C, D = step.S, step.C, step.D
    m, mc = p.m, p.mc
    # One whole shift, by the addition theorem from two halves.
    below = 1.0 / (1.0 - m * S * S * S * S)
    S1, C1, D1 = 2.0 * S * C * D * below, (C * C - S * S * D * D) * below, (D * D - m * S * S * C * C) * below
    CD1, SD1, mS1 = C1 * D1, S1 * D1, m * S1 * S1
    # 1 / (1 - m S^2 s_mid^2) = (1 + m S^2 s0 s1) / (1 - m S^4), and s0 + s1 = 2 s_mid C D / (1 - m S^2 s_mid^2), and so on.
    y0, y0s = step.r0 * below, step.r0 * below * m * S * S
    y1, y2, y3 = step.r1 / (2.0 * C), step.r2 / (2.0 * C * D), step.r3 / (2.0 * D)
    a = directions(p)
    s, c, d, z_re, z_im = p.s, p.c, p.d, 1.0, 0.0
    x, y, up = a[0] * c, a[1] * s, 1.0 + a[2] * d
    n = 1.0 / (x * x + y * y + up * up)
    left = product(model.q, (n * up, -n * y, n * x, 0.0))
    store(0, p, a, s, c, d, z_re, z_im, left, q_out, L_out)
    row, until_rescale, until_sample = 0, RESCALE, every
    done = 0
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        for step_number in range(done + 1, last + 1):
            r = 1.0 / (1.0 - mS1 * (s * s))
            s1, c1 = (s * CD1 + S1 * (c * d)) * r, (c * C1 - SD1 * (s * d)) * r
            f = 1.5 - 0.5 * (s1 * s1 + c1 * c1)
            s1, c1 = s1 * f, c1 * f
            d1 = math.sqrt(mc + m * (c1 * c1))
            q0, q1, q2, q3 = y0 + y0s * (s * s1), y1 * (c + c1), y2 * (s + s1), y3 * (d + d1)
            x, y, up = a[0] * c, a[1] * s, 1.0 + a[2] * d
            re, im = q0 * up - y * q1 + x * q2, q3 * up + y * q2 + x * q1
            z_re, z_im = z_re * re - z_im * im, z_re * im + z_im * re
            s, c, d = s1, c1, d1
            until_rescale -= 1
            if until_rescale == 0:
                until_rescale = RESCALE
                n = 1.0 / math.hypot(z_re, z_im)
                z_re, z_im = z_re * n, z_im * n
            until_sample -= 1
            if until_sample == 0 or step_number == n_steps:
                until_sample = every
                row += 1
                store(row, p, a, s, c, d, z_re, z_im, left, q_out, L_out)
        done = last
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps, 0, None, 0.0, False)


MODEL_END, COEFFICIENTS_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    return loosen(march(model, coefficients, Workspace(*loose[COEFFICIENTS_END:])))
