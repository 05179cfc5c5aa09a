"""Trial runs: the error of a run, estimated from one more at twice the step, and remembered for the next call.

What is remembered belongs to the numbers of a scene and not to the object: a scene that is built anew profits, too. As an
estimate depends on nothing else, a call is given the same choice whether or not another one went before.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from time import monotonic
from typing import Any

import numpy as np

from ..attitude import Array, angle_between
from ..errors import IntegrationFailed, MissingEngine, Unsupported
from ..method import Grid, Method
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Trajectory

LARGEST_FACTOR = 30.0
"""Largest factor by which halving the step is trusted to shrink the error, whatever the order: round-off does not shrink."""
ASYMPTOTIC = 0.2
"""Errors above this, rad, are saturated (angles end at pi) and are not used."""
MOST_SCENES, MOST_ESTIMATES = 64, 1024
"""Scenes whose trial runs are remembered, those used last, and trial runs of each."""
QUIET, PAUSE = 1.0, 0.1
"""Time, s, before progress is told for the first time, and between two times."""


@dataclass(frozen=True)
class Estimate:
    """Estimated attitude error of a run, rad, inf where it failed, and its work, ns by `Method.cost`."""

    error: float
    work: float


Known = dict[tuple[Method, Grid], Estimate]
Observe = Callable[[Method, Grid], None]


@dataclass(frozen=True)
class Trials:
    """Trial runs of a scene: those known already are not made again.

    Attributes
    ----------
    scene
        What is integrated.
    known
        The estimates so far, shared by all scenes of the same content.
    observe
        Called before each run.
    """

    scene: Scene
    known: Known
    observe: Observe

    def estimate(self, method: Method, grid: Grid) -> Estimate:
        """Return the estimate of a run."""
        return self.known.get((method, grid)) or self.make(method, grid)[0]

    def make(self, method: Method, grid: Grid) -> tuple[Estimate, Trajectory]:
        """Return the estimate of a run, and the run."""
        self.observe(method, grid)
        error, trajectory = run_twice(method, self.scene, grid)
        found = Estimate(error, count_work(method, trajectory))
        if len(self.known) >= MOST_ESTIMATES:
            self.known.clear()
        self.known[method, grid] = found
        return found, trajectory


def trials_of(scene: Scene, progress: Callable[[Progress], object] | None = None) -> Trials:
    """Return the trial runs of a scene with what is known of them; `progress` is called as `integrate` says."""
    try:
        known = recall(content_of(scene))
    except TypeError:  # a field that cannot be hashed
        known = recall(scene)
    return Trials(scene, known, (lambda method, grid: None) if progress is None else tell(progress))


@lru_cache(maxsize=MOST_SCENES)
def recall(content: object) -> Known:
    """Return what is known of a scene's content: one and the same dictionary each time."""
    return {}


def content_of(scene: Scene) -> tuple[Any, ...]:
    """Return what trial runs of a scene depend on, as a value that can be compared."""
    return tuple(map(plain, (scene.body, scene.R_WB0, scene.w_WB_B0, scene.potential, scene.dt)))


def plain(value: Any) -> Any:
    """Return an array, or a frozen value of fields, as a tuple of numbers; anything else as it is."""
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    if is_dataclass(value) and not isinstance(value, type) and type(value).__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return type(value), *(plain(getattr(value, field.name)) for field in fields(value))
    return value


def tell(progress: Callable[[Progress], object], clock: Callable[[], float] = monotonic) -> Observe:
    """Return what calls `progress` before a run: not in the first `QUIET` seconds, then each `PAUSE` at most."""
    start, runs, due = clock(), 0, QUIET

    def observe(method: Method, grid: Grid) -> None:
        nonlocal runs, due
        elapsed = clock() - start
        if elapsed >= due:
            due = elapsed + PAUSE
            progress(Progress(elapsed, runs, method, grid.dt, grid.n_steps))
        runs += 2

    return observe


def run_twice(method: Method, scene: Scene, grid: Grid) -> tuple[float, Trajectory]:
    """Return the estimated error, rad, inf where a run fails, and the trajectory of a run, from one more at twice the step."""
    fine = method.solve(scene, grid)
    # Half the samples where samples fall on odd steps: then coarse samples lie on every other fine one.
    stride = 1 + grid.every % 2
    try:
        coarse = method.solve(scene, Grid(2 * grid.dt, grid.n_steps // 2, grid.every * stride // 2))
    except (IntegrationFailed, MissingEngine, Unsupported):
        return math.inf, fine
    if not (fine.ok and coarse.ok):
        return math.inf, fine
    difference = float(angle_between(_every(stride, fine.R_WB), coarse.R_WB).max())
    estimate = difference / convergence_factor(method) + rounding_error(fine)
    return (estimate if difference < ASYMPTOTIC else math.inf), fine


def _every(stride: int, R_WB: Array) -> Array:
    """Return every `stride`-th attitude of (n, 3, 3), and the last."""
    return R_WB[::stride] if (len(R_WB) - 1) % stride == 0 else np.concatenate([R_WB[::stride], R_WB[-1:]])


def convergence_factor(method: Method) -> float:
    """Return by which factor the finer of two runs is less off than their difference."""
    return 1.0 if method.order is None else min(2.0**method.order - 1, LARGEST_FACTOR)


def rounding_error(trajectory: Trajectory) -> float:
    """Return what rounding the scene's own numbers turns the body by, rad: no comparison of two runs can see it."""
    if not len(trajectory):
        return math.inf
    speed = float(np.linalg.norm(trajectory.w_WB_B, axis=1).max())
    return float(np.finfo(float).eps / 2 * speed * trajectory.t[-1])


def count_work(method: Method, trajectory: Trajectory) -> float:
    """Return the work of a run, in ns: the number of steps and of corrections, each times its cost beside those of others."""
    return method.cost.correction * (trajectory.counters.iterations or 0) + method.cost.step * trajectory.counters.steps
