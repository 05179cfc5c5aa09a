"""Steps: an integrator makes the motion, with a step that is too long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
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
