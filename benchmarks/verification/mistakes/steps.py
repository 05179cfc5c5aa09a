"""Steps: an integrator makes the motion, with a step that is too long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from typing import Any, ClassVar

import numpy as np

from conservative.attitude import Array
from conservative.methods.coefficients.explicit import (
    EULER,
    HEUN,
    HEUN_3,
    KUTTA_3,
    MIDPOINT,
    RALSTON,
    RUNGE_KUTTA_4,
    SHU_OSHER_3,
    ExplicitTableau,
)

from ..solution import cross
from .mistake import Mistake, Number

MOST_ITERATIONS = 60
"""Largest number of fixed-point iterations of an implicit step, which usually end at round-off."""

Slope = Any
"""The derivative of states (7, ...) at a time or times, s, with an attribute `body`, and `rates` of times and states."""


def _rotate(q: Array, turn: Array) -> Array:
    """Return quaternions (4, ...) turned by rotation vectors (3, ...) in body axes."""
    angle = np.sqrt((turn * turn).sum(axis=0))
    part = np.concatenate([np.cos(angle / 2)[None], np.sinc(angle / (2 * np.pi)) * turn / 2])
    return _product(q, part)


def _product(p: Array, q: Array) -> Array:
    a, v, b, u = p[0], p[1:], q[0], q[1:]
    return np.concatenate([(a * b - (v * u).sum(axis=0))[None], a * u + b * v + cross(v, u)])


def _split_step(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], rates: int, use: str, exact: bool) -> Array:
    """Return the state after rates with up to `rates` corrections of their torque, then attitudes by old, new or mean rates."""
    new = y.copy()
    for _ in range(rates):
        before = new[4:].copy()
        new[4:] = y[4:] + h * f(t, new)[4:]
        if np.abs(new[4:] - before).max() <= 2e-16 * np.abs(y[4:]).max():
            break
    old, later = f.rates(t, y), f.rates(t + h, new)
    with_rates = {"old": old, "new": later, "mean": (old + later) / 2}[use]
    if exact:
        new[:4] = _rotate(y[:4], h * with_rates)
    else:
        new[:4] = y[:4] + h / 2 * _product(y[:4], np.concatenate([0 * y[:1], with_rates]))
    return new


Turning = Callable[[Array, Array], Array]
"""The derivative of rotation vectors (3, ...), of which stages make a sum, from that sum and the rates in body axes."""


def _runge_kutta(
    f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], tableau: ExplicitTableau, turning: Turning | None
) -> Array:
    """Return the state of a Runge-Kutta method; with `turning`, stages turn the body by a sum of rates or rotation vectors.

    The compiled steppers of `conservative.kernels` take one tableau, one body and its own equations. This one takes any slope
    of many states at once, as the search for integrators needs it: wrong equations, and all rows of a recording in one step.
    """
    slopes, turns = list[Array](), list[Array]()
    for row, c in zip((*tableau.A, tableau.b), (*tableau.c, 1.0), strict=True):
        state = y + h * sum((a * k for a, k in zip(row, slopes, strict=True)), np.zeros_like(y))
        turn = h * sum((a * w for a, w in zip(row, turns, strict=True)), np.zeros_like(y[4:])) if turning else None
        if turn is not None:
            state[:4] = _rotate(y[:4], turn)
        if len(slopes) < len(tableau.b):
            slopes.append(f(t + h * c, state))
            if turning and turn is not None:
                turns.append(turning(turn, f.rates(t + h * c, state)))
    return state


def _rates(turn: Array, w: Array) -> Array:
    """Return the rates themselves: a rotation vector that is their sum, as if rotations commuted."""
    return w


def _vector_rates(turn: Array, w: Array) -> Array:
    """Return the derivatives of rotation vectors (3, ...) for rates in body axes."""
    angle = np.sqrt((turn * turn).sum(axis=0))
    small = angle < 1e-2  # the series is accurate to round-off there, and the quotient is not
    half = np.where(small, 1.0, angle / 2)
    factor = np.where(small, 1 / 12 + angle**2 / 720, (1 - half / np.tan(half)) / np.where(small, 1.0, angle**2))
    across = cross(turn, w)
    return w + across / 2 + factor * cross(turn, across)


def _implicit(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], at: float) -> Array:
    """Return the state of implicit Euler (at = 1) or of the implicit midpoint rule (at = 1/2)."""
    stage = y
    for _ in range(MOST_ITERATIONS):
        new = y + at * h * f(t + at * h, stage)
        if np.abs(new - stage).max() <= 2e-16 * np.abs(y).max():
            break
        stage = new
    return y + (stage - y) / at


def _trapezoid(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    new, slope = y, f(t, y)
    for _ in range(MOST_ITERATIONS):
        before, new = new, y + h / 2 * (slope + f(t + h, new))
        if np.abs(new - before).max() <= 2e-16 * np.abs(y).max():
            break
    return new


def _adams(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], weights: Sequence[float]) -> Array:
    """Return the state of Adams and Bashforth's method; steps without enough history are of lower order."""
    states = [y, *past][: len(weights)]
    lower = {1: (1.0,), 2: (1.5, -0.5), 3: weights}[len(states)]
    slopes = (f(t - i * h, state) for i, state in enumerate(states))
    return y + h * sum((a * slope for a, slope in zip(lower, slopes, strict=True)), np.zeros_like(y))


def _leapfrog(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    """Return the state after half a kick, a drift and half a kick (velocity Verlet)."""
    half = y.copy()
    half[4:] += h / 2 * f(t, y)[4:]
    half[:4] = _rotate(y[:4], h * f.rates(t + h / 2, half))
    new = half.copy()
    new[4:] += h / 2 * f(t + h, half)[4:]
    return new


def _stormer(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    """Return the state of Störmer's method on the quaternion, q_{n+1} = 2 q_n - q_{n-1} + h^2 q''; rates by the same f."""
    k, e = f(t, y), 1e-6
    second = (f(t + e * h, y + e * h * k) - f(t - e * h, y - e * h * k))[:4] / (2 * e * h)
    new = y + h * k
    new[:4] = y[:4] + h * k[:4] + h * h / 2 * second if not past else 2 * y[:4] - past[0][:4] + h * h * second
    new[4:] = y[4:] + h / 2 * (k + f(t + h, new))[4:]
    return new


def _buss(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], order: int) -> Array:
    """Return the state of Buss's augmented method of order 2 or 3: one rotation; the momentum stays in world axes."""
    k, w, e, J = f(t, y), f.rates(t, y), 1e-5 * h, f.body.inertia
    slope = (f.rates(t + e, y + e * k) - f.rates(t - e, y - e * k)) / (2 * e)
    turn = h * w + h * h / 2 * slope + h**3 / 12 * cross(slope, w)  # w' x w has the same components in world and body axes
    if order == 3:  # w'' in world axes is w'' + w x w' in body axes
        turn = turn + h**3 / 6 * ((f(t + e, y + e * k) - f(t - e, y - e * k))[4:] / (2 * e) + cross(w, slope))
    rotor = f.rotor(t)
    L = (J @ y[4:].reshape(3, -1) + rotor).reshape(w.shape)
    L = L + h * ((J @ k[4:].reshape(3, -1)).reshape(w.shape) - cross(L, w))
    back = _rotate(np.concatenate([np.ones_like(w[:1]), 0 * w]), -turn)
    carried = _product(
        _product(back, np.concatenate([0 * w[:1], L])), back * np.array([1, -1, -1, -1]).reshape(4, *(1,) * (y.ndim - 1))
    )[1:]
    new = y.copy()
    new[:4] = _rotate(y[:4], turn)
    new[4:] = np.linalg.solve(J, carried.reshape(3, -1) - rotor).reshape(w.shape)
    return new


def _iterate(next_one: Callable[[Array], Array], first: Array) -> Array:
    """Return the fixed point of an implicit step."""
    for _ in range(MOST_ITERATIONS):
        before, first = first, next_one(first)
        if np.abs(first - before).max() <= 2e-16 * np.abs(first).max():
            break
    return first


def _cayley(turn: Array) -> Array:
    """Return the rotation vectors (3, ...) whose Cayley maps have the vectors 2 tan(angle/2) along the axis."""
    size = np.sqrt((turn * turn).sum(axis=0))
    return turn * 2 * np.arctan(size / 2) / np.where(size == 0, 1.0, size)


def _carry(turn: Array, v: Array) -> Array:
    """Return vectors in body axes, such as the momentum, in the axes of a body that is turned by rotation vectors."""
    size = np.sqrt((turn * turn).sum(axis=0))
    axis, side = turn / np.where(size == 0, 1.0, size), np.cos(size)
    return side * v - np.sin(size) * cross(axis, v) + (1 - side) * (axis * v).sum(axis=0) * axis


class _Body:
    """Momentum and torque of states (7, ...) in body axes, from a slope."""

    def __init__(self, f: Slope) -> None:
        self.f, self.J = f, f.body.inertia
        self.rotor = np.zeros(3) if f.body.rotor_momentum is None else f.body.rotor_momentum

    def times(self, matrix: Array, v: Array) -> Array:
        return (matrix @ v.reshape(3, -1)).reshape(v.shape)

    def momentum(self, y: Array) -> Array:
        return self.times(self.J, y[4:]) + self.rotor.reshape(3, *(1,) * (y.ndim - 1))

    def rates(self, L: Array) -> Array:
        return self.times(np.linalg.inv(self.J), L - self.rotor.reshape(3, *(1,) * (L.ndim - 1)))

    def torque(self, t: Any, y: Array) -> Array:
        return self.times(self.J, self.f(t, y)[4:]) - cross(self.momentum(y), self.f.rates(t, y))


def _mean_momentum(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], turn_of: Callable[[Array], Array]) -> Array:
    """Return the state of a method that turns by the mean of the rates of both ends, and keeps the momentum in world axes."""
    body = _Body(f)
    pushed = body.momentum(y) + h / 2 * body.torque(t, y)

    def improve(new: Array) -> Array:
        turn = turn_of(h * (y[4:] + new[4:]) / 2)
        out = np.concatenate([_rotate(y[:4], turn), new[4:]])
        out[4:] = body.rates(_carry(turn, pushed) + h / 2 * body.torque(t + h, out))
        return out

    return _iterate(improve, y)


def _midpoint_on_group(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    """Return the state of the midpoint rule on the rotation group: the momentum of the middle turns the body."""
    body = _Body(f)
    L = body.momentum(y)

    def improve(middle: Array) -> Array:
        turn = h / 2 * middle[4:]
        out = np.concatenate([_rotate(y[:4], turn), middle[4:]])
        out[4:] = body.rates(_carry(turn, L) + h / 2 * body.torque(t + h / 2, out))
        return out

    middle = _iterate(improve, y)
    turn, push = h * middle[4:], h * body.torque(t + h / 2, middle)
    return np.concatenate([_rotate(y[:4], turn), body.rates(_carry(turn, L) + _carry(turn / 2, push))])


def _moser_veselov(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    """Return the state of the discrete Moser-Veselov map, with half a push of the torque, and of a rotor, at each end."""
    body = _Body(f)
    J, rotor = body.J, _column(body.rotor, y[4:])

    def push(t: Any, y: Array) -> Array:
        return h / 2 * (body.torque(t, y) + cross(rotor, y[4:]))

    def improve(c: Array) -> Array:
        return np.linalg.solve(J, (h / 2 * (1 + (c * c).sum(axis=0)) * L - cross(c, body.times(J, c))).reshape(3, -1)).reshape(
            c.shape
        )

    L = body.times(J, y[4:]) + push(t, y)
    c = _iterate(improve, h / 2 * y[4:])
    L = L - 4 / h * cross(c, body.times(J, c)) / (1 + (c * c).sum(axis=0))
    q = _rotate(y[:4], _cayley(2 * c))

    def end(new: Array) -> Array:
        return np.concatenate([q, body.rates(L + rotor + push(t + h, new))])

    return _iterate(end, np.concatenate([q, body.rates(L + rotor)]))


def _split_axes(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], axes: Sequence[int]) -> Array:
    """Return the state after rotations about principal axes, each by its part of the energy, and half a push at each end."""
    body, moments, R_BP = _Body(f), f.body.moments, f.body.R_BP
    L, new = body.momentum(y) + h / 2 * body.torque(t, y), y.copy()
    for axis, share in zip((*axes, *axes[1::-1]), (0.5, 0.5, 1.0, 0.5, 0.5), strict=True):
        direction = R_BP[:, axis]
        turn = share * h / moments[axis] * np.multiply.outer(direction, np.tensordot(direction, L - _column(body.rotor, L), 1))
        L, new[:4] = _carry(turn, L), _rotate(new[:4], turn)
    new[4:] = body.rates(L)
    new[4:] = body.rates(L + h / 2 * body.torque(t + h, new))
    return new


def _column(v: Array, like: Array) -> Array:
    return v.reshape(3, *(1,) * (like.ndim - 1))


def _newmark(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    """Return the state of Newmark's method on rotation vectors, with beta 1/4 and gamma 1/2."""
    first = f(t, y)[4:]

    def improve(new: Array) -> Array:
        last = f(t + h, new)[4:]
        turn = h * y[4:] + h * h / 4 * (first + last)
        return np.concatenate([_rotate(y[:4], turn), y[4:] + h / 2 * (first + last)])

    return _iterate(improve, y)


TURNED = " with the exponential map of weighted rates"
BARE = " without normalisation"


@dataclass(frozen=True)
class Step:
    """A method: its order, the number of earlier states, and the function to the next state, whose quaternion is normalised.

    The errors of a `recurrent` method do not add up step by step, because its new state contains differences of earlier ones.
    """

    order: int
    past: int
    next: Callable[..., Array]
    normalised: bool = True
    recurrent: bool = False


def _by_tableau(tableau: ExplicitTableau, turning: Turning | None = None) -> Step:
    """Return the method of a tableau. Sums of rates are of order 2, because rotations do not commute."""
    order = min(2, tableau.order) if turning is _rates else tableau.order
    return Step(order, 0, partial(_runge_kutta, tableau=tableau, turning=turning))


STEPS: dict[str, Step] = {
    "explicit Euler": _by_tableau(EULER),
    "explicit Euler with the exponential map": Step(1, 0, partial(_split_step, rates=1, use="old", exact=True)),
    "semi-implicit Euler with an explicit gyroscopic term": Step(1, 0, partial(_split_step, rates=1, use="new", exact=False)),
    "semi-implicit Euler with an explicit gyroscopic term and the exponential map": Step(
        1, 0, partial(_split_step, rates=1, use="new", exact=True)
    ),
    "semi-implicit Euler with an implicit gyroscopic term": Step(1, 0, partial(_split_step, rates=40, use="new", exact=False)),
    "semi-implicit Euler with an implicit gyroscopic term and the exponential map": Step(
        1, 0, partial(_split_step, rates=40, use="new", exact=True)
    ),
    "explicit Euler of the rates, and mean rates for the attitude": Step(
        1, 0, partial(_split_step, rates=1, use="mean", exact=True)
    ),
    "implicit Euler": Step(1, 0, partial(_implicit, at=1.0)),
    "the explicit midpoint rule (RK2)": _by_tableau(MIDPOINT),
    "Heun's method": _by_tableau(HEUN),
    "Ralston's method": _by_tableau(RALSTON),
    "the implicit midpoint rule": Step(2, 0, partial(_implicit, at=0.5)),
    "the trapezoidal rule": Step(2, 0, _trapezoid),
    "leapfrog (velocity Verlet)": Step(2, 0, _leapfrog),
    "Störmer's method on the quaternion": Step(2, 1, _stormer, recurrent=True),
    f"Störmer's method on the quaternion{BARE}": Step(2, 1, _stormer, normalised=False, recurrent=True),
    "Adams-Bashforth 2 (first step Euler)": Step(2, 1, partial(_adams, weights=(1.5, -0.5))),
    f"Adams-Bashforth 2 (first step Euler){BARE}": Step(2, 1, partial(_adams, weights=(1.5, -0.5)), normalised=False),
    "Buss 2 (augmented)": Step(2, 0, partial(_buss, order=2)),
    "Buss 3 (augmented)": Step(3, 0, partial(_buss, order=3)),
    "Adams-Bashforth 3": Step(3, 2, partial(_adams, weights=(23 / 12, -16 / 12, 5 / 12))),
    f"Adams-Bashforth 3{BARE}": Step(3, 2, partial(_adams, weights=(23 / 12, -16 / 12, 5 / 12)), normalised=False),
    "RK3 (Kutta)": _by_tableau(KUTTA_3),
    "RK3 (Heun)": _by_tableau(HEUN_3),
    "RK3 (SSP)": _by_tableau(SHU_OSHER_3),
    "RK4": _by_tableau(RUNGE_KUTTA_4),
    f"the explicit midpoint rule (RK2){TURNED}": _by_tableau(MIDPOINT, _rates),
    f"Heun's method{TURNED}": _by_tableau(HEUN, _rates),
    f"RK4{TURNED}": _by_tableau(RUNGE_KUTTA_4, _rates),
    "RK4 on rotation vectors (Munthe-Kaas)": _by_tableau(RUNGE_KUTTA_4, _vector_rates),
    "the energy-momentum method (Krenk & Nielsen; Simo & Wong with Cayley's map)": Step(
        2, 0, partial(_mean_momentum, turn_of=_cayley)
    ),
    "the energy-momentum method with the exponential map (Simo & Wong)": Step(
        2, 0, partial(_mean_momentum, turn_of=lambda turn: turn)
    ),
    "the midpoint rule on the rotation group": Step(2, 0, _midpoint_on_group),
    "the discrete Moser-Veselov map": Step(2, 0, _moser_veselov),
    "Newmark's method on rotation vectors": Step(2, 0, _newmark),
    **{
        f"splitting into rotations about the principal axes {a}, {b}, {c}, {b}, {a}": Step(
            2, 0, partial(_split_axes, axes=(a - 1, b - 1, c - 1))
        )
        for a, b, c in permutations((1, 2, 3))
    },
}


@dataclass(frozen=True)
class Integrator(Mistake):
    """The motion by an integrator. Rates alone do not show whether it normalises quaternions."""

    kind: ClassVar[str] = "steps"
    step: Step


INTEGRATORS = tuple(
    Integrator(name, f"The rows follow {name} with a step of {{step:.4g}} s", step, numbers=(Number("step", unit="s"),))
    for name, step in STEPS.items()
)
