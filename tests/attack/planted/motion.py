"""Motions of a rotating body: right-hand side, exact solution and textbook steps of the generator's own, compiled.

A state is (q, w): a quaternion, scalar first, body to world, and rates, rad/s, body axes.

    q' = q (0, w) / 2        J w' = (J w + h) x w + T - h'

A world is a tuple of arrays: its numbers (see `PLACES`), and two tables, torque and wheel, each times and values.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

PLACES: dict[str, tuple[int, int]] = {}
"""First and last place of each number of a world."""


def _place(**sizes: int) -> list[int]:
    at = 0
    for name, size in sizes.items():
        PLACES[name] = at, at + size
        at += size
    return [first for first, _ in PLACES.values()]


(
    INERTIA, INVERSE, GYROSCOPIC, FIELD, KIND, POINT, AMOUNT, REST, ANCHOR, ORBIT, NORMAL, GRADIENT, DAMPING, IN_WORLD,
    REACTION, SPEED, SIDE, IS_FIXED, FIXED, UNFIXED, DRAG,
) = _place(
    inertia=9, inverse=9, gyroscopic=1, field=1, kind=1, point=3, amount=1, rest=1, anchor=3, orbit=1, normal=3, gradient=9,
    damping=9, in_world=1, reaction=1, speed=1, side=1, is_fixed=1, fixed=9, unfixed=9, drag=1,
)  # fmt: skip
SIZE = max(end for _, end in PLACES.values())


@njit(cache=True)
def _multiply(A, at, v):  # type: ignore[no-untyped-def]
    """Return a matrix, which begins at a place, times a vector."""
    return (
        A[at] * v[0] + A[at + 1] * v[1] + A[at + 2] * v[2],
        A[at + 3] * v[0] + A[at + 4] * v[1] + A[at + 5] * v[2],
        A[at + 6] * v[0] + A[at + 7] * v[1] + A[at + 8] * v[2],
    )


@njit(cache=True)
def _cross(a, b):  # type: ignore[no-untyped-def]
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _add(a, s, b):  # type: ignore[no-untyped-def]
    """Return a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@njit(cache=True)
def _spin(q, v, sign):  # type: ignore[no-untyped-def]
    """Return a body vector in world axes, or with sign -1 a world vector in body axes."""
    u = _cross((q[1], q[2], q[3]), v)
    u = _add(_cross((q[1], q[2], q[3]), u), sign * q[0], u)
    return _add(v, 2.0, u)


@njit(cache=True)
def _read(times, values, t, inside):  # type: ignore[no-untyped-def]
    """Return the value of a table at a time, and its slope, in the piece that has the time `inside`."""
    k = min(max(np.searchsorted(times, inside, side="right") - 1, 0), len(times) - 2)
    g = 1 / (times[k + 1] - times[k])
    slope = (
        g * (values[k + 1, 0] - values[k, 0]), g * (values[k + 1, 1] - values[k, 1]), g * (values[k + 1, 2] - values[k, 2])
    )  # fmt: skip
    return _add((values[k, 0], values[k, 1], values[k, 2]), t - times[k], slope), slope


@njit(cache=True)
def _pull(t, q, p):  # type: ignore[no-untyped-def]
    """Return the torque of the field. A field that turns is as at t = 0 in axes that turn."""
    kind = p[KIND]
    A = (0.0, 0.0, 1.0) if kind == 1.0 else (p[ANCHOR], p[ANCHOR + 1], p[ANCHOR + 2])
    if p[ORBIT] != 0.0:
        half = p[ORBIT] * t / 2
        s = math.sin(half)
        A = _spin((math.cos(half), s * p[NORMAL], s * p[NORMAL + 1], s * p[NORMAL + 2]), A, 1.0)
    A = _spin(q, A, -1.0)
    if kind == 4.0:
        T, size = _cross(A, _multiply(p, GRADIENT, A)), 3 * p[AMOUNT] * p[AMOUNT]
    else:
        point = (p[POINT], p[POINT + 1], p[POINT + 2])
        if kind == 1.0:
            T, size = _cross(point, A), -p[AMOUNT]
        else:
            line = _add(A, -1.0, point)
            far = math.sqrt(line[0] * line[0] + line[1] * line[1] + line[2] * line[2])
            T = _cross(point, line)
            size = p[AMOUNT] * (1 - p[REST] / far) if kind == 2.0 else p[AMOUNT] / (far * far * far)
    size *= p[FIELD]
    return size * T[0], size * T[1], size * T[2]


@njit(cache=True)
def _slope(t, inside, y, world, out):  # type: ignore[no-untyped-def]
    """Write the derivative of a state. `inside` is a time in the piece of the tables that counts."""
    p, torque_times, torque, wheel_times, wheel = world
    w = (y[4], y[5], y[6])
    f, side = 0.5 * p[SPEED], 1 - 2 * p[SIDE]
    c = _cross((y[1], y[2], y[3]), w)
    out[0] = -f * (y[1] * w[0] + y[2] * w[1] + y[3] * w[2])
    for i in range(3):
        out[1 + i] = f * (y[0] * w[i] + side * c[i])
    n = 1 / math.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3])
    q = (y[0] * n, y[1] * n, y[2] * n, y[3] * n)
    h, slope = _read(wheel_times, wheel, t, inside)
    T = _add(_multiply(p, DAMPING, w), p[REACTION], slope)
    M, _ = _read(torque_times, torque, t, inside)
    if p[IN_WORLD] != 0.0:
        M = _spin(q, M, -1.0)
    T = _add(M, -1.0, T)
    if p[KIND] != 0.0:
        T = _add(T, 1.0, _pull(t, q, p))
    if p[IS_FIXED] != 0.0:  # the tensor does not turn with the body: the equations in world axes
        W = _spin(q, w, 1.0)
        L = _add(_multiply(p, FIXED, W), 1.0, _spin(q, h, 1.0))
        a = _spin(q, _multiply(p, UNFIXED, _add(_spin(q, T, 1.0), p[GYROSCOPIC], _cross(L, W))), -1.0)
    else:
        L = _add(_multiply(p, INERTIA, w), 1.0, h)
        a = _multiply(p, INVERSE, _add(T, p[GYROSCOPIC], _cross(L, w)))
    for i in range(3):
        out[4 + i] = a[i] - p[DRAG] * w[i]


COLUMNS = 9
"""Columns of the extrapolation: order 18."""


@njit(cache=True)
def _stretch(t, H, y, world, scale, new, T):  # type: ignore[no-untyped-def]
    """Write the state after H by Gragg's extrapolation; return the estimated error. T is space for its table."""
    error, k = np.inf, np.empty(7)
    for j in range(COLUMNS):
        n = 2 * (j + 1)
        h = H / n
        _slope(t, t + 0.5 * H, y, world, k)
        a, b = y.copy(), y + h * k
        for m in range(1, n):
            _slope(t + m * h, t + 0.5 * H, b, world, k)
            for i in range(7):
                a[i], b[i] = b[i], a[i] + 2 * h * k[i]
        _slope(t + H, t + 0.5 * H, b, world, k)
        for i in range(7):  # Neville's scheme: T[m] is the entry of column m in this row
            last = T[0, i]
            T[0, i] = 0.5 * (b[i] + a[i] + h * k[i])
            for m in range(1, j + 1):
                ratio = (n / (2.0 * (j - m + 1))) ** 2 - 1
                value = T[m - 1, i] + (T[m - 1, i] - last) / ratio
                last = T[m, i]
                T[m, i] = value
        if j > 1:
            before, error = error, 0.0
            for i in range(7):
                error = max(error, abs(T[j, i] - T[j - 1, i]) / (1.0 if i < 4 else scale))
            if error < 3e-15 or (error < 3e-14 and error >= before):
                new[:] = T[j]
                return 0.0
    new[:] = T[COLUMNS - 1]
    return error


@njit(cache=True)
def solve(y0, start, times, breaks, world, longest):  # type: ignore[no-untyped-def]
    """Return the states (n, 7) of the exact motion at increasing times, s, from the state at `start`.

    No stretch is longer than `longest`, s, or has one of the breaks inside. A motion that needs very short ones ends: nan.
    """
    rows, T, new, y = np.full((len(times), 7), np.nan), np.empty((COLUMNS, 7)), np.empty(7), y0.copy()
    left = 200 + 4 * len(times) + int(20 * (times[-1] - start) / longest)
    t, part = start, longest
    for row in range(len(times)):
        while t < times[row]:
            end = times[row]
            for at in breaks:
                if t < at < end:
                    end = at
            H = min(part, end - t)
            whole = end - t <= H
            scale = max(math.sqrt(y[4] * y[4] + y[5] * y[5] + y[6] * y[6]), 1e-300)
            left -= 1
            if left < 0 or not scale < 1e100:
                return rows
            error = _stretch(t, H, y, world, scale, new, T)
            if error > 1e-13 and longest < 1e6 * H:
                part = H / 2
                continue
            y[:] = new
            y[:4] /= math.sqrt((new[:4] ** 2).sum())
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
def _turn(v, h):  # type: ignore[no-untyped-def]
    """Return the quaternion of a rotation vector h v."""
    angle = h * math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    s = h * (math.sin(angle / 2) / angle if angle > 0 else 0.5)
    return math.cos(angle / 2), s * v[0], s * v[1], s * v[2]


# Steps: each writes the state after h. `past` (3, 7) is kept for the next step, and `number` is the kind in a family.


@njit(cache=True)
def _runge_kutta(t, h, y, world, A, b, turned, new):  # type: ignore[no-untyped-def]
    """Explicit Runge-Kutta. With `turned`, stages and step turn the body by weighted sums of rates."""
    s = len(b)
    k, stage, used = np.empty((s, 7)), np.empty(7), np.empty((s, 3))
    for i in range(s + 1):
        at, turn = 0.0, np.zeros(3)
        stage[:] = y
        for j in range(min(i, s)):
            a = A[i, j] if i < s else b[j]
            at += a
            stage += h * a * k[j]
            turn += a * used[j]
        if turned:
            _times(y, _turn(turn, h), stage)
        if i < s:
            _slope(t + at * h, t + at * h, stage, world, k[i])
            used[i] = stage[4:]
    new[:] = stage


@njit(cache=True)
def _split(t, h, y, world, number, turned, new):  # type: ignore[no-untyped-def]
    """Rates first, with `number` corrections of their torque, then attitudes by new rates, or by old ones for 0."""
    k = np.empty(7)
    new[:] = y
    for _ in range(max(number, 1)):
        before = new[4:].copy()
        _slope(t, t, new, world, k)
        new[4:] = y[4:] + h * k[4:]
        if np.abs(new[4:] - before).sum() <= 4e-16 * np.abs(before).sum():
            break
    w = y[4:] if number == 0 else new[4:].copy()
    _times(y, _turn(w, h) if turned else (1.0, h * w[0] / 2, h * w[1] / 2, h * w[2] / 2), new)


@njit(cache=True)
def _implicit(t, h, y, world, share, trapezoid, new):  # type: ignore[no-untyped-def]
    """Implicit Euler (share 1), the implicit midpoint rule (1/2) or the trapezoidal rule, iterated to round-off."""
    old, k, m = np.empty(7), np.empty(7), np.empty(7)
    _slope(t, t, y, world, old)
    k[:] = old
    for _ in range(100):
        _slope(t + share * h, t + share * h, y + h / 2 * (k + old) if trapezoid else y + share * h * k, world, m)
        off = np.abs(m - k).max()
        k[:] = m
        if off <= 1e-15 * np.abs(m).max():
            break
    new[:] = y + h / 2 * (k + old) if trapezoid else y + h * k


@njit(cache=True)
def _adams(t, h, y, world, number, known, past, new):  # type: ignore[no-untyped-def]
    """Adams and Bashforth's method. First steps are of lower order."""
    k, order = np.empty(7), min(number, known + 1)
    _slope(t, t, y, world, k)
    if order == 1:
        new[:] = y + h * k
    elif order == 2:
        new[:] = y + h * (1.5 * k - 0.5 * past[0])
    else:
        new[:] = y + h / 12 * (23 * k - 16 * past[0] + 5 * past[1])
    past[1] = past[0]
    past[0] = k


@njit(cache=True)
def _leapfrog(t, h, y, world, new):  # type: ignore[no-untyped-def]
    """Velocity Verlet: half a kick, a drift, half a kick."""
    k = np.empty(7)
    _slope(t, t, y, world, k)
    new[4:] = y[4:] + h / 2 * k[4:]
    _times(y, _turn(new[4:], h), new)
    _slope(t + h, t + h, new, world, k)
    new[4:] += h / 2 * k[4:]


@njit(cache=True)
def _stormer(t, h, y, world, known, past, new):  # type: ignore[no-untyped-def]
    """q'' = q (0, w') / 2 - |w|^2 q / 4, as q(n+1) = 2 q(n) - q(n-1) + h^2 q''; rates by Heun's rule with the new attitude."""
    k, m, second, stage = np.empty(7), np.empty(7), np.empty(4), np.empty(7)
    _slope(t, t, y, world, k)
    _times(y, (0.0, k[4], k[5], k[6]), second)
    second[:] = second / 2 - (y[4:] ** 2).sum() / 4 * y[:4]
    new[:4] = y[:4] + h * k[:4] + h * h / 2 * second if known == 0 else 2 * y[:4] - past[0, :4] + h * h * second
    stage[:4], stage[4:] = new[:4], y[4:] + h * k[4:]
    _slope(t + h, t + h, stage, world, m)
    new[4:] = y[4:] + h / 2 * (k[4:] + m[4:])
    past[0] = y


@njit(cache=True)
def _buss(t, h, y, world, number, new):  # type: ignore[no-untyped-def]
    """Buss's augmented steps (2000), world axes: h W + h^2/2 W' + h^3/12 W' x W, and h^3/6 W'' for order 3."""
    p, _, _, wheel_times, wheel = world
    k, m = np.empty(7), np.empty(7)
    _slope(t, t, y, world, k)
    q, w, a = (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6]), (k[4], k[5], k[6])
    W, V = _spin(q, w, 1.0), _spin(q, a, 1.0)
    v = _add(_add((h * W[0], h * W[1], h * W[2]), h * h / 2, V), h**3 / 12, _cross(V, W))
    if number == 3:
        small = 1e-4 * h
        for sign in (1.0, -1.0):
            stage = y + sign * small * k
            stage[:4] /= math.sqrt((stage[:4] ** 2).sum())
            _slope(t + sign * small, t + sign * small, stage, world, m)
            v = _add(v, sign * h**3 / 6 / (2 * small), _spin(stage, (m[4], m[5], m[6]), 1.0))
    rotor, _ = _read(wheel_times, wheel, t, t)
    L = _add(_multiply(p, INERTIA, w), 1.0, rotor)
    torque = _add(_multiply(p, INERTIA, a), -1.0, _cross(L, w))
    L = _spin(q, _add(L, h, torque), 1.0)
    _times(_turn(v, 1.0), y, new)
    L = _add(_spin(new, L, -1.0), -1.0, rotor)
    new[4], new[5], new[6] = _multiply(p, INVERSE, L)


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
RUNGE_KUTTA, SPLIT, IMPLICIT, TRAPEZOID, ADAMS, LEAPFROG, STORMER, BUSS = range(8)
"""Families of steps."""


@njit(cache=True)
def _step(family, t, h, y, world, A, b, number, turned, known, past, new):  # type: ignore[no-untyped-def]
    if family == RUNGE_KUTTA:
        _runge_kutta(t, h, y, world, A, b, turned, new)
    elif family == SPLIT:
        _split(t, h, y, world, number, turned, new)
    elif family in (IMPLICIT, TRAPEZOID):
        _implicit(t, h, y, world, b[0], family == TRAPEZOID, new)
    elif family == ADAMS:
        _adams(t, h, y, world, number, known, past, new)
    elif family == LEAPFROG:
        _leapfrog(t, h, y, world, new)
    elif family == STORMER:
        _stormer(t, h, y, world, known, past, new)
    else:
        _buss(t, h, y, world, number, new)


@njit(cache=True)
def march(y0, h, count, every, family, A, b, number, turned, normalise, single, world):  # type: ignore[no-untyped-def]
    """Return every `every`-th of the states after `count` steps of length h from t = 0 by a textbook method.

    `number` and `turned` choose in a family: the order or the number of iterations, and the exponential map. With `single` the
    state is rounded to single precision after each step. Rows after a method diverged are nan.
    """
    rows, past, y, new = np.full((count // every + 1, 7), np.nan), np.zeros((3, 7)), y0.copy(), np.empty(7)
    rows[0] = y
    for n in range(count):
        _step(family, n * h, h, y, world, A, b, number, turned, n, past, new)
        if normalise:
            new[:4] /= math.sqrt((new[:4] ** 2).sum())
        if single:
            for i in range(7):
                new[i] = np.float64(np.float32(new[i]))
        y[:] = new
        if not np.abs(y).max() < 1e30:
            break
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
