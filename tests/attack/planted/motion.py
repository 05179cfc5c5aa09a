"""Motions of a rotating body: right-hand side, exact solution and textbook steps of the generator's own, compiled.

A state is (q, w): a quaternion, scalar first, body to world, and rates, rad/s, body axes.

    q' = q (0, w) / 2        J w' = (J w + h) x w + T - h'

Numbers of a world are one flat array `p` (see `PLACES`), and two tables: torque and wheel, (times, values).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

PLACES: dict[str, tuple[int, int]] = {}
"""First and last place of each number in `p`."""


def _place(**sizes: int) -> None:
    at = 0
    for name, size in sizes.items():
        PLACES[name] = at, at + size
        at += size


_place(
    J=9, inverse=9, gyroscopic=1, field=1, kind=1, point=3, size=1, rest=1, anchor=3, orbit=1, normal=3, gradient=9, damping=9,
    world=1, torque=1, reaction=1, speed=1, side=1, fixed=1, start=9, drag=1, turn=9,
)  # fmt: skip
SIZE = max(end for _, end in PLACES.values())
J_, JI, GYRO, FIELD, KIND, POINT, AMOUNT, REST, ANCHOR, ORBIT, NORMAL, K_, D_, WORLD, TORQUE, REACTION, SPEED, SIDE, FIXED, S_, DRAG, TURN = (
    first for first, _ in PLACES.values()
)  # fmt: skip


@njit(cache=True)
def _multiply(A, at, x, y, z):  # type: ignore[no-untyped-def]
    return (
        A[at] * x + A[at + 1] * y + A[at + 2] * z,
        A[at + 3] * x + A[at + 4] * y + A[at + 5] * z,
        A[at + 6] * x + A[at + 7] * y + A[at + 8] * z,
    )


@njit(cache=True)
def _segment(times, t):  # type: ignore[no-untyped-def]
    k = np.searchsorted(times, t, side="right") - 1
    return min(max(k, 0), len(times) - 2)


@njit(cache=True)
def _slope(t, inside, y, p, tt, tv, mt, mv, out):  # type: ignore[no-untyped-def]
    """Write the derivative of a state. `inside` is a time in the piece of the tables that counts."""
    n = 1 / math.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3])
    a, b, c, d = y[0] * n, y[1] * n, y[2] * n, y[3] * n
    x, v, z = y[4], y[5], y[6]
    f = 0.5 * p[SPEED]
    s = -1.0 if p[SIDE] != 0.0 else 1.0
    out[0] = -f * (y[1] * x + y[2] * v + y[3] * z)
    out[1] = f * (y[0] * x + s * (y[2] * z - y[3] * v))
    out[2] = f * (y[0] * v + s * (y[3] * x - y[1] * z))
    out[3] = f * (y[0] * z + s * (y[1] * v - y[2] * x))
    r00, r01, r02 = 1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)
    r10, r11, r12 = 2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)
    r20, r21, r22 = 2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)
    k = _segment(mt, inside)
    e = (t - mt[k]) / (mt[k + 1] - mt[k])
    g = 1 / (mt[k + 1] - mt[k])
    h0, h1, h2 = mv[k, 0] + e * (mv[k + 1, 0] - mv[k, 0]), mv[k, 1] + e * (mv[k + 1, 1] - mv[k, 1]), mv[k, 2] + e * (mv[k + 1, 2] - mv[k, 2])
    D0, D1, D2 = _multiply(p, D_, x, v, z)
    u = p[REACTION]
    T0 = -D0 - u * g * (mv[k + 1, 0] - mv[k, 0])
    T1 = -D1 - u * g * (mv[k + 1, 1] - mv[k, 1])
    T2 = -D2 - u * g * (mv[k + 1, 2] - mv[k, 2])
    k = _segment(tt, inside)
    e = (t - tt[k]) / (tt[k + 1] - tt[k])
    u = p[TORQUE]
    M0, M1, M2 = u * (tv[k, 0] + e * (tv[k + 1, 0] - tv[k, 0])), u * (tv[k, 1] + e * (tv[k + 1, 1] - tv[k, 1])), u * (tv[k, 2] + e * (tv[k + 1, 2] - tv[k, 2]))
    if p[WORLD] != 0.0:
        M0, M1, M2 = r00 * M0 + r10 * M1 + r20 * M2, r01 * M0 + r11 * M1 + r21 * M2, r02 * M0 + r12 * M1 + r22 * M2
    T0, T1, T2 = T0 + M0, T1 + M1, T2 + M2
    kind = p[KIND]
    if kind > 0.0:
        # The direction or the anchor, in body axes; a field that turns is brought back to its attitude at t = 0.
        A0, A1, A2 = (0.0, 0.0, 1.0) if kind == 1.0 else (p[ANCHOR], p[ANCHOR + 1], p[ANCHOR + 2])
        if p[ORBIT] != 0.0:
            m0, m1, m2 = p[NORMAL], p[NORMAL + 1], p[NORMAL + 2]
            C, S = math.cos(p[ORBIT] * t), math.sin(p[ORBIT] * t)
            dot = (1 - C) * (m0 * A0 + m1 * A1 + m2 * A2)
            A0, A1, A2 = C * A0 + S * (m1 * A2 - m2 * A1) + dot * m0, C * A1 + S * (m2 * A0 - m0 * A2) + dot * m1, C * A2 + S * (m0 * A1 - m1 * A0) + dot * m2
        A0, A1, A2 = r00 * A0 + r10 * A1 + r20 * A2, r01 * A0 + r11 * A1 + r21 * A2, r02 * A0 + r12 * A1 + r22 * A2
        P0, P1, P2 = p[POINT], p[POINT + 1], p[POINT + 2]
        F0, F1, F2 = 0.0, 0.0, 0.0
        if kind == 1.0:
            F0, F1, F2 = -p[AMOUNT] * A0, -p[AMOUNT] * A1, -p[AMOUNT] * A2
        elif kind == 4.0:
            P0, P1, P2 = A0, A1, A2
            F0, F1, F2 = _multiply(p, K_, A0, A1, A2)
            u = 3 * p[AMOUNT] * p[AMOUNT]
            F0, F1, F2 = u * F0, u * F1, u * F2
        else:
            A0, A1, A2 = A0 - P0, A1 - P1, A2 - P2
            far = math.sqrt(A0 * A0 + A1 * A1 + A2 * A2)
            u = p[AMOUNT] * (1 - p[REST] / far) if kind == 2.0 else p[AMOUNT] / (far * far * far)
            F0, F1, F2 = u * A0, u * A1, u * A2
        u = p[FIELD]
        T0, T1, T2 = T0 + u * (P1 * F2 - P2 * F1), T1 + u * (P2 * F0 - P0 * F2), T2 + u * (P0 * F1 - P1 * F0)
    if p[FIXED] != 0.0:  # the tensor does not turn with the body: the equations in world axes
        W0, W1, W2 = r00 * x + r01 * v + r02 * z, r10 * x + r11 * v + r12 * z, r20 * x + r21 * v + r22 * z
        L0, L1, L2 = _multiply(p, S_, W0, W1, W2)
        L0, L1, L2 = L0 + r00 * h0 + r01 * h1 + r02 * h2, L1 + r10 * h0 + r11 * h1 + r12 * h2, L2 + r20 * h0 + r21 * h1 + r22 * h2
        T0, T1, T2 = r00 * T0 + r01 * T1 + r02 * T2, r10 * T0 + r11 * T1 + r12 * T2, r20 * T0 + r21 * T1 + r22 * T2
        T0, T1, T2 = T0 + p[GYRO] * (L1 * W2 - L2 * W1), T1 + p[GYRO] * (L2 * W0 - L0 * W2), T2 + p[GYRO] * (L0 * W1 - L1 * W0)
        T0, T1, T2 = _multiply(p, TURN, T0, T1, T2)
        out[4] = r00 * T0 + r10 * T1 + r20 * T2
        out[5] = r01 * T0 + r11 * T1 + r21 * T2
        out[6] = r02 * T0 + r12 * T1 + r22 * T2
    else:
        L0, L1, L2 = _multiply(p, J_, x, v, z)
        L0, L1, L2 = L0 + h0, L1 + h1, L2 + h2
        T0, T1, T2 = T0 + p[GYRO] * (L1 * z - L2 * v), T1 + p[GYRO] * (L2 * x - L0 * z), T2 + p[GYRO] * (L0 * v - L1 * x)
        out[4], out[5], out[6] = _multiply(p, JI, T0, T1, T2)
    out[4] -= p[DRAG] * x
    out[5] -= p[DRAG] * v
    out[6] -= p[DRAG] * z


COLUMNS = 9
"""Columns of the extrapolation: order 18."""


@njit(cache=True)
def _stretch(t, H, y, p, tt, tv, mt, mv, scale, new, T, a, b, k):  # type: ignore[no-untyped-def]
    """Write the state after H by Gragg's extrapolation; return the estimated error."""
    error = np.inf
    for j in range(COLUMNS):
        n = 2 * (j + 1)
        h = H / n
        _slope(t, t + 0.5 * H, y, p, tt, tv, mt, mv, k)
        for i in range(7):
            a[i] = y[i]
            b[i] = y[i] + h * k[i]
        for m in range(1, n):
            _slope(t + m * h, t + 0.5 * H, b, p, tt, tv, mt, mv, k)
            for i in range(7):
                c = a[i] + 2 * h * k[i]
                a[i] = b[i]
                b[i] = c
        _slope(t + H, t + 0.5 * H, b, p, tt, tv, mt, mv, k)
        for i in range(7):  # Neville's scheme: T[m] is the entry of column m in this row
            last = T[0, i]
            T[0, i] = 0.5 * (b[i] + a[i] + h * k[i])
            for m in range(1, j + 1):
                ratio = (n / (2.0 * (j - m + 1))) ** 2 - 1
                value = T[m - 1, i] + (T[m - 1, i] - last) / ratio
                last = T[m, i]
                T[m, i] = value
        if j > 1:
            before = error
            error = 0.0
            for i in range(7):
                error = max(error, abs(T[j, i] - T[j - 1, i]) / (1.0 if i < 4 else scale))
            if error < 3e-15 or (error < 3e-14 and error >= before):
                for i in range(7):
                    new[i] = T[j, i]
                return 0.0
    for i in range(7):
        new[i] = T[COLUMNS - 1, i]
    return error


@njit(cache=True)
def solve(y0, start, times, breaks, p, tt, tv, mt, mv, longest):  # type: ignore[no-untyped-def]
    """Return the states (n, 7) of the exact motion at increasing times, s, from the state at `start`.

    No stretch is longer than `longest`, s, or has one of the breaks inside. A motion that needs very short ones ends: rows of nan.
    """
    left = 200 + 4 * len(times) + int(20 * (times[-1] - start) / longest)
    rows = np.full((len(times), 7), np.nan)
    T, a, b, k, new, y = np.empty((COLUMNS, 7)), np.empty(7), np.empty(7), np.empty(7), np.empty(7), y0.copy()
    t, part = start, longest
    for row in range(len(times)):
        while t < times[row]:
            end = times[row]
            for at in breaks:
                if t < at < end:
                    end = at
            H = min(part, end - t)
            whole = H == end - t
            scale = max(math.sqrt(y[4] * y[4] + y[5] * y[5] + y[6] * y[6]), 1e-300)
            if not math.isfinite(scale) or scale > 1e100:
                return rows
            left -= 1
            if left < 0:
                return rows
            error = _stretch(t, H, y, p, tt, tv, mt, mv, scale, new, T, a, b, k)
            if error > 1e-13 and H > 1e-6 * longest:
                part = H / 2
                continue
            n = 1 / math.sqrt(new[0] ** 2 + new[1] ** 2 + new[2] ** 2 + new[3] ** 2)
            for i in range(7):
                y[i] = new[i] * n if i < 4 else new[i]
            t = end if whole else t + H
            part = min(longest, 1.5 * max(part, H))
        rows[row] = y
    return rows


@njit(cache=True)
def _times(q, r, out):  # type: ignore[no-untyped-def]
    """Write the product of two quaternions."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    e, f, g, h = r[0], r[1], r[2], r[3]
    out[0], out[1] = a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g
    out[2], out[3] = a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e


@njit(cache=True)
def _turn(x, y, z, out):  # type: ignore[no-untyped-def]
    """Write the quaternion of a rotation vector."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = math.sin(angle / 2) / angle if angle > 0 else 0.5
    out[0], out[1], out[2], out[3] = math.cos(angle / 2), s * x, s * y, s * z


# Steps by number: see `STEPS` in `mistakes.py`
_RK = {
    "explicit Euler": ([[0.0]], [1.0]),
    "midpoint": ([[0, 0], [1 / 2, 0]], [0, 1]),
    "Heun": ([[0, 0], [1, 0]], [1 / 2, 1 / 2]),
    "Ralston": ([[0, 0], [2 / 3, 0]], [1 / 4, 3 / 4]),
    "Kutta 3": ([[0, 0, 0], [1 / 2, 0, 0], [-1, 2, 0]], [1 / 6, 2 / 3, 1 / 6]),
    "Heun 3": ([[0, 0, 0], [1 / 3, 0, 0], [0, 2 / 3, 0]], [1 / 4, 0, 3 / 4]),
    "SSP 3": ([[0, 0, 0], [1, 0, 0], [1 / 4, 1 / 4, 0]], [1 / 6, 1 / 6, 2 / 3]),
    "RK4": ([[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]),
}
TABLEAUX = {name: (np.array(A, float), np.array(b, float)) for name, (A, b) in _RK.items()}
NONE = np.zeros((1, 1)), np.zeros(1)
RUNGE_KUTTA, RUNGE_KUTTA_TURNED, SPLIT, IMPLICIT, ADAMS, LEAPFROG, STORMER, BUSS, TRAPEZOID = range(9)
"""Families of steps."""


@njit(cache=True)
def _spun(x, v, z, q, w, out):  # type: ignore[no-untyped-def]
    """Write the components of a body vector in world axes, by the attitude q."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    out[0] = (1 - 2 * (c * c + d * d)) * x + 2 * (b * c - a * d) * v + 2 * (b * d + a * c) * z
    out[1] = 2 * (b * c + a * d) * x + (1 - 2 * (b * b + d * d)) * v + 2 * (c * d - a * b) * z
    out[2] = 2 * (b * d - a * c) * x + 2 * (c * d + a * b) * v + (1 - 2 * (b * b + c * c)) * z


@njit(cache=True)
def march(y0, start, h, count, every, family, A, b, number, flag, normalise, single, p, tt, tv, mt, mv):  # type: ignore[no-untyped-def]
    """Return every `every`-th of the states after `count` steps of length h by a textbook method.

    `number` and `flag` choose in a family: the order or the number of iterations, and the exponential map. With `single` the
    state is rounded to single precision after each step.
    """
    rows = np.empty((count // every + 1, 7))
    y, new, q, e = y0.copy(), np.empty(7), np.empty(4), np.empty(4)
    s = len(b)
    k = np.zeros((max(s, 4), 7))
    stage, m = np.empty(7), np.empty(7)
    past = np.zeros((3, 7))
    known = 0
    rows[0] = y
    W, V, X = np.empty(3), np.empty(3), np.empty(3)
    for n in range(count):
        t = start + n * h
        if family == 0 or family == 1:
            for i in range(s):
                stage[:] = y
                c, x, v, z = 0.0, 0.0, 0.0, 0.0
                for j in range(i):
                    c += A[i, j]
                    stage += h * A[i, j] * k[j]
                    if family == 1:
                        x, v, z = x + A[i, j] * past[0, j], v + A[i, j] * past[1, j], z + A[i, j] * past[2, j]
                if family == 1:
                    _turn(h * x, h * v, h * z, e)
                    _times(y, e, q)
                    stage[:4] = q
                _slope(t + c * h, t + c * h, stage, p, tt, tv, mt, mv, k[i])
                past[0, i], past[1, i], past[2, i] = stage[4], stage[5], stage[6]
            new[:] = y
            x, v, z = 0.0, 0.0, 0.0
            for i in range(s):
                new += h * b[i] * k[i]
                x, v, z = x + b[i] * past[0, i], v + b[i] * past[1, i], z + b[i] * past[2, i]
            if family == 1:
                _turn(h * x, h * v, h * z, e)
                _times(y, e, q)
                new[:4] = q
        elif family == 2:  # rates first, then attitudes: by old rates (number 0) or new ones
            new[:] = y
            for i in range(max(number, 1)):
                x, v, z = new[4], new[5], new[6]
                _slope(t, t, new, p, tt, tv, mt, mv, k[0])
                new[4:] = y[4:] + h * k[0, 4:]
                if abs(new[4] - x) + abs(new[5] - v) + abs(new[6] - z) <= 4e-16 * (abs(x) + abs(v) + abs(z)):
                    break
            u = y if number == 0 else new
            x, v, z = h * u[4], h * u[5], h * u[6]
            if flag:
                _turn(x, v, z, e)
                _times(y, e, q)
                new[:4] = q
            else:
                e[0], e[1], e[2], e[3] = 1.0, x / 2, v / 2, z / 2
                _times(y, e, q)
                new[:4] = q
        elif family == 3 or family == 8:  # implicit Euler, the implicit midpoint rule (b is the place), the trapezoidal rule
            share = b[0]
            _slope(t, t, y, p, tt, tv, mt, mv, k[1])
            k[0] = k[1]
            for i in range(100):
                if family == 8:
                    stage[:] = y + h / 2 * (k[0] + k[1])
                    _slope(t + h, t + h, stage, p, tt, tv, mt, mv, m)
                else:
                    stage[:] = y + share * h * k[0]
                    _slope(t + share * h, t + share * h, stage, p, tt, tv, mt, mv, m)
                off = np.abs(m - k[0]).max()
                k[0] = m
                if off <= 1e-15 * np.abs(m).max():
                    break
            new[:] = y + h / 2 * (k[0] + k[1]) if family == 8 else y + h * k[0]
        elif family == 4:
            _slope(t, t, y, p, tt, tv, mt, mv, k[0])
            order = min(number, known + 1)
            if order == 1:
                new[:] = y + h * k[0]
            elif order == 2:
                new[:] = y + h * (1.5 * k[0] - 0.5 * past[0])
            else:
                new[:] = y + h / 12 * (23 * k[0] - 16 * past[0] + 5 * past[1])
            past[1], past[0] = past[0].copy(), k[0]
            known += 1
        elif family == 5:
            _slope(t, t, y, p, tt, tv, mt, mv, k[0])
            new[:] = y
            new[4:] += h / 2 * k[0, 4:]
            _turn(h * new[4], h * new[5], h * new[6], e)
            _times(y, e, q)
            new[:4] = q
            _slope(t + h, t + h, new, p, tt, tv, mt, mv, k[0])
            new[4:] += h / 2 * k[0, 4:]
        elif family == 6:
            # q'' = q (0, w') / 2 - |w|^2 q / 4, as q(n+1) = 2 q(n) - q(n-1) + h^2 q''; rates by Heun's rule with the new attitude
            _slope(t, t, y, p, tt, tv, mt, mv, k[0])
            e[0], e[1], e[2], e[3] = 0.0, k[0, 4], k[0, 5], k[0, 6]
            _times(y, e, q)
            square = (y[4] * y[4] + y[5] * y[5] + y[6] * y[6]) / 4
            for i in range(4):
                second = q[i] / 2 - square * y[i]
                new[i] = y[i] + h * k[0, i] + h * h / 2 * second if known == 0 else 2 * y[i] - past[0, i] + h * h * second
            stage[:4], stage[4:] = new[:4], y[4:] + h * k[0, 4:]
            _slope(t + h, t + h, stage, p, tt, tv, mt, mv, k[1])
            new[4:] = y[4:] + h / 2 * (k[0, 4:] + k[1, 4:])
            past[0] = y
            known += 1
        else:  # Buss's augmented steps (2000), world axes: h W + h^2/2 W' + h^3/12 W' x W, and h^3/6 W'' for order 3
            _slope(t, t, y, p, tt, tv, mt, mv, k[0])
            _spun(y[4], y[5], y[6], y, y, W)
            _spun(k[0, 4], k[0, 5], k[0, 6], y, y, V)
            x = h * W[0] + h * h / 2 * V[0] + h**3 / 12 * (V[1] * W[2] - V[2] * W[1])
            v = h * W[1] + h * h / 2 * V[1] + h**3 / 12 * (V[2] * W[0] - V[0] * W[2])
            z = h * W[2] + h * h / 2 * V[2] + h**3 / 12 * (V[0] * W[1] - V[1] * W[0])
            if number == 3:
                small = 1e-4 * h
                for sign in (1.0, -1.0):
                    stage[:] = y + sign * small * k[0]
                    q[:] = stage[:4] / np.sqrt((stage[:4] ** 2).sum())
                    _slope(t + sign * small, t + sign * small, stage, p, tt, tv, mt, mv, k[1])
                    _spun(k[1, 4], k[1, 5], k[1, 6], q, q, X)
                    u = sign * h**3 / 6 / (2 * small)
                    x, v, z = x + u * X[0], v + u * X[1], z + u * X[2]
            g = _segment(mt, t)
            u = (t - mt[g]) / (mt[g + 1] - mt[g])
            X[:] = mv[g] + u * (mv[g + 1] - mv[g])
            L0, L1, L2 = _multiply(p, J_, y[4], y[5], y[6])
            L0, L1, L2 = L0 + X[0], L1 + X[1], L2 + X[2]
            d0, d1, d2 = _multiply(p, J_, k[0, 4], k[0, 5], k[0, 6])
            d0, d1, d2 = d0 - (L1 * y[6] - L2 * y[5]), d1 - (L2 * y[4] - L0 * y[6]), d2 - (L0 * y[5] - L1 * y[4])
            _spun(L0 + h * d0, L1 + h * d1, L2 + h * d2, y, y, V)
            _turn(x, v, z, e)
            _times(e, y, q)
            new[:4] = q
            e[0], e[1], e[2], e[3] = q[0], -q[1], -q[2], -q[3]
            _spun(V[0], V[1], V[2], e, e, W)
            new[4], new[5], new[6] = _multiply(p, JI, W[0] - X[0], W[1] - X[1], W[2] - X[2])
        if normalise:
            u = math.sqrt(new[0] ** 2 + new[1] ** 2 + new[2] ** 2 + new[3] ** 2)
            for i in range(4):
                new[i] /= u
        if single:
            for i in range(7):
                new[i] = np.float64(np.float32(new[i]))
        y[:] = new
        if not math.isfinite(y[0] + y[4] + y[5] + y[6]) or abs(y[4]) + abs(y[5]) + abs(y[6]) > 1e30:
            rows[(n // every) + 1 :] = np.nan
            return rows
        if (n + 1) % every == 0:
            rows[(n + 1) // every] = y
    return rows


def times(p: Any, q: Any) -> Any:
    """Return the products of quaternions (..., 4), scalar first."""
    p, q = np.moveaxis(np.asarray(p), -1, 0), np.moveaxis(np.asarray(q), -1, 0)
    return np.stack([
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1], p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ], -1)  # fmt: skip


def turn(v: Any) -> Any:
    """Return the quaternions of rotation vectors (..., 3)."""
    v = np.asarray(v, float)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(angle / 2), np.sinc(angle / (2 * np.pi)) / 2 * v], -1)


def spin(q: Any, v: Any) -> Any:
    """Return vectors (..., 3) in body axes as vectors in world axes."""
    a, b = q[..., :1], q[..., 1:]
    return v + 2 * np.cross(b, np.cross(b, v) + a * v)


def back(q: Any) -> Any:
    """Return the conjugates."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def vector(q: Any) -> Any:
    """Return the rotation vectors (..., 3), of at most half a turn, of quaternions."""
    q = np.where(q[..., :1] < 0, -q, q)
    size = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(size, q[..., :1])
    return np.where(size > 1e-12, angle / np.where(size > 0, size, 1.0), 2.0) * q[..., 1:]
