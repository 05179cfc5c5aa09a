"""Versions of an engine: a run at the scene's step, a few with slightly shorter steps, errors over steps, and times in turn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from conservative import registry
from conservative.attitude import angle_between
from conservative.errors import BadInput
from conservative.grid import Grid, grid_for
from conservative.invariants import Invariant, sizes
from conservative.method import Method
from conservative.method_info import settings_text
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.environments.engine_method import EngineMethod
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.change import NOTHING, Range
from ..measures.convergence_order import MIN_POINTS, Order, observed_order
from ..measures.measure import Measure
from ..measures.timing import time_interleaved
from ..studies import selection, step_ladder
from ..studies.case import Case, Success
from ..studies.line import LinePoint, measure_line
from ..studies.speed import CALL, keep_end, own_loop, shorten
from ..studies.study import Progress, Study
from .comparison import TIMING, Comparison, Line, compare
from .times import Ratio, ratio_of
from .version import Version

MORE_STEPS = (0, 1, 2)
"""Numbers of further steps in the runs of a setting: a change of the error that one or two more steps also cause is noise."""
SAMPLES = 1000
"""Approximate number of samples of a run."""
REPEATS = 3
"""Repeats of all rounds; the interval of a ratio comes from them."""
ROUNDS = 3
"""Rounds of a repeat; the fastest call counts."""
TIME_FACTOR = 1.25
"""Two times differ if the whole interval of their ratio is beyond this factor."""
ERRORS = (Measure.ATTITUDE_MAX, Measure.RATES_MAX)
"""Errors to which orders are fitted."""
NO_TIME = (OutcomeKind.SKIPPED, OutcomeKind.TIMEOUT)
NO_STEP = "its accuracy does not depend on dt"
NO_ORDER = Order()


@dataclass(frozen=True, kw_only=True)
class Observation:
    """Measurements of one version of an engine, with one setting, on one scene at the step dt, s.

    Attributes
    ----------
    points
        Errors at shorter and shorter steps; empty for a method whose accuracy does not depend on a step.
    attitude_order, rates_order
        Orders of convergence, over the steps that all versions have.
    error
        Largest attitude error, rad. Its range, and the range of a drift, come from runs with one or two more steps.
    drifts
        Largest relative change of each invariant, by name; signed unless the invariant is a vector.
    """

    scene: str
    setting: str
    version: str
    label: str
    dt: float
    outcome: Outcome = OK
    points: tuple[LinePoint, ...] = ()
    attitude_order: Order = NO_ORDER
    rates_order: Order = NO_ORDER
    error: Range = NOTHING
    drifts: Mapping[str, Range] = field(default_factory=dict)


def observe(study: Study, scene: Scene, method: Method, version: str) -> Observation:
    """Return the observation of a method on a scene; the study has the time limit and the reference solutions."""
    n = grid_for(scene, scene.dt).n_steps
    counts = [n + more for more in MORE_STEPS]
    cases = [Case(study.name, scene, method, Grid(scene.t_end / count, count, math.ceil(count / SAMPLES))) for count in counts]
    setting, dt = method.setting(), cases[0].grid.dt
    observation = Observation(scene=scene.name, setting=setting, version=version, label=method.label, dt=dt)
    first = study.attempt(cases[0])  # at the scene's dt: only its failure is a failure of the setting
    if isinstance(first, Outcome):
        return replace(observation, outcome=first)
    done = [first, *map(study.attempt, cases[1:])]
    runs = [attempt.trajectory for attempt in done if isinstance(attempt, Success)]
    return replace(
        observation,
        points=tuple(_points(study, scene, method)),
        error=Range.of(
            float(angle_between(study.truth(scene, case.grid).trajectory.R_WB, run.R_WB).max())
            for run, case in zip(runs, cases, strict=False)
        ),
        drifts={invariant.name: Range.of(_largest_change(run, invariant) for run in runs) for invariant in scene.invariants},
    )


def _largest_change(run: Trajectory, invariant: Invariant) -> float:
    """Return the largest relative change of an invariant, signed unless it is a vector."""
    change = run.drift(invariant)
    place = int(np.argmax(sizes(change)))
    return float(change[place]) if change.ndim == 1 else float(sizes(change)[place])


def _points(study: Study, scene: Scene, method: Method) -> Iterator[LinePoint]:
    """Yield the errors at shorter and shorter steps, without the runs, which the engine's process would keep."""
    if method.order is None:
        return
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    cases = [Case(study.name, scene, method, grid) for grid in step_ladder.steps(scene, method)]
    for point in measure_line(study, cases, truth, ERRORS):
        yield replace(point, done=point.outcome)  # a `Success` holds its run


def fit_orders(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return the observations of all versions with their orders, over the steps that every version had time for.

    An order depends a little on the steps that it is fitted to. A version with too few steps for a fit does not limit the steps
    of the others.
    """
    reached = [{p.case.grid.dt for p in observation.points if p.outcome.kind not in NO_TIME} for observation in observations]
    enough = [steps for steps in reached if len(steps) >= MIN_POINTS]
    steps = set.intersection(*enough) if enough else set()
    fitted = []
    for seen in observations:
        points = [point for point in seen.points if point.case.grid.dt in steps]
        orders = [Order(reason=NO_STEP)] * 2
        if seen.points:
            dts = [point.case.grid.dt for point in points]
            orders = [observed_order(dts, [point.errors[measure] for point in points]) for measure in ERRORS]
        fitted.append(replace(seen, attitude_order=orders[0], rates_order=orders[1]) if seen.outcome.ok else seen)
    return tuple(fitted)


StepTimes = tuple[float, ...]
"""Shortest time of a step, s, in each repeat."""
EngineLine = Line[Observation, Mapping[str, StepTimes]]
EngineComparison = Comparison[Observation, Mapping[str, StepTimes]]


def ratio(was: StepTimes, now: StepTimes) -> Ratio:
    """Return the ratio of the times (n,), s, of two versions in the same repeats, with its interval; NaN without times."""
    return ratio_of(list(zip(was, now, strict=True)) if was and now else [])


@dataclass
class EngineSide:
    """A version of an engine, its methods, and the study with the time limit and the reference solutions."""

    version: Version
    methods: tuple[Method, ...]
    study: Study

    def measure(self, scene: str) -> Iterator[tuple[str, Observation]]:
        """Yield each setting as tables show it, and its observation on a scene."""
        (definition,) = (candidate for candidate in self.study.scenes if candidate.name == scene)
        for method in self.methods:
            yield method.setting(), observe(self.study, definition, method, self.version.name)


def plan_versions(versions: Sequence[Version], settings: Iterable[str], scene_names: Iterable[str]) -> tuple[EngineSide, ...]:
    """Return the sides of a comparison of two or more versions of an engine, in their order.

    Settings are as in the name of a method, `RK4` or `integrator=RK4`. By default they are the settings that tables show, on
    the scenes of a report that one of them supports.

    Raises
    ------
    BadInput
        There are fewer than two versions, one is there twice, a setting or a scene is unknown, or no setting supports a scene.
    """
    settings, scene_names = tuple(settings), tuple(scene_names)
    require_several([version.name for version in versions])
    engine = versions[-1].environment.engine
    if not settings:
        family: type[EngineMethod] = registry.engine(engine).at_version(versions[-1].name)
        settings = tuple(settings_text(method) for method in family.settings_in_tables())
    methods = [tuple(registry.method(f"{engine}@{version.name}:{setting}") for setting in settings) for version in versions]
    all_methods = tuple(method for row in methods for method in row)
    scenes = selection.scenes(scene_names or selection.DEFAULT_SCENES)
    taken = tuple(scene for scene in scenes if any(method.unsupported(scene) is None for method in all_methods))
    study = Study("track", scenes if scene_names else taken, all_methods, quick=True)
    return tuple(EngineSide(version, row, study) for version, row in zip(versions, methods, strict=True))


def require_several(versions: list[str]) -> None:
    """Raise `BadInput` unless there are two versions or more, all different."""
    if len(set(versions)) < len(versions):
        twice = next(version for version in versions if versions.count(version) > 1)
        raise BadInput("versions", f"{twice!r} twice", "different versions")
    if len(versions) < 2:
        raise BadInput(
            "versions", f"{', '.join(versions) or 'none'}, nothing to compare", "two or more, --last N, or --against"
        )


def compare_engine(sides: Sequence[EngineSide], tell: Progress) -> EngineComparison:
    """Return the comparison of versions of an engine: all settings on all scenes in all versions."""
    study = sides[0].study
    scenes = {scene.name: scene for scene in study.scenes}
    made: EngineComparison = compare(sides, list(scenes), tell)
    lines = []
    for number, line in enumerate(made.lines):
        tell(TIMING + (1 - TIMING) * number / len(made.lines), f"{line.scene}: timing {line.setting}")
        good = {
            side.version.name: next(method for method in side.methods if method.setting() == line.setting)
            for side, seen in zip(sides, line.results, strict=True)
            if seen is not None and seen.outcome.ok
        }
        results = fit_orders([result for result in line.results if result])
        lines.append(replace(line, results=results, times=time_versions(study, scenes[line.scene], good)))
    return replace(made, lines=tuple(lines))


def time_versions(study: Study, scene: Scene, methods: Mapping[str, Method]) -> dict[str, StepTimes]:
    """Return the times of a step by version, from rounds that go through all versions: one version computes at a time.

    Versions whose run fails are left out. If a time differs from the time of the previous version, all are measured again: a
    real difference appears again.
    """
    grid = keep_end(grid_for(scene, scene.dt))
    cases = {version: Case(study.name, scene, method, grid) for version, method in methods.items()}
    tried = {version: study.attempt_here(shorten(study, case, study.expected_cost(case))) for version, case in cases.items()}
    ready = {version: done for version, done in tried.items() if not isinstance(done, Outcome)}
    times = _repeat(study, ready, range(REPEATS))
    if any(ratio(was, now).direction(TIME_FACTOR) for was, now in pairwise(times.values())):
        again = _repeat(study, ready, range(REPEATS, 2 * REPEATS))
        return {version: times[version] + again[version] for version in ready}
    return times


def _repeat(study: Study, ready: Mapping[str, Success], seeds: range) -> dict[str, StepTimes]:
    runs = {version: own_loop(done.run) for version, done in ready.items()}
    repeats = [time_interleaved(runs, ROUNDS, CALL, study.timing_budget, seed) for seed in seeds]
    steps = {version: done.trajectory.counters.steps or math.nan for version, done in ready.items()}
    return {version: tuple(repeat[version].minimum / steps[version] for repeat in repeats) for version in ready}
