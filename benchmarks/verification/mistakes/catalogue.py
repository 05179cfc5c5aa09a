"""Mistakes that simulators and their files have: for each a sentence, and a function that makes the motion or reading with it.

Every table maps a name to a sentence about the file, and a short function:

READINGS    attitudes and rates of the file to those that were meant
SCENES      the scene to the one that was simulated, or None if it does not differ in kind
EQUATIONS   the scene to other equations of motion
FITTED      the same, with numbers that are fitted to the file
STEPS       a method: the state after a step, and its order
ATTITUDES   rules that integrate attitudes from rates: matrices (n, 4, 4) that act on
            quaternions, or (n, 3, 3) that multiply rotation matrices

They know nothing of files, fits and verdicts, and can be planted into an integrator as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, combinations
from typing import Any

import numpy as np

from conservative.attitude import Array, from_quaternion, hat, to_quaternion
from conservative.body import RigidBody
from conservative.check import replace_unchecked
from conservative.needs import join
from conservative.potentials.load import FRAMES
from conservative.potentials.turning import Turning, static_part
from conservative.scene import Scene

from ..solution import Equations, States, cross

Reading = Callable[[Array | None, Array | None], States]
Slope = Any
"""The derivative of states (7, ...) at a time or times, s, with an attribute `body`, and `rates` of times and states."""


def _attitude(change: Callable[[Array], Array]) -> Reading:
    return lambda R, w: (None if R is None else change(R), w)


def _rates(change: Callable[[Array], Array]) -> Reading:
    return lambda R, w: (R, None if w is None else change(w))


def _to_body(R: Array | None, w: Array | None) -> States:
    return R, None if w is None or R is None else (w[:, None] @ R)[:, 0]


def _rolled(by: int) -> Reading:
    return _attitude(lambda R: from_quaternion(np.roll(to_quaternion(R), by, axis=1)))


READINGS: dict[str, tuple[str, Reading]] = {
    "transposed": (
        "The attitudes are transposed, or the quaternions conjugated: they map world to body",
        _attitude(lambda R: np.swapaxes(R, 1, 2)),
    ),
    "order xyzw": (
        "The quaternions are in the order xyzw, but were read as wxyz: --quaternion, or the names of the columns",
        _rolled(1),
    ),
    "order wxyz": (
        "The quaternions are in the order wxyz, but were read as xyzw: --quaternion, or the names of the columns",
        _rolled(-1),
    ),
    "world rates": ("The rates are in world axes; --rates world converts them", _to_body),
    "rates in degrees": ("The rates are in deg/s, but were read in rad/s", _rates(lambda w: w * (np.pi / 180))),
    "rates in radians": ("The rates are in rad/s, but were read in deg/s", _rates(lambda w: w * (180 / np.pi))),
    "reversed rates": ("The rates have the other sign", _rates(lambda w: -w)),
}
QUATERNION = ("order xyzw", "order wxyz")
"""Readings of files with quaternions only."""


def _changed(scene: Scene, **changes: Any) -> Scene | None:
    other = scene.rename(scene.name, **changes)
    return None if other.key == scene.key else other


def with_inertia(scene: Scene, inertia: Array) -> Scene | None:
    """Return the scene with another inertia, also in a field that depends on it; None for one that is no inertia."""
    if np.linalg.eigvalsh(inertia)[0] <= 0:
        return None
    field, fixed = scene.potential, static_part(scene.potential)
    if hasattr(fixed, "inertia"):
        other: Any = replace(fixed, inertia=inertia)
        field = replace(field, potential=other) if isinstance(field, Turning) else other
    return _changed(scene, body=replace(scene.body, inertia=inertia), potential=field)


def _rotor(scene: Scene, sign: float) -> RigidBody:
    body = scene.body
    return replace(body, rotor_momentum=sign * body.momentum(np.zeros(3)), motor=body.motor and body.motor.in_units(sign, 1.0))


def _turn_torque(scene: Scene) -> Scene | None:
    torque = scene.torque
    return (
        None if torque is None else _changed(scene, torque=replace_unchecked(torque, frame=FRAMES[torque.frame == FRAMES[0]]))
    )


PARTS: dict[str, Callable[[Scene], dict[str, Any]]] = {
    "the rotor": lambda scene: {"body": RigidBody(scene.body.inertia)},
    "the torque": lambda scene: {"torque": None},
    "the damping": lambda scene: {"damping": None},
    "the field": lambda scene: {"potential": None},
}
SCENES: dict[str, tuple[str, Callable[[Scene], Scene | None]]] = {
    f"without {join(names)}": (
        f"It is the motion without {join(names)}",
        lambda scene, names=names: without(scene, names),
    )
    for names in chain.from_iterable(combinations(PARTS, n + 1) for n in range(4))
} | {
    "sign of the rotor": (
        "The momentum of the rotor has the other sign",
        lambda scene: _changed(scene, body=_rotor(scene, -1.0)),
    ),
    "turning of the field": ("The field does not turn", lambda scene: _changed(scene, potential=static_part(scene.potential))),
    "sign of the torque": (
        "The torque has the other sign",
        lambda scene: None if scene.torque is None else _changed(scene, torque=scene.torque.in_units(-1.0, 1.0)),
    ),
    "axes of the torque": (
        "The components of the torque are taken in the other axes, world instead of body or the reverse",
        _turn_torque,
    ),
    "no products of inertia": (
        "The products of inertia are dropped",
        lambda scene: with_inertia(scene, np.diag(np.diag(scene.body.inertia))),
    ),
    "sign of the products of inertia": (
        "The products of inertia have the other sign",
        lambda scene: with_inertia(scene, 2 * np.diag(np.diag(scene.body.inertia)) - scene.body.inertia),
    ),
}


def without(scene: Scene, names: Sequence[str]) -> Scene | None:
    """Return the scene without parts; None if it does not have all of them."""
    for name in names:
        other = _changed(scene, **PARTS[name](scene))
        if other is None:
            return None
        scene = other
    return scene


NO_TERM = "The gyroscopic term is missing: without a torque the angular velocity is constant"
EQUATIONS: dict[str, tuple[str, Callable[[Scene], Equations]]] = {
    "no gyroscopic term": (NO_TERM, lambda scene: Equations(scene, gyroscopic=0.0)),
    "sign of the field": ("The torque of the field has the other sign", lambda scene: Equations(scene, field=-1.0)),
    "sign of the gyroscopic term": ("The gyroscopic term has the other sign", lambda scene: Equations(scene, gyroscopic=-1.0)),
    "inertia of the start": (
        "The inertia does not turn with the body: it keeps the world components of the start",
        lambda scene: Equations(scene, fixed=scene.R_WB0 @ scene.body.inertia @ scene.R_WB0.T),
    ),
    "inertia in world axes": (
        "The inertia does not turn with the body: its body components are used in world axes",
        lambda scene: Equations(scene, fixed=scene.body.inertia),
    ),
}


def _rotate(q: Array, turn: Array) -> Array:
    """Return quaternions (4, ...) turned by rotation vectors (3, ...) in body axes."""
    angle = np.sqrt((turn * turn).sum(axis=0))
    part = np.concatenate([np.cos(angle / 2)[None], np.sinc(angle / (2 * np.pi)) * turn / 2])
    return _product(q, part)


def _product(p: Array, q: Array) -> Array:
    a, v, b, u = p[0], p[1:], q[0], q[1:]
    return np.concatenate([(a * b - (v * u).sum(axis=0))[None], a * u + b * v + cross(v, u)])


def _split_step(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], rates: int, use: str, exact: bool) -> Array:
    """Return the state after rates with so many corrections of their torque, then attitudes by old, new or mean rates."""
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


def _tableau(
    f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], A: Sequence[Sequence[float]], b: Sequence[float]
) -> Array:
    slopes: list[Array] = []
    for row in ((), *A):
        slopes.append(f(t + h * sum(row), y + h * sum((a * k for a, k in zip(row, slopes, strict=True)), np.zeros_like(y))))
    return y + h * sum((weight * k for weight, k in zip(b, slopes, strict=True)), np.zeros_like(y))


def _turned_tableau(
    f: Slope,
    t: Any,
    y: Array,
    h: float,
    past: Sequence[Array],
    A: Sequence[Sequence[float]],
    b: Sequence[float],
    corrected: bool,
) -> Array:
    """Return the state of a Runge-Kutta method whose stages turn the body by sums of rates, or of those of rotation vectors."""
    slopes, turns = list[Array](), list[Array]()

    def state(weights: Sequence[float]) -> tuple[Array, Array]:
        new = y + h * sum((a * k for a, k in zip(weights, slopes, strict=True)), np.zeros_like(y))
        turn = h * sum((a * w for a, w in zip(weights, turns, strict=True)), np.zeros_like(y[4:]))
        new[:4] = _rotate(y[:4], turn)
        return new, turn

    for row in ((), *A):
        (stage, turn), at = state(row), t + h * sum(row)
        slopes.append(f(at, stage))
        w = f.rates(at, stage)
        turns.append(_vector_rates(turn, w) if corrected else w)
    return state(b)[0]


def _vector_rates(turn: Array, w: Array) -> Array:
    """Return the derivatives of rotation vectors (3, ...) for rates in body axes."""
    angle = np.sqrt((turn * turn).sum(axis=0))
    small = angle < 1e-2
    half = np.where(small, 1.0, angle / 2)
    factor = np.where(small, 1 / 12 + angle**2 / 720, (1 - half / np.tan(half)) / np.where(small, 1.0, angle**2))
    across = cross(turn, w)
    return w + across / 2 + factor * cross(turn, across)


def _implicit(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], at: float) -> Array:
    """Return the state of implicit Euler (at = 1) or of the implicit midpoint rule (at = 1/2)."""
    stage = y
    for _ in range(60):
        new = y + at * h * f(t + at * h, stage)
        if np.abs(new - stage).max() <= 2e-16 * np.abs(y).max():
            break
        stage = new
    return y + (stage - y) / at


def _trapezoid(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array]) -> Array:
    new, slope = y, f(t, y)
    for _ in range(60):
        before, new = new, y + h / 2 * (slope + f(t + h, new))
        if np.abs(new - before).max() <= 2e-16 * np.abs(y).max():
            break
    return new


def _adams(f: Slope, t: Any, y: Array, h: float, past: Sequence[Array], weights: Sequence[float]) -> Array:
    """Return the state of Adams and Bashforth's method; steps without enough history are of lower order."""
    known = [y, *past][: len(weights)]
    lower = {1: (1.0,), 2: (1.5, -0.5), 3: weights}[len(known)]
    return y + h * sum((a * f(t - i * h, each) for i, (a, each) in enumerate(zip(lower, known, strict=True))), np.zeros_like(y))


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
    if order == 3:  # and w'' is w'' + w x w' in body axes
        turn = turn + h**3 / 6 * ((f(t + e, y + e * k) - f(t - e, y - e * k))[4:] / (2 * e) + cross(w, slope))
    rotor = np.zeros(3) if f.body.rotor_momentum is None or f.body.motor else f.body.rotor_momentum
    L = (J @ y[4:].reshape(3, -1) + rotor[:, None]).reshape(w.shape)
    L = L + h * ((J @ k[4:].reshape(3, -1)).reshape(w.shape) - cross(L, w))
    back = _rotate(np.concatenate([np.ones_like(w[:1]), 0 * w]), -turn)
    carried = _product(
        _product(back, np.concatenate([0 * w[:1], L])), back * np.array([1, -1, -1, -1]).reshape(4, *(1,) * (y.ndim - 1))
    )[1:]
    new = y.copy()
    new[:4] = _rotate(y[:4], turn)
    new[4:] = np.linalg.solve(J, carried.reshape(3, -1) - rotor[:, None]).reshape(w.shape)
    return new


KUTTA = (((0.5,), (-1.0, 2.0)), (1 / 6, 2 / 3, 1 / 6))
RK4 = (((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6))


TURNED = " with the exponential map of weighted rates"
BARE = " without normalisation"
"""End of the names of methods that do not normalise quaternions: rates alone do not show it."""


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


STEPS: dict[str, Step] = {
    "explicit Euler": Step(1, 0, partial(_tableau, A=(), b=(1.0,))),
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
    "the explicit midpoint rule (RK2)": Step(2, 0, partial(_tableau, A=((0.5,),), b=(0.0, 1.0))),
    "Heun's method": Step(2, 0, partial(_tableau, A=((1.0,),), b=(0.5, 0.5))),
    "Ralston's method": Step(2, 0, partial(_tableau, A=((2 / 3,),), b=(0.25, 0.75))),
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
    "RK3 (Kutta)": Step(3, 0, partial(_tableau, A=KUTTA[0], b=KUTTA[1])),
    "RK3 (Heun)": Step(3, 0, partial(_tableau, A=((1 / 3,), (0.0, 2 / 3)), b=(0.25, 0.0, 0.75))),
    "RK3 (SSP)": Step(3, 0, partial(_tableau, A=((1.0,), (0.25, 0.25)), b=(1 / 6, 1 / 6, 2 / 3))),
    "RK4": Step(4, 0, partial(_tableau, A=RK4[0], b=RK4[1])),
    f"the explicit midpoint rule (RK2){TURNED}": Step(
        2, 0, partial(_turned_tableau, A=((0.5,),), b=(0.0, 1.0), corrected=False)
    ),
    f"Heun's method{TURNED}": Step(2, 0, partial(_turned_tableau, A=((1.0,),), b=(0.5, 0.5), corrected=False)),
    f"RK4{TURNED}": Step(2, 0, partial(_turned_tableau, A=RK4[0], b=RK4[1], corrected=False)),
    "RK4 on rotation vectors (Munthe-Kaas)": Step(4, 0, partial(_turned_tableau, A=RK4[0], b=RK4[1], corrected=True)),
}


def _linear(w: Array, h: Array) -> Array:
    """Return the matrices (n, 4, 4) of q + h/2 q w."""
    x, y, z = (w * h[:, None] / 2).T
    one = np.ones_like(x)
    return np.stack([np.stack(row, -1) for row in ((one, -x, -y, -z), (x, one, z, -y), (y, -z, one, x), (z, y, -x, one))], 1)


def _map(w: Array, h: Array) -> Array:
    """Return the matrices (n, 4, 4) of the exponential map."""
    angle = np.linalg.norm(w, axis=1) * h
    size = np.sinc(angle / (2 * np.pi))
    return _linear(w * size[:, None], h) - (1 - np.cos(angle / 2))[:, None, None] * np.eye(4)


def _other_side(M: Array) -> Array:
    """Return the matrices that multiply from the left instead of the right: the vector part's block is transposed."""
    out = M.copy()
    out[:, 1:, 1:] = np.swapaxes(M[:, 1:, 1:], 1, 2)
    return out


def _in_place(w: Array, h: Array) -> Array:
    """Return the matrices of the first-order step, whose components are updated one after another, from new ones."""
    increments, out = _linear(w, h) - np.eye(4), np.broadcast_to(np.eye(4), (len(h), 4, 4)).copy()
    for row in range(4):
        out[:, row] += (increments[:, row : row + 1] @ out)[:, 0]
    return out


def _atan(w: Array, h: Array) -> Array:
    """Return the matrices (n, 4, 4) of a rotation by the arc tangent of the angle, to which R + h R [w] is repaired."""
    angle = np.linalg.norm(w, axis=1) * h
    return _map(w * (np.arctan(angle) / np.where(angle == 0, 1.0, angle))[:, None], h)


UPDATES: dict[str, Callable[[Array, Array], Array]] = {
    "the first-order step q + h/2 q w, normalised,": _linear,
    "a rotation": _map,
    "the first-order step of the quaternion, whose components are updated in place, one after another,": _in_place,
    "the first-order step R + h R [w], whose loss of orthonormality is not repaired,": lambda w, h: (
        np.eye(3) + hat(w * h[:, None])
    ),
    "the first-order step R + h R [w], made orthonormal,": _atan,
}
RATES: dict[str, Callable[[Array, Array], Array]] = {
    "by the rates of the start of the step (coning error)": lambda a, b: a,
    "by the rates of the end of the step": lambda a, b: b,
    "by the mean of the rates of both ends (coning error)": lambda a, b: (a + b) / 2,
}
Rule = Callable[[Array, Array, Array], Array]
"""From rates (n, 3) at the start and the end of steps, rad/s, body axes, and their lengths (n,), s, to matrices."""


def _rule(update: Callable[[Array, Array], Array], rates: Callable[[Array, Array], Array], world: bool) -> Rule:
    def rule(a: Array, b: Array, h: Array) -> Array:
        made = update(rates(a, b), h)
        return made if not world or made.shape[1] == 3 else _other_side(made)

    return rule


IN_WORLD = ", which are in body axes, as if they were in world axes"
ATTITUDES: dict[str, Rule] = {
    f"{name} {which}{IN_WORLD * world}": _rule(update, rates, world)
    for name, update in UPDATES.items()
    for which, rates in RATES.items()
    for world in (False, True)[: 1 + (update in (_linear, _map))]
}


def integrate(rule: Callable[[Array, Array, Array], Array], R0: Array, w: Array, h: Array, parts: int) -> Array:
    """Return attitudes (n, 3, 3) by a rule from the first, at every `parts`-th of the rates w (m, 3), rad/s, steps h, s."""
    matrices = rule(w[:-1], w[1:], h)
    if matrices.shape[1] == 3:  # of rotation matrices, which are not repaired before they are compared
        products = [R0]
        for matrix in matrices:
            products.append(products[-1] @ matrix)
        U, _, V = np.linalg.svd(np.array(products[::parts]))
        return U @ V
    q, kept = to_quaternion(R0), []
    for number, matrix in enumerate(matrices):
        if number % parts == 0:
            kept.append(q)
        q = matrix @ q
        q = q / np.sqrt(q @ q)
    return from_quaternion(np.array([*kept, q]))


def align(R: Array, to: Array, right: bool) -> Array:
    """Return attitudes (n, 3, 3) with the constant rotation in the world, or in the body (`right`), that fits others best."""
    U, _, V = np.linalg.svd((np.swapaxes(R, 1, 2) @ to if right else to @ np.swapaxes(R, 1, 2)).sum(axis=0))
    return R @ (U @ V) if right else (U @ V) @ R


def changes(scene: Scene) -> Iterator[tuple[str, str, Equations]]:
    """Yield the names, sentences and equations of all mistakes in a scene that have no numbers to fit."""
    for name, (sentence, change) in SCENES.items():
        if (other := change(scene)) is not None:
            yield name, sentence, Equations(other)
    for name, (sentence, build) in EQUATIONS.items():
        if {"inertia in world axes": np.abs(scene.R_WB0 - np.eye(3)).max() > 1e-6, "sign of the field": scene.potential}.get(
            name, True
        ):
            yield name, sentence, build(scene)
