"""Random scenes whose loads or fields have corners and jumps in time or in attitude, and their smooth likes.

Each has its law: the torque in body axes as a function of time, attitude and rates, that shares nothing with the package. The
truth is an integration by SciPy that is restarted wherever the law is not smooth, as events find it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import conservative as cv

from ..independent import angle_between, matrix_of, quaternion_of

Shape = tuple[Callable[[float], float], tuple[float, ...]]
"""A function of one number, and the values at which it is not smooth; a period of 1 if the first is nan."""


def sine(x: float) -> float:
    """Return the sine of 2 pi x."""
    return math.sin(2 * math.pi * x)


SHAPES: dict[str, Shape] = {  # of numbers from -1 to 1
    "absolute": (abs, (0.0,)),
    "one side": (lambda x: max(0.0, x - 0.2), (0.2,)),
    "clipped": (lambda x: min(0.4, max(-0.4, 2 * x)), (-0.2, 0.2)),
    "dead band": (lambda x: x - min(0.3, max(-0.3, x)), (-0.3, 0.3)),
    "sign": (lambda x: float(np.sign(x)), (0.0,)),
    "step": (lambda x: float(x > 0.3), (0.3,)),
}
SMOOTH: dict[str, Shape] = {
    "absolute": (lambda x: math.sqrt(x * x + 0.01), ()),
    "one side": (lambda x: 0.1 * math.log1p(math.exp(10 * (x - 0.2))), ()),
    "clipped": (lambda x: 0.4 * math.tanh(5 * x), ()),
    "dead band": (lambda x: x**3, ()),
    "sign": (lambda x: math.tanh(4 * x), ()),
    "step": (lambda x: 1 / (1 + math.exp(-8 * (x - 0.3))), ()),
}


def triangle(x: float) -> float:
    """Return a triangle wave of period 1 from -1 to 1."""
    return 4 * abs(x % 1 - 0.5) - 1


def saw(x: float) -> float:
    """Return a wave of period 1 that jumps."""
    return 2 * (x % 1) - 1


KINDS = (
    *("torque of time", "torque of attitude", "torque of both", "damping of time", "damping of attitude"),
    *("push", "stick", "wave", "motor", "push in time"),
)


@dataclass(frozen=True)
class Corners:
    """A scene and its law.

    `torque` is a function of t, R_WB and w_WB_B, N m, and `rotor` of t, kg m^2/s, body axes. `bends` are functions of t and
    R_WB that are 0 where the law is not smooth; `times` are such times, s.
    """

    what: str
    scene: cv.Scene
    torque: Callable[[float, Any, Any], Any]
    rotor: Callable[[float], Any]
    bends: tuple[Callable[[float, Any], float], ...]
    times: tuple[float, ...] = ()


def draw(seed: int, smooth: bool = False) -> Corners:  # noqa: PLR0912, PLR0915  # a case for each kind
    """Return a random scene of the kind of its seed."""
    g, kind = np.random.default_rng((50, seed)), KINDS[seed % len(KINDS)]
    shapes = SMOOTH if smooth else SHAPES
    name = list(shapes)[g.integers(len(shapes))]
    p = g.exponential(size=3) + 0.05
    A = matrix_of(g.normal(size=4))
    J = A @ np.diag([p[1] + p[2], p[0] + p[2], p[0] + p[1]]) @ A.T
    J = (J + J.T) / 2
    R0, w, t_end = matrix_of(g.normal(size=4)), g.normal(size=3), float(g.uniform(4, 12))
    size, direction, point = g.normal(size=3) * g.uniform(0.2, 2), *(g.normal(size=(2, 3)))
    direction, point = direction / np.linalg.norm(direction), point / np.linalg.norm(point)
    rate, phase = float(g.uniform(0.1, 1.2)), float(g.uniform(0, 1))
    if kind in ("motor", "push", "push in time") and name in ("sign", "step"):
        name = "absolute"
    f, values = shapes[name]
    zero = np.zeros(3)
    rotor: Callable[[float], Any] = lambda t: zero  # noqa: E731
    bends: tuple[Any, ...] = ()
    times: tuple[float, ...] = ()
    options: dict[str, Any] = {}
    of_time, along = (lambda t: sine(rate * t + phase)), (lambda R: float(direction @ R @ point))
    if kind == "torque of time":
        bends = tuple(lambda t, R, v=v: of_time(t) - v for v in values)
        force = lambda t, R, w: size * f(of_time(t))  # noqa: E731
        options["torque"] = cv.Torque(lambda t: size * f(of_time(t)))
    elif kind == "torque of attitude":
        bends = tuple(lambda t, R, v=v: along(R) - v for v in values)
        force = lambda t, R, w: size * f(along(R))  # noqa: E731
        options["torque"] = cv.Torque(lambda t, R: size * f(along(R)))
    elif kind == "torque of both":
        turned = lambda t: np.array([math.cos(t), math.sin(t), 0.5]) / 1.2  # noqa: E731
        bends = tuple(lambda t, R, v=v: float(turned(t) @ R @ point) - v for v in values)
        force = lambda t, R, w: np.cross(size * f(float(turned(t) @ R @ point)), turned(t) @ R)  # noqa: E731
        options["torque"] = cv.Torque(lambda t, R: force(t, R, None))
    elif kind == "damping of time":
        bends = tuple(lambda t, R, v=v: of_time(t) - v for v in values)
        low = min(f(x) for x in np.linspace(-1, 1, 201))
        force = lambda t, R, w: -(f(of_time(t)) - low + 0.05) * (0.3 * w)  # noqa: E731
        options["damping"] = cv.Damping(0.3 * np.eye(3), lambda t: f(of_time(t)) - low + 0.05)
    elif kind == "damping of attitude":
        bends = tuple(lambda t, R, v=v: along(R) - v for v in values)
        low = min(f(x) for x in np.linspace(-1, 1, 201))
        D = 0.3 * np.diag([1.0, 0.5, 0.2])
        force = lambda t, R, w: -(f(along(R)) - low + 0.05) * (D @ w)  # noqa: E731
        options["damping"] = cv.Damping(lambda t, R: (f(along(R)) - low + 0.05) * D)
    elif kind in ("push", "push in time"):
        # V = k/2 u(x)^2 with u one-sided or a dead band: the force has corners. Smooth: V = k x^4 / 4.
        k, d = 10 ** float(g.uniform(0, 1.5)), float(g.uniform(-0.3, 0.6))
        both = bool(g.integers(2))
        d = abs(d) if both else d
        gain = (lambda t: 1 + 0.5 * math.sin(rate * t)) if kind == "push in time" else (lambda t: 1.0)

        def reach(x: float) -> float:
            return x - min(d, max(-d, x)) if both else max(0.0, x - d)

        def energy(R: Any, *t: float) -> float:
            x = along(R)
            return float(k * gain(*(t or (0.0,))) * (x**4 / 4 if smooth else reach(x) ** 2 / 2))

        def gradient(R: Any, *t: float) -> Any:
            x = along(R)
            return k * gain(*(t or (0.0,))) * (x**3 if smooth else reach(x)) * np.outer(direction, point)

        bends = () if smooth else tuple(lambda t, R, v=v: along(R) - v for v in ((-d, d) if both else (d,)))
        force = lambda t, R, w: -k * gain(t) * (along(R) ** 3 if smooth else reach(along(R))) * np.cross(point, direction @ R)  # noqa: E731
        options["potential"] = cv.FunctionPotential(energy, gradient, scale=k, time_dependent=kind == "push in time")
    elif kind == "stick":
        n = int(g.integers(5, 60))
        at, row = np.linspace(0, t_end, n), g.normal(size=n)
        if smooth:
            force = lambda t, R, w: size * math.sin(3 * rate * t)  # noqa: E731
        else:
            times = tuple(at[1:-1].tolist())
            force = lambda t, R, w: size * float(np.interp(t, at, row))  # noqa: E731
        options["torque"] = cv.Torque(lambda t: force(t, None, None), "body")
    elif kind == "wave":
        wave = sine if smooth else (triangle, saw)[g.integers(2)]
        if not smooth:
            half = np.arange(-2, 2 * rate * t_end + 2) / 2
            times = tuple(x for x in ((half - phase) / rate).tolist() if 0 < x < t_end)
        force = lambda t, R, w: size * wave(rate * t + phase)  # noqa: E731
        options["torque"] = cv.Torque(lambda t: size * wave(rate * t + phase))
    else:  # a motor
        bends = tuple(lambda t, R, v=v: of_time(t) - v for v in values)
        rotor = lambda t: size * f(of_time(t))  # noqa: E731
        force = lambda t, R, w: zero  # noqa: E731
    body = cv.RigidBody(J, rotor_momentum=rotor) if kind == "motor" else cv.RigidBody(J)
    scene = cv.Scene(kind, body, R0, w, t_end, **options)
    return Corners(f"{kind}, {name}", scene, force, rotor, bends, times)


def integrate(case: Corners, t: Any, rtol: float, least: int) -> Any:
    """Return attitudes (n, 3, 3) at times (n,), s, with so many steps at least; restarted at times and bends."""
    J = np.asarray(case.scene.body.inertia)
    K = np.linalg.inv(J)

    def slope(t: float, y: Any) -> Any:
        R = matrix_of(y[:4])
        w = K @ (y[4:] - case.rotor(t))
        a, b, c, d = y[:4]
        x, u, v = w / 2
        turned = (-b * x - c * u - d * v, a * x + c * v - d * u, a * u + d * x - b * v, a * v + b * u - c * x)
        return np.concatenate([turned, np.cross(y[4:], w) + case.torque(t, R, w)])

    def event(bend: Any) -> Any:
        found = lambda t, y: bend(t, matrix_of(y[:4]))  # noqa: E731
        found.terminal = True
        return found

    end, events = float(t[-1]), [event(each) for each in case.bends]
    y = np.concatenate([quaternion_of(case.scene.R_WB0), J @ case.scene.w_WB_B0 + case.rotor(0.0)])
    stops, states = sorted({0.0, end, *np.asarray(t).tolist(), *case.times}), {0.0: y}
    for first, last in pairwise(stops):
        now = first
        while now < last:
            # The side of a jump is the state's: a short step leaves the corner behind, whose error is of its length squared.
            found = solve_ivp(
                slope, (now, last), y, "DOP853", rtol=rtol, atol=rtol, max_step=end / least, events=events or None
            )
            assert found.status >= 0, found.message
            y, now = found.y[:, -1], float(found.t[-1])
            if found.status == 1 and now < last:
                h = min(1e-7, last - now)
                y = y + h * slope(now + h / 2, y + h / 2 * slope(now + h / 2, y))
                now += h
        states[last] = y
    return np.array([matrix_of(states[each][:4]) for each in np.asarray(t).tolist()])


def truth_of(case: Corners, t: Any) -> tuple[Any, float]:
    """Return attitudes at times (n,), s, the first 0, and their uncertainty, rad: the difference of two integrations."""
    first, second = integrate(case, t, 1e-12, 400), integrate(case, t, 1e-11, 330)
    return first, float(angle_between(first, second).max())
