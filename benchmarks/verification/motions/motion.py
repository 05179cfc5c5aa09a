"""The motions of `catalogue.toml`, and their solutions in integer arithmetic."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from operator import mul
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array, from_quaternion
from conservative.body import RigidBody
from conservative.potentials.load import Damping, Torque
from conservative.potentials.turning import Orbit
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.scene import Scene

GRAVITY = 9.81
"""Acceleration, m/s^2, with which a weight is a mass."""
TERMS, BITS, ANGLE = 60, 200, 0.2
"""The exact motion: terms of its Taylor series, bits of its numbers, and length of its steps, rad."""
ONE, LEAST = 2**BITS, 2**40
"""The integer that stands for 1, and the smallest one that is not noise."""
KINDS = {"rotor_momentum_B": "rotor", "torque_B": "torque", "torque_W": "torque", "damping": "damping",
         "weight": "fixed point", "orbit": "orbit"}  # fmt: skip
"""The feature of a motion by its key; a motion without any of them is free."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of the catalogue, in SI units: `step` is the time in which it turns by about 0.1 rad.

    There are `samples` samples after the start, each after `steps` of these steps. `inertia` has xx, yy, zz, xy, xz and yz.
    `seed` is the seed of a fresh motion (see `search`), None for a published one. `own` is True for the body of a user.
    """

    name: str
    about: str
    inertia: Sequence[float]
    quaternion: Sequence[float]
    rates: Sequence[float]
    step: float
    steps: int
    samples: int
    rotor_momentum_B: Sequence[float] | None = None
    torque_B: Sequence[float] | None = None
    torque_W: Sequence[float] | None = None
    damping: Sequence[Sequence[float]] | None = None
    weight: float | None = None
    com_B: Sequence[float] | None = None
    orbit: float | None = None
    seed: int | None = None
    own: bool = False

    @property
    def features(self) -> list[str]:
        """The features that a program has to support besides free rotation."""
        return sorted({kind for key, kind in KINDS.items() if getattr(self, key) is not None})

    @property
    def inertia_B(self) -> list[list[float]]:
        """The inertia (3, 3), kg m^2, about the centre of mass or the fixed point."""
        xx, yy, zz, xy, xz, yz = map(float, self.inertia)
        return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]

    @property
    def arm(self) -> list[float]:
        """Weight times centre of mass (3,), N m, body axes; 0 without weight."""
        return [(self.weight or 0.0) * x for x in self.com_B or (0.0, 0.0, 0.0)]

    @property
    def t(self) -> list[float]:
        """The times of the samples after the start, s."""
        return [n * (self.steps * self.step) for n in range(1, self.samples + 1)]

    @cached_property
    def scene(self) -> Scene:
        """The motion as a scene."""
        J, q = np.array(self.inertia_B), np.array(self.quaternion, dtype=float)
        field: Any = None if self.weight is None else UniformGravity(self.weight, self.com_B or (0, 0, 0))
        field = field if self.orbit is None else Orbit(self.orbit, (0, 0, 1)).gravity_gradient(J, (1, 0, 0))
        body, torque = RigidBody(J, self.rotor_momentum_B), self.torque_B or self.torque_W
        return Scene(self.name, body, from_quaternion(q / np.sqrt(q @ q)), self.rates, self.t[-1], field,
                     torque=None if torque is None else Torque(torque, "body" if self.torque_B else "world"),
                     damping=None if self.damping is None else Damping(self.damping))  # fmt: skip

    @cached_property
    def exact(self) -> dict[str, Array]:
        """The solution at t = 0 and at the samples, arrays (n, ...) by the names in `SAMPLE`, each number rounded once."""
        return _solve(self)


SAMPLE = ("R_WB", "quaternion_wxyz", "w_WB_B", "w_WB_W", "energy", "momentum_W")
"""The quantities of a sample, in SI units."""


def load() -> list[Motion]:
    """Return the motions of the catalogue."""
    text = Path(__file__).with_name("catalogue.toml").read_text(encoding="utf-8")
    return [Motion(name, **keys) for name, keys in tomllib.loads(text).items()]


class _Scaled:
    """The numbers of a motion in units of its longest step and its largest moment, as integers: multiples of 2^-`BITS`.

    Sums of products are rounded once, so that the solution has the same bits on every machine.
    """

    def __init__(self, motion: Motion) -> None:
        self.step, self.size = 2 * Fraction(motion.step), max(Fraction(x) for x in motion.inertia[:3])
        none, torque = (0.0, 0.0, 0.0), self.step**2 / self.size
        J = [[Fraction(x) / self.size for x in row] for row in motion.inertia_B]
        self.J, self.inverse = _whole(J), _whole(_inverse(J))
        self.rates = _whole([Fraction(x) * self.step for x in motion.rates])
        self.rotor = _whole([Fraction(x) * self.step / self.size for x in motion.rotor_momentum_B or none])
        self.body, self.world = (
            _whole([Fraction(x) * torque for x in load or none]) for load in (motion.torque_B, motion.torque_W)
        )
        self.damping = _whole([[Fraction(x) * self.step / self.size for x in row] for row in motion.damping or (none,) * 3])
        self.arm = _whole([Fraction(motion.weight or 0) * Fraction(x) * torque for x in motion.com_B or none])
        self.orbit = _whole(Fraction(motion.orbit or 0) * self.step)
        q = [Fraction(x) for x in motion.quaternion]
        square = sum(x * x for x in q)
        norm = Fraction(math.isqrt(round(square * ONE**4)), ONE**2)
        self.quaternion = _whole([x / norm for x in q])


def _whole(x: Any) -> Any:
    """Return numbers as multiples of 2^-`BITS`."""
    return [_whole(part) for part in x] if isinstance(x, list) else round(x * ONE)


def _inverse(J: list[list[Fraction]]) -> list[list[Fraction]]:
    (a, b, c), (_, d, e), (_, _, f) = J
    rows = [[d * f - e * e, c * e - b * f, b * e - c * d], [c * e - b * f, a * f - c * c, b * c - a * e]]
    rows.append([rows[0][2], rows[1][2], a * d - b * b])
    determinant = a * rows[0][0] + b * rows[0][1] + c * rows[0][2]
    return [[x / determinant for x in row] for row in rows]


def _matrix(q: Sequence[Any], product: Callable[[Any, Any], int]) -> list[list[int]]:
    """Return the matrix of a quaternion of norm 1, or a coefficient of its series with the product of series."""
    w, x, y, z = q
    ww, xx, yy, zz = (product(a, a) for a in q)
    xy, xz, yz, wx, wy, wz = (product(a, b) for a, b in ((x, y), (x, z), (y, z), (w, x), (w, y), (w, z)))
    return [[ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)],
            [2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)],
            [2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz]]  # fmt: skip


def _dot(a: Iterable[int], b: Iterable[int]) -> int:
    return sum(map(mul, a, b)) >> BITS


def _apply(M: Sequence[Sequence[int]], v: Sequence[int]) -> list[int]:
    return [_dot(row, v) for row in M]


def _convolve(a: list[int], b: list[int]) -> int:
    """Return the newest coefficient of the product of two series."""
    return sum(map(mul, a, reversed(b))) >> BITS


def _cross(a: Sequence[list[int]], b: Sequence[list[int]]) -> list[int]:
    """Return the newest coefficients of a x b, of vectors of series."""
    return [_convolve(a[i - 2], b[i - 1]) - _convolve(a[i - 1], b[i - 2]) for i in range(3)]


def _advance(f: _Scaled, state: list[int], h: int) -> list[int]:
    """Return the quaternion, the rates and the direction of the planet after a step, by their Taylor series.

    q' = q w / 2 and J w' = (J w + h) x w + R' T_W + T_B - D w + g x m + 3 n^2 u x J u, with the vertical g, the moment m of the
    weight, and the direction u = R' (cos n t, sin n t, 0) of the planet in an orbit of rate n, in body axes.
    """
    y = [[x] for x in state]
    q, w, planet = y[:4], y[4:7], y[7:]
    L, u, Ju, *R = (list[list[int]](([], [], [])) for _ in range(6))
    square = 3 * f.orbit * f.orbit >> BITS
    for k in range(TERMS):
        now = [series[k] for series in w]
        _append(L, [a + (b if k == 0 else 0) for a, b in zip(_apply(f.J, now), f.rotor, strict=True)])
        for row, new in zip(R, _matrix(q, _convolve), strict=True):
            _append(row, new)
        world = [[row[i][k] for row in R] for i in range(3)]
        torque = [a - b + c for a, b, c in zip(_apply(world, f.world), _apply(f.damping, now), _cross(L, w), strict=True)]
        torque = [a + _dot((R[2][i - 2][k], -R[2][i - 1][k]), (f.arm[i - 1], f.arm[i - 2])) for i, a in enumerate(torque)]
        if k == 0:
            torque = [a + b for a, b in zip(torque, f.body, strict=True)]
        if f.orbit:
            _append(u, [_convolve(R[0][i], planet[0]) + _convolve(R[1][i], planet[1]) for i in range(3)])
            _append(Ju, _apply(f.J, [series[k] for series in u]))
            torque = [a + (square * b >> BITS) for a, b in zip(torque, _cross(u, Ju), strict=True)]
        turn = [-sum(map(_convolve, q[1:], w)), *(_convolve(q[0], x) + b for x, b in zip(w, _cross(q[1:], w), strict=True))]
        along = [-(f.orbit * planet[1][k] >> BITS), f.orbit * planet[0][k] >> BITS]
        _append(y, [x // (k + 1) for x in (*(x >> 1 for x in turn), *_apply(f.inverse, torque), *along)])
    ends = []
    for series in y:
        end = 0
        for coefficient in reversed(series):
            end = (end * h >> BITS) + coefficient
        ends.append(end)
    return ends


def _append(series: Sequence[list[int]], new: Sequence[int]) -> None:
    for coefficients, x in zip(series, new, strict=True):
        coefficients.append(x)


def _solve(motion: Motion) -> dict[str, Array]:
    """Return the solution. All numbers of the motion are taken as exact, and its quaternion is normalised."""
    f, t = _Scaled(motion), Fraction(0)
    state = [*f.quaternion, *f.rates, ONE, 0]
    parts, rows = math.ceil(0.1 * motion.steps / ANGLE), [_sample(f, state)]
    for end in map(Fraction, motion.t):
        for _ in range(parts):
            state = _advance(f, state, round((end - t) / f.step / parts * ONE))
        t = end
        rows.append(_sample(f, state))
    return {name: np.array([row[name] for row in rows]) for name in SAMPLE}


def _sample(f: _Scaled, state: list[int]) -> dict[str, Any]:
    q, w = state[:4], state[4:7]
    R, L = _matrix(q, lambda a, b: a * b >> BITS), _apply(f.J, w)
    energy = _dot(w, L) // 2 + _dot(R[2], f.arm)
    momentum = _apply(R, [a + b for a, b in zip(L, f.rotor, strict=True)])
    return {"quaternion_wxyz": _round(q), "R_WB": _round(R), "w_WB_B": _round(w, 1 / f.step),
            "w_WB_W": _round(_apply(R, w), 1 / f.step), "energy": _round(energy, f.size / f.step**2),
            "momentum_W": _round(momentum, f.size / f.step)}  # fmt: skip


def _round(x: Any, unit: Fraction = Fraction(1)) -> Any:
    """Return multiples of 2^-`BITS` times a unit, each rounded once to a float. What the last bits leave of 0 is 0."""
    if isinstance(x, list):
        return [_round(part, unit) for part in x]
    return float(x * unit / ONE) if abs(x) >= LEAST else 0.0
