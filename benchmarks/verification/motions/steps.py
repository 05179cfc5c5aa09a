"""Kernels of the designs in `integrators`: steps of many kinds, for the numbers of one motion at a time.

Kernels compute in the precision of their arrays, so constants that are not exact have its type. A state has an attitude, four
or nine numbers, and three numbers of the variable of rotation.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from conservative.kernels import entry, kernel, small

RATES, MOMENTUM, WORLD_RATES, WORLD_MOMENTUM = range(4)
"""Places in `VARIABLES`."""


J, INVERSE, DAMPING, AXES, MOMENTS, ROTOR, BODY, WORLD, ARM, QUATERNION, RATES_0, ORBIT, LOADED, HALF, NONE, SIZE = np.cumsum(
    [0, 9, 9, 9, 9, 3, 3, 3, 3, 3, 4, 3, 1, 1, 1, 1]
).tolist()
"""Places of the numbers of a motion: matrices by rows, vectors, the start, whether there is any load, 1/2 and 0.

Kernels get them in one array, because an array for each is copied at each call, which takes longer than the sums.
"""


class Rule(NamedTuple):
    """A step: its kind, one of the constants below, and its numbers, each of which has a meaning for some kinds only.

    They are rows A and weights b of a Runge-Kutta method, the time `at` of an implicit stage, the rates that turn the attitude,
    whether it is turned by the exponential map, and how often a torque is corrected.
    """

    kind: int
    A: Any
    b: Any
    at: Any
    use: int
    exact: bool
    sweeps: int


TABLEAU, TURNED, CORRECTED, SEMI_IMPLICIT, IMPLICIT, TRAPEZOID, GAUSS, ADAMS, SPLITTING, COMPOSED, SPLIT_TWICE, EXTRAPOLATED = (
    range(12)
)
"""Kinds of steps: Runge-Kutta methods, on rotation vectors without and with corrections above order 2, ..."""
OLD, NEW, MEAN = range(3)
"""Rates that turn the attitude."""
KICKS = 12
"""Number of iterations of a kick. Each multiplies the error by h D / 2, at most 0.03 here."""
MOST = 60
"""Largest number of iterations of an implicit step."""


@small
def cross(a, b):
    """Return the cross product of vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@small
def add(a, b):
    """Return the sum of vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@small
def less(a, b):
    """Return the difference of vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@small
def times(x, a):
    """Return a vector times a number."""
    return x * a[0], x * a[1], x * a[2]


@small
def dot(a, b):
    """Return the product of vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@small
def row(f, i):
    """Return the vector at a place."""
    return f[i], f[i + 1], f[i + 2]


@small
def rows(f, i):
    """Return the matrix at a place as nine numbers."""
    return f[i], f[i + 1], f[i + 2], f[i + 3], f[i + 4], f[i + 5], f[i + 6], f[i + 7], f[i + 8]


@small
def apply(M, v):
    """Return M v of a matrix, nine numbers."""
    return (
        M[0] * v[0] + M[1] * v[1] + M[2] * v[2],
        M[3] * v[0] + M[4] * v[1] + M[5] * v[2],
        M[6] * v[0] + M[7] * v[1] + M[8] * v[2],
    )


@small
def back(M, v):
    """Return M' v of a matrix, nine numbers."""
    return (
        M[0] * v[0] + M[3] * v[1] + M[6] * v[2],
        M[1] * v[0] + M[4] * v[1] + M[7] * v[2],
        M[2] * v[0] + M[5] * v[1] + M[8] * v[2],
    )


@small
def matrix(w, x, y, z):
    """Return the matrix of a quaternion of any norm."""
    size = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / size, x / size, y / size, z / size
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    a, b, c, d, e, f = xy - wz, xz + wy, xy + wz, yz - wx, xz - wy, yz + wx
    return w * w + x * x - y * y - z * z, a + a, b + b, c + c, w * w - x * x + y * y - z * z, d + d, e + e, f + f, (
        w * w - x * x - y * y + z * z
    )  # fmt: skip


@kernel
def exponential(half, turn):
    """Return the quaternion of a rotation vector."""
    angle = math.sqrt(dot(turn, turn))
    size = math.sin(half * angle) / angle if angle > 0 else half
    return math.cos(half * angle), size * turn[0], size * turn[1], size * turn[2]


@small
def rotation(y):
    """Return the matrix of a state, which need not be orthogonal."""
    if len(y) == 7:
        return matrix(y[0], y[1], y[2], y[3])
    return y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], y[8]


@small
def variable_of(y):
    """Return the variable of rotation of a state."""
    n = len(y) - 3
    return y[n], y[n + 1], y[n + 2]


@small
def put(out, v):
    """Write the variable of rotation to a state."""
    n = len(out) - 3
    out[n], out[n + 1], out[n + 2] = v


@small
def momentum_of(f, w):
    """Return the momentum in body axes, with the rotor's momentum."""
    return add(apply(rows(f, J), w), row(f, ROTOR))


@small
def of_momentum(f, variable, R, M):
    """Return the variable of rotation from the momentum in body axes."""
    v = M
    if variable in (RATES, WORLD_RATES):
        v = apply(rows(f, INVERSE), less(M, row(f, ROTOR)))
    return apply(R, v) if variable >= WORLD_RATES else v


@small
def rates_of(f, variable, R, v):
    """Return the rates in body axes from the variable of rotation."""
    if variable >= WORLD_RATES:
        v = back(R, v)
    return apply(rows(f, INVERSE), less(v, row(f, ROTOR))) if variable in (MOMENTUM, WORLD_MOMENTUM) else v


@kernel
def torque(f, t, R, w):
    """Return the torque in body axes."""
    if f[LOADED] == 0:
        return f[NONE], f[NONE], f[NONE]
    T = less(add(back(R, row(f, WORLD)), row(f, BODY)), apply(rows(f, DAMPING), w))
    T = add(T, cross((R[6], R[7], R[8]), row(f, ARM)))
    n = f[ORBIT]
    if n != 0:
        c, s = math.cos(n * t), math.sin(n * t)
        u = R[0] * c + R[3] * s, R[1] * c + R[4] * s, R[2] * c + R[5] * s
        T = add(T, times(n * n + n * n + n * n, cross(u, apply(rows(f, J), u))))
    return T


@kernel
def change(f, variable, t, R, v, w):
    """Return the derivative of the variable of rotation."""
    T = torque(f, t, R, w)
    if variable == WORLD_MOMENTUM:
        return apply(R, T)
    if variable == MOMENTUM:
        return add(T, cross(v, w))
    slope = apply(rows(f, INVERSE), add(T, cross(momentum_of(f, w), w)))
    return apply(R, slope) if variable == WORLD_RATES else slope


@kernel
def turning(f, y, w, out):
    """Write the derivative of an attitude."""
    if len(y) == 7:
        a, b, c = times(f[HALF], w)
        out[0] = -(y[1] * a + y[2] * b + y[3] * c)
        out[1] = y[0] * a + y[2] * c - y[3] * b
        out[2] = y[0] * b + y[3] * a - y[1] * c
        out[3] = y[0] * c + y[1] * b - y[2] * a
    else:
        for k in (0, 3, 6):
            out[k], out[k + 1], out[k + 2] = cross((y[k], y[k + 1], y[k + 2]), w)  # a row of R hat(w)


@kernel
def turned(f, y, turn, out):
    """Write the attitude of a state, turned by a rotation vector in body axes."""
    p, q, r, s = exponential(f[HALF], turn)
    if len(y) == 7:
        w, x, z, u = y[0], y[1], y[2], y[3]
        out[0] = w * p - (x * q + z * r + u * s)
        out[1] = w * q + p * x + z * s - u * r
        out[2] = w * r + p * z + u * q - x * s
        out[3] = w * s + p * u + x * r - z * q
    else:
        M = matrix(p, q, r, s)
        for k in (0, 3, 6):
            out[k], out[k + 1], out[k + 2] = back(M, (y[k], y[k + 1], y[k + 2]))


@kernel
def slope(f, variable, t, y, out):
    """Write the derivative of a state."""
    R, v = rotation(y), variable_of(y)
    w = rates_of(f, variable, R, v)
    turning(f, y, w, out)
    put(out, change(f, variable, t, R, v, w))


@kernel
def normalise(y):
    """Give a state a unit quaternion, or an orthonormal matrix whose rows are made orthogonal in their order."""
    if len(y) == 7:
        size = math.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3])
        for k in range(4):
            y[k] /= size
        return
    x, second = (y[0], y[1], y[2]), (y[3], y[4], y[5])
    size = math.sqrt(dot(x, x))
    x = x[0] / size, x[1] / size, x[2] / size
    z = cross(x, second)
    size = math.sqrt(dot(z, z))
    z = z[0] / size, z[1] / size, z[2] / size
    y[0], y[1], y[2] = x
    y[3], y[4], y[5] = cross(z, x)
    y[6], y[7], y[8] = z


@kernel
def converged(new, old):
    """Return whether two iterates of an implicit step agree, and write the new one over the old one."""
    change, size = abs(new[0] - old[0]), abs(new[0])
    for k in range(len(new)):
        difference = abs(new[k] - old[k])
        if not difference <= change:  # also nan
            change = difference
        size = max(size, abs(new[k]))
        old[k] = new[k]
    return change <= 2 * np.finfo(new.dtype).eps * size


@kernel
def tableau(f, variable, rule, t, y, h, out, work):
    """Explicit Runge-Kutta methods."""
    n = len(rule.b)
    for s in range(n):
        stage, at = work[n], t
        stage[:] = y
        for k in range(s):
            if rule.A[s, k] != 0:
                at += h * rule.A[s, k]
                for j in range(len(y)):
                    stage[j] += (h * rule.A[s, k]) * work[k, j]
        slope(f, variable, at, stage, work[s])
    out[:] = y
    for k in range(n):
        if rule.b[k] != 0:
            for j in range(len(y)):
                out[j] += (h * rule.b[k]) * work[k, j]


@kernel
def turned_tableau(f, variable, rule, t, y, h, out, work):
    """Explicit Runge-Kutta methods with the exponential map; `CORRECTED` (Munthe-Kaas) keeps the order above 2.

    A row of `work` has a rotation vector and a change of the variable of rotation; its last row is the stage.
    """
    n, start, none = len(rule.b), variable_of(y), times(y.dtype.type(0), variable_of(y))
    for s in range(n + 1):
        turn, v, at = none, start, t
        for k in range(min(s, n)):
            a = rule.A[s, k] if s < n else rule.b[k]
            if a != 0:
                turn = add(turn, times(h * a, (work[k, 0], work[k, 1], work[k, 2])))
                v = add(v, times(h * a, (work[k, 3], work[k, 4], work[k, 5])))
                at += h * a
        if s == n:
            turned(f, y, turn, out)
            put(out, v)
            return
        stage = work[n]
        turned(f, y, turn, stage)
        R = rotation(stage)
        w = rates_of(f, variable, R, v)
        work[s, 3], work[s, 4], work[s, 5] = change(f, variable, at, R, v, w)
        if rule.kind == CORRECTED:
            across = cross(turn, w)
            again = cross(turn, across)
            twelfth = y.dtype.type(1 / 12)
            w = add(add(w, times(f[HALF], across)), times(twelfth, again))
        work[s, 0], work[s, 1], work[s, 2] = w


@kernel
def semi_implicit(f, variable, rule, t, y, h, out, work):
    """Rates with some corrections of their torque, then the attitude with old, new or mean rates."""
    end, k = work[0], work[1]
    end[:] = y
    start = variable_of(y)
    for _ in range(rule.sweeps):
        slope(f, variable, t, end, k)
        put(end, add(start, times(h, variable_of(k))))
    R = rotation(y)
    w, new = rates_of(f, variable, R, start), rates_of(f, variable, R, variable_of(end))
    if rule.use == NEW:
        w = new
    elif rule.use == MEAN:
        w = times(f[HALF], add(w, new))
    if rule.exact:
        turned(f, y, times(h, w), out)
    else:
        turning(f, y, w, k)
        for j in range(len(y) - 3):
            out[j] = y[j] + h * k[j]
    put(out, variable_of(end))


@kernel
def implicit(f, variable, at, t, y, h, out, work):
    """Implicit Euler (at = 1) or the implicit midpoint rule (at = 1/2). It needs three rows of `work`."""
    part, stage, new, k = h * at, work[0], work[1], work[2]
    stage[:] = y
    for _ in range(MOST):
        slope(f, variable, t + part, stage, k)
        for j in range(len(y)):
            new[j] = y[j] + part * k[j]
        if converged(new, stage):
            break
    for j in range(len(y)):
        out[j] = y[j] + (stage[j] - y[j]) / at


@kernel
def trapezoid(f, variable, t, y, h, out, work):
    """The trapezoidal rule."""
    first, k, new, part = work[0], work[1], work[2], f[HALF] * h
    slope(f, variable, t, y, k)
    for j in range(len(y)):
        first[j] = y[j] + part * k[j]
        out[j] = y[j]
    for _ in range(MOST):
        slope(f, variable, t + h, out, k)
        for j in range(len(y)):
            new[j] = first[j] + part * k[j]
        if converged(new, out):
            break


@kernel
def gauss(f, variable, t, y, h, out, work):
    """Gauss's collocation of order 4."""
    a, b, new, other, stage = work[0], work[1], work[2], work[3], work[4]
    root, quarter = y.dtype.type(3**0.5 / 6), f[HALF] * f[HALF] * h
    low, high = (f[HALF] - root) * h, (f[HALF] + root) * h
    slope(f, variable, t, y, a)
    b[:] = a
    for _ in range(MOST):
        for j in range(len(y)):
            stage[j] = y[j] + quarter * a[j] + (low - quarter) * b[j]
        slope(f, variable, t + low, stage, new)
        for j in range(len(y)):
            stage[j] = y[j] + (high - quarter) * a[j] + quarter * b[j]
        slope(f, variable, t + high, stage, other)
        done = converged(new, a)
        if converged(other, b) and done:
            break
    for j in range(len(y)):
        out[j] = y[j] + f[HALF] * h * (a[j] + b[j])


@kernel
def adams(f, variable, n, t, y, before, h, out, work):
    """Adams-Bashforth of order 2; the first step is explicit Euler."""
    new, old = work[0], work[1]
    slope(f, variable, t, y, new)
    if n == 0:
        for j in range(len(y)):
            out[j] = y[j] + h * new[j]
        return
    slope(f, variable, t - h, before, old)
    for j in range(len(y)):
        out[j] = y[j] + h * (f[HALF] * (new[j] + new[j] + new[j] - old[j]))


@kernel
def kick(f, t, R, M, h):
    """Return the momentum changed by torques at a fixed attitude, by the implicit midpoint rule: a step back undoes it."""
    new = M
    for _ in range(KICKS if f[LOADED] != 0 else 0):
        w = apply(rows(f, INVERSE), less(times(f[HALF], add(M, new)), row(f, ROTOR)))
        new = add(M, times(h, torque(f, t, R, w)))
    return new


@kernel
def splitting(f, variable, t, y, h, out):
    """Half a kick, rotations about the principal axes 1, 2, 3, 2, 1, half a kick (Dullweber, Leimkuhler & McLachlan 1997)."""
    out[:] = y
    v, part = variable_of(y), f[HALF] * h
    M = kick(f, t, rotation(y), v if variable == MOMENTUM else momentum_of(f, v), part)
    for k in (0, 1, 2, 1, 0):
        axis = f[AXES + k], f[AXES + 3 + k], f[AXES + 6 + k]
        angle = (h if k == 2 else part) * dot(axis, less(M, row(f, ROTOR))) / f[MOMENTS + k]
        turn = times(angle, axis)
        turned(f, out, turn, out)
        p, q, r, s = exponential(f[HALF], turn)
        M = back(matrix(p, q, r, s), M)
    R = rotation(out)
    put(out, of_momentum(f, variable, R, kick(f, t + h, R, M, part)))


@kernel
def composed(f, variable, kind, t, y, h, out, work):
    """A symmetric step of order 2, composed to order 4 (Yoshida 1990)."""
    outer = 1 / (2 - 2 ** (1 / 3))
    out[:] = y
    for share in (outer, 1 - 2 * outer, outer):
        part, state = h * y.dtype.type(share), work[3]
        state[:] = out
        if kind == COMPOSED:
            implicit(f, variable, f[HALF], t, state, part, out, work)
        else:
            splitting(f, variable, t, state, part, out)
        t += part


@kernel
def extrapolated(f, variable, t, y, h, out, work):
    """The implicit midpoint rule, extrapolated to order 4 from one and two steps."""
    one, half, part = work[3], work[4], f[HALF] * h
    implicit(f, variable, f[HALF], t, y, part, half, work)
    implicit(f, variable, f[HALF], t, y, h, one, work)
    implicit(f, variable, f[HALF], t + part, half, part, out, work)
    for j in range(len(y)):
        out[j] = (y.dtype.type(4) * out[j] - one[j]) / y.dtype.type(3)


@kernel
def step(f, variable, rule, n, h, y, before, out, work):  # one branch for each kind
    """Write the state after the step of number n from state y; `before` is the state before it."""
    t = h * y.dtype.type(n)
    if rule.kind == TABLEAU:
        tableau(f, variable, rule, t, y, h, out, work)
    elif rule.kind in (TURNED, CORRECTED):
        turned_tableau(f, variable, rule, t, y, h, out, work)
    elif rule.kind == SEMI_IMPLICIT:
        semi_implicit(f, variable, rule, t, y, h, out, work)
    elif rule.kind == IMPLICIT:
        implicit(f, variable, rule.at, t, y, h, out, work)
    elif rule.kind == TRAPEZOID:
        trapezoid(f, variable, t, y, h, out, work)
    elif rule.kind == GAUSS:
        gauss(f, variable, t, y, h, out, work)
    elif rule.kind == ADAMS:
        adams(f, variable, n, t, y, before, h, out, work)
    elif rule.kind == SPLITTING:
        splitting(f, variable, t, y, h, out)
    elif rule.kind == EXTRAPOLATED:
        extrapolated(f, variable, t, y, h, out, work)
    else:
        composed(f, variable, rule.kind, t, y, h, out, work)


@entry
def begin(numbers, variable, y):
    """Write the initial states y (motions, 7 or 12)."""
    for i in range(len(y)):
        f = numbers[i]
        R = matrix(f[QUATERNION], f[QUATERNION + 1], f[QUATERNION + 2], f[QUATERNION + 3])
        if y.shape[1] == 7:
            for k in range(4):
                y[i, k] = f[QUATERNION + k]
        else:
            for k in range(9):
                y[i, k] = R[k]
        put(y[i], of_momentum(f, variable, R, momentum_of(f, row(f, RATES_0))))


@entry
def advance(bodies, variable, rule, normalised, parts, first, last, y, before, R, w):
    """Take the steps from `first` on, before `last`, in each motion up to its last sample. Write the samples before each step.

    A step is a `parts`-th of 0.1 rad. States y and `before`, a step earlier, are (motions, 7 or 12), and the samples R, with
    unit norm, and w are (samples, ...), as in `Bodies`.
    """
    h, size = y.dtype.type(1 / parts), y.shape[1]
    work, new = np.zeros((6, size), y.dtype), np.zeros(size, y.dtype)
    for i in range(len(y)):
        f, state, at = bodies.numbers[i], y[i], bodies.first[i]
        while at < bodies.first[i + 1] and bodies.ends[at] * parts < first:
            at += 1
        for n in range(first, last):
            if at < bodies.first[i + 1] and bodies.ends[at] * parts == n:
                new[:] = state
                normalise(new)
                matrix_of, rates = rotation(new), rates_of(f, variable, rotation(state), variable_of(state))
                for k in range(9):
                    R[at, k // 3, k % 3] = matrix_of[k]
                for k in range(3):
                    w[at, k] = rates[k]
                at += 1
            if at == bodies.first[i + 1]:
                break
            step(f, variable, rule, n, h, state, before[i], new, work)
            if normalised:
                normalise(new)
            before[i] = state
            state[:] = new
