"""Runs of random bodies in all fields, with steps of any length: part of what `hostile_values` tries.

Moments lie up to 1e16 apart in diagonal tensors and up to 1e13 in others, some are equal or nearly so; steps take the body
from a ten thousandth of a radian to a hundred. Each run is right within its bounds or ends with an outcome; where the body is
`TAME` and the step `SHORT`, that outcome must not be a lack of conservation. Short runs of free bodies and tops are compared
with `Exact`. Source: our own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np

import conservative as cv
from conservative.attitude import Array, angle_between, from_quaternion, orthonormality
from conservative.errors import NotConserved
from conservative.invariants import kept_sizes, sizes
from conservative.method import Grid, Method
from conservative.methods.bounds import LOOSEST, condition
from conservative.methods.units import bound_rate
from conservative.references.exact.method import Exact
from conservative.trajectory import Trajectory

from .hostile_arguments import Try
from .hostile_scales import OURS

Generator = np.random.Generator
SEARCHED: tuple[Method, ...] = (
    *OURS,
    *(cv.Reduced(8), cv.Reduced(4, frame="auto"), cv.Reduced(frame="auto"), cv.Gauss(1), cv.Gauss(6), cv.Gauss(4, "body")),
    *(cv.MoserVeselov(2), cv.MoserVeselov(6), cv.Convected(tol=1e-4), cv.Substepped("gauss:6")),
)
TAME, SHORT = 1e6, 3.0
"""Ratio of moments, and turn in a step, rad, up to which a run may not end for lack of conservation."""
SLACK, FLOOR = 10.0, 1e-9
"""Error that a run may have in attitude: so many times the order's power of the turn in a step (measured: below 2), and so
much anyway, rad."""


@dataclass(frozen=True)
class Search:
    """A run, its method, and the turn in a step, rad."""

    found: Trajectory
    method: Method
    grid: Grid
    turn: float

    @property
    def fault(self) -> str:
        """What is wrong with the run, "" if nothing is."""
        failure = self.found.failure
        if failure is None:
            return self._find_drift()
        tame = self.turn <= SHORT and condition(self.found.scene) <= TAME
        alarmed = tame and isinstance(failure, NotConserved) and not self._is_loose()
        return f"false alarm: {self.method.name} and {failure.quantity}" if alarmed else ""  # type: ignore[attr-defined]

    def _find_drift(self) -> str:
        """Return what an ok run has lost, by the definitions and not by the compiled code that called it ok."""
        found, bounds = self.found, self.method.bounds(self.found.scene, self.grid)
        if not orthonormality(found.R_WB).max() <= min(LOOSEST, bounds.orthonormality):
            return f"wrong ok: {self.method.name} is not orthonormal"
        for invariant, size in kept_sizes(found.scene, self.method.conserves).items():
            if not (sizes(found.drift(invariant)) * (invariant.scale / size)).max() <= min(LOOSEST, bounds.drift):
                return f"wrong ok: {self.method.name} and {invariant.name}"
        return ""

    def _is_loose(self) -> bool:
        """Whether the tolerance of the method allows more than is ever called ok."""
        return getattr(self.method, "tol", 0.0) * self.grid.n_steps > LOOSEST / 10


@dataclass(frozen=True)
class Comparison:
    """A run, the exact motion at its times, and how far apart they may be, rad."""

    found: Trajectory
    truth: Trajectory
    bound: float

    @property
    def fault(self) -> str:
        """What is wrong with the run, "" if nothing is."""
        if not (self.found.ok and self.truth.ok):
            return ""
        off = float(angle_between(self.truth.R_WB, self.found.R_WB).max())
        return "" if off <= self.bound else f"wrong ok: {self.found.label.rpartition('/')[2]} is not the motion"


def try_body(rng: Random, folder: Path) -> Try:
    """Return a short run of a random body in a random field, with a step of any length."""
    seed, method = rng.getrandbits(60), rng.choice(SEARCHED)

    def run() -> object:
        draw = np.random.default_rng(seed)
        scene, turn = draw_scene(draw, 16.0), 10 ** draw.uniform(-4, 2)
        if method.unsupported(scene) is not None:
            return None
        grid = Grid(turn / _usual_rate(scene), int(10 ** draw.uniform(0, 2.3)))
        return Search(method.solve(scene, grid), method, grid, turn)

    return Try(f"{method.name} on a body", f"{method.name}, scene {seed}", run)


def try_truth(rng: Random, folder: Path) -> Try:
    """Return a short run of a free body or a top, and the exact motion."""
    seed, method = rng.getrandbits(60), rng.choice(SEARCHED)

    def run() -> object:
        draw = np.random.default_rng(seed)
        scene, turn = draw_scene(draw, 1.0, (_nothing, _gravity)), 10 ** draw.uniform(-2.5, -0.7)
        if method.unsupported(scene) is not None or Exact().unsupported(scene) is not None:
            return None
        grid = Grid(turn / bound_rate(scene), int(draw.integers(1, 40)))
        power = 0.0 if method.order is None else turn**method.order
        return Comparison(method.solve(scene, grid), Exact().solve(scene, grid), SLACK * power + FLOOR)

    return Try(f"{method.name} and the truth", f"{method.name}, scene {seed}", run)


def draw_scene(draw: Generator, decades: float, fields: tuple[Callable[..., cv.Potential | None], ...] = ()) -> cv.Scene:
    """Return a random scene whose moments, kg m^2, are up to so many decades apart."""
    body = _body(draw, decades)
    size = 10 ** draw.uniform(-3, 3)
    w = np.zeros(3) if draw.random() < 0.1 else size * draw.normal(size=3)
    if draw.random() < 0.3:
        w = body.inverse @ w * float(body.moments.max())
    energy = (float(w @ body.inertia @ w) or float(body.moments.max())) * 10 ** draw.uniform(-3, 3)
    field = (fields or FIELDS)[draw.integers(len(fields or FIELDS))](draw, body, energy)
    return cv.Scene("drawn", body, _rotation(draw), w, 1.0, field)


def _body(draw: Generator, decades: float) -> cv.RigidBody:
    """Return a body: diagonal or in other axes, of three moments, two, nearly two, or one."""
    plain = draw.random() < 0.6
    moments = 10 ** -draw.uniform(0, min(decades, 16.0 if plain else 12.9) * draw.random(), size=3)
    kind = draw.random()
    if kind < 0.4:
        moments[1] = moments[0] * (1 + (10 ** draw.uniform(-16, -5) if kind < 0.15 else 0.0))
    elif kind < 0.5:
        moments[:] = moments[0]
    moments *= 10 ** draw.uniform(-5, 5) / moments.max()
    if plain:
        return cv.RigidBody(moments)
    R = _rotation(draw)
    tensor = R @ np.diag(moments) @ R.T
    return cv.RigidBody((tensor + tensor.T) / 2)


def _rotation(draw: Generator) -> Array:
    q = draw.normal(size=4)
    return np.eye(3) if draw.random() < 0.2 else from_quaternion(q / np.linalg.norm(q))


def _nothing(draw: Generator, body: cv.RigidBody, energy: float) -> None:
    return None


def _gravity(draw: Generator, body: cv.RigidBody, energy: float) -> cv.UniformGravity:
    axis = body.symmetry_axis()
    lever = draw.normal(size=3) if axis is None or draw.random() < 0.3 else body.R_BP[:, axis]
    return cv.UniformGravity(energy * draw.choice((-1, 1)), lever)


def _points(draw: Generator) -> tuple[Array, Array]:
    """Return a point of the body and one of the world, m, that never meet."""
    b, a = draw.normal(size=3), draw.normal(size=3)
    ratio = 10 ** draw.uniform(0.1, 2) if draw.random() < 0.7 else 10 ** draw.uniform(-2, -0.1)
    return b, a * ratio * np.linalg.norm(b) / np.linalg.norm(a)


def _spring(draw: Generator, body: cv.RigidBody, energy: float) -> cv.LinearSpring:
    b, a = _points(draw)
    farthest = float(np.linalg.norm(a) + np.linalg.norm(b))
    rest = 0.0 if draw.random() < 0.4 else farthest * 10 ** draw.uniform(-2, 2)
    return cv.LinearSpring(energy / farthest**2, b, a, rest)


def _attraction(draw: Generator, body: cv.RigidBody, energy: float) -> cv.PointAttraction:
    b, a = _points(draw)
    return cv.PointAttraction(energy * draw.choice((-1, 1)) * math.hypot(*a, *b), b, a)


def _gradient(draw: Generator, body: cv.RigidBody, energy: float) -> cv.GravityGradient:
    return cv.GravityGradient(math.sqrt(energy / body.moments.max() / 3), body.inertia, draw.normal(size=3))


FIELDS = (_nothing, _gravity, _gravity, _spring, _attraction, _gradient)


def _usual_rate(scene: cv.Scene) -> float:
    """Return a rate, rad/s, that a scene has at its start, or that its field gives the axis of largest moment."""
    made = 0.0 if scene.potential is None else math.sqrt(scene.potential.scale() / float(scene.body.moments.max()))
    return max(float(np.linalg.norm(scene.w_WB_B0)), made) or 1.0
