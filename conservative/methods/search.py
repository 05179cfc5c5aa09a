"""Search for the method and step size that reach an error with the least work.

All candidates are tried over the same short duration (`trials`). A lower bound of the work of each is known at any time: before
its first trial run from its order, afterwards from the error of its last one. The candidate with the smallest bound is tried
next, with a shorter step, and the search ends when that candidate already has a step that is short enough. So a method of order
2 is not refined to 1e-9 if a method of order 8 has already reached it, and most candidates are never run. (Best-first search:
P. E. Hart, N. J. Nilsson and B. Raphael, 1968.)

Fixed steps are given up as soon as one candidate's steps show that the motion is not smooth, or when steps as short as a trial
allows show no order: an adaptive method follows. It is not tried on noise of time, which no step resolves.

The chosen setting is then refined over the whole duration (`refine_until`), by its step or its tolerance. `recommend` does the
same with engines as well, and measures the errors that are estimated here and the times that are counted.

Work is counted and not timed, so that the same scene always gets the same choice. The count also limits the search: once a
candidate has reached the error, it ends when it has taken as long as the runs by that candidate. The first trial of a short run
starts at a step that is likely to be short enough, and ends the search if it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import chain
from typing import TypeVar

import numpy as np

from .. import registry
from ..errors import MissingEngine
from ..grid import Grid, count_steps
from ..method import Method, Role
from ..scene import Scene
from .projected import Projected
from .trials import Trials, convergence_factor, parts_for
from .units import bound_rate

Setting = TypeVar("Setting")
Tried = TypeVar("Tried")
SAFETY = 0.5
"""Share of the requested error that steps have to reach."""
ATTEMPTS = 24
"""Largest number of trial runs of a method."""
STALLED = 0.7
"""Shorter steps no longer help if two in a row leave more than this share of the error before them."""
PROBE_RADIANS = 200.0
"""Duration of trial runs, in radians of the fastest rotation that the energy allows."""
MOST_PROBED = 10**7
"""Largest number of steps of a trial run: a second by the fastest method."""
MOST_CALLING = 20_000
"""Largest number of steps of a trial run that calls functions of Python: ten seconds."""
MOST_UNORDERED = 4096
"""Largest number of steps of such a run if those before show no order."""
MOST_COMPARED = 10**5
"""Largest number of samples of a trial run."""
LENIENCY = 3.0
"""Factor by which the work of a candidate may be smaller than predicted."""
PENALTY = 10.0
"""Factor on the work of a candidate that stalls above the error, so that one that reaches the error is preferred."""
RESOLVED = 0.01
"""If runs with shorter steps, in radians of that rotation, still differ completely, the sensitivity to rounding is measured."""
MOST_ROUGH, ROUGH = 2**13, 0.01
"""Largest number of steps of a run of a function that no method resolves, and its step in radians of that rotation."""
TRIAL = 2e5
"""Time that a trial takes beside its runs, ns."""
FIRST = 1.5
"""First step, in units of the step that order and rate predict: short enough for 85 % of random bodies."""
FIRST_TOLERANCE, ADAPTIVE_SAMPLES = 300.0, 64
"""Requested error over the first tolerance of an adaptive method; samples of its runs, if no others are requested."""


@dataclass(frozen=True)
class Candidate:
    """A method and its trial runs with shorter and shorter steps.

    Attributes
    ----------
    method, error, duration
        The method, and the attitude error, rad, that it has to reach over the duration, s.
    rate
        Fastest rotation that the energy allows, rad/s.
    dt
        Step to try next, s; the last one tried if the candidate is settled.
    attempts
        Steps tried so far, s, and the estimated error of each, rad.
    step_work
        Work of a step in the last attempt, ns.
    sensitivity
        Attitude error caused by rounding the scene, rad, if the last attempt measured it; otherwise 0.
    runs
        Number of runs of that duration for which the method and the step are chosen.
    most_steps
        Largest number of steps of a trial run.
    rough
        True if the last attempt shows that the motion is not smooth.
    ordered
        True if the last attempt shows the order of the method, or there is none.
    """

    method: Method
    error: float
    duration: float
    rate: float
    dt: float
    attempts: tuple[tuple[float, float], ...] = ()
    step_work: float = 0.0
    sensitivity: float = 0.0
    runs: float = 1.0
    most_steps: int = MOST_PROBED
    rough: bool = False
    ordered: bool = True

    @property
    def reached(self) -> bool:
        """True if the last step is short enough."""
        return bool(self.attempts) and self.attempts[-1][1] <= SAFETY * self.error

    @property
    def settled(self) -> bool:
        """True if the last step is short enough, or shorter ones do not help."""
        if not self.attempts:
            return False
        return self.reached or self.method.order is None or stops_falling([error for _, error in self.attempts])

    @property
    def hopeless(self) -> bool:
        """True if the candidate is given up."""
        most = self.most_steps if self.ordered else min(self.most_steps, MOST_UNORDERED)
        return not self.settled and (self.duration / self.dt > most or len(self.attempts) >= ATTEMPTS)

    @property
    def work(self) -> float:
        """Work of the last attempt, ns."""
        return self.step_work * self.duration / self.attempts[-1][0]

    def advance(self, trials: Trials) -> Candidate:
        """Return the candidate after a trial run at its next step."""
        every = max(1, int(self.duration / self.dt / MOST_COMPARED))
        grid = even_grid(self.duration, self.dt, every, parts_for(trials.scene))
        # The runs differ completely even at short steps. Check if rounding is the reason.
        lost = bool(self.attempts) and self.attempts[-1][1] == math.inf and self.rate * grid.dt < RESOLVED
        trial, _ = trials.estimate(self.method, grid, sensitivity=lost)
        after = replace(
            self,
            dt=grid.dt,
            attempts=(*self.attempts, (grid.dt, trial.error)),
            step_work=trial.work / grid.n_steps,
            sensitivity=(trial.sensitivity or 0.0) if lost else 0.0,
            rough=trial.rough is not None,
            ordered=trial.ordered,
        )
        return after if after.settled else replace(after, dt=grid.dt * step_factor(trial.error, self.error, self.method))

    @cached_property
    def prior_work(self) -> float:
        """Estimate of the work, ns, from order and rate alone."""
        return (
            self.method.method_info.cost(self.method).least * self.duration / predict_step(self.method, self.error, self.rate)
        )

    def expected_work(self, scale: float) -> float:
        """Return the smallest work, ns, that may reach the error; before the first attempt from `scale` times the prior."""
        if self.hopeless:
            return math.inf
        if not self.attempts:
            return scale * self.prior_work + TRIAL / self.runs
        if self.settled:
            return self.work * (1.0 if self.reached or self.method.order is None else PENALTY)
        dt, error = self.attempts[-1]
        if not math.isfinite(error) or self.method.order is None:
            return self.step_work * self.duration / self.dt
        steps = self.duration / dt * (error / (SAFETY * self.error)) ** (1 / self.method.order)
        return max(self.work, self.step_work * steps / LENIENCY)


def find_cheapest(
    trials: Trials, error: float, t_end: float, methods: Sequence[Method] | None = None, bodies: float = 1.0
) -> tuple[Method, float]:
    """Return the method with the least work for an attitude error, rad, up to t_end, s, and the step that it needs, s.

    `methods` are by default the `candidates` of the scene. The choice is for runs of `bodies` bodies. If the motion is not
    smooth, the method is adaptive, and the step the distance of samples.
    """
    if not methods and trials.scene.smoothness(t_end).noise:
        return fallback(trials.scene, t_end)
    spent = 0.0
    running = [begin(method, trials.scene, error, t_end, bodies) for method in methods or candidates(trials.scene)]
    while True:
        i = most_promising(running)
        if running[i].settled or running[i].hopeless or (len(running) == 1 and running[i].method.order is None):
            if running[i].hopeless and not running[i].ordered and not methods:
                return adaptive_method(error), adaptive_spacing(t_end)
            return running[i].method, running[i].dt
        running[i] = running[i].advance(trials)
        if running[i].rough and not running[i].reached and not methods:
            return adaptive_method(error), adaptive_spacing(t_end)
        if running[i].sensitivity > error:  # no step of any method helps
            return running[i].method, running[i].attempts[-1][0]
        spent += 1.5 * running[i].work + TRIAL
        done = [candidate for candidate in running if candidate.reached]
        cheapest = min(done, key=lambda candidate: candidate.work, default=None)
        if cheapest and spent > cheapest.work * cheapest.runs:
            return cheapest.method, cheapest.dt


def fallback(scene: Scene, t_end: float) -> tuple[Method, float]:
    """Return a method and a step, s, for motions that are not smooth enough for any: the run says how far errors are."""
    return Projected(), max(t_end / MOST_ROUGH, min(t_end / ADAPTIVE_SAMPLES, ROUGH / scene.derive(bound_rate)))


def adaptive_method(error: float) -> Projected:
    """Return the adaptive method to try first for an attitude error, rad."""
    return Projected(tolerance=error / FIRST_TOLERANCE)


def adaptive_spacing(t_end: float) -> float:
    """Return the distance of samples, s, of runs with a tolerance to t_end, s."""
    return t_end / ADAPTIVE_SAMPLES


def begin(method: Method, scene: Scene, error: float, t_end: float, bodies: float = 1.0) -> Candidate:
    """Return a candidate before its first trial run, for an attitude error, rad, of runs of `bodies` bodies to t_end, s.

    The first step is likely to be short enough, or as short as the time of a trial allows. It is at most half the duration, and
    the longest that is worth trying, which it is if steps call Python and their cost is unknown. If accuracy does not depend on
    the step, it is half the method's longest, and at most a 16th of t_end.
    """
    rate = scene.derive(bound_rate)
    duration = min(t_end, PROBE_RADIANS / rate)
    error *= min(1.0, 4 * duration / t_end)
    likely = max(FIRST * predict_step(method, error, rate), method.method_info.cost(method).least * bodies * t_end / TRIAL)
    dt = min(duration / 2, method.method_info.longest / rate, math.inf if scene.calls_python else likely)
    if scene.loads:  # runs at two to eight times the step have to differ everywhere (`conservative.methods.pieces`)
        breaks, step, *_ = scene.smoothness(t_end)
        dt = min(dt, step, t_end / parts_for(scene) / (1 + np.count_nonzero(breaks < t_end)))
    if method.order is None:
        dt = min(method.longest_step(scene) / 2, t_end / 16)
    most = MOST_CALLING if scene.calls_python else MOST_PROBED
    return Candidate(method, error, duration, rate, dt, runs=bodies * t_end / duration, most_steps=most)


def predict_step(method: Method, error: float, rate: float) -> float:
    """Return a step, s, for an error, rad, if the run differs from that at twice the step by (2 * step * rate)^order."""
    if method.order is None:
        return 1 / rate
    return (convergence_factor(method) * SAFETY * error) ** (1 / method.order) / (2 * rate)


def most_promising(running: Sequence[Candidate]) -> int:
    """Return the index of the candidate with the least expected work; at the very first among settings of the first rank."""
    if not any(candidate.attempts for candidate in running):
        first = [candidate for candidate in running if candidate.method.family == running[0].method.family]
        return running.index(min(first, key=lambda candidate: candidate.prior_work))
    # The fastest rotation that the energy allows may be far above the actual one. Candidates that have reached the error
    # show by how much, and the priors of the others are scaled to be lower bounds.
    ratios = (candidate.work / candidate.prior_work for candidate in running if candidate.reached and candidate.prior_work > 0)
    scale = min(ratios, default=1.0) / LENIENCY
    return min(range(len(running)), key=lambda i: running[i].expected_work(scale))


def candidates(scene: Scene, exact: bool = True) -> tuple[Method, ...]:
    """Return the methods that are worth trying on a scene, in the order of their ranks (`MethodInfo`).

    These are the settings of a family without truncation error, if one supports the scene; otherwise, and if `exact` is False,
    the settings of the first family of each group.
    """
    families = [
        family
        for family in registry.list_families().values()
        if family.role == Role.OURS and family.method_info.rank is not None
    ]
    chosen: dict[str, tuple[Method, ...]] = {}
    for family in sorted(families, key=lambda family: family.method_info.rank or 0):
        try:
            settings = _settings_of(family)
        except MissingEngine:
            continue
        if not settings or (family.method_info.exact and not exact) or settings[0].unsupported(scene) is not None:
            continue
        if family.method_info.exact:
            return settings
        chosen.setdefault(family.method_info.group or family.family, settings)
    return tuple(chain.from_iterable(chosen.values()))


@lru_cache(maxsize=64)
def _settings_of(family: type[Method]) -> tuple[Method, ...]:
    """Return the settings that are tried; reading them from `method_info` each time would double the time of `candidates`."""
    return family.settings_for("candidates")


def even_grid(t_end: float, dt: float, sample_every: int, parts: int = 2) -> Grid:
    """Return a grid of a multiple of `parts` steps of at most dt up to t_end, both in s, for runs at twice the step."""
    n = parts * count_steps(t_end, parts * dt)
    return Grid(t_end / n, n, min(sample_every, n))


def refine_until(
    tried: list[Tried],
    finer: Callable[[list[Tried]], Setting | None],
    attempt: Callable[[Setting], Tried],
    reached: Callable[[Tried], bool],
    error: Callable[[Tried], float],
    most: int,
) -> list[Tried]:
    """Add attempts with finer and finer settings to those that were tried, and return all of them.

    It ends when an attempt has reached the error, when finer settings no longer help (`stops_falling` of `error`, rad), when
    `finer` returns no setting, and at `most` attempts.
    """
    while len(tried) < most and not reached(tried[-1]) and not stops_falling([error(entry) for entry in tried]):
        setting = finer(tried)
        if setting is None:
            break
        tried.append(attempt(setting))
    return tried


def step_factor(estimate: float, error: float, method: Method, least: float = 0.1, unknown: float = 0.5) -> float:
    """Return the factor for the next step, from the estimated and the requested error, rad.

    The factor is at least `least`, and `unknown` if the estimate is infinite or accuracy does not depend on the step.
    """
    if not math.isfinite(estimate) or method.order is None:
        return unknown
    return min(0.9, max(least, (SAFETY * error / estimate) ** (1 / method.order)))


def stops_falling(errors: Sequence[float]) -> bool:
    """Return whether the errors of finer and finer settings, rad, have stopped falling, as at round-off; inf is ignored."""
    finite = [error for error in errors if math.isfinite(error)]
    return len(finite) >= 3 and min(finite[-2:]) > STALLED * finite[-3]
