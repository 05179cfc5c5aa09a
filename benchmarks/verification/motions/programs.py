"""Correct methods and mistaken programs on many motions at once: tolerances, and the factors by which mistakes exceed them.

Mistakes and methods are those of `judge` (`benchmarks.verification.mistakes`), with others here that only a program can have.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from conservative import registry
from conservative.attitude import Array, angle_between, from_quaternion
from conservative.errors import Unsupported
from conservative.grid import Grid
from conservative.method import Method
from conservative.potentials.turning import static_part
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

from ..mistakes import BY_KEY as _BY_KEY
from ..mistakes.steps import STEPS, TURNED, Step
from ..solution import Equations
from .motion import Motion

BY_KEY: Any = _BY_KEY  # each mistake here has the effect of its kind
ORDERS, ANGLES, PARTS = (1, 2, 4), (0.1, 0.03, 0.01), (1, 3, 10)  # declared orders; |w| h, and steps in 0.1 rad
LEAST = {1: 1e-6, 2: 1e-6, 4: 1e-10}
"""Errors that are allowed in addition, by order: implicit steps are iterated to a tolerance."""
MARGIN = {1: 15.0, 2: 5.0, 4: 5.0}
"""Tolerances over the largest error of the methods. Order 2 on rotation matrices errs four times as much as on quaternions, and
order 1 with a joint at the fixed point nine times as much as these methods (Jolt and Rapier, `heavy_fast`)."""
OURS = {1: (), 2: ("no_squish", "moser_veselov:order=2"), 4: ("no_squish:order=4", "splitting:order=4")}
"""Methods of this package by order, on motions that they take: NoSquish errs up to 23 times as much as Runge and Kutta's."""
ROUND_OFF, FACTOR = 1e-11, 10.0  # errors that depend on the machine; factor of a mistake that is listed
QUANTITIES = ("attitude", "rates", "energy", "momentum")
RK2, RK4, MIDPOINT = STEPS["the explicit midpoint rule (RK2)"], STEPS["RK4"], STEPS["the implicit midpoint rule"].next
CLAMP, SLEEP = 100.0, 0.5  # rad/s, as engines have them


class Slope:
    """The derivative of states (7, n) of n equations at times (n,), s.

    `tensor` returns the inertia in body axes from that of the body and the attitudes (n, 3, 3), `spinning` the one that the
    gyroscopic term has. Times and rates are in `unit` (n,), s: implicit steps of all motions end by one test.
    """

    def __init__(self, equations: Sequence[Equations], tensor: Any = None, spinning: Any = None) -> None:
        self.tensor, self.spinning, self.unit = tensor, spinning, np.ones(len(equations))

        def gather(read: Callable[[Any], Any]) -> Array:
            return np.array([read(each.scene) for each in equations], dtype=float)

        self.J = gather(lambda s: s.body.inertia)
        self.inverse = np.linalg.inv(self.J)
        self.rotor = gather(lambda s: np.zeros(3) if s.body.rotor_momentum is None else s.body.rotor_momentum)
        self.body = gather(lambda s: s.torque.at(0.0) if s.torque and s.torque.frame == "body" else np.zeros(3))
        self.world = gather(lambda s: s.torque.at(0.0) if s.torque and s.torque.frame == "world" else np.zeros(3))
        self.damping = gather(lambda s: s.damping.at(0.0) if s.damping else np.zeros((3, 3)))
        self.arm = gather(lambda s: s.potential.moment_B if isinstance(s.potential, UniformGravity) else np.zeros(3))
        self.pull = gather(lambda s: getattr(static_part(s.potential), "factor", 0.0))
        self.orbit = gather(lambda s: s.potential.orbit.rate if hasattr(s.potential, "orbit") else 0.0)
        self.gyroscopic, self.field = np.array([[each.gyroscopic, each.field] for each in equations]).T[:, :, None]
        self.fixed = None if equations[0].fixed is None else np.array([each.fixed for each in equations], dtype=float)

    def rates(self, t: Any, y: Array) -> Array:
        """Return the rates (3, n) of states, in their units."""
        return y[4:]

    def __call__(self, t: Any, y: Array) -> Array:
        q, w, t = y[:4], (y[4:] / self.unit).T, t * self.unit
        R = from_quaternion((q / np.sqrt((q * q).sum(axis=0))).T)
        J, inverse = self.J, self.inverse
        if self.fixed is not None:
            J = np.swapaxes(R, 1, 2) @ self.fixed @ R
        elif self.tensor:
            J = self.tensor(J, R)
        if J is not self.J:
            inverse = np.linalg.inv(J)
        G = self.spinning(J) if self.spinning else J
        torque = self.gyroscopic * np.cross(_times(G, w) + self.rotor, w) + self.body - _times(self.damping, w)
        torque = torque + self.field * np.cross(R[:, 2], self.arm) + _times(np.swapaxes(R, 1, 2), self.world)
        if self.pull.any():
            angle = self.orbit * t
            u = np.cos(angle)[:, None] * R[:, 0] + np.sin(angle)[:, None] * R[:, 1]
            torque = torque + (self.field * self.pull[:, None]) * np.cross(u, _times(self.J, u))
        v, s, out = q[1:].T, q[0], np.empty_like(y)
        out[0], out[1:4] = -0.5 * self.unit * (v * w).sum(axis=1), 0.5 * self.unit * (s * w.T + np.cross(v, w).T)
        out[4:] = self.unit**2 * _times(inverse, torque).T
        return out


def _times(M: Any, v: Any) -> Array:
    return (M @ v[..., None])[..., 0]


def march(
    f: Slope, step: Step, y: Array, h: Array, count: int, first: float = 1.0, after: Callable[[Array], Array] | None = None
) -> Array:
    """Return the states (count + 1, 7, n) of steps of lengths h (n,), the first one scaled, each followed by a change."""
    t, past, states = 0 * h, list[Array](), [y]
    with np.errstate(all="ignore"):
        for i in range(count):
            size = h * (first if i == 0 else 1.0)
            new = step.next(f, t, y, size, past)
            if step.normalised:
                new[:4] /= np.sqrt((new[:4] * new[:4]).sum(axis=0))
            past, y, t = [y, *past][: step.past], new if after is None else after(new), t + size
            states.append(y)
    return np.array(states)


def _compose(f: Any, t: Any, y: Array, h: Any, past: Any) -> Array:
    """Return the state of three implicit midpoint steps, composed to order 4 (Yoshida 1990)."""
    outer = 1 / (2 - 2 ** (1 / 3))
    for share in (outer, 1 - 2 * outer, outer):
        y, t = MIDPOINT(f, t, y, share * h, ()), t + share * h
    return y


def _extrapolate(f: Any, t: Any, y: Array, h: Any, past: Any) -> Array:
    """Return the state of the implicit midpoint rule, extrapolated to order 4 from one and two steps."""
    return (4 * MIDPOINT(f, t + h / 2, MIDPOINT(f, t, y, h / 2, ()), h / 2, ()) - MIDPOINT(f, t, y, h, ())) / 3


def _orthonormal(f: Any, t: Any, y: Array, h: Any, past: Any) -> Array:
    """Return the state of semi-implicit Euler, whose attitude is turned by the arc tangent of the angle."""
    new = y + h * f(t, y)
    angle = h * np.sqrt((new[4:] * new[4:]).sum(axis=0))
    turn = f(t, np.concatenate([y[:4], new[4:]]))[:4]
    new[:4] = y[:4] + h * turn * np.tan(np.arctan(angle) / 2) / np.where(angle == 0, 0.5, angle / 2)
    return new


def _gauss(f: Any, t: Any, y: Array, h: Any, past: Any) -> Array:
    """Return the state of Gauss's collocation of order 4."""
    a, b = f(t, y), f(t + h, y)
    root = 3**0.5 / 6
    for _ in range(30):
        a, b = (f(t + (0.5 - root) * h, y + h * (a / 4 + (0.25 - root) * b)),
                f(t + (0.5 + root) * h, y + h * ((0.25 + root) * a + b / 4)))  # fmt: skip
    return y + h / 2 * (a + b)


# For one body at a time; of order 1 with a gyroscopic term; not among those that the files are measured with.
OTHERS = ("Buss 2 (augmented)", "leapfrog (velocity Verlet)", "RK4 on rotation vectors (Munthe-Kaas)")
OF_ORDER: dict[int, dict[str, Step]] = {
    order: {
        name: step
        for name, step in STEPS.items()
        if step.order == order and step.normalised and not (step.recurrent or name.endswith(TURNED) or name in OTHERS)
    }
    for order in ORDERS
}
OF_ORDER[1]["R + h R [w], made orthonormal"] = Step(1, 0, _orthonormal)
OF_ORDER[4] |= {
    "three implicit midpoint steps": Step(4, 0, _compose),
    "the extrapolated midpoint rule": Step(4, 0, _extrapolate),
    "Gauss 4": Step(4, 0, _gauss),
}


def _stale(f: Any, t: Any, y: Array, h: Any, past: Any, update: str) -> Array:
    """Return the rates of RK4, and the attitude by rates of the start or of the end of the step alone."""
    new, old = RK4.next(f, t, y, h, past), STEPS["explicit Euler with the exponential map"].next
    if update == "old":
        new[:4] = old(f, t, y, h, past)[:4]
    else:
        new[:4] = y[:4] + h * f(t, np.concatenate([y[:4], new[4:]]))[:4]
    return new


def _damped(f: Any, t: Any, y: Array, h: Any, past: Any, rate: float) -> Array:
    """Return the state of RK2 with rates that are damped, 1/s."""
    new = RK2.next(f, t, y, h, past)
    new[4:] *= np.exp(-rate * h)
    return new


def _limit(y: Array, low: float, high: float) -> Array:
    speed = np.sqrt((y[4:] * y[4:]).sum(axis=0))
    scale = np.where(speed < low, 0.0, np.minimum(1.0, high / np.maximum(speed, 1e-300)))
    return np.concatenate([y[:4], y[4:] * scale])


@dataclass(frozen=True)
class Mistake:
    """A mistaken program: equations of a scene, or None where it makes no difference, and how they are solved and read."""

    sentence: str
    equations: Callable[[Scene], Equations | None] = Equations
    options: tuple[tuple[str, Any], ...] = ()
    step: Step = RK2
    first: float = 1.0
    after: Callable[[Array], Array] | None = None
    read: Callable[..., Any] = lambda R, w: (R, w)


def _of_scene(change: Callable[[Scene], Scene | None], scene: Scene) -> Equations | None:
    other = change(scene)
    return None if other is None else Equations(other)


MISTAKES: dict[str, Mistake] = {
    **{name: Mistake(BY_KEY[name].sentence, partial(_of_scene, BY_KEY[name].change))
       for name in ("without the rotor", "without the torque", "without the damping", "without the field", "sign of the rotor",
                    "turning of the field", "sign of the torque", "axes of the torque", "no products of inertia",
                    "sign of the products of inertia")},
    **{name: Mistake(BY_KEY[name].sentence, BY_KEY[name].build)
       for name in ("no gyroscopic term", "sign of the field", "sign of the gyroscopic term", "inertia of the start",
                    "inertia in world axes")},
    **{name: Mistake(BY_KEY[name].sentence, read=BY_KEY[name].write)
       for name in ("transposed", "reversed rates", "order xyzw", "world rates")},
    "diagonal gyroscopic term": Mistake(
        "The gyroscopic term has the diagonal of the inertia only",
        options=(("spinning", lambda J: J * np.eye(3, dtype=J.dtype)),),
    ),
    "R I for R I R'": Mistake("The inertia in world axes is R I instead of R I R'", options=(("tensor", lambda J, R: J @ R),)),
    "half a step late": Mistake("The state is that of half a step earlier", first=0.5),
    **{f"damping {rate}": Mistake(f"Damping of {rate} per second is on", step=Step(2, 0, partial(_damped, rate=rate)))
       for rate in (0.01, 0.05)},
    "no gyroscopic term and damping 0.05": Mistake(
        "Both, as in engines as installed", BY_KEY["no gyroscopic term"].build, step=Step(2, 0, partial(_damped, rate=0.05))
    ),
    "clamp": Mistake(f"Rates are limited to {CLAMP:g} rad/s", after=partial(_limit, low=0.0, high=CLAMP)),
    "sleep": Mistake(f"Bodies slower than {SLEEP:g} rad/s are put to sleep", after=partial(_limit, low=SLEEP, high=np.inf)),
    "attitude by normalisation": Mistake(
        "The attitude is q + h/2 q w with rates of one end, normalised", step=Step(1, 0, partial(_stale, update="new"))
    ),
    "stale rates": Mistake(
        "The attitude is turned by the rates of the start of the step", step=Step(1, 0, partial(_stale, update="old"))
    ),
    "smallest moments": Mistake(BY_KEY["smallest moments"].sentence, partial(_of_scene, BY_KEY["smallest moments"].change)),
}  # fmt: skip
"""The mistakes that are compared with a failing program, by name."""


class Measured(NamedTuple):
    """Sizes (3,) of rates, energy and momentum; tolerances by order and |w| h; factors by order and errors of each mistake."""

    scale: Array
    tolerances: dict[tuple[int, float], Array]
    catches: dict[str, tuple[Array, Array]]


def measure(motions: Sequence[Motion], among: Sequence[str] = tuple(MISTAKES)) -> list[Measured]:
    """Return tolerances and factors of motions, all motions at once."""
    right = [Equations(each.scene) for each in motions]
    scale, plain, everyone = _scales(motions), Slope(right), range(len(motions))
    runs = partial(_errors, motions, scale, mistake=Mistake(""))
    largest = {
        (order, angle): np.max(
            [
                *(runs(plain, step, parts) for step in OF_ORDER[order].values()),
                *(_errors_of(registry.method(name), motions, scale, parts) for name in OURS[order]),
            ],
            axis=0,
        )
        for order in ORDERS
        for angle, parts in zip(ANGLES, PARTS, strict=True)
    }
    tolerances = {key: _round_up(MARGIN[key[0]] * found + LEAST[key[0]]) for key, found in largest.items()}
    catches: list[dict[str, tuple[Array, Array]]] = [{} for _ in motions]
    for name in among:
        mistake = MISTAKES[name]
        given = [mistake.equations(each.scene) for each in motions]
        mine = [i for i in everyone if given[i] is not None]
        if mine:
            f = Slope([given[i] for i in mine], **dict(mistake.options))  # type: ignore[misc]  # those of `mine` are not None
            found = _errors([motions[i] for i in mine], scale[mine], f, mistake.step, PARTS[-1], mistake)
            for i, error in zip(mine, found, strict=True):
                error = np.where(error < ROUND_OFF, 0.0, error)
                factors = np.array([(error / tolerances[order, ANGLES[-1]][i]).max() for order in ORDERS])
                catches[i][name] = factors, error
    return [Measured(scale[i], {key: each[i] for key, each in tolerances.items()}, catches[i]) for i in everyone]


def _round_up(x: Array) -> Array:
    """Return numbers rounded up to two digits."""
    size = 10.0 ** (np.floor(np.log10(x)) - 1)
    return np.array([float(f"{each:.1e}") for each in (np.ceil(x / size) * size).ravel()]).reshape(x.shape)


def _scales(motions: Sequence[Motion]) -> Array:
    """Return the sizes (n, 3) of rates, kinetic energy and momentum, which errors are relative to."""
    return np.array([
        [np.linalg.norm(w, axis=1).max(), (w @ m.inertia_B * w).sum(axis=1).max() / 2, np.linalg.norm(L, axis=1).max()]
        for m in motions for w, L in [(m.exact["w_WB_B"], m.exact["momentum_W"])]
    ])  # fmt: skip


def _errors(motions: Sequence[Motion], scale: Array, f: Slope, step: Step, parts: int, mistake: Mistake) -> Array:
    """Return the largest errors (n, 4) of the samples."""
    f.unit = np.array([1.0 if mistake.sentence else each.step for each in motions])  # mistakes have numbers with units
    h = np.array([each.step / parts for each in motions]) / f.unit
    ends = [[n * each.steps * parts for n in range(1, each.samples + 1)] for each in motions]
    start = np.array([[*m.exact["quaternion_wxyz"][0], *m.rates] for m in motions]).T
    start[4:] *= f.unit
    y = march(f, step, start, h, max(map(max, ends)), mistake.first, mistake.after)
    out = np.empty((len(motions), 4))
    for i, (motion, rows) in enumerate(zip(motions, ends, strict=True)):
        q, w, body = y[rows, :4, i], y[rows, 4:, i] / f.unit[i], motion.scene.body
        R, w = mistake.read(from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True)), w)
        exact = {name: each[1:] for name, each in motion.exact.items()}
        out[i] = compare(body.inertia, body.rotor_momentum, motion.arm, exact, scale[i], R, w)
    return out


def _errors_of(method: Method, motions: Sequence[Motion], scale: Array, parts: int) -> Array:
    """Return the largest errors (n, 4) of a method of this package; 0 for motions that it does not take."""
    out = np.zeros((len(motions), 4))
    for i, motion in enumerate(motions):
        every, body = motion.steps * parts, motion.scene.body
        with suppress(Unsupported):
            found = method.solve(motion.scene, Grid(motion.step / parts, every * motion.samples, every))
            exact = {name: each[1:] for name, each in motion.exact.items()}
            given = found.R_WB[1:], found.w_WB_B[1:]
            out[i] = compare(body.inertia, body.rotor_momentum, motion.arm, exact, scale[i], *given)
    return out


def compare(J: Any, rotor: Any, arm: Any, exact: Any, scale: Any, R: Any, w: Any) -> Array:
    """Return the largest errors (4,) of attitudes (n, 3, 3) and rates (n, 3) against samples by name, in `QUANTITIES`."""
    with np.errstate(all="ignore"):
        L = w @ np.array(J)
        energy = (w * L).sum(axis=1) / 2 + R[:, 2] @ np.array(arm)
        momentum = _times(R, L if rotor is None else L + rotor)
        found = (w, exact["w_WB_B"]), (energy[:, None], np.array(exact["energy"])[:, None]), (momentum, exact["momentum_W"])
        sizes = [np.linalg.norm(a - b, axis=1).max() / size for (a, b), size in zip(found, scale, strict=True)]
        return np.nan_to_num([angle_between(R, np.array(exact["R_WB"])).max(), *sizes], nan=1e6, posinf=1e6)
