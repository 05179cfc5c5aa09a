"""Observe one version of an engine: a run at the scene's step, a few with slightly shorter steps, and errors over steps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from conservative.grid import Grid, grid_for
from conservative.invariants import Invariant, sizes
from conservative.method import Method
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.convergence_order import MIN_POINTS, observed_order
from ..measures.errors import measure_errors
from ..measures.measure import Measure
from ..studies import convergence, step_ladder
from ..studies.case import Case, Failure, Success
from ..studies.study import Study
from ..studies.time_limit import attempt_within

MORE_STEPS = (0, 1, 2)
"""Steps of the runs in addition to those at the scene's dt: a change caused by one or two more steps is noise."""
SAMPLES = 1000
"""Approximate number of samples of a run."""
NO_TIME = (OutcomeKind.SKIPPED, OutcomeKind.TIMEOUT)
NO_STEP = "its accuracy does not depend on dt"


@dataclass(frozen=True)
class Spread:
    """A value, and its smallest and largest value under changes that should not matter.

    For errors (rad) and drifts (relative) the change is one or two more steps in the run; for times (s) it is a repetition.
    """

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread:
        """Return the spread of values, of which the first is the one that counts; NaN are ignored."""
        first, *rest = values
        known = [value for value in (first, *rest) if not math.isnan(value)] or [math.nan]
        return cls(first, min(known), max(known))

    @property
    def sizes(self) -> tuple[float, float]:
        """Smallest and largest absolute value."""
        ends = sorted((abs(self.low), abs(self.high)))
        return (0.0 if self.low < 0 < self.high else ends[0]), ends[1]


NOTHING = Spread(math.nan, math.nan, math.nan)
"""The spread of a value that could not be measured."""


@dataclass(frozen=True)
class Fit:
    """An order of convergence: its slope and standard error, NaN if there is none for a reason."""

    slope: float = math.nan
    stderr: float = math.nan
    reason: str = ""


@dataclass(frozen=True)
class Point:
    """Largest errors at a step dt, s, of attitude, rad, and of rates, relative; NaN if the run did not reach its end.

    `reached` is False if there was no time for the run.
    """

    dt: float
    attitude: float
    rates: float
    reached: bool = True


@dataclass(frozen=True, kw_only=True)
class Observation:
    """Measurements of one version of an engine, with one setting, on one scene.

    Attributes
    ----------
    scene, setting, version, label
        Names; setting and label as the method has them.
    dt
        Step, s, of everything but the orders.
    outcome
        How the run ended.
    points
        Errors at shorter and shorter steps; empty for a method whose accuracy does not depend on a step.
    attitude_order, rates_order
        Orders of convergence, over the steps that all versions have.
    error
        Largest attitude error, rad.
    drifts
        Largest relative change of each invariant, by name; signed unless the invariant is a vector.
    """

    scene: str
    setting: str
    version: str
    label: str
    dt: float
    outcome: Outcome = OK
    points: tuple[Point, ...] = ()
    attitude_order: Fit = Fit()
    rates_order: Fit = Fit()
    error: Spread = NOTHING
    drifts: Mapping[str, Spread] = field(default_factory=dict)


def observe(study: Study, scene: Scene, method: Method, version: str) -> Observation:
    """Return the observation of a method on a scene; the study has the time limit and the reference solutions."""
    n = grid_for(scene, scene.dt).n_steps
    counts = [n + more for more in MORE_STEPS]
    cases = [Case(study.name, scene, method, Grid(scene.t_end / count, count, math.ceil(count / SAMPLES))) for count in counts]
    setting, dt = method.setting(), cases[0].grid.dt
    found = Observation(scene=scene.name, setting=setting, version=version, label=method.label, dt=dt)
    first = attempt_within(study.hang_limit, cases[0], study.skip_missing)
    if isinstance(first, Failure):
        return replace(found, outcome=first.outcome)
    done = [first, *(attempt_within(study.hang_limit, case, study.skip_missing) for case in cases[1:])]
    runs = [each.trajectory for each in done if isinstance(each, Success)]
    return replace(
        found,
        points=tuple(_points(study, scene, method)),
        error=Spread.of(_largest_error(study, run, case.grid) for run, case in zip(runs, cases, strict=False)),
        drifts={invariant.name: Spread.of(_largest_change(run, invariant) for run in runs) for invariant in scene.invariants},
    )


def _largest_error(study: Study, run: Trajectory, grid: Grid) -> float:
    truth = study.truth(run.scene, grid).trajectory
    return next(each.value for each in measure_errors(run, truth) if each.measure is Measure.ATTITUDE_MAX)


def _largest_change(run: Trajectory, invariant: Invariant) -> float:
    """Return the largest relative change of an invariant, signed unless it is a vector."""
    change = run.drift(invariant)
    place = int(np.argmax(sizes(change)))
    return float(change[place]) if change.ndim == 1 else float(sizes(change)[place])


def _points(study: Study, scene: Scene, method: Method) -> Iterator[Point]:
    """Yield the errors at shorter and shorter steps."""
    if method.order is None:
        return
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    cases = [Case(study.name, scene, method, grid) for grid in step_ladder.steps(scene, method)]
    for case, done in convergence.attempt_each(study, cases):
        if isinstance(done, Success):
            found = {each.measure: each.value for each in measure_errors(done.trajectory, truth)}
            yield Point(case.grid.dt, found[Measure.ATTITUDE_MAX], found[Measure.RATES_MAX])
        else:
            yield Point(case.grid.dt, math.nan, math.nan, reached=done.outcome.kind not in NO_TIME)


def fit_orders(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return the observations of all versions with their orders, over the steps that every version had time for.

    An order depends a little on the steps that it is fitted to. A version with too few steps for a fit takes none from others.
    """
    reached = [{point.dt for point in each.points if point.reached} for each in observations]
    enough = [steps for steps in reached if len(steps) >= MIN_POINTS]
    steps = set.intersection(*enough) if enough else set()
    return tuple(_with_orders(each, steps) for each in observations)


def _with_orders(seen: Observation, steps: set[float]) -> Observation:
    if not seen.outcome.ok:
        return seen
    if not seen.points:
        return replace(seen, attitude_order=Fit(reason=NO_STEP), rates_order=Fit(reason=NO_STEP))
    points = [point for point in seen.points if point.dt in steps]
    fits = []
    for errors in ([point.attitude for point in points], [point.rates for point in points]):
        order = observed_order([point.dt for point in points], errors)
        fits.append(Fit(reason=order.reason) if order.reason else Fit(order.slope, order.stderr))
    return replace(seen, attitude_order=fits[0], rates_order=fits[1])
