"""Trial runs: the error of a run is estimated from a second run at twice the step, and cached for later calls.

The order of a method holds for the laws of this package. A function or a load of a user may have corners and jumps, at which
differences of runs are small by chance. Runs at four and eight times the step then show whether differences fall as the
method's order says, twice in a row. Otherwise the largest difference is the estimate, and the last one where steps are
divided at break points. Adaptive methods have no step: their second run has a larger tolerance, and the local errors of all
steps count as well.

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
from itertools import pairwise
from time import monotonic
from typing import Any, NamedTuple

import numpy as np

from ..attitude import Array, angle_between
from ..check import replace_unchecked
from ..errors import IntegrationFailed, MissingEngine, Unsupported
from ..features import Feature
from ..grid import Grid
from ..method import Method
from ..outcome import Progress
from ..potentials.point_to_point import LinearSpring
from ..potentials.turning import static_part
from ..scene import Scene
from ..trajectory import Trajectory

LARGEST_FACTOR = 30.0
"""Largest factor by which halving the step is assumed to reduce the error, for any order, because round-off is not reduced."""
HALVINGS = 3
"""Halvings of the step, and differences of runs, that show the order of a motion that is not presumed smooth."""
SHOWN, ALIKE = 0.5, 2.0**0.75
"""Differences fall in order if each is smaller by this share of what the order says, and the factors of both halvings are as
alike as this."""
LOW, RESOLVED = 0.25, 0.05
"""A function is not smooth if differences below so many rad fall, in two halvings, by less than this share of the order."""
MAGNIFIED = 2.0**20
"""Factor on the change of a scene that represents rounding, for adaptive methods; the effect is divided by it."""
LOOSER = 30.0
"""Factor between the tolerances of the two runs of an adaptive method."""
BY_CHANCE = 3.0
"""Factor on the difference of runs of two tolerances, which a corner may make small by chance. In 19 runs of
functions with corners, the error was 2.8 times the difference in one, and at most 0.8 times in the others."""
NEAR = 0.1
"""A spring is not presumed smooth if its points can come as near to each other as this, relative to their distance from the
pivot: its force has no direction where they meet."""
NOISE = 4.0
"""Largest effect of rounding in the steps, in units of the sensitivity. After 1,600 steps of order 16, the errors of 5 % of
random bodies are larger than the estimate, and at most 2.6 times as large; 23 % and 4.2 times without this."""
ASYMPTOTIC = 0.2
"""Errors above this, rad, are saturated (angles end at pi) and are not used."""
MOST_SCENES, MOST_ESTIMATES, MOST_CHOICES = 64, 1024, 64
"""Largest numbers of scenes whose trial runs are cached, and of cached trial runs and choices of each."""
ROUNDED = float(np.finfo(float).eps)
"""Relative change of a scene's numbers that represents rounding."""
NOTHING = 1e-13
"""Differences that rounding explains, rad, and for each rad of the motion."""
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
        Attitude error from runs at longer steps, rad; inf if a run failed or they differ completely.
    work
        Work of the run, ns by `MethodInfo.cost`.
    sensitivity
        Attitude error caused by rounding inertia and initial state, rad; None if not measured.
    rough
        Time, s, near which differences of runs do not fall in order, so that a function is not smooth there; None if they do.
    ordered
        Whether differences of runs fall as the order of the method says, or are presumed to.
    failed
        Whether the run itself ended early.
    """

    error: float
    work: float
    sensitivity: float | None = None
    rough: float | None = None
    ordered: bool = True
    failed: bool = False

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


class Known(dict[tuple[Method, Grid], Estimate]):
    """Estimates of runs of a scene, and in `choices` the results of searches (`automatic`), by what they are for."""

    def __init__(self) -> None:
        super().__init__()
        self.choices: dict[Any, Any] = {}

    def clear(self) -> None:
        super().clear()
        self.choices.clear()


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
    last: dict[tuple[Method, Grid], Runs] = field(default_factory=dict)

    def estimate(self, method: Method, grid: Grid, sensitivity: bool = False) -> tuple[Estimate, Trajectory | None]:
        """Return the estimate of a run, with its `sensitivity` if requested, and its trajectory, or None if no run was made."""
        cached = self.known.get((method, grid))
        if cached is not None and not (sensitivity and cached.sensitivity is None):
            return cached, self.last[method, grid].fine if (method, grid) in self.last else None
        if (method, grid) not in self.last:
            self.last.clear()
            self.observe(method, grid)
            self.last[method, grid] = run_twice(method, self.scene, grid)
        error, fine, coarse, rough, ordered = self.last[method, grid]
        cost, counters = method.method_info.cost(method), fine.counters
        work = cost.correction * (counters.iterations or 0) + cost.step * counters.steps
        moved = 0.0 if sensitivity else None
        if sensitivity and coarse is not None:  # otherwise the step is too long to measure the sensitivity
            other, longer = coarser(method, grid)
            # Steps of a tolerance are not the same in both runs, so that the change has to be larger than their errors.
            factors = (MAGNIFIED, 1.0) if coarse.control is not None else (1.0,)
            for factor in factors:
                scene = nearby_scene(self.scene, factor * ROUNDED)
                if method.unsupported(scene) is not None:  # it needs a symmetry that the changed inertia lacks
                    scene = scene.rename(scene.name, body=self.scene.body)
                nearby = _solve(other, self.scene, longer, scene) if factor == 1.0 else _solve(other, scene, longer)
                moved = math.inf if nearby is None else float(angle_between(coarse.R_WB, nearby.R_WB).max()) / factor
                if factor * moved < RESOLVED:
                    break
        estimate = Estimate(error, work, moved, rough, ordered, not fine.ok)
        if len(self.known) >= MOST_ESTIMATES:
            self.known.clear()
        self.known[method, replace(grid)] = estimate  # a copy, without the times that a grid caches
        return estimate, fine


def trials_of(scene: Scene, progress: Callable[[Progress], object] | None = None) -> Trials:
    """Return the trial runs of a scene, including cached ones; `progress` is called as `integrate` describes.

    Nothing is cached for a scene that cannot be followed (`Scene.key`).
    """
    estimates = Known() if (identity := scene.identity).unknown else recall(identity.text)
    return Trials(scene, estimates, (lambda method, grid: None) if progress is None else throttle(progress))


@lru_cache(maxsize=MOST_SCENES)
def recall(key: str) -> Known:
    """Return the estimates for scenes with a key (`Scene.key`): the same dictionary each time."""
    return Known()


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


def presumed_smooth(scene: Scene) -> bool:
    """Return whether only laws of this package act on a scene, which are smooth: any error of a method falls with its order.

    It is False with loads, with functions and compiled fields of a user, and if the points of a spring with a length can meet.
    """
    if scene.loaded or not scene.features.isdisjoint((Feature.FUNCTION, Feature.FIELD)):
        return False
    field: Any = static_part(scene.potential)
    if not isinstance(field, LinearSpring) or field.rest_length == 0:
        return True
    lengths = float(np.linalg.norm(field.point_B)), float(np.linalg.norm(field.anchor_W))
    return abs(lengths[0] - lengths[1]) > NEAR * max(lengths)


def run_twice(method: Method, scene: Scene, grid: Grid) -> Runs:
    """Return the estimated error of a run, rad, its trajectory, and the trajectory at twice the step, or a larger tolerance.

    If a run fails, the estimate is inf and the last trajectory None.
    """
    fine = method.solve(scene, grid)
    other, longer = coarser(method, grid)
    given_up = fine.control is not None and not fine.ok  # such steps may be thousands of short ones
    coarse = None if given_up else _solve(other, scene, longer)
    if not fine.ok or coarse is None:
        return Runs(math.inf, fine, None, fine.control and fine.control.rough, presumed_smooth(scene))
    difference, rough, ordered = _largest_difference(fine, coarse), None, True
    if fine.control is not None:
        error, rough = BY_CHANCE * max(difference, fine.control.local), fine.control.rough
    elif presumed_smooth(scene) or method.order is None:
        error = difference / convergence_factor(method)
    else:
        error, rough, ordered = _by_shown_order(method, scene, grid, fine, coarse)
    # Rounding of the angular velocity, which a comparison of two runs cannot show.
    rounding = ROUNDED / 2 * float(np.linalg.norm(fine.w_WB_B, axis=1).max()) * fine.t[-1]
    return Runs(error + float(rounding) if difference < ASYMPTOTIC else math.inf, fine, coarse, rough, ordered)


class Runs(NamedTuple):
    """The estimated error of a run, rad; its trajectory and the coarser one, None if a run failed; `rough` and `ordered` of
    `Estimate`.
    """

    error: float
    fine: Trajectory
    coarse: Trajectory | None
    rough: float | None
    ordered: bool


def _by_shown_order(
    method: Method, scene: Scene, grid: Grid, fine: Trajectory, coarse: Trajectory
) -> tuple[float, float | None, bool]:
    """Return the error, rad, by the order that two halvings of the step show, and `rough` and `ordered` of `Estimate`."""
    breaks, _, interval, noise = scene.smoothness(grid.last)
    noisy = interval[0] if noise else None
    differences, before, longer = [_largest_difference(fine, coarse)], coarse, coarse_grid(grid)
    while len(differences) < HALVINGS and differences[-1] < ASYMPTOTIC and longer.n_steps % 2 == 0:
        longer = coarse_grid(longer)
        after = _solve(method, scene, longer)
        differences.append(math.inf if after is None else _largest_difference(before, after))
        before = coarse if after is None else after
    seen = [difference for difference in differences if difference < ASYMPTOTIC]
    if len(seen) < 2:  # one difference alone may be small by chance
        return math.inf, noisy, False
    if len(seen) == HALVINGS:
        most = convergence_factor(method) + 1
        factors = [min(most, second / first) if first > 0 else most for first, second in pairwise(seen)]
        if min(factors) >= SHOWN * most and max(factors) <= ALIKE * min(factors):
            # Steps are divided at break points. A part of a step that is as long at twice the step has the same error in both
            # runs, so that their difference bounds the error, and no more: it was 2.8 times the error in a random scene.
            return seen[0] if len(breaks) else seen[0] / (min(factors) - 1), noisy, True
    # As far as rounding explains the differences, they say nothing about the function; long steps do not show an order, either.
    floor = NOTHING * (1.0 + float(np.linalg.norm(fine.w_WB_B, axis=1).max()) * float(fine.t[-1]))
    shown = len(seen) == HALVINGS and min(seen) > floor and max(seen) < RESOLVED
    rough = shown and seen[-1] < (LOW * (convergence_factor(method) + 1)) ** 2 * seen[0]
    return max(seen), _roughest(fine, coarse) if rough and noisy is None else noisy, False


def _roughest(fine: Trajectory, coarse: Trajectory) -> float:
    """Return the time of the sample, s, up to which the angle between two runs grows most."""
    off, t = _differences(fine, coarse), coarse.t
    grown = np.diff(np.maximum.accumulate(off), prepend=0.0)
    return float(t[int(grown.argmax())])


def coarser(method: Method, grid: Grid) -> tuple[Method, Grid]:
    """Return the method and the grid of the run with which a run is compared: twice the step, or a larger tolerance."""
    if getattr(method, "tolerance", None) is None:
        return method, coarse_grid(grid)
    changes: Any = {"tolerance": LOOSER * method.tolerance}  # type: ignore[attr-defined]
    return replace(method, **changes), grid


def _largest_difference(fine: Trajectory, coarse: Trajectory) -> float:
    """Return the largest angle between two runs, rad, of which the second may have every other sample of the first."""
    return float(_differences(fine, coarse).max())


def _differences(fine: Trajectory, coarse: Trajectory) -> Array:
    """Return the angles between two runs at the samples of the second, rad."""
    R_WB, stride = fine.R_WB, max(1, round((len(fine) - 1) / max(1, len(coarse) - 1)))
    same = R_WB[::stride] if (len(R_WB) - 1) % stride == 0 else np.concatenate([R_WB[::stride], R_WB[-1:]])
    return np.asarray(angle_between(same, coarse.R_WB))


def parts_for(scene: Scene) -> int:
    """Return the number of which the number of steps of a trial run is a multiple: runs at twice to eight times the step."""
    return 2 if presumed_smooth(scene) else 2**HALVINGS


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


def nearby_scene(scene: Scene, by: float = ROUNDED) -> Scene:
    """Return the scene with inertia, attitude and rates changed by a share, as rounding them may change them.

    If the tensor is diagonal, no axes have to be computed and zeros stay zeros, so a spin about a principal axis remains one.
    Equal moments stay equal, because they are the same number: rounding it does not make a rod a body of three moments.
    Moments and axes of any other tensor are known to an ulp of the largest, rates along its axes to an ulp of the whole rate.
    """
    body, w = scene.body, scene.w_WB_B0
    diagonal = np.array_equal(body.R_BP, np.eye(3))
    sizes, rates = (body.moments, np.abs(w)) if diagonal else (body.moments.max(), np.linalg.norm(w))
    # Equal moments stay equal, such as a rod's.
    equal = [_SIGNS[0][int(np.argmax(body.moments == moment))] for moment in body.moments]
    signs = np.diag(equal) if diagonal else _AXES_TOO
    moved = body.R_BP @ (by * sizes * signs) @ body.R_BP.T
    return replace_unchecked(
        scene,
        body=replace_unchecked(body, inertia=body.inertia + (moved + moved.T) / 2),
        R_WB0=scene.R_WB0 * (1 + by * _SIGNS),
        w_WB_B0=w + by * rates * _SIGNS[0],
    )


def convergence_factor(method: Method) -> float:
    """Return the difference of two runs divided by the error of the finer one."""
    return 1.0 if method.order is None else min(2.0**method.order - 1, LARGEST_FACTOR)
