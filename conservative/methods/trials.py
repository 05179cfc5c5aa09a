"""Trial runs: the error of a run is estimated from a second run at twice the step, and cached for later calls.

Step doubling (Richardson's extrapolation) cannot show the effect of rounding the scene's own numbers: principal moments of a
tensor are known only to an ulp of the largest, and chaotic motions or motions near a separatrix amplify that error. A third run
therefore starts from a scene whose inertia and initial state are changed by an ulp. Its distance from the second run, the
sensitivity, is added to the estimate, and so is the difference of the first two as far as rounding explains it.

Estimates are cached by the numbers of a scene, so an equal scene that is built later uses them as well. They depend on nothing
else, so earlier calls do not change the choice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from time import monotonic

import numpy as np

from ..attitude import angle_between
from ..check import replace_unchecked
from ..errors import IntegrationFailed, MissingEngine, Unsupported
from ..grid import Grid
from ..method import Method
from ..outcome import Progress
from ..scene import Scene
from ..trajectory import Trajectory

LARGEST_FACTOR = 30.0
"""Largest factor by which halving the step is assumed to reduce the error, for any order, because round-off is not reduced."""
LEAST_FACTOR = 0.5
"""Smallest such factor that is measured from three steps: runs that hardly converge are twice as wrong as they differ."""
NOISE = 4.0
"""Largest effect of rounding in the steps, in units of the sensitivity. After 1,600 steps of order 16, the errors of 5 % of
random bodies are larger than the estimate, and at most 2.6 times as large; 23 % and 4.2 times without this."""
ASYMPTOTIC = 0.2
"""Errors above this, rad, are saturated (angles end at pi) and are not used."""
MOST_SCENES, MOST_ESTIMATES = 64, 1024
"""Largest numbers of scenes whose trial runs are cached, and of cached trial runs of each."""
ROUNDED = float(np.finfo(float).eps)
"""Relative change of a scene's numbers that represents rounding."""
_SIGNS = np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]])
_AXES_TOO = np.array([[1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]])
"""Signs of the change of a tensor, which also turns its principal axes."""
QUIET, PAUSE = 1.0, 0.1
"""Time, s, before the first report of progress, and between reports."""


@dataclass(frozen=True)
class Estimate:
    """Estimated error of a run.

    Attributes
    ----------
    error
        Attitude error from a run at twice the step, rad; inf if a run failed or both differ completely.
    work
        Work of the run, ns by `Card.cost`.
    sensitivity
        Attitude error caused by rounding inertia and initial state, rad; None if not measured.
    """

    error: float
    work: float
    sensitivity: float | None = None

    @property
    def noise(self) -> float:
        """Attitude error caused by rounding the scene and the steps, rad: shorter steps do not reduce it.

        The difference of two runs belongs to it as far as it is explained by rounding.
        """
        sensitivity = self.sensitivity or 0.0
        return sensitivity + min(LARGEST_FACTOR * self.error, NOISE * sensitivity)

    @property
    def total(self) -> float:
        """Attitude error including the effect of rounding, rad."""
        return self.error + self.noise


Known = dict[tuple[Method, Grid], Estimate]
Observe = Callable[[Method, Grid], None]


@dataclass(frozen=True)
class Trials:
    """Trial runs of a scene.

    `known` are the estimates so far, shared by all scenes with the same key. `observe` is called before each pair of runs.
    `last` has the last pair, which is not repeated if its sensitivity is requested later.
    """

    scene: Scene
    known: Known
    observe: Observe
    last: dict[tuple[Method, Grid], tuple[float, Trajectory, Trajectory | None]] = field(default_factory=dict)

    def estimate(self, method: Method, grid: Grid, sensitivity: bool = False) -> tuple[Estimate, Trajectory | None]:
        """Return the estimate of a run, with its `sensitivity` if requested, and its trajectory, or None if no run was made."""
        known = self.known.get((method, grid))
        if known is not None and not (sensitivity and known.sensitivity is None):
            return known, self.last[method, grid][1] if (method, grid) in self.last else None
        if (method, grid) not in self.last:
            self.last.clear()
            self.observe(method, grid)
            self.last[method, grid] = run_twice(method, self.scene, grid)
        error, fine, coarse = self.last[method, grid]
        cost, counters = method.card.cost(method), fine.counters
        work = cost.correction * (counters.iterations or 0) + cost.step * counters.steps
        moved = 0.0 if sensitivity else None
        if sensitivity and coarse is not None:  # otherwise the step is too long to measure the sensitivity
            scene = nearby_scene(self.scene)
            if method.unsupported(scene) is not None:  # it needs a symmetry that the changed inertia lacks
                scene = scene.rename(scene.name, body=self.scene.body)
            nearby = _solve(method, self.scene, coarse_grid(grid), scene)
            moved = math.inf if nearby is None else float(angle_between(coarse.R_WB, nearby.R_WB).max())
        estimate = Estimate(error, work, moved)
        if len(self.known) >= MOST_ESTIMATES:
            self.known.clear()
        self.known[method, replace(grid)] = estimate  # a copy, without the times that a grid caches
        return estimate, fine


def trials_of(scene: Scene, progress: Callable[[Progress], object] | None = None) -> Trials:
    """Return the trial runs of a scene, including cached ones; `progress` is called as `integrate` describes.

    Nothing is cached for a scene that cannot be followed (`Scene.key`).
    """
    known = {} if (identity := scene.identity).unknown else recall(identity.text)
    return Trials(scene, known, (lambda method, grid: None) if progress is None else throttle(progress))


@lru_cache(maxsize=MOST_SCENES)
def recall(key: str) -> Known:
    """Return the estimates for scenes with a key (`Scene.key`): the same dictionary each time."""
    return {}


def throttle(progress: Callable[[Progress], object], clock: Callable[[], float] = monotonic) -> Observe:
    """Return a function that calls `progress` before a run: not in the first `QUIET` seconds, then at most every `PAUSE`."""
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
    """Return the estimated error of a run, rad, its trajectory, and the trajectory at twice the step.

    With loads a third run at four times the step measures by which factor errors fall: a load that is not smooth at an unknown
    time reduces the order. If a run fails, the estimate is inf and the last trajectory None.
    """
    fine = method.solve(scene, grid)
    coarse = _solve(method, scene, coarse_grid(grid))
    if not fine.ok or coarse is None:
        return math.inf, fine, None
    difference, factor = _largest_difference(fine, coarse), convergence_factor(method)
    if scene.loaded and grid.n_steps % 4 == 0 and difference < ASYMPTOTIC:  # its order may be lower than the method's
        third = _solve(method, scene, coarse_grid(coarse_grid(grid)))
        longer = math.inf if third is None else _largest_difference(coarse, third)
        factor = max(LEAST_FACTOR, min(factor, longer / difference - 1.0)) if difference > 0 else factor
    # Rounding of the angular velocity, which a comparison of two runs cannot show.
    rounding = ROUNDED / 2 * float(np.linalg.norm(fine.w_WB_B, axis=1).max()) * fine.t[-1]
    estimate = difference / factor + float(rounding)
    return (estimate if difference < ASYMPTOTIC else math.inf), fine, coarse


def _largest_difference(fine: Trajectory, coarse: Trajectory) -> float:
    """Return the largest angle between two runs, rad, of which the second may have every other sample of the first."""
    R_WB, stride = fine.R_WB, max(1, round((len(fine) - 1) / max(1, len(coarse) - 1)))
    same = R_WB[::stride] if (len(R_WB) - 1) % stride == 0 else np.concatenate([R_WB[::stride], R_WB[-1:]])
    return float(angle_between(same, coarse.R_WB).max())


def parts_for(scene: Scene) -> int:
    """Return the number of which the number of steps of a trial run is a multiple: runs at twice and four times the step."""
    return 4 if scene.loaded else 2


def coarse_grid(grid: Grid) -> Grid:
    """Return the grid of twice the step, with every other sample if samples fall on odd steps."""
    return Grid(2 * grid.dt, grid.n_steps // 2, grid.every * (1 + grid.every % 2) // 2)


def _solve(method: Method, scene: Scene, grid: Grid, nearby: Scene | None = None) -> Trajectory | None:
    """Return the run of a scene, or of a nearby one, which is checked like a run of the scene; None if it fails."""
    try:
        run = method.prepare(nearby or scene, grid)()
        trajectory = method.check(scene, grid, replace(run, scene=scene) if nearby else run)
    except (IntegrationFailed, MissingEngine, Unsupported):
        return None
    return trajectory if trajectory.ok else None


def nearby_scene(scene: Scene) -> Scene:
    """Return the scene with inertia, attitude and rates changed by `ROUNDED`, as rounding them may change them.

    If the tensor is diagonal, no axes have to be computed and zeros stay zeros, so a spin about a principal axis remains one.
    Moments and axes of any other tensor are known to an ulp of the largest, rates along its axes to an ulp of the whole rate.
    """
    body, w = scene.body, scene.w_WB_B0
    diagonal = np.array_equal(body.R_BP, np.eye(3))
    sizes, rates = (body.moments, np.abs(w)) if diagonal else (body.moments.max(), np.linalg.norm(w))
    signs = np.diag(_SIGNS[0]) if diagonal else _AXES_TOO
    moved = body.R_BP @ (ROUNDED * sizes * signs) @ body.R_BP.T
    return replace_unchecked(
        scene,
        body=replace_unchecked(body, inertia=body.inertia + (moved + moved.T) / 2),
        R_WB0=scene.R_WB0 * (1 + ROUNDED * _SIGNS),
        w_WB_B0=w + ROUNDED * rates * _SIGNS[0],
    )


def convergence_factor(method: Method) -> float:
    """Return the difference of two runs divided by the error of the finer one."""
    return 1.0 if method.order is None else min(2.0**method.order - 1, LARGEST_FACTOR)
