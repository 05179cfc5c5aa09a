"""Which method, with which step, reaches an error at the least work: the candidates are tried side by side, over a short while.

Each candidate's work is known from below at any time: before its first trial run from its order and its rank among those that
are known, then from the error of its last one. The candidate that promises the least is always the one whose step is cut
next; the search ends when the one that promises the least has kept it. So a method of order 2 is not driven to 1e-9 where one
of order 8 is there already, and most are not run at all.

A count decides, not a time, so that the same scene gets the same choice. The count bounds the search as well: no trial run is
dearer than the candidate that is taken would be, but for the error of a prediction, and from the first candidate that gets
there on, all that are left may cost `MOST_RUNS` times as much as that one, over the same while.

Source: best-first search (P. E. Hart, N. J. Nilsson and B. Raphael, 1968); the rest is our own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

from .. import registry
from ..errors import MissingEngine
from ..grid import Grid
from ..method import Method, Role
from ..scene import Scene
from .trials import Trials
from .units import bound_rate

SAFETY = 0.5
"""Share of the wanted error that steps are chosen for."""
ATTEMPTS = 24
STALLED = 0.7
"""Shorter steps have stopped helping when two in a row leave more than this share of the error before them."""
PROBE_RADIANS = 200.0
"""Length of a probe in units of the fastest turning that the energy allows."""
MOST_PROBED = 10**7
"""Steps of a trial run at most: a second by the fastest method."""
MOST_COMPARED = 10**5
"""Samples of a trial run at most."""
LENIENCY = 3.0
"""How much less work than predicted a candidate may turn out to need: it is not given up before."""
PENALTY = 10.0
"""How much dearer a candidate counts that stalls above the error: it is taken where no other gets there for less."""
RESOLVED = 0.01
"""Step, rad turned at most, at which two runs with nothing in common mean that the motion amplifies rounding."""
MOST_RUNS = 20.0
"""Work of a search after the first candidate that gets there, in units of what that one needs."""

Attempts = tuple[tuple[float, float], ...]
"""Steps tried, s, with the estimated error of each, rad."""


@dataclass(frozen=True)
class Goal:
    """What candidates are tried for: an error, rad, over a duration, s, which is the first part of a run of t_end, s.

    `rate` is the fastest turning that the energy allows, rad/s.
    """

    error: float
    duration: float
    t_end: float
    rate: float

    @property
    def target(self) -> float:
        """The error, rad, that steps are chosen for."""
        return SAFETY * self.error


@dataclass(frozen=True)
class Candidate:
    """A method on its way to a step that reaches the goal.

    Attributes
    ----------
    method, goal
        What is tried, and what for.
    dt
        The step to try next, s.
    attempts
        Those tried so far.
    step_work
        Work of a step in the last attempt, ns.
    sensitivity
        Attitude error that rounding the scene causes, rad, where the last attempt was to find it; else 0.
    """

    method: Method
    goal: Goal
    dt: float
    attempts: Attempts = ()
    step_work: float = 0.0
    sensitivity: float = 0.0

    @property
    def reached(self) -> bool:
        """Whether the last step is short enough."""
        return bool(self.attempts) and self.attempts[-1][1] <= self.goal.target

    @property
    def settled(self) -> bool:
        """Whether its step is known: short enough, or shorter ones do not help."""
        return bool(self.attempts) and (self.reached or self.method.order is None or stalls(self.attempts))

    @property
    def hopeless(self) -> bool:
        """Whether it is given up."""
        return not self.settled and (self.goal.duration / self.dt > MOST_PROBED or len(self.attempts) >= ATTEMPTS)

    @property
    def grid(self) -> Grid:
        """Return the grid of the step to try next, with an even number of steps."""
        duration, dt = self.goal.duration, self.dt
        return even_grid(duration, dt, max(1, int(duration / dt / MOST_COMPARED)))

    def advance(self, trials: Trials) -> Candidate:
        """Return it after a trial run at its next step; where that settles it, the step stays."""
        grid = self.grid
        lost = bool(self.attempts) and self.attempts[-1][1] == math.inf and self.goal.rate * grid.dt < RESOLVED
        found = (trials.estimate_all if lost else trials.estimate)(self.method, grid)
        attempts, work = (*self.attempts, (grid.dt, found.error)), found.work / grid.n_steps
        moved = (found.sensitivity or 0.0) if lost else 0.0
        after = replace(self, dt=grid.dt, attempts=attempts, step_work=work, sensitivity=moved)
        return after if after.settled else replace(after, dt=grid.dt * step_factor(found.error, self.goal.error, self.method))

    def prior_work(self) -> float:
        """Return a guess at the work, ns, from order and rate alone: error = (rate * step)^order."""
        step = 1.0 if self.method.order is None else self.goal.target ** (1 / self.method.order)
        return self.method.card.cost(self.method).least * self.goal.rate * self.goal.duration / step

    def expected_work(self, scale: float) -> float:
        """Return the least work, ns, with which it may reach the goal; of a method not tried yet `scale` times its prior."""
        if self.hopeless:
            return math.inf
        if not self.attempts:
            return scale * self.prior_work()
        if self.settled:
            return self.work * (1.0 if self.reached or self.method.order is None else PENALTY)
        dt, error = self.attempts[-1]
        if not math.isfinite(error) or self.method.order is None:
            return self.step_work * self.goal.duration / self.dt
        steps = self.goal.duration / dt * (error / self.goal.target) ** (1 / self.method.order)
        return max(self.work, self.step_work * steps / LENIENCY)

    @property
    def work(self) -> float:
        """Work of the last attempt, ns."""
        return self.step_work * self.goal.duration / self.attempts[-1][0]


def find_cheapest(trials: Trials, error: float, t_end: float) -> tuple[Method, float]:
    """Return the candidate with the least work for an error, rad, up to t_end, s, and the step, s, that it needs."""
    scene, spent = trials.scene, 0.0
    goal = goal_for(scene, error, t_end)
    found = [begin(method, scene, goal) for method in candidates(scene)]
    while True:
        i = most_promising(found)
        if found[i].settled or found[i].hopeless or (len(found) == 1 and found[i].method.order is None):
            return found[i].method, found[i].dt
        found[i] = found[i].advance(trials)
        if found[i].sensitivity > error:  # no step of any method helps
            return found[i].method, found[i].attempts[-1][0]
        spent += 1.5 * found[i].work
        done = [each for each in found if each.reached]
        if done and spent > MOST_RUNS * min(each.work for each in done):
            cheapest = min(done, key=lambda each: each.work)
            return cheapest.method, cheapest.dt


def most_promising(found: Sequence[Candidate]) -> int:
    """Return which candidate may reach the goal with the least work; at the very first that of the first rank."""
    if not any(each.attempts for each in found):
        return 0
    scale = prior_scale(found)
    return min(range(len(found)), key=lambda i: found[i].expected_work(scale))


def prior_scale(found: Sequence[Candidate]) -> float:
    """Return the factor of guesses that are made before a trial run, with which they are no more than is needed.

    The fastest turning that the energy allows may be far above what there is: the candidates that have got there tell.
    """
    done = [each for each in found if each.reached]
    return min((each.work / each.prior_work() for each in done if each.prior_work() > 0), default=1.0) / LENIENCY


def goal_for(scene: Scene, error: float, t_end: float) -> Goal:
    """Return what candidates are tried for where an error, rad, is asked for up to t_end, s."""
    rate = bound_rate(scene)
    duration = min(t_end, PROBE_RADIANS / rate)
    return Goal(error * min(1.0, 4 * duration / t_end), duration, t_end, rate)


def begin(method: Method, scene: Scene, goal: Goal) -> Candidate:
    """Return a candidate before its first trial run, of two steps, or of steps as long as are worth a trial.

    Where accuracy does not depend on the step, it is half of the longest, and at most a 16th of the duration.
    """
    if method.order is None:
        return Candidate(method, goal, min(method.longest_step(scene) / 2, goal.t_end / 16))
    return Candidate(method, goal, min(goal.duration / 2, method.card.longest / goal.rate))


def candidates(scene: Scene) -> tuple[Method, ...]:
    """Return the methods worth trying on a scene: an exact family alone where one supports it, else one of each group."""
    found: dict[str, tuple[Method, ...]] = {}
    for family in _ranked_families():
        settings = _settings(family)
        if not settings or settings[0].unsupported(scene) is not None:
            continue
        if family.card.exact:
            return settings
        found.setdefault(family.card.group or family.family, settings)
    return tuple(chain.from_iterable(found.values()))


def _ranked_families() -> list[type[Method]]:
    """Return the families of ours that are candidates, in the order of their ranks."""
    ours = (family for family in registry.list_families().values() if family.role == Role.OURS)
    return sorted((family for family in ours if family.card.rank is not None), key=lambda family: family.card.rank or 0)


def _settings(family: type[Method]) -> tuple[Method, ...]:
    """Return the settings of a family that are tried; none where what it needs is not installed."""
    try:
        return family.settings_for("candidates")
    except MissingEngine:
        return ()


def even_grid(t_end: float, dt: float, sample_every: int) -> Grid:
    """Return a grid of an even number of steps of at most dt up to t_end, both in s."""
    n = 2 * max(1, math.ceil(t_end / dt / 2 * (1 - 1e-9)))
    return Grid(t_end / n, n, min(sample_every, n))


def step_factor(estimate: float, error: float, method: Method) -> float:
    """Return the factor for the next step, from the estimated error and that wanted, rad."""
    if not math.isfinite(estimate) or method.order is None:
        return 0.5
    return min(0.9, max(0.1, (SAFETY * error / estimate) ** (1 / method.order)))


def stalls(attempts: Attempts) -> bool:
    """Return whether shorter steps have stopped helping."""
    return stops_falling([estimate for _, estimate in attempts if math.isfinite(estimate)])


def stops_falling(errors: Sequence[float]) -> bool:
    """Return whether errors, rad, of finer and finer settings have stopped falling, as at round-off."""
    return len(errors) >= 3 and min(errors[-2:]) > STALLED * errors[-3]
