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

Many bodies take the same steps in the same arithmetic, each in a lane (`march_lanes`). `prepare_lanes` makes two columns per
body: one of constants and one of the state. The number of columns is a multiple of WIDTH; the last body fills the rest.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from . import brief, entry, kernel, small
from .compiler.lanes import WIDTH, load_rows, save, save_columns, save_rows
from .compiler.signals import call_handlers, end_of_block
from .compiler.vector import choose, dot, fill_like, fuse, product
from .elliptic import find_means, jacobi, sine_and_cosine
from .protocol import Result, Workspace, find_ends, loosen, record

NODES = tuple((float(x), float(weight)) for x, weight in zip(*np.polynomial.legendre.leggauss(16), strict=True) if x > 0)
"""Nodes and weights of Gauss's quadrature with 16 nodes on [-1, 1], those above 0."""
TERMS = 12
PAUSE = 2**20
"""Steps between two calls of handlers of signals."""
RESCALE = 32
"""Steps between two rescalings of z, whose modulus changes by a factor in [1/2, 2] or so a step."""
GIVEN = 24
"""Numbers that a body is given by: `gather`."""
SHIFT, LEFT, RATES, AXES, FINISHED = 0, 15, 19, 22, 31
"""First rows: of `Shift`, the turn in front, amplitudes of the rate, the polhode's axes in those of the body, and 0 or 1."""
ROWS, STATE_ROWS = 32, 5
SLOWEST = 1e-60
"""Limit of |w| dt below which bodies that turn are left to be run alone: squares of squares would be no floats."""


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


class Model(NamedTuple):
    """The values of a `Polhode` and the initial attitude, both in this module's axes."""

    polhode: Any
    q: Any


Coefficients = Step
"""All that a step is made of."""


class Shift(NamedTuple):
    """Constants of all steps of a run.

    Of a whole shift cn, sn, cn dn, sn dn and m sn^2; m and mc; factors of a step's quaternion, y0 to y3; amplitudes of L/l.
    """

    C1: Any
    S1: Any
    CD1: Any
    SD1: Any
    mS1: Any
    m: Any
    mc: Any
    y0: Any
    y0s: Any
    y1: Any
    y2: Any
    y3: Any
    a1: Any
    a2: Any
    a3: Any


class State(NamedTuple):
    """The state: s, c, d and the complex number z of the attitude."""

    s: Any
    c: Any
    d: Any
    z_re: Any
    z_im: Any


@brief
def polhode(J1, J2, J3, L1, L2, L3):
    """Return the polhode for J2 intermediate, L3 >= 0 and L^2 - 2 E J2 not below 0 for J3 > J1, not above for J3 < J1.

    All differences are of given moments, and every sum is of terms of one sign except D = L^2 - 2 E J2 in mc, which is what
    tells both sides of the separatrix apart. Where L stays, as in a spherical body or one at rest, the phase is that of L. A
    body with J3 = J2 alone is given with its axes exchanged.
    """
    l = math.sqrt(L1 * L1 + L2 * L2 + L3 * L3)  # noqa: E741
    E = 0.5 * (L1 * L1 / J1 + L2 * L2 / J2 + L3 * L3 / J3)
    one, zero = fill_like(1.0, l), fill_like(0.0, l)
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
    m, mc = choose(flat, zero, gap21 * no3 / below), choose(flat, one, max(gap31 * no2 / below, 0.0))
    nu = choose(stays, zero, sign * math.sqrt(gap32 * no1 / (J1 * J2 * J3)))
    still = (A1 == 0.0) | (A2 == 0.0)
    s, c = choose(still, zero, L2 / choose(still, one, A2)), choose(still, one, L1 / choose(still, one, A1))
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
    r0 = 1.0 if math.isfinite(g) and abs(S) < 1.0 else math.nan
    return Step(S, C, D, r0, r1, intermediate(p, C, D, r1, r3), r3)


@brief
def normalise(step):
    """Return the same step with r0^2 + r1^2 + r3^2 = 1, so that products of many steps stay in range."""
    size = math.sqrt(step.r0 * step.r0 + step.r1 * step.r1 + step.r3 * step.r3)
    return Step(step.S, step.C, step.D, step.r0 / size, step.r1 / size, step.r2 / size, step.r3 / size)


@kernel
def directions(p):
    """Amplitudes of L/l; a body at rest has no direction of its own and gets e3."""
    one = fill_like(1.0, p.l)
    rests = p.l == 0.0
    size = choose(rests, one, p.l)
    return (p.A1 / size, p.A2 / size, choose(rests, one, p.A3 / size))


@kernel
def whole_shift(p, step):
    """Return the constants of all steps: one whole shift, by the addition theorem from two halves.

    1 / (1 - m S^2 s_mid^2) = (1 + m S^2 s0 s1) / (1 - m S^4), and s0 + s1 = 2 s_mid C D / (1 - m S^2 s_mid^2), and so on.
    """
    S, C, D, m = step.S, step.C, step.D, p.m
    below = 1.0 / (1.0 - m * S * S * S * S)
    S1, C1, D1 = 2.0 * S * C * D * below, (C * C - S * S * D * D) * below, (D * D - m * S * S * C * C) * below
    y0, y0s = step.r0 * below, step.r0 * below * m * S * S
    y1, y2, y3 = step.r1 / (2.0 * C), step.r2 / (2.0 * C * D), step.r3 / (2.0 * D)
    a1, a2, a3 = directions(p)
    return Shift(C1, S1, C1 * D1, S1 * D1, m * S1 * S1, m, p.mc, y0, y0s, y1, y2, y3, a1, a2, a3)


@kernel
def start(k, p, q):
    """Return the initial state, and the rotation that multiplies `own_quaternion` to give the attitude q."""
    one, zero = fill_like(1.0, p.l), fill_like(0.0, p.l)
    x, y, up = k.a1 * p.c, k.a2 * p.s, 1.0 + k.a3 * p.d
    n = 1.0 / (x * x + y * y + up * up)
    return State(p.s, p.c, p.d, one, zero), product(q, (n * up, -n * y, n * x, zero))


@small
def advance(k, at):
    """One step.

    After the addition theorem c and s are brought back to s^2 + c^2 = 1 and d is formed from c, so that energy and momentum
    cannot drift, and mc is not lost near the separatrix, where it is far below the round-off of L. Of two products that are
    added, `fuse` says which one is not rounded: the compiler would take either, in lanes the other one.
    """
    s, c, d, z_re, z_im = at
    r = 1.0 / (1.0 - k.mS1 * (s * s))
    s1, c1 = fuse(s, k.CD1, k.S1 * (c * d)) * r, fuse(c, k.C1, -(k.SD1 * (s * d))) * r
    f = 1.5 - 0.5 * fuse(s1, s1, c1 * c1)
    s1, c1 = s1 * f, c1 * f
    d1 = math.sqrt(k.mc + k.m * (c1 * c1))
    q0, q1, q2, q3 = k.y0 + k.y0s * (s * s1), k.y1 * (c + c1), k.y2 * (s + s1), k.y3 * (d + d1)
    x, y, up = k.a1 * c, k.a2 * s, 1.0 + k.a3 * d
    re, im = fuse(q0, up, fuse(x, q2, -(y * q1))), fuse(q3, up, fuse(y, q2, x * q1))
    return State(s1, c1, d1, fuse(z_re, re, -(z_im * im)), fuse(z_re, im, z_im * re))


@small
def take_steps(k, at, done, last):
    """Return the state after `last` steps from the state after `done` steps."""
    while done < last:
        end = min(last, done - done % RESCALE + RESCALE)
        for _ in range(end - done):
            at = advance(k, at)
        done = end
        if done % RESCALE == 0:
            n = 1.0 / math.sqrt(fuse(at.z_re, at.z_re, at.z_im * at.z_im))
            at = State(at.s, at.c, at.d, at.z_re * n, at.z_im * n)
    return at


@small
def own_quaternion(k, at):
    """Return the quaternion, of any length, of the attitude relative to axes along the momentum."""
    x, y, up = k.a1 * at.c, k.a2 * at.s, 1.0 + k.a3 * at.d
    return (
        at.z_re * up,
        fuse(at.z_re, y, at.z_im * x),
        fuse(at.z_im, y, -(at.z_re * x)),
        at.z_im * up,
    )


@kernel
def store(row, p, k, at, left, q_out, L_out):
    """Write a state: its momentum and its quaternion, turned in the world by what is constant."""
    record(row, product(left, own_quaternion(k, at)), (p.A1 * at.c, p.A2 * at.s, p.A3 * at.d), q_out, L_out)


@kernel
def march(model, coefficients, workspace):
    """Take the steps (`protocol`)."""
    p = Polhode(*model.polhode)
    n_steps, every, pause, q_out, L_out = workspace
    k = whole_shift(p, coefficients)
    at, left = start(k, p, model.q)
    store(0, p, k, at, left, q_out, L_out)
    row, done = 0, 0
    while done < n_steps:
        last = end_of_block(done, n_steps, pause)
        while done < last:
            sample = min((row + 1) * every, n_steps)
            end = min(sample, last)
            at = take_steps(k, at, done, end)
            done = end
            if done == sample:
                row += 1
                store(row, p, k, at, left, q_out, L_out)
        if done < n_steps:
            call_handlers()
    return Result(n_steps, n_steps, 0, None, 0.0, False)


MODEL_END, COEFFICIENTS_END = find_ends(Model, Coefficients)


@entry
def enter(*loose):
    """`march` as Python calls it (`protocol`)."""
    model, coefficients = Model(*loose[:MODEL_END]), Coefficients(*loose[MODEL_END:COEFFICIENTS_END])
    return loosen(march(model, coefficients, Workspace(*loose[COEFFICIENTS_END:])))


@kernel
def gather(first, moments, R_BP, R_WB0, w_WB_B0, time, room):
    """Fill rows of lanes: moments, R_BP, R_WB0 and w_WB_B0 of bodies from number `first` on.

    `moments` and `R_BP` are of all bodies or of one for all. Rates are in units of 1 / time, moments in any.
    """
    for lane in range(WIDTH):
        i = min(first + lane, len(R_WB0) - 1)
        own = min(i, len(moments) - 1)
        for j in range(3):
            room[j * WIDTH + lane] = moments[own, j]
            room[(21 + j) * WIDTH + lane] = w_WB_B0[i, j] * time
            for k in range(3):
                room[(3 + 3 * j + k) * WIDTH + lane] = R_BP[own, j, k]
                room[(12 + 3 * j + k) * WIDTH + lane] = R_WB0[i, j, k]


@kernel
def sort(a, b, parity):
    """Two axes in the order of their moments, which come first, and the parity of all exchanges, 1.0 or -1.0."""
    wrong = a[0] > b[0]
    return choose(wrong, b, a), choose(wrong, a, b), choose(wrong, -parity, parity)


@kernel
def turn_over(sign, a):
    """Return the axis times 1.0 or -1.0."""
    return (a[0], sign * a[1], sign * a[2], sign * a[3], sign * a[4])


@kernel
def polhode_axes(a, b, c):
    """Return the polhode's axes from principal axes, as `conservative.methods.moser_veselov.polhode_axes` does.

    An axis is its moment, the momentum along it, and its direction.
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


@kernel
def quaternion(x, y, z):
    """Return the unit quaternion of the matrix with these columns, computed from its largest component."""
    wx, wy, wz = y[2] - z[1], z[0] - x[2], x[1] - y[0]
    xy, xz, yz = x[1] + y[0], x[2] + z[0], y[2] + z[1]
    largest, q1, q2, q3 = 1.0 + x[0] + y[1] + z[2], 1.0 + x[0] - y[1] - z[2], 1.0 - x[0] + y[1] - z[2], 1.0 - x[0] - y[1] + z[2]
    q = (largest, wx, wy, wz)
    q, largest = choose(q1 > largest, (wx, q1, xy, xz), q), max(largest, q1)
    q, largest = choose(q2 > largest, (wy, xy, q2, yz), q), max(largest, q2)
    q = choose(q3 > largest, (wz, xz, yz, q3), q)
    n = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (n * q[0], n * q[1], n * q[2], n * q[3])


@kernel
def turn(R, a):
    """Return the direction of an axis, rotated by the matrix with rows R."""
    return (
        R[0] * a[2] + R[1] * a[3] + R[2] * a[4],
        R[3] * a[2] + R[4] * a[3] + R[5] * a[4],
        R[6] * a[2] + R[7] * a[3] + R[8] * a[4],
    )


@kernel
def step_of_order(p, h, order, room):
    """`preprocessed_step` of each body, one after the other."""
    save_rows(room, 0, WIDTH, p)
    for i in range(WIDTH):
        a = room[i::WIDTH]
        alone = Polhode(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13])
        step = preprocessed_step(alone, h, order)
        for j in range(7):
            a[j] = step[j]
    return Step(*load_rows(room, 0, WIDTH, 7, WIDTH))


@entry
def prepare_lanes(moments, R_BP, R_WB0, w_WB_B0, time, dt, order, limits, table, states):
    """Fill `table` (ROWS, columns) and `states` (STATE_ROWS, columns) for steps dt of an order, 0 for the exact one.

    Bodies are given as `gather` takes them; dt is in units `time`. `limits` are those of |w| dt, of nu dt and of cn: bodies
    beyond them, or without a step, get 0 in the row FINISHED.
    """
    columns, flat, room = table.shape[1], table.reshape(-1), np.empty(GIVEN * WIDTH)
    for first in range(0, columns, WIDTH):
        gather(first, moments, R_BP, R_WB0, w_WB_B0, time, room)
        J, R = load_rows(room, 0, WIDTH, 3, WIDTH), load_rows(room, 3 * WIDTH, WIDTH, 9, WIDTH)
        A, w = load_rows(room, 12 * WIDTH, WIDTH, 9, WIDTH), load_rows(room, 21 * WIDTH, WIDTH, 3, WIDTH)
        x, y, z = polhode_axes(
            (J[0], (w[0] * R[0] + w[1] * R[3] + w[2] * R[6]) * J[0], R[0], R[3], R[6]),
            (J[1], (w[0] * R[1] + w[1] * R[4] + w[2] * R[7]) * J[1], R[1], R[4], R[7]),
            (J[2], (w[0] * R[2] + w[1] * R[5] + w[2] * R[8]) * J[2], R[2], R[5], R[8]),
        )
        p = polhode(x[0], y[0], z[0], x[1], y[1], z[1])
        h = fill_like(dt, p.l)
        step = normalise(exact_step(p, h) if order == 0 else step_of_order(p, dt, order, room))
        k = whole_shift(p, step)
        at, left = start(k, p, quaternion(turn(A, x), turn(A, y), turn(A, z)))
        rates = (p.A1 / (p.J1 * time), p.A2 / (p.J2 * time), p.A3 / (p.J3 * time))
        axes = (x[2], y[2], z[2], x[3], y[3], z[3], x[4], y[4], z[4])
        # There is a step below the limits whose squares stay in the range of floats.
        angle = math.sqrt(dot(w, w)) * h
        known = (angle == 0.0) | ((angle > SLOWEST) & (angle < limits[0]))
        known = known & (abs(p.nu) * h < limits[1]) & (limits[2] < step.C) & (step.r0 - step.r0 == 0.0)
        finished = choose(known, 1.0, 0.0 * h)
        save_rows(flat, first + SHIFT * columns, columns, k)
        save_rows(states.reshape(-1), first, columns, at)
        save_rows(flat, first + LEFT * columns, columns, left)
        save_rows(flat, first + RATES * columns, columns, rates)
        save_rows(flat, first + AXES * columns, columns, axes)
        save(flat, first + FINISHED * columns, finished)


@small
def store_state(flat, columns, k, at, first, row, R_WB, w_WB_B):
    """Write sample number `row` of the bodies of a number, in body axes."""
    w, x, y, z = product(load_rows(flat, first + LEFT * columns, columns, 4, WIDTH), own_quaternion(k, at))
    s = 2.0 / (w * w + x * x + y * y + z * z)
    r0 = (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y))
    r1 = (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x))
    r2 = (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y))
    axes = load_rows(flat, first + AXES * columns, columns, 9, WIDTH)
    amplitudes = load_rows(flat, first + RATES * columns, columns, 3, WIDTH)
    a, b, c = axes[0:3], axes[3:6], axes[6:9]
    rates = (amplitudes[0] * at.c, amplitudes[1] * at.s, amplitudes[2] * at.d)
    rows = (dot(r0, a), dot(r0, b), dot(r0, c), dot(r1, a), dot(r1, b), dot(r1, c), dot(r2, a), dot(r2, b), dot(r2, c))
    samples = R_WB.shape[1]
    place = first * samples + row
    save_columns(R_WB.reshape(-1), 9 * place, 9 * samples, rows)
    save_columns(w_WB_B.reshape(-1), 3 * place, 3 * samples, (dot(rates, a), dot(rates, b), dot(rates, c)))


@entry
def march_lanes(table, states, done, last, n_steps, every, R_WB, w_WB_B):
    """Take the steps of all bodies from number `done` to `last` of `n_steps`, and store the samples that fall among them.

    R_WB (columns, s, 3, 3) and w_WB_B (columns, s, 3), rad/s, in body axes, get the start, every `every`-th step, and the last.
    """
    columns, flat = table.shape[1], table.reshape(-1)
    for first in range(0, columns, WIDTH):
        k = Shift(*load_rows(flat, first + SHIFT * columns, columns, 15, WIDTH))
        at = State(*load_rows(states.reshape(-1), first, columns, STATE_ROWS, WIDTH))
        row, here = (done // every + 1 if done > 0 else 0), done
        while here < last or row == 0:
            sample = min(row * every, n_steps)
            end = min(sample, last)
            at = take_steps(k, at, here, end)
            here = end
            if here == sample:
                store_state(flat, columns, k, at, first, row, R_WB, w_WB_B)
                row += 1
        save_rows(states.reshape(-1), first, columns, at)
