"""Mistakes that are planted: what a program or a recorder does instead. Names are those that the answer should have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from . import motion
from .motion import (
    ADAMS,
    BUSS,
    IMPLICIT,
    LEAPFROG,
    NONE,
    RUNGE_KUTTA,
    SPLIT,
    STORMER,
    TABLEAUX,
    TRAPEZOID,
)
from .worlds import Draw, World, is_table, scaled

# The scene and the equations: another world. `None` is a world that does not have the part.


def diagonal(J: Any) -> Any:
    return np.diag(np.diag(J))


def has_products(world: World) -> bool:
    return bool(np.abs(world.J - diagonal(world.J)).max() > 1e-9 * np.abs(world.J).max())


def part(name: str, change: Callable[[World, Draw], World]) -> Callable[[World, Draw], World | None]:
    """Return a change of worlds that have a part."""
    return lambda world, draw: change(world, draw) if getattr(world, name) is not None else None


def motor(change: Callable[[World], World]) -> Callable[[World, Draw], World | None]:
    return lambda world, draw: change(world) if is_table(world.wheel) else None


def factor(draw: Draw) -> float:
    """Return a factor that is not 1: by a third at most, and at least as the digits of a scene file."""
    return 1 + draw.sign() * draw.between(1e-5, 0.3)


def quadrant(given: World) -> float:
    """Return the sign that keeps an inertia positive if its products change theirs: 0 if there is none."""
    return float(np.linalg.eigvalsh(2 * diagonal(given.J) - given.J)[0] > 0)


def other_moments(world: World, draw: Draw) -> World:
    moments, axes = np.linalg.eigh(world.J)
    moments = moments * (1 + draw.between(1e-3, 0.1) * draw.random.uniform(-1, 1, size=3))
    return world.with_inertia(axes @ np.diag(moments) @ axes.T)


def another_body(world: World, draw: Draw) -> World:
    half = np.eye(3) + draw.between(1e-3, 0.1) * draw.random.normal(size=(3, 3))
    return world.with_inertia(half @ world.J @ half.T)


def inverted(world: World, draw: Draw) -> World | None:
    return world.but(J=np.linalg.inv(world.J)) if world.wheel is None else None


def start_tensor(world: World) -> Any:
    R = motion.spin(np.tile(world.q0, (3, 1)), np.eye(3)).T
    return R @ world.J @ R.T


SCENES: dict[str, Callable[[World, Draw], World | None]] = {
    "without the rotor": part("wheel", lambda world, draw: world.but(wheel=None)),
    "without the torque": part("torque", lambda world, draw: world.but(torque=None)),
    "without the damping": part("damping", lambda world, draw: world.but(damping=None)),
    "without the field": part("field", lambda world, draw: world.but(field=None, orbit=None)),
    "sign of the rotor": part("wheel", lambda world, draw: world.but(wheel=scaled(world.wheel, -1.0))),
    "sign of the torque": part("torque", lambda world, draw: world.but(torque=scaled(world.torque, -1.0))),
    "sign of the damping": part("damping", lambda world, draw: world.but(damping=-world.damping)),
    "sign of the field": part("field", lambda world, draw: world.but(pull=-1.0)),
    "size of the rotor": part("wheel", lambda world, draw: world.but(wheel=scaled(world.wheel, factor(draw)))),
    "size of the torque": part("torque", lambda world, draw: world.but(torque=scaled(world.torque, factor(draw)))),
    "size of the damping": part("damping", lambda world, draw: world.but(damping=world.damping * factor(draw))),
    "size of the field": part("field", lambda world, draw: world.but(pull=factor(draw))),
    "axes of the torque": part("torque", lambda world, draw: world.but(axes="body" if world.axes == "world" else "world")),
    "turning of the field": part("orbit", lambda world, draw: world.but(orbit=None)),
    "rate of the orbit": part("orbit", lambda world, draw: other_orbit(world, factor(draw))),
    "no reaction of the motor": motor(lambda world: world.but(reaction=0.0)),
    "sign of the reaction of the motor": motor(lambda world: world.but(reaction=-1.0)),
    "no products of inertia": lambda world, draw: world.with_inertia(diagonal(world.J)) if has_products(world) else None,
    "sign of the products of inertia": lambda world, draw: (
        world.with_inertia(2 * diagonal(world.J) - world.J) if has_products(world) and quadrant(world) else None
    ),
    "inverted inertia": inverted,
    "other moments": other_moments,
    "another body": another_body,
    "no gyroscopic term": lambda world, draw: world.but(gyroscopic=0.0),
    "sign of the gyroscopic term": lambda world, draw: world.but(gyroscopic=-1.0),
    "inertia of the start": lambda world, draw: world.but(fixed=start_tensor(world)),
    "inertia in world axes": lambda world, draw: world.but(fixed=world.J),
    "damping": lambda world, draw: world.but(drag=draw.between(1e-4, 0.03) * float(np.linalg.norm(world.w0))),
    "wrong side": lambda world, draw: world.but(side=True),
    "factor one half": lambda world, draw: world.but(speed=2.0),
    "speed of attitudes": lambda world, draw: world.but(speed=draw.pick((0.5, factor(draw), factor(draw)))),
}
"""Scenes and equations."""
NEEDS = {
    "rotor": "wheel", "torque": "torque", "damping": "damping", "field": "field", "turning of the field": "orbit",
    "rate of the orbit": "orbit", "motor": "motor",
}  # fmt: skip
ATTITUDES_ALONE = ("wrong side", "factor one half", "speed of attitudes")
"""Equations that only attitudes show, unless the motion depends on the attitude."""


def other_orbit(world: World, by: float) -> World:
    """Return the world with another rate of the orbit, which is also the rate of a gravity gradient."""
    rate, normal = world.orbit
    if world.field[0] == "gradient":
        return world.but(orbit=(rate * by, normal), field=("gradient", world.field[1] * by, *world.field[2:]))
    return world.but(orbit=(rate * by, normal))


def needs(mistake: str) -> str:
    """Return the part of a world that a mistake needs, "" if every world will do."""
    if mistake in ("damping",):
        return ""
    return next((needed for word, needed in reversed(NEEDS.items()) if word in mistake and mistake in SCENES), "")


# Steps: family, tableau, number, exponential map

ONE, HALF = (np.zeros((1, 1)), np.ones(1)), (np.zeros((1, 1)), np.full(1, 0.5))
GAME = "semi-implicit Euler with an {} gyroscopic term"
TURNED = " with the exponential map of weighted rates"
STEPS: dict[str, tuple[int, Any, int, bool]] = {
    "explicit Euler": (RUNGE_KUTTA, TABLEAUX["explicit Euler"], 0, False),
    "explicit Euler with the exponential map": (SPLIT, NONE, 0, True),
    GAME.format("explicit"): (SPLIT, NONE, 1, False),
    GAME.format("explicit") + " and the exponential map": (SPLIT, NONE, 1, True),
    GAME.format("implicit"): (SPLIT, NONE, 60, False),
    GAME.format("implicit") + " and the exponential map": (SPLIT, NONE, 60, True),
    "implicit Euler": (IMPLICIT, ONE, 0, False),
    "the implicit midpoint rule": (IMPLICIT, HALF, 0, False),
    "the trapezoidal rule": (TRAPEZOID, ONE, 0, False),
    "the explicit midpoint rule (RK2)": (RUNGE_KUTTA, TABLEAUX["midpoint"], 0, False),
    "Heun's method": (RUNGE_KUTTA, TABLEAUX["Heun"], 0, False),
    "Ralston's method": (RUNGE_KUTTA, TABLEAUX["Ralston"], 0, False),
    "RK3 (Kutta)": (RUNGE_KUTTA, TABLEAUX["Kutta 3"], 0, False),
    "RK3 (Heun)": (RUNGE_KUTTA, TABLEAUX["Heun 3"], 0, False),
    "RK3 (SSP)": (RUNGE_KUTTA, TABLEAUX["SSP 3"], 0, False),
    "RK4": (RUNGE_KUTTA, TABLEAUX["RK4"], 0, False),
    "the explicit midpoint rule (RK2)" + TURNED: (RUNGE_KUTTA, TABLEAUX["midpoint"], 0, True),
    "Heun's method" + TURNED: (RUNGE_KUTTA, TABLEAUX["Heun"], 0, True),
    "RK4" + TURNED: (RUNGE_KUTTA, TABLEAUX["RK4"], 0, True),
    "Adams-Bashforth 2 (first step Euler)": (ADAMS, NONE, 2, False),
    "Adams-Bashforth 3": (ADAMS, NONE, 3, False),
    "leapfrog (velocity Verlet)": (LEAPFROG, NONE, 0, False),
    "Störmer's method on the quaternion": (STORMER, NONE, 0, False),
    "Buss 2 (augmented)": (BUSS, NONE, 2, False),
    "Buss 3 (augmented)": (BUSS, NONE, 3, False),
}


def march(world: World, name: str, n: int, gap: float, parts: int, normalise: bool = True, single: bool = False) -> Any:
    """Return states (n, 7) by a textbook method with `parts` steps between two rows that are `gap` s apart."""
    family, (A, b), number, flag = STEPS[name]
    with np.errstate(all="ignore"):
        return motion.march(
            world.start, gap / parts, (n - 1) * parts, parts, family, A, b, number, flag, normalise, single, world.given
        )


# Attitudes that are not the integral of right rates: the quaternion of a step from rates at its start and end


def first(q: Any, v: Any) -> Any:
    return q + motion.times(q, np.append(0.0, v)) / 2


def in_place(q: Any, v: Any) -> Any:
    (a, b, c, d), (x, y, z) = q, v / 2
    a -= b * x + c * y + d * z
    b += a * x + c * z - d * y
    c += a * y - b * z + d * x
    return np.array([a, b, c, d + a * z + b * y - c * x])


ATTITUDES: dict[str, Callable[[Any, Any, Any, float], Any]] = {
    "attitude by normalisation, old rates": lambda q, a, b, h: first(q, a * h),
    "attitude by normalisation": lambda q, a, b, h: first(q, b * h),
    "attitude by normalisation, mean rates": lambda q, a, b, h: first(q, (a + b) / 2 * h),
    "stale rates": lambda q, a, b, h: motion.times(q, motion.turn(a * h)),
    "attitude by rotation, new rates": lambda q, a, b, h: motion.times(q, motion.turn(b * h)),
    "attitude by rotation, mean rates": lambda q, a, b, h: motion.times(q, motion.turn((a + b) / 2 * h)),
    "attitude in place, old rates": lambda q, a, b, h: in_place(q, a * h),
    "stale rates on the wrong side": lambda q, a, b, h: motion.times(motion.turn(a * h), q),
    "attitude by rotation, mean rates on the wrong side": lambda q, a, b, h: motion.times(motion.turn((a + b) / 2 * h), q),
    "attitude by normalisation, old rates on the wrong side": lambda q, a, b, h: q + motion.times(np.append(0.0, a * h), q) / 2,
}


def integrate(rule: Any, q: Any, w: Any, h: float, parts: int) -> Any:
    """Return attitudes (n, 4) by a rule, at every `parts`-th of the rates."""
    rows = [q]
    for i in range(len(w) - 1):
        q = rule(q, w[i], w[i + 1], h)
        q = q / np.sqrt(q @ q)
        rows += [q] * ((i + 1) % parts == 0)
    return np.array(rows)


# Readings: what is written instead of right attitudes and rates


def turned(q: Any, w: Any, c: Any) -> tuple[Any, Any]:
    return q, motion.spin(np.broadcast_to(c, q.shape), w)


READINGS: dict[str, Callable[[Any, Any, Any, Draw], tuple[Any, Any]]] = {
    "transposed": lambda q, w, t, draw: (motion.back(q), w),
    "order xyzw": lambda q, w, t, draw: (np.roll(q, -1, axis=1), w),
    "order wxyz": lambda q, w, t, draw: (np.roll(q, 1, axis=1), w),
    "world rates": lambda q, w, t, draw: (q, motion.spin(q, w)),
    "body rates": lambda q, w, t, draw: (q, motion.spin(motion.back(q), w)),
    "rates in degrees": lambda q, w, t, draw: (q, np.degrees(w)),
    "rates in radians": lambda q, w, t, draw: (q, np.radians(w)),
    "reversed rates": lambda q, w, t, draw: (q, -w),
    "size of the rates": lambda q, w, t, draw: (q, factor(draw) * w),
    "bias of the rates": lambda q, w, t, draw: (
        q, w + draw.vector(draw.between(1e-3, 0.1)) * np.linalg.norm(w, axis=1).max()
    ),
    "rates in turned axes": lambda q, w, t, draw: (
        turned(q, w, motion.turn(draw.vector(draw.between(0.01, 2)))) if draw.chance(0.6) else (q, w[:, [1, 0, 2]] * [1, 1, -1])
    ),
    "rates in mirrored axes": lambda q, w, t, draw: (q, w * [1, 1, -1] if draw.chance(0.5) else w[:, [1, 0, 2]]),
    "body axes": lambda q, w, t, draw: axes_of_body(q, w, motion.turn(draw.vector(draw.between(0.01, 1.5)))),
}  # fmt: skip
BOTH = (
    "world rates", "body rates", "reversed rates", "size of the rates", "bias of the rates", "rates in turned axes",
    "rates in mirrored axes", "transposed", "rates in degrees", "rates in radians",
)  # fmt: skip
"""Readings that attitudes and rates show together."""


def slow(t: Any, w: Any, draw: Draw) -> Any:
    """Return the rate of a drift (3,), rad/s, which turns attitudes by a radian or so, or less."""
    fastest = float(np.linalg.norm(w, axis=1).max())
    return draw.vector(min(draw.between(1e-4, 0.1), 3 / (fastest * float(t[-1] - t[0]))) * fastest)


DRIFTS: dict[str, Callable[[World, Any, Any, Any], Any]] = {
    "drift in body axes": lambda world, t, Y, d: motion.times(Y[:, :4], motion.turn(np.outer(t - t[0], d))),
    "drift in world axes": lambda world, t, Y, d: motion.times(motion.turn(np.outer(t - t[0], d)), Y[:, :4]),
    "heading drift": lambda world, t, Y, d: motion.times(motion.turn(np.outer(t - t[0], d * [0, 0, 1])), Y[:, :4]),
    "drift of a bias": lambda world, t, Y, d: biased(world, t, Y[0], d),
}
"""Attitudes that drift at a rate d, rad/s, against right rates."""
FINE = 8
"""Steps between two rows of the drift of a bias."""


def biased(world: World, t: Any, y0: Any, d: Any) -> Any:
    """Return the attitudes r q with q' = q (0, w) / 2 and r' = r (0, R d) / 2, so that (r q)' = r q (0, w + d) / 2."""
    at = np.append((t[:-1, None] + np.diff(t)[:, None] * np.arange(2 * FINE) / (2 * FINE)).ravel(), t[-1])
    q = world.solve(at, y0, t[0])[:, :4]
    rate = motion.spin(q, np.broadcast_to(d, (len(q), 3))) / 2
    rate = np.hstack([np.zeros((len(q), 1)), rate])
    r, out = np.array([1.0, 0, 0, 0]), [q[0]]
    for i in range(0, len(at) - 1, 2):
        h = at[i + 2] - at[i]
        a = motion.times(r, rate[i])
        b = motion.times(r + h / 2 * a, rate[i + 1])
        c = motion.times(r + h / 2 * b, rate[i + 1])
        r = r + h / 6 * (a + 2 * b + 2 * c + motion.times(r + h * c, rate[i + 2]))
        out += [motion.times(r, q[i + 2])] * ((i + 2) % (2 * FINE) == 0)
    return np.array(out)


def axes_of_body(q: Any, w: Any, c: Any) -> tuple[Any, Any]:
    return motion.times(q, np.broadcast_to(c, q.shape)), motion.spin(np.broadcast_to(motion.back(c), q.shape), w)


TIMES = ("time shift", "time scale", "time in ms", "jittered times", "dropped rows", "rates at other times")
HABITS = ("rate limit", "rate limit per component", "dead band", "sleep", "halt", "frozen motion")
SAMPLES = {
    "held samples": ("held", "held"),
    "held attitudes": ("held", ""),
    "held rates": ("", "held"),
    "interpolated rates": ("", "line"),
    "interpolated quaternions and interpolated rates": ("line", "line"),
    "attitudes by slerp and interpolated rates": ("slerp", "line"),
    "attitudes by slerp": ("slerp", ""),
}
"""What a recorder makes of attitudes and rates between right samples."""
ROWS = (*SAMPLES, "held rows", "single rows", "first row", "transposed in some rows")
PAIR = "two mistakes"
NUMBERS = {
    **dict.fromkeys([name for name in SCENES if name.startswith("size of")], 1),
    **dict.fromkeys(("rate of the orbit", "damping", "speed of attitudes", "size of the rates", "time shift", "time scale"), 1),
    **dict.fromkeys((*STEPS, *ATTITUDES), 1),
    **dict.fromkeys(("bias of the rates", "rates in turned axes", "rates in mirrored axes", "body axes"), 3),
    **dict.fromkeys(("drift in body axes", "drift in world axes", "drift of a bias"), 3),
    **dict.fromkeys(("rates at other times", "rate limit", "rate limit per component", "dead band", "sleep", "halt"), 1),
    **dict.fromkeys((*SAMPLES, "held rows", "transposed in some rows"), 2),
    "other moments": 3, "another body": 6, "jittered times": 99, "dropped rows": 4, "single rows": 3,
    "heading drift": 1,
}  # fmt: skip
"""Fitted numbers of a mistake, beside the initial state; 0 if it is not here."""


def shift_times(draw: Draw, name: str, world: World, t: Any, gap: float) -> Any:
    """Return the right states at other times than the file says."""
    n = len(t)
    if name == "rates at other times":
        late = gap * (0.5 if draw.chance(0.5) else draw.between(0.02, 1.5)) * draw.sign()
        at = np.maximum(t - late, 0.0)
        both = world.solve(np.unique(np.concatenate([t, at])))
        order = np.unique(np.concatenate([t, at]))
        return np.hstack([both[np.searchsorted(order, t), :4], both[np.searchsorted(order, at), 4:]])
    at = {
        "time shift": lambda: np.append(0.0, t[1:] + gap * draw.between(0.05, 3)),
        "time scale": lambda: t * (1 + draw.sign() * draw.between(1e-4, 0.03)),
        "jittered times": lambda: np.append(
            0.0, t[1:] + gap * draw.between(0.02, 0.2) * np.clip(draw.random.normal(size=n - 1), -2, 2)
        ),
        "dropped rows": lambda: t + gap * np.cumsum(np.bincount(draw.random.integers(n // 8 + 1, n, size=3), minlength=n)),
    }[name]()
    return world.solve(at)


def habit(draw: Draw, name: str, world: World, n: int, gap: float, parts: int) -> Any:
    """Return the states (n, 7) of a program that is exact between its steps, and changes each new state."""
    t = gap * np.arange(n)
    exact = world.solve(t)
    if name in ("sleep", "halt", "frozen motion"):
        at = 0 if name == "frozen motion" else int(draw.random.integers(n // 5 + 1, max(4 * n // 5, n // 5 + 2)))
        rows = exact.copy()
        rows[at:] = exact[at]
        if name == "sleep":
            rows[at + 1 :, 4:] = 0.0
        return rows
    size = np.linalg.norm(exact[:, 4:], axis=1) if name == "rate limit" else np.abs(exact[:, 4:]).max(axis=1)
    most = float(f"{np.quantile(size, draw.random.uniform(0.4, 0.9)):.2g}")
    band = float(f"{np.abs(exact[:, 4:]).max() * draw.between(0.01, 0.1):.2g}")
    y, rows, h = world.start, [world.start], gap / parts
    for i in range((n - 1) * parts):
        y = world.solve(np.array([(i + 1) * h]), y, i * h)[0]
        w = y[4:]
        if name == "rate limit":
            w = w * min(1.0, most / max(float(np.linalg.norm(w)), 1e-300))
        elif name == "rate limit per component":
            w = np.clip(w, -most, most)
        else:
            w = np.where(np.abs(w) < band, 0.0, w)
        y = np.append(y[:4], w)
        rows += [y] * ((i + 1) % parts == 0)
    return np.array(rows)


def change_rows(draw: Draw, name: str, Y: Any, scale: float) -> Any:
    """Return the rows of a recorder that changes right ones."""
    n, Y = len(Y), Y.copy()
    if name in SAMPLES:
        return resampled(Y, int(draw.random.integers(2, 9)), *SAMPLES[name])
    if name == "held rows":
        m = int(draw.random.integers(2, 9))
        Y[m::m] = Y[m - 1 : n - 1 : m]
        return Y
    if name == "first row":
        Y[0] = np.append(motion.times(Y[0, :4], motion.turn(draw.vector(0.1))), Y[0, 4:] + 0.1 * scale * draw.vector())
        return Y
    if name == "transposed in some rows":
        m = int(draw.random.integers(2, 5))
        Y[m::m, :4] = motion.back(Y[m::m, :4])
        return Y
    for row in draw.random.choice(np.arange(n // 4, n), size=int(draw.random.integers(1, 4)), replace=False):
        Y[row, 4:] += scale * draw.vector(draw.between(0.1, 10))
        Y[row, :4] = motion.times(Y[row, :4], motion.turn(draw.vector(draw.random.uniform(0.1, 2))))
    return Y


def resampled(Y: Any, m: int, attitudes: str, rates: str) -> Any:
    """Return rows of a recorder that has every m-th of them, up to the last one that it has."""
    Y = Y[: (len(Y) - 1) // m * m + 1].copy()
    Y[:, :4] *= np.cumprod(np.append(1.0, np.where((Y[1:, :4] * Y[:-1, :4]).sum(axis=1) < 0, -1.0, 1.0)))[:, None]
    a = np.arange(len(Y)) // m * m
    b, share = np.minimum(a + m, len(Y) - 1), ((np.arange(len(Y)) - a) / m)[:, None]
    out, line = Y.copy(), Y[a] + share * (Y[b] - Y[a])
    if attitudes:
        turn = motion.turn(share * motion.vector(motion.times(motion.back(Y[a, :4]), Y[b, :4])))
        out[:, :4] = {"held": Y[a, :4], "line": line[:, :4], "slerp": motion.times(Y[a, :4], turn)}[attitudes]
    if rates:
        out[:, 4:] = {"held": Y[a, 4:], "line": line[:, 4:]}[rates]
    return out
