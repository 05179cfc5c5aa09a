"""Integrators of every common design, for many motions at once: an attitude, a variable of rotation, and a step.

They share no code with the methods of this package and with the catalogue of mistakes: the tolerances of motions are measured
with them. All numbers of a motion are in units of its step and its largest moment, so that single precision does not overflow
and one test ends the implicit steps of all motions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from conservative.attitude import Array

from .motion import Motion

ATTITUDES, VARIABLES = ("quaternion", "matrix"), ("rates", "momentum", "world rates", "world momentum")
"""The attitude of a state, and its other part: rates or momentum in body axes, or in world axes."""


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of vectors (3, n)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def apply(M: Array, v: Array) -> Array:
    """Return M v of matrices (3, 3, n) and vectors (3, n)."""
    return (M * v[None]).sum(axis=1)


def back(M: Array, v: Array) -> Array:
    """Return M' v of matrices (3, 3, n) and vectors (3, n)."""
    return (M * v[:, None]).sum(axis=0)


def multiply(A: Array, B: Array) -> Array:
    """Return the products of matrices (3, 3, n)."""
    return (A[:, :, None] * B[None]).sum(axis=1)


def hat(w: Array) -> Array:
    """Return the matrices (3, 3, n) of w x."""
    none = 0 * w[0]
    return np.stack([np.stack(row) for row in ((none, -w[2], w[1]), (w[2], none, -w[0]), (-w[1], w[0], none))])


def product(p: Array, q: Array) -> Array:
    """Return the products of quaternions (4, n)."""
    return np.concatenate([[p[0] * q[0] - (p[1:] * q[1:]).sum(axis=0)], p[0] * q[1:] + q[0] * p[1:] + cross(p[1:], q[1:])])


def matrix(q: Array) -> Array:
    """Return the matrices (3, 3, n) of quaternions (4, n) of any norm."""
    w, x, y, z = q / np.sqrt((q * q).sum(axis=0))
    return np.stack([np.stack(row) for row in (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )])  # fmt: skip


def exponential(turn: Array) -> Array:
    """Return the quaternions (4, n) of rotation vectors (3, n)."""
    angle = np.sqrt((turn * turn).sum(axis=0))
    size = np.sinc(angle / (2 * np.pi)).astype(turn.dtype) / 2
    return np.concatenate([np.cos(angle / 2)[None], size * turn])


class Bodies:
    """The equations of motions in one design, in units of their steps and largest moments."""

    def __init__(self, motions: Sequence[Motion], attitude: str, variable: str, single: bool = False) -> None:
        kind = np.float32 if single else np.float64
        self.unit = np.array([motion.step for motion in motions])
        size = np.array([np.linalg.eigvalsh(motion.inertia_B)[2] for motion in motions])
        self.attitude, self.variable, self.n = attitude, variable, 4 if attitude == "quaternion" else 9

        def gather(values: Any, scale: Any = 1.0) -> Array:
            return (np.moveaxis(np.array(values, dtype=float), 0, -1) * scale).astype(kind)

        none, square = [0.0] * 3, np.zeros((3, 3))
        J = np.array([motion.inertia_B for motion in motions])
        self.J, self.inverse = gather(J, 1 / size), gather(np.linalg.inv(J), size)
        moments, axes = np.linalg.eigh(J)
        self.moments, self.axes = gather(moments, 1 / size), gather(axes)
        self.rotor = gather([motion.rotor_momentum_B or none for motion in motions], self.unit / size)
        torque = self.unit**2 / size
        self.body = gather([motion.torque_B or none for motion in motions], torque)
        self.world = gather([motion.torque_W or none for motion in motions], torque)
        self.damping = gather([square if motion.damping is None else motion.damping for motion in motions], self.unit / size)
        self.arm = gather([motion.arm for motion in motions], torque)
        self.orbit = gather([motion.orbit or 0.0 for motion in motions], self.unit)
        self.q0 = gather([motion.exact["quaternion_wxyz"][0] for motion in motions])
        self.w0 = gather([motion.rates for motion in motions], self.unit)

    @property
    def start(self) -> Array:
        """The initial states (n + 3, motions)."""
        R = matrix(self.q0)
        return np.concatenate([self.q0 if self.n == 4 else R.reshape(9, -1), self.of_momentum(R, self.momentum(self.w0))])

    def R(self, y: Array) -> Array:
        """Return the matrices (3, 3, n) of states."""
        return matrix(y[:4]) if self.n == 4 else y[:9].reshape(3, 3, -1)

    def momentum(self, w: Array) -> Array:
        """Return the momentum in body axes, with the rotor's momentum."""
        return apply(self.J, w) + self.rotor

    def of_momentum(self, R: Array, M: Array) -> Array:
        """Return the variable of rotation from the momentum in body axes."""
        v = M if "momentum" in self.variable else apply(self.inverse, M - self.rotor)
        return apply(R, v) if "world" in self.variable else v

    def rates(self, R: Array, v: Array) -> Array:
        """Return the rates in body axes from the variable of rotation."""
        v = back(R, v) if "world" in self.variable else v
        return apply(self.inverse, v - self.rotor) if "momentum" in self.variable else v

    def torque(self, t: Array, R: Array, w: Array) -> Array:
        """Return the torques in body axes."""
        out = self.body + back(R, self.world) - apply(self.damping, w) + cross(R[2], self.arm)
        u = back(R, np.stack([np.cos(self.orbit * t), np.sin(self.orbit * t), 0 * t]))
        return out + 3 * self.orbit**2 * cross(u, apply(self.J, u))

    def turning(self, a: Array, w: Array) -> Array:
        """Return the derivative of attitudes (4 or 9, n)."""
        if self.n == 4:
            return product(a, np.concatenate([0 * w[:1], w])) / 2
        return multiply(a.reshape(3, 3, -1), hat(w)).reshape(9, -1)

    def turned(self, a: Array, turn: Array) -> Array:
        """Return attitudes (4 or 9, n) turned by rotation vectors (3, n) in body axes."""
        q = exponential(turn)
        return product(a, q) if self.n == 4 else multiply(a.reshape(3, 3, -1), matrix(q)).reshape(9, -1)

    def change(self, t: Array, R: Array, v: Array, w: Array) -> Array:
        """Return the derivative of the variable of rotation."""
        T = self.torque(t, R, w)
        if self.variable == "world momentum":
            return apply(R, T)
        if self.variable == "momentum":
            return T + cross(v, w)
        slope = apply(self.inverse, T + cross(self.momentum(w), w))
        return apply(R, slope) if self.variable == "world rates" else slope

    def __call__(self, t: Array, y: Array) -> Array:
        """Return the derivative of states."""
        R, v = self.R(y), y[self.n :]
        w = self.rates(R, v)
        return np.concatenate([self.turning(y[: self.n], w), self.change(t, R, v, w)])

    def normalise(self, y: Array) -> Array:
        """Return states with unit quaternions, or orthonormal matrices whose rows are made orthogonal in their order."""
        if self.n == 4:
            return np.concatenate([y[:4] / np.sqrt((y[:4] * y[:4]).sum(axis=0)), y[4:]])
        x = y[:3] / np.sqrt((y[:3] * y[:3]).sum(axis=0))
        z = cross(x, y[3:6])
        z = z / np.sqrt((z * z).sum(axis=0))
        return np.concatenate([x, cross(z, x), z, y[9:]])


Next = Callable[[Bodies, Array, Array, Array, list[Array]], Array]
"""From bodies, times (n,), states, step sizes (n,) and earlier states, the newest first, to the next states."""


def _sum(y: Array, h: Array, weights: Sequence[float], slopes: Sequence[Array]) -> Array:
    for a, k in zip(weights, slopes, strict=False):
        y = y + (h * y.dtype.type(a)) * k if a else y
    return y


def tableau(
    f: Bodies, t: Array, y: Array, h: Array, past: list[Array], A: Sequence[Sequence[float]], b: Sequence[float]
) -> Array:
    """Explicit Runge-Kutta methods."""
    slopes: list[Array] = []
    for row in ((), *A):
        slopes.append(f(t + h * y.dtype.type(sum(row)), _sum(y, h, row, slopes)))
    return _sum(y, h, b, slopes)


def turned_tableau(
    f: Bodies,
    t: Array,
    y: Array,
    h: Array,
    past: list[Array],
    A: Sequence[Sequence[float]],
    b: Sequence[float],
    corrected: bool,
) -> Array:
    """Explicit Runge-Kutta methods with the exponential map; `corrected` (Munthe-Kaas) keeps the order above 2."""
    changes, turns, none = list[Array](), list[Array](), 0 * y[f.n :]
    for row in ((), *A):
        turn, v = _sum(none, h, row, turns), _sum(y[f.n :], h, row, changes)
        R = f.R(np.concatenate([f.turned(y[: f.n], turn), v]))
        w, at = f.rates(R, v), t + h * y.dtype.type(sum(row))
        changes.append(f.change(at, R, v, w))
        across = cross(turn, w)
        turns.append(w + across / 2 + cross(turn, across) / 12 if corrected else w)
    return np.concatenate([f.turned(y[: f.n], _sum(none, h, b, turns)), _sum(y[f.n :], h, b, changes)])


def semi_implicit(f: Bodies, t: Array, y: Array, h: Array, past: list[Array], use: str, exact: bool, sweeps: int = 1) -> Array:
    """Rates with some corrections of their torque, then the attitude with old, new or mean rates."""
    v, end = y[f.n :], y
    for _ in range(sweeps):
        end = np.concatenate([y[: f.n], v + h * f(t, end)[f.n :]])
    R = f.R(y)
    old, new = f.rates(R, v), f.rates(R, end[f.n :])
    w = {"old": old, "new": new, "mean": (old + new) / 2}[use]
    a = f.turned(y[: f.n], h * w) if exact else y[: f.n] + h * f.turning(y[: f.n], w)
    return np.concatenate([a, end[f.n :]])


def _solve(y: Array, function: Callable[[Array], Array]) -> Array:
    """Return the fixed point of a function near y."""
    for _ in range(60):
        before, y = y, function(y)
        if np.abs(y - before).max() <= 2 * np.finfo(y.dtype).eps * np.abs(y).max():
            break
    return y


def implicit(f: Bodies, t: Array, y: Array, h: Array, past: list[Array], at: float) -> Array:
    """Implicit Euler (at = 1) or the implicit midpoint rule (at = 1/2)."""
    part = h * y.dtype.type(at)
    stage = _solve(y, lambda stage: y + part * f(t + part, stage))
    return y + (stage - y) / y.dtype.type(at)


def trapezoid(f: Bodies, t: Array, y: Array, h: Array, past: list[Array]) -> Array:
    """The trapezoidal rule."""
    first = y + h / 2 * f(t, y)
    return _solve(y, lambda new: first + h / 2 * f(t + h, new))


def gauss(f: Bodies, t: Array, y: Array, h: Array, past: list[Array]) -> Array:
    """Gauss's collocation of order 4."""
    root = y.dtype.type(3**0.5 / 6)
    low, high = (y.dtype.type(0.5) - root) * h, (y.dtype.type(0.5) + root) * h

    def again(slopes: Array) -> Array:
        a, b = slopes
        return np.stack([f(t + low, y + h * (a / 4) + (low - h / 4) * b), f(t + high, y + (high - h / 4) * a + h * (b / 4))])

    a, b = _solve(np.stack([f(t, y), f(t, y)]), again)
    return y + h / 2 * (a + b)


def adams(f: Bodies, t: Array, y: Array, h: Array, past: list[Array]) -> Array:
    """Adams-Bashforth of order 2; the first step is explicit Euler."""
    return y + h * f(t, y) if not past else y + h * (3 * f(t, y) - f(t - h, past[0])) / 2


KICKS = 12
"""Number of iterations of a kick. Each multiplies the error by h D / 2, at most 0.03 here."""


def splitting(f: Bodies, t: Array, y: Array, h: Array, past: list[Array]) -> Array:
    """Half a kick, rotations about the principal axes 1, 2, 3, 2, 1, half a kick (Dullweber, Leimkuhler & McLachlan 1997)."""
    a, R = y[: f.n], f.R(y)
    M = _kick(f, t, R, y[f.n :] if f.variable == "momentum" else f.momentum(y[f.n :]), h / 2)
    for i, part in ((0, h / 2), (1, h / 2), (2, h), (1, h / 2), (0, h / 2)):
        axis = f.axes[:, i]
        turn = part * (axis * (M - f.rotor)).sum(axis=0) / f.moments[i] * axis
        a, M = f.turned(a, turn), back(matrix(exponential(turn)), M)
    R = f.R(np.concatenate([a, M]))
    return np.concatenate([a, f.of_momentum(R, _kick(f, t + h, R, M, h / 2))])


def _kick(f: Bodies, t: Array, R: Array, M: Array, h: Array) -> Array:
    """The change of the momentum by torques at a fixed attitude, by the implicit midpoint rule: a step back undoes it."""
    new = M
    for _ in range(KICKS):
        new = M + h * f.torque(t, R, apply(f.inverse, (M + new) / 2 - f.rotor))
    return new


def composed(f: Bodies, t: Array, y: Array, h: Array, past: list[Array], step: Next) -> Array:
    """A symmetric step of order 2, composed to order 4 (Yoshida 1990)."""
    outer = 1 / (2 - 2 ** (1 / 3))
    for share in (outer, 1 - 2 * outer, outer):
        part = h * y.dtype.type(share)
        y, t = step(f, t, y, part, past), t + part
    return y


def extrapolated(f: Bodies, t: Array, y: Array, h: Array, past: list[Array]) -> Array:
    """The implicit midpoint rule, extrapolated to order 4 from one and two steps."""
    middle = partial(implicit, at=0.5)
    half = middle(f, t, y, h / 2, past)
    return (4 * middle(f, t + h / 2, half, h / 2, past) - middle(f, t, y, h, past)) / 3


RK4 = (((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
EIGHTHS = (((1 / 3,), (-1 / 3, 1.0), (1.0, -1.0, 1.0)), (1 / 8, 3 / 8, 3 / 8, 1 / 8))
"""Rows of A, and b, of Runge and Kutta's rules of order 4: the classical one, and the rule of three eighths."""
STEPS: dict[int, dict[str, Next]] = {
    1: {
        "explicit Euler": partial(tableau, A=(), b=(1.0,)),
        "explicit Euler with the exponential map": partial(semi_implicit, use="old", exact=True),
        "semi-implicit Euler": partial(semi_implicit, use="new", exact=False),
        "semi-implicit Euler with the exponential map": partial(semi_implicit, use="new", exact=True),
        "semi-implicit Euler with an implicit torque": partial(semi_implicit, use="new", exact=False, sweeps=20),
        "mean rates": partial(semi_implicit, use="mean", exact=True),
        "implicit Euler": partial(implicit, at=1.0),
    },
    2: {
        "explicit midpoint": partial(tableau, A=((0.5,),), b=(0.0, 1.0)),
        "Heun": partial(tableau, A=((1.0,),), b=(0.5, 0.5)),
        "Ralston": partial(tableau, A=((2 / 3,),), b=(0.25, 0.75)),
        "explicit midpoint with the exponential map": partial(turned_tableau, A=((0.5,),), b=(0.0, 1.0), corrected=False),
        "Heun with the exponential map": partial(turned_tableau, A=((1.0,),), b=(0.5, 0.5), corrected=False),
        "implicit midpoint": partial(implicit, at=0.5),
        "trapezoid": trapezoid,
        "Adams-Bashforth": adams,
        "splitting": splitting,
    },
    4: {
        "RK4": partial(tableau, A=RK4[0], b=RK4[1]),
        "3/8": partial(tableau, A=EIGHTHS[0], b=EIGHTHS[1]),
        "RK4 on rotation vectors (Munthe-Kaas)": partial(turned_tableau, A=RK4[0], b=RK4[1], corrected=True),
        "Gauss": gauss,
        "composed implicit midpoint": partial(composed, step=partial(implicit, at=0.5)),
        "composed splitting": partial(composed, step=splitting),
        "extrapolated implicit midpoint": extrapolated,
    },
}
"""The steps by their order."""
GROWS = {"explicit Euler", "semi-implicit Euler", "semi-implicit Euler with an implicit torque", "implicit Euler"}
"""Steps that change the norm of an attitude in order 1: they are not right without normalisation."""
KEPT = {
    "implicit midpoint",
    "trapezoid",
    "Gauss",
    "composed implicit midpoint",
    "composed splitting",
    "extrapolated implicit midpoint",
}
"""Steps that keep the norm much better than their order says: normalisation changes nothing."""


@dataclass(frozen=True)
class Design:
    """A right program."""

    order: int
    step: str
    attitude: str
    variable: str
    normalised: bool
    single: bool = False

    @property
    def name(self) -> str:
        """The design in words."""
        parts = [self.step, self.attitude, self.variable, *["never normalised"] * (not self.normalised)]
        return ", ".join([*parts, *["single"] * self.single])

    def run(
        self, motions: Sequence[Motion], parts: int, after: Callable[[Array], Array] | None = None
    ) -> Iterator[tuple[Array, Array]]:
        """Yield attitudes (samples, 3, 3) and rates (samples, 3) of each motion, by steps of 0.1 rad over `parts`.

        `after` is a habit: it changes rates (3, motions), rad/s, after each step. The variable of rotation is then the rates.
        """
        f, step = Bodies(motions, self.attitude, self.variable, self.single), STEPS[self.order][self.step]
        ends = [[n * motion.steps * parts for n in range(1, motion.samples + 1)] for motion in motions]
        y, past, states = f.start, list[Array](), list[Array]()
        h = np.full(len(motions), 1 / parts, dtype=y.dtype)
        with np.errstate(all="ignore"):
            for n in range(max(map(max, ends))):
                states.append(y)
                new = step(f, h * y.dtype.type(n), y, h, past)
                past, y = [y], f.normalise(new) if self.normalised else new
                if after is not None:
                    y[f.n :] = after(y[f.n :] / f.unit) * f.unit
            states.append(y)
            R = np.array([f.R(f.normalise(state)) for state in states], dtype=float)
            w = np.array([f.rates(f.R(state), state[f.n :]) for state in states], dtype=float) / f.unit
        for i, rows in enumerate(ends):
            yield R[rows, :, :, i], w[rows, :, i]


def designs(order: int, single: bool = False) -> list[Design]:
    """Return the right programs of an order."""
    return [
        Design(order, step, attitude, variable, normalised, single)
        for step in STEPS[order]
        for attitude in ATTITUDES
        for variable in VARIABLES
        for normalised in (True, False)
        if (normalised or step not in GROWS | KEPT) and not ("world" in variable and "splitting" in step)
    ]
