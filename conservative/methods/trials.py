"""Trial runs: the error of a run, estimated from one more at twice the step, and remembered for the next call.

Two runs of one scene cannot show what rounding the scene's own numbers causes: principal moments of a tensor are known to an
ulp of the largest only, and motions near a separatrix, or chaotic ones, amplify that. So a third run starts from a scene whose
inertia and start are changed by an ulp; its distance from the second run is added to the estimate.

What is remembered belongs to the numbers of a scene and not to the object: a scene that is built anew profits, too. As an
estimate depends on nothing else, a call is given the same choice whether or not another one went before.

Source: step doubling as in Richardson's extrapolation; the rest is our own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from time import monotonic
from typing import Any

import numpy as np

from ..attitude import Array, angle_between
from ..body import RigidBody
from ..errors import IntegrationFailed, MissingEngine, Unsupported
from ..grid import Grid
from ..method import Method
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Trajectory

LARGEST_FACTOR = 30.0
"""Largest factor by which halving the step is trusted to shrink the error, whatever the order: round-off does not shrink."""
ASYMPTOTIC = 0.2
"""Errors above this, rad, are saturated (angles end at pi) and are not used."""
MOST_SCENES, MOST_ESTIMATES = 64, 1024
"""Scenes whose trial runs are remembered, those used last, and trial runs of each."""
ROUNDED = float(np.finfo(float).eps)
"""Relative change of a scene's numbers that stands for rounding them."""
_SIGNS = np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]])
QUIET, PAUSE = 1.0, 0.1
"""Time, s, before progress is told for the first time, and between two times."""


@dataclass(frozen=True)
class Estimate:
    """Estimated error of a run.

    Attributes
    ----------
    error
        Attitude error from a run at twice the step, rad; inf where a run failed, or both have nothing in common.
    work
        Work of the run, ns by `Card.cost`.
    sensitivity
        Attitude error that rounding inertia and start causes, rad; None if it was not asked for.
    """

    error: float
    work: float
    sensitivity: float | None = None

    @property
    def total(self) -> float:
        """Attitude error with what rounding causes, rad."""
        return self.error + (self.sensitivity or 0.0)


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

    def estimate_all(self, method: Method, grid: Grid) -> Estimate:
        """Return the estimate of a run with its `sensitivity`."""
        known = self.known.get((method, grid))
        return self.make(method, grid, sensitivity=True)[0] if known is None or known.sensitivity is None else known

    def make(self, method: Method, grid: Grid, sensitivity: bool = False) -> tuple[Estimate, Trajectory]:
        """Return the estimate of a run, if wanted with its `sensitivity`, and the run."""
        self.observe(method, grid)
        error, fine, coarse = run_twice(method, self.scene, grid)
        found = Estimate(error, count_work(method, fine))
        if sensitivity:
            # Where the run at twice the step failed, shorter steps come first.
            moved = find_sensitivity(method, coarse, coarse_grid(grid)) if coarse is not None else 0.0
            found = replace(found, sensitivity=moved)
        if len(self.known) >= MOST_ESTIMATES:
            self.known.clear()
        self.known[method, grid] = found
        return found, fine


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


def run_twice(method: Method, scene: Scene, grid: Grid) -> tuple[float, Trajectory, Trajectory | None]:
    """Return the estimated error of a run, rad, the run, and the run at twice the step that the estimate is made from.

    Where one of them fails, the estimate is inf and the last None.
    """
    fine = method.solve(scene, grid)
    coarse = _solve(method, scene, coarse_grid(grid))
    if not fine.ok or coarse is None:
        return math.inf, fine, None
    difference = float(angle_between(_every(1 + grid.every % 2, fine.R_WB), coarse.R_WB).max())
    estimate = difference / convergence_factor(method) + rounding_error(fine)
    return (estimate if difference < ASYMPTOTIC else math.inf), fine, coarse


def coarse_grid(grid: Grid) -> Grid:
    """Return the grid of twice the step. Where samples fall on odd steps, it has every other one."""
    return Grid(2 * grid.dt, grid.n_steps // 2, grid.every * (1 + grid.every % 2) // 2)


def _solve(method: Method, scene: Scene, grid: Grid) -> Trajectory | None:
    """Return a run that is ok, else None."""
    try:
        found = method.solve(scene, grid)
    except (IntegrationFailed, MissingEngine, Unsupported):
        return None
    return found if found.ok else None


def find_sensitivity(method: Method, found: Trajectory, grid: Grid) -> float:
    """Return how far a run on a grid is from that of `nearby_scene`, rad; inf where that fails."""
    scene = nearby_scene(found.scene)
    if method.unsupported(scene) is not None:  # it needs a symmetry, which the other inertia lacks
        scene = scene.rename(scene.name, body=found.scene.body)
    nearby = _solve(method, scene, grid)
    return math.inf if nearby is None else float(angle_between(found.R_WB, nearby.R_WB).max())


def nearby_scene(scene: Scene) -> Scene:
    """Return the scene with inertia, attitude and rates changed by `ROUNDED`, as rounding them may change them.

    What is 0 stays 0 in a body whose tensor is diagonal, where no axes have to be computed: a spin about a principal axis stays
    one. Moments of any other tensor are known to an ulp of the largest, and rates along its axes to an ulp of the whole rate.
    """
    body, w = scene.body, scene.w_WB_B0
    plain = np.array_equal(body.R_BP, np.eye(3))
    sizes, rates = (body.moments, np.abs(w)) if plain else (body.moments.max(), np.linalg.norm(w))
    moved = body.R_BP @ np.diag(ROUNDED * sizes * _SIGNS[0]) @ body.R_BP.T
    return scene.rename(
        scene.name,
        body=RigidBody(body.inertia + moved),
        R_WB0=scene.R_WB0 * (1 + ROUNDED * _SIGNS),
        w_WB_B0=w + ROUNDED * rates * _SIGNS[0],
    )


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
    cost, counters = method.card.cost(method), trajectory.counters
    return cost.correction * (counters.iterations or 0) + cost.step * counters.steps
