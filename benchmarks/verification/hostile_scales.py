"""Runs at scales anywhere in the range that is allowed: part of what `hostile_values` tries.

Units that are powers of two change nothing but exponents, so that a run in other units has to give the same attitudes.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np

import conservative as cv
from conservative.method import Method
from conservative.references.engines.heyoka import Heyoka
from conservative.references.engines.mujoco import MuJoCo
from conservative.references.engines.pinocchio import Pinocchio
from conservative.references.engines.scipy import SciPy
from conservative.references.exact.method import Exact
from conservative.references.precise import Precise
from conservative.trajectory import Trajectory

from .hostile_arguments import Try

OURS = (cv.Reduced(), cv.Reduced(4), cv.Gauss(2), cv.MoserVeselov(), cv.Lame(), cv.Projected(), cv.Convected(), cv.Substepped())
REFERENCES = (MuJoCo(), Pinocchio(), Heyoka(1e-9), SciPy(rtol=1e-8), Exact(), Precise(64))


@dataclass(frozen=True)
class Pair:
    """One motion, computed twice: in usual units, and with units of time and inertia that are far away."""

    plain: Trajectory
    scaled: Trajectory


def _draw_scene(rng: Random, time: float, inertia: float) -> cv.Scene:
    """Return a random scene in units of time, s, and of inertia, kg m^2."""
    moments = np.array([rng.uniform(0.7, 1.3) for _ in range(3)])
    if rng.random() < 0.4:
        moments[1] = moments[0]
    rates, moment = np.array([rng.gauss(0, 1) for _ in range(3)]), rng.uniform(0.1, 3)
    field = cv.UniformGravity(moment * inertia / time**2, (0, 0, 1.0)) if rng.random() < 0.5 else None
    return cv.Scene("drawn", cv.RigidBody(moments * inertia), np.eye(3), rates / time, 0.5 * time, field)


def try_units(rng: Random, folder: Path) -> Try:
    """Return the same run in usual and in far units, both powers of two, so that exact arithmetic would give the same."""
    seed, time, inertia = rng.random(), 2.0 ** rng.randint(-300, 300), 2.0 ** rng.randint(-300, 300)
    method: Method = rng.choice(OURS + REFERENCES)

    def run() -> Pair:
        scenes = (_draw_scene(Random(seed), 1.0, 1.0), _draw_scene(Random(seed), time, inertia))
        plain, scaled = (cv.integrate(s, s.t_end / 10, method, on_failure="return") for s in scenes)
        return Pair(plain, scaled)

    return Try(f"{method.family} in units", f"{method.name}, units {time:g} s and {inertia:g} kg m^2, scene {seed}", run)


def _draw_size(rng: Random) -> float:
    return 10.0 ** rng.uniform(-99, 99)


def try_extremes(rng: Random, folder: Path) -> Try:
    """Return a run of a scene whose numbers lie anywhere in the range that is allowed."""
    moments, rates = [_draw_size(rng) for _ in range(3)], [_draw_size(rng) for _ in range(3)]
    t_end, weight, method = _draw_size(rng), _draw_size(rng), rng.choice(OURS)
    if rng.random() < 0.5:
        moments = [_draw_size(rng)] * 3

    def run() -> object:
        field = cv.UniformGravity(weight, (0, 0, 1)) if int(t_end) % 2 else None
        scene = cv.Scene("extreme", cv.RigidBody(moments), np.eye(3), rates, t_end, field)
        return cv.integrate(scene, t_end / 10, method, on_failure="return")

    return Try(f"{method.family} at extremes", f"{method.name}, J {moments}, w {rates}, t_end {t_end}, weight {weight}", run)
