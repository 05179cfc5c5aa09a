"""The search for motions: bodies and starts of each family are drawn from a seed, and those are taken that show its mistakes.

A seed gives fresh motions, one of each family, with other bodies and starts than the published ones, to which a program could
be tuned. The motions of `catalogue.toml` were drawn by the same functions: 40 of each family and length, from one generator.

A seed gives the same motions on every machine. Numbers of a motion have at most four digits, and the solution is computed in
integers. Only a choice or a tolerance that round-off decides could differ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from conservative.attitude import Array, to_quaternion
from conservative.errors import BadInput, IntegrationFailed
from conservative.grid import Grid
from conservative.references.collocation import collocate

from ..solution import Equations
from . import programs
from .integrators import designs, gather
from .motion import GRAVITY, SAMPLE, Motion
from .signatures import signatures

ENOUGH = 20.0
"""Smallest factor by which the mistakes of a family should exceed what a program of order 2 may err at |w| h = 0.01."""
TRIES = 3
"""How many fresh motions of each family and length are drawn."""
LENGTHS = ((1, 1), (1, 2), (1, 4), (2, 4), (4, 4), (4, 5))
"""Lengths of motions, the shortest first: steps of 0.1 rad in a sample, and samples."""
AGREEMENT = 1e-15
"""Largest difference between two solutions of a fresh motion, relative to the size of a quantity."""


class Random:
    """Random bodies and starts."""

    def __init__(self, seed: int | Sequence[int]) -> None:
        self.random = np.random.default_rng(seed)

    def unit(self, n: int = 3) -> Array:
        """Return a unit vector (n,)."""
        v = self.random.normal(size=n)
        return np.asarray(v / np.linalg.norm(v))

    def turned(self, J: Array) -> Array:
        """Return a tensor (3, 3) with principal moments J and random axes."""
        Q = np.linalg.qr(self.random.normal(size=(3, 3)))[0]
        return np.asarray(Q @ np.diag(J) @ Q.T)

    def moments(self, kind: str) -> Array:
        """Return the principal moments (3,) of a kind of body, of order 1."""
        uniform = self.random.uniform
        if kind == "ordered":
            return np.asarray(np.array([0.5, 0.8, 1.0]) * uniform(0.9, 1.1, 3))
        if kind == "oblate":
            return np.array([1.0, 1.0 + 1e-3 * uniform(0.1, 1), uniform(1.3, 1.9)])
        if kind == "prolate":
            return np.array([uniform(0.2, 0.5), 1.0, 1.0 + 1e-3 * uniform(0.1, 1)])
        if kind == "flat":
            a, b = digits(uniform(0.3, 1, 2))
            return np.array([a, b, a + b - 2e-4])
        if kind == "rod":
            return np.array([uniform(0.005, 0.02), 1.0, uniform(0.99, 1.0)])
        if kind == "ball":
            return np.ones(3)
        a, b = uniform(0.3, 1, 2)
        return np.array([a, b, uniform(abs(a - b) + 0.1 * min(a, b), 0.95 * (a + b))])

    def motion(
        self,
        body: str = "generic",
        size: float = 1.0,
        speed: float = 1.0,
        tilt: bool = True,
        rate: Callable[[Random, Array], Array] | None = None,
        attitude: bool | Callable[[Random, Sequence[float]], Array] = True,
        rotor: float = 0.0,
        torque: str | None = None,
        damping: float = 0.0,
        arm: float = 0.0,
        orbit: float = 0.0,
    ) -> dict[str, Any]:
        """Return the numbers of a motion, with few digits.

        Parameters
        ----------
        body
            Kind of body, see `moments`.
        size, speed
            Sizes of its moments, kg m^2, and rates, rad/s.
        tilt
            Whether the axes of the body are not principal.
        rate
            Rates from the moments, in principal axes; by default in a random direction.
        attitude
            Random or (False) the unit quaternion, or a function of the rates.
        rotor, damping, arm
            Sizes of the rotor's momentum, the damping and the torque of the weight, relative to those of the motion.
        torque
            Key of a torque, or None.
        orbit
            Rate of an orbit over the rates.
        """
        J = self.moments(body)
        w = rate(self, J) if rate else self.unit()
        full = self.turned(J) if tilt else np.diag(J)
        if rate and tilt:  # rates along principal axes
            w = np.linalg.eigh(full)[1] @ w
        inertia, rates = _six(size * full), digits(speed * w, 4)
        middle, keys = size * float(np.median(J)), dict[str, Any]()
        pace = float(np.linalg.norm(rates))
        if rotor:
            h = digits(rotor * middle * speed * self.unit())
            keys["rotor_momentum_B"], pace = h, max(pace, float(np.linalg.norm(h)) / middle)
        if torque:
            keys[torque] = digits(middle * speed**2 * self.unit() * self.random.uniform(0.5, 1.5))
        if damping:
            keys["damping"] = np.reshape(
                digits(damping * middle * speed * np.diag(self.random.uniform(0.3, 1, 3))), (3, 3)
            ).tolist()
        if arm:  # the mass times the square of the arm is a hundredth of the least moment
            moment, least = arm * middle * speed**2, size * J.min()
            weight = moment**2 / (0.01 * least * GRAVITY)
            keys["weight"] = digits([weight])[0]
            keys["com_B"] = digits(moment / weight * self.unit())
            pace = max(pace, float(np.sqrt(moment / middle)))
        if orbit:
            keys["orbit"] = digits([orbit * speed])[0]
        q = attitude(self, rates) if callable(attitude) else self.unit(4) if attitude else np.array([1.0, 0, 0, 0])
        return {"inertia": inertia, "quaternion": digits(q), "rates": rates, "step": digits([0.1 / pace], 2)[0], **keys}


def digits(x: Any, n: int = 3) -> list[float]:
    """Return numbers with n digits."""
    return [float(f"{v:.{n - 1}e}") for v in np.ravel(x)]


def _six(J: Array) -> list[float]:
    return digits([J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]], 4)


def _about_z(random: Random, J: Array) -> Array:
    return np.array([0.0, 0.0, 1.0])


def _separatrix(random: Random, J: Array, side: float = 1.0) -> Array:
    """Return rates on the separatrix, or beside it, of ordered moments."""
    a, b, c = J
    x = random.random.uniform(0.2, 0.6)
    z = side * x * np.sqrt(a * (b - a) / (c * (c - b)))
    return np.array([x, np.sqrt(max(0, 1 - x * x - z * z)), z])


def _through_zero(random: Random, rates: Sequence[float]) -> Array:
    """Return a quaternion whose scalar part changes its sign soon."""
    axis = np.array(rates) / np.linalg.norm(rates)
    angle = np.pi - random.random.uniform(0.05, 0.2)
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])


GYRO = ("no gyroscopic term", "sign of the gyroscopic term")
TENSOR = ("no products of inertia", "sign of the products of inertia", "diagonal gyroscopic term", "R I for R I R'")
WORLD = ("inertia of the start", "inertia in world axes")
READ = ("transposed", "order xyzw", "world rates", "reversed rates")
ORDER = ("stale rates", "attitude by normalisation", "half a step late")
FAMILIES: dict[str, tuple[str, tuple[str, ...], dict[str, Any]]] = {
    "gyroscopic_term": ("a generic body in principal axes", GYRO, {"tilt": False}),
    "products": ("a generic body in axes that are not principal", (*TENSOR, *GYRO), {}),
    "products_flat": ("a flat body in axes that are not principal", (*TENSOR, *GYRO), {"body": "flat"}),
    "start_at_identity": (
        "a generic body that starts with the unit quaternion",
        (*GYRO, *TENSOR, WORLD[0], *READ),
        {"attitude": False},
    ),
    "world_tensor": ("a generic body in a generic attitude", (*WORLD, *READ), {}),
    "readings": ("a ball: quaternions, axes and signs alone", ("transposed", "order xyzw"), {"body": "ball", "tilt": False}),
    "half_step": ("a steady turn: times alone", ("half a step late",), {"tilt": False, "rate": _about_z}),
    "stale_rates": ("rates that change fast", ORDER, {"body": "rod"}),
    "normalisation": ("rates that change fast, in principal axes", ORDER, {"tilt": False}),
    "separatrix": ("a start on the separatrix", (*GYRO, *WORLD), {"body": "ordered", "tilt": False, "rate": _separatrix}),
    "separatrix_turned": ("the same in turned axes", (*GYRO, *TENSOR), {"body": "ordered", "rate": _separatrix}),
    "around_smallest": (
        "near the intermediate axis, around the smallest",
        GYRO,
        {"body": "ordered", "tilt": False, "rate": partial(_separatrix, side=0.9)},
    ),
    "around_largest": (
        "near the intermediate axis, around the largest",
        GYRO,
        {"body": "ordered", "tilt": False, "rate": partial(_separatrix, side=1.1)},
    ),
    "nearly_oblate": ("two moments that are nearly equal, the third larger", (*GYRO, *WORLD), {"body": "oblate"}),
    "nearly_prolate": ("two moments that are nearly equal, the third smaller", (*GYRO, *WORLD), {"body": "prolate"}),
    "flat": ("a flat body: the largest moment is nearly the sum of the others", GYRO, {"body": "flat", "tilt": False}),
    "rod": ("a rod about its long axis and across", GYRO, {"body": "rod"}),
    "tiny": ("moments of 1e-9 kg m^2", ("smallest moments", *GYRO), {"size": 1e-9, "tilt": False}),
    "tiny_turned": ("moments of 1e-12 kg m^2, products of inertia", ("smallest moments", *GYRO), {"size": 1e-12}),
    "tiny_fast": (
        "moments of 1e-7 kg m^2 at 300 rad/s",
        ("smallest moments", "rate limit 100"),
        {"size": 1e-7, "speed": 300.0},
    ),
    "huge": ("moments of 1e9 kg m^2", (*GYRO, *TENSOR), {"size": 1e9, "speed": 0.3}),
    "slow": ("1e-3 rad/s: damping and sleep", ("damping 0.01", "damping 0.05", "sleep"), {"speed": 1e-3}),
    "very_slow": ("1e-5 rad/s: damping and sleep", ("damping 0.01", "damping 0.05", "sleep"), {"speed": 1e-5, "tilt": False}),
    "slow_turn": (
        "a steady turn at 0.01 rad/s",
        ("damping 0.01", "damping 0.05", "sleep"),
        {"speed": 0.01, "rate": _about_z, "tilt": False},
    ),
    "walking_pace": ("0.1 rad/s: damping", ("damping 0.01", "damping 0.05"), {"speed": 0.1}),
    "fast": ("1000 rad/s: limits of the rate", ("rate limit 100",), {"speed": 1000.0}),
    "fast_turn": (
        "a steady turn at 150 rad/s",
        ("rate limit 100", "half a step late"),
        {"speed": 150.0, "rate": _about_z, "tilt": False},
    ),
    "half_turn": ("the scalar part of the quaternion passes 0", ("transposed", "order xyzw"), {"attitude": _through_zero}),
    "half_turn_slow": ("the same at 0.02 rad/s", ("transposed", "damping 0.01"), {"attitude": _through_zero, "speed": 0.02}),
    "rotor": ("a rotor in a generic direction", ("without the rotor", "sign of the rotor"), {"rotor": 0.5}),
    "rotor_turned": (
        "a rotor, starting from the unit quaternion",
        ("without the rotor", "sign of the rotor", "no gyroscopic term"),
        {"rotor": 1.0, "attitude": False},
    ),
    "rotor_dominates": ("a rotor with most of the momentum", ("without the rotor", "sign of the rotor"), {"rotor": 20.0}),
    "rotor_slow": (
        "a satellite with a wheel, at 1e-3 rad/s",
        ("without the rotor", "sign of the rotor", "sleep"),
        {"rotor": 2.0, "size": 100.0, "speed": 1e-3},
    ),
    "torque_in_body": ("a constant torque in body axes", ("axes of the torque", "without the torque"), {"torque": "torque_B"}),
    "torque_in_world": (
        "a constant torque in world axes",
        ("axes of the torque", "sign of the torque"),
        {"torque": "torque_W"},
    ),
    "torque_strong": (
        "a strong torque in world axes on a flat body",
        ("axes of the torque", "no gyroscopic term"),
        {"torque": "torque_W", "body": "flat"},
    ),
    "torque_and_rotor": (
        "a torque in body axes and a rotor",
        ("axes of the torque", "sign of the rotor"),
        {"torque": "torque_B", "rotor": 0.5},
    ),
    "damped": (
        "damping that differs along the axes",
        ("without the damping", "no gyroscopic term"),
        {"damping": 0.5, "tilt": False},
    ),
    "damped_and_driven": (
        "damping against a torque in world axes",
        ("without the damping", "axes of the torque"),
        {"damping": 0.5, "torque": "torque_W"},
    ),
    "heavy": (
        "a heavy body about a fixed point",
        ("without the field", "sign of the field", "no gyroscopic term"),
        {"arm": 1.0},
    ),
    "heavy_fast": ("a heavy fast top", ("without the field", "sign of the field"), {"arm": 0.2, "speed": 30.0}),
    "orbit": (
        "a satellite in a circular orbit",
        ("without the field", "turning of the field"),
        {"orbit": 0.5, "size": 100.0, "speed": 2e-3},
    ),
    "orbit_flat": (
        "a flat satellite in a circular orbit",
        ("without the field", "sign of the field"),
        {"orbit": 0.7, "size": 100.0, "speed": 1.5e-3, "body": "flat"},
    ),
}
"""Families: a description, the mistakes that each should show, and the arguments of `Random.motion`."""
LONGER: dict[str, int] = {
    **dict.fromkeys(("half_turn", "half_turn_slow", "products_flat", "huge", "fast_turn", "rotor_slow", "tiny_turned"), 2),
    **dict.fromkeys(("world_tensor", "nearly_oblate", "flat", "rod", "slow_turn", "torque_in_body", "damped"), 3),
    **dict.fromkeys(("separatrix", "around_smallest", "around_largest", "rotor", "heavy", "orbit", "damped_and_driven"), 5),
    **dict.fromkeys(("nearly_prolate", "torque_in_world", "very_slow", "rotor_dominates", "orbit_flat", "heavy_fast"), 4),
}
"""The first of `LENGTHS` that is tried: motions that are longer than a mistake needs show more of it."""


def require_seed(seed: object) -> None:
    """Raise `BadInput` if a seed is not an integer of 0 or more."""
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BadInput("seed", repr(seed), "an integer of 0 or more")


@cache
def fresh(seed: int) -> tuple[Motion, ...]:
    """Return the motions of a seed, one of each family, in the order of `FAMILIES`. Each is solved twice (`confirm`).

    Raises
    ------
    BadInput
        The seed is not an integer of 0 or more.
    IntegrationFailed
        Two independent solutions of a motion differ.
    """
    motions = tuple(replace(motion) for motion in choose(seed))  # without the solution of the search
    for motion in motions:
        confirm(motion)
    return motions


def choose(seed: int) -> list[Motion]:
    """Return the motions of a seed with solutions in double precision, whose errors are some units of round-off.

    In each length, beginning with the shortest one of the family, up to `TRIES` motions are drawn, and the first one is taken
    whose mistakes exceed `ENOUGH`; the best of all if there is none. Each family has a generator of its own.
    """
    require_seed(seed)
    random = {name: Random([seed, *name.encode()]) for name in FAMILIES}
    best = dict[str, tuple[float, Motion]]()
    for i in range(len(LENGTHS)):
        for _ in range(TRIES):
            left = [name for name in FAMILIES if i >= LONGER.get(name, 0) and best.get(name, (0.0,))[0] < ENOUGH]
            drawn = [_draw(random[name], name, LENGTHS[i], seed) for name in left]
            for motion, factor in zip(drawn, _factors(drawn, [FAMILIES[name][1] for name in left]), strict=True):
                if motion.name not in best or factor > best[motion.name][0]:
                    best[motion.name] = factor, motion
    return [best[name][1] for name in FAMILIES]


def confirm(motion: Motion) -> float:
    """Return the largest difference between the solution and collocation in extended precision.

    It is relative to the size of a quantity. The two solutions share no code. Raise `IntegrationFailed` if it is above
    `AGREEMENT`.
    """
    found, exact = collocate(motion.scene, Grid(motion.steps * motion.step, motion.samples), 8), motion.exact
    other = {"R_WB": found.R_WB, "w_WB_B": found.w_WB_B}
    off = max(float(np.abs(x - exact[name]).max() / np.abs(exact[name]).max()) for name, x in other.items())
    if not off <= AGREEMENT:
        raise IntegrationFailed(f"{motion.name}, seed {motion.seed}: two solutions differ by {off:.1e}")
    return off


def _draw(random: Random, name: str, length: tuple[int, int], seed: int) -> Motion:
    """Return the next motion of a family whose body can exist."""
    about, _, options = FAMILIES[name]
    while not _exists(motion := Motion(name, about, **random.motion(**options), steps=length[0], samples=length[1], seed=seed)):
        pass
    return _shorten(motion)


def _exists(motion: Motion) -> bool:
    """Return whether some mass distribution has the moments, about the fixed point and about the centre of mass."""
    J, c = np.array(motion.inertia_B), np.array(motion.com_B or (0.0, 0.0, 0.0))
    mass = (motion.weight or 0.0) / GRAVITY
    for tensor in (J, J - mass * (c @ c * np.eye(3) - np.outer(c, c))):
        low, middle, high = np.linalg.eigvalsh(tensor)
        if not 0 < low <= high <= low + middle:
            return False
    return True


def _factors(motions: Sequence[Motion], targets: Sequence[Sequence[str]]) -> list[float]:
    """Return the least factor by which mistakes exceed what right programs of order 2 may err."""
    if not motions:
        return []
    scale, bodies, comparison = programs.sizes(motions), gather(motions), programs.Comparison(motions)
    rules = [design for design in designs(2) if design.step != "trapezoid"]
    allowed = programs.MARGIN * np.max([comparison.errors(*rule.samples(bodies, 10)) for rule in rules], axis=0)
    allowed += programs.LEAST[2]
    wrong = [signatures([motion], names)[0] for motion, names in zip(motions, targets, strict=True)]

    def factor(i: int, name: str) -> float:
        return (programs.error(motions[i], scale[i], wrong[i][name]) / allowed[i]).max() if name in wrong[i] else 0.0

    return [min(factor(i, name) for name in names) for i, names in enumerate(targets)]


def _shorten(motion: Motion) -> Motion:
    """Return the motion with its solution in double precision, and a step of at most 0.1 rad at its largest rate."""
    fastest = float(np.linalg.norm(_solve(motion)["w_WB_B"], axis=1).max())
    shorter = replace(motion, step=digits([min(motion.step, 0.1 / fastest)], 2)[0])
    shorter.__dict__["exact"] = _solve(shorter)  # it suffices for the choice
    return shorter


def _solve(motion: Motion) -> dict[str, Array]:
    scene, t = motion.scene, np.array([0.0, *motion.t])
    (R,), (w,) = Equations(scene).solve(0.0, scene.R_WB0[None], scene.w_WB_B0[None], t)
    L = w @ motion.inertia_B + (motion.rotor_momentum_B or (0, 0, 0))
    E = (w * (w @ motion.inertia_B)).sum(axis=1) / 2 + R[:, 2] @ motion.arm
    return dict(zip(SAMPLE, (R, to_quaternion(R), w, w, E, (R @ L[..., None])[..., 0]), strict=True))
