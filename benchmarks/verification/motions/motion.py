"""The motions of `catalogue.toml`, and their solutions in multi-precision."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from conservative.attitude import Array, from_quaternion
from conservative.body import RigidBody
from conservative.potentials.load import Damping, Torque
from conservative.potentials.turning import Orbit
from conservative.potentials.uniform_gravity import UniformGravity
from conservative.references.exact.digits import MP_LOCK, mp
from conservative.scene import Scene

GRAVITY = 9.81
"""Acceleration, m/s^2, with which a weight is a mass."""
TERMS, BITS, ANGLE = 60, 200, 0.2
"""The exact motion: terms of its Taylor series, bits of its numbers, and length of its steps, rad."""
KINDS = {"rotor_momentum_B": "rotor", "torque_B": "torque", "torque_W": "torque", "damping": "damping",
         "weight": "fixed point", "orbit": "orbit"}  # fmt: skip
"""The feature of a motion by its key; a motion without any of them is free."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of the catalogue, in SI units: `step` is the time in which it turns by about 0.1 rad.

    There are `samples` samples after the start, each after `steps` of these steps. `inertia` has xx, yy, zz, xy, xz and yz.
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
        with MP_LOCK, mp.workprec(BITS):
            return _solve(self)


SAMPLE = ("R_WB", "quaternion_wxyz", "w_WB_B", "w_WB_W", "energy", "momentum_W")
"""The quantities of a sample, in SI units."""


def load() -> list[Motion]:
    """Return the motions of the catalogue."""
    text = Path(__file__).with_name("catalogue.toml").read_text(encoding="utf-8")
    return [Motion(name, **keys) for name, keys in tomllib.loads(text).items()]


def _matrix(q: Sequence[Any], product: Any = lambda a, b: a * b) -> list[list[Any]]:
    """Return the matrix of a quaternion of norm 1, or a coefficient of its series with the product of series."""
    w, x, y, z = q
    ww, xx, yy, zz = (product(a, a) for a in q)
    xy, xz, yz, wx, wy, wz = (product(a, b) for a, b in ((x, y), (x, z), (y, z), (w, x), (w, y), (w, z)))
    return [[ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)],
            [2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)],
            [2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz]]  # fmt: skip


def _apply(M: Any, v: Any) -> list[Any]:
    return [mp.fdot(row, v) for row in M]


def _convolve(a: list[Any], b: list[Any]) -> Any:
    """Return the newest coefficient of the product of two series."""
    return mp.fdot(a, reversed(b))


def _cross(a: Any, b: Any) -> list[Any]:
    """Return the newest coefficients of a x b, of vectors of series."""
    return [_convolve(a[i - 2], b[i - 1]) - _convolve(a[i - 1], b[i - 2]) for i in range(3)]


def _advance(motion: Motion, inverse: Any, t: Any, state: list[Any], h: Any) -> list[Any]:
    """Return the quaternion and the rates after a step, by their Taylor series.

    q' = q w / 2 and J w' = (J w + h) x w + R' T_W + T_B - D w + g x m + 3 n^2 u x J u, with the vertical g, the moment m of the
    weight, and the direction u of the planet in an orbit of rate n, in body axes.
    """
    J, y = motion.inertia_B, [[x] for x in state]
    q, w, none = y[:4], y[4:], [mp.mpf(0)] * 3
    L, u, Ju, R0, R1, R2 = (list[list[Any]](([], [], [])) for _ in range(6))
    R = R0, R1, R2
    moment, n = [mp.mpf(motion.weight or 0) * mp.mpf(x) for x in motion.com_B or none], mp.mpf(motion.orbit or 0)
    orbit: tuple[list[Any], list[Any]] = [], []
    for k in range(TERMS):
        now = [series[k] for series in w]
        _append(L, _apply(J, now), motion.rotor_momentum_B if motion.rotor_momentum_B and k == 0 else none)
        for row, new in zip(R, _matrix(q, _convolve), strict=True):
            _append(row, new)
        for series, function in zip(orbit, (mp.cos, mp.sin), strict=True):  # a derivative turns by a quarter
            series.append(function(n * t + k * mp.pi / 2) * n**k / mp.factorial(k))
        _append(u, [_convolve(R[0][i], orbit[0]) + _convolve(R[1][i], orbit[1]) for i in range(3)])
        _append(Ju, _apply(J, [series[k] for series in u]))
        g, world = [series[k] for series in R[2]], [[row[i][k] for row in R] for i in range(3)]
        loads = _apply(world, motion.torque_W or none), _apply(motion.damping or [none] * 3, now)
        torque = [
            a + 3 * n * n * b + c - d + g[i - 2] * moment[i - 1] - g[i - 1] * moment[i - 2]
            for i, (a, b, c, d) in enumerate(zip(_cross(L, w), _cross(u, Ju), *loads, strict=True))
        ]
        if motion.torque_B and k == 0:
            torque = [a + b for a, b in zip(torque, motion.torque_B, strict=True)]
        turn = [-sum(map(_convolve, q[1:], w)), *(_convolve(q[0], x) + b for x, b in zip(w, _cross(q[1:], w), strict=True))]
        _append(y, [x / (k + 1) for x in (*(x / 2 for x in turn), *_apply(inverse, torque))])
    powers = [h**k for k in range(TERMS + 1)]
    return [mp.fdot(series, powers) for series in y]


def _append(series: Any, new: Any, more: Any = None) -> None:
    for i, coefficients in enumerate(series):
        coefficients.append(new[i] + more[i] if more else new[i])


def _solve(motion: Motion) -> dict[str, Array]:
    """Return the solution. The initial quaternion is normalised in multi-precision, other numbers are taken as exact."""
    q = [mp.mpf(x) for x in motion.quaternion]
    state, inverse = [*(x / mp.norm(q) for x in q), *map(mp.mpf, motion.rates)], (mp.matrix(motion.inertia_B) ** -1).tolist()
    parts, t, rows = math.ceil(0.1 * motion.steps / ANGLE), mp.mpf(0), [_sample(motion, state)]
    for end in motion.t:
        h = (mp.mpf(end) - t) / parts
        for i in range(parts):
            state = _advance(motion, inverse, t + i * h, state, h)
        t = mp.mpf(end)
        rows.append(_sample(motion, state))
    return {name: np.array([row[name] for row in rows]).astype(float) for name in SAMPLE}


def _sample(motion: Motion, state: list[Any]) -> dict[str, Any]:
    q, w = state[:4], state[4:]
    R, L = _matrix(q), _apply(motion.inertia_B, w)
    energy = mp.fdot(w, L) / 2
    if motion.weight and motion.com_B:
        energy += mp.mpf(motion.weight) * mp.fdot(R[2], map(mp.mpf, motion.com_B))
    L = [a + b for a, b in zip(L, motion.rotor_momentum_B or (0, 0, 0), strict=True)]
    return {"quaternion_wxyz": q, "R_WB": R, "w_WB_B": w, "w_WB_W": _apply(R, w), "energy": energy,
            "momentum_W": _apply(R, L)}  # fmt: skip
