"""The studies of cost: wall time of every method at the scene's step, and error against wall time over steps and tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from conservative.method import Grid, Method, Role, grid_for
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measurement import Measurement
from ..measures.timing import Timing, elapsed, interleaved
from . import step_ladder
from .case import Case, Done, Failed, attempt
from .paper import climb
from .selection import at_tolerance, series, tolerance_setting

if TYPE_CHECKING:
    from .studies import Progress, Study

SPEED = (
    ("time per step", "s"),
    ("time per step median", "s"),
    ("time per simulated second", "s/s"),
    ("time per simulated second median", "s/s"),
    ("prepare time", "s"),
    ("first call time", "s"),
)
WORK_PRECISION = (("attitude error final", "rad"), ("attitude error max", "rad"))
TIME = "time per simulated second"
CALL = 0.004
"""Duration, s, that one timed call is stretched to, so that what a call costs beside its steps stays a few per cent."""
STRETCH = 2**16
"""Limit of the stretching."""
POINT_ROUNDS = 5
"""Rounds at most for each of the hundreds of points of a picture over many decades."""


def end_only(grid: Grid, times: int = 1) -> Grid:
    """Return a grid of `times` as many steps that keeps the start and the end alone."""
    return Grid(grid.dt, grid.n_steps * times, grid.n_steps * times)


def stretched(case: Case, done: Done) -> tuple[Case, Done]:
    """Return the case over so long a time that a call lasts about `CALL` s; as long as it gets there where the method fails.

    In several goes: the first, short runs are mostly what a call costs beside its steps, and say little of the steps.
    """
    bare, times = case, 1
    while times < STRETCH and (spent := elapsed(done.run)) < CALL / 2:
        times = min(STRETCH, times * max(2, math.ceil(CALL / spent)))
        longer = replace(bare, grid=end_only(bare.grid, times))
        found = attempt(longer)
        if not isinstance(found, Done):
            break
        case, done = longer, found
    return case, done


@dataclass(frozen=True)
class Timed:
    """A case to be timed: as it is timed, and as it was at the first call."""

    case: Case
    done: Done
    first: Done

    @property
    def simulated(self) -> float:
        """Simulated time of one timed call, s."""
        return self.case.grid.dt * self.case.grid.n_steps


def speed(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield wall times at the scene's own step: each method in its own loop, all interleaved, sampled at the end only."""
    methods = [method for method in study.methods if method.role != Role.TRUTH]
    pieces = len(methods) + 1
    for i, scene in enumerate(study.scenes):
        grid = end_only(grid_for(scene, scene.dt))
        ready: dict[str, Timed] = {}
        for j, method in enumerate(methods):
            progress(i * pieces + j, len(study.scenes) * pieces, f"{scene.name}: preparing {method.name}")
            # A copy, as conversions are kept for each scene, and other studies have paid for this one's.
            case = Case(study.name, copy(scene), method, grid)
            outcome = attempt(case, study.skip_missing)
            if isinstance(outcome, Done):
                ready[method.name] = Timed(*stretched(case, outcome), outcome)
            else:
                yield from case.blanks(SPEED, outcome.status, outcome.detail)
        progress((i + 1) * pieces - 1, len(study.scenes) * pieces, f"{scene.name}: timing {len(ready)} methods")
        timings = interleaved({name: timed.done.run for name, timed in ready.items()}, study.rounds, budget=study.timing_budget)
        for name, timed in ready.items():
            yield from speed_rows(timed, timings[name])


def speed_rows(timed: Timed, timing: Timing) -> Iterator[Measurement]:
    """Yield the rows of one method."""
    steps = timed.done.trajectory.counters.steps or math.nan
    values = (
        timing.minimum / steps,
        timing.median / steps,
        timing.minimum / timed.simulated,
        timing.median / timed.simulated,
        timed.first.cost.prepare,
        timed.first.cost.first_call,
    )
    detail = f"{timing} of {timed.simulated:.4g} s, {steps} steps"
    for (measure, unit), value in zip(SPEED, values, strict=True):
        if math.isnan(value):
            yield timed.case.row(measure, value, unit, "unsupported", "its engine does not count steps")
        else:
            yield timed.case.row(measure, value, unit, detail=detail)


def work_precision(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield error and time of every point; rows of one point share scene, method and dt, those of one line their `detail`."""
    methods = series_of(study)
    pieces = len(methods) + 1
    for i, scene in enumerate(study.scenes):
        good: list[Case] = []
        for j, method in enumerate(methods):
            progress(i * pieces + j, len(study.scenes) * pieces, f"{scene.name}: errors of {method.name}")
            truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
            for case, outcome in climb(points(study, scene, method), study.longest_run, study.skip_missing):
                yield from error_rows(case, outcome, truth)
                good += [case] * isinstance(outcome, Done)
        progress((i + 1) * pieces - 1, len(study.scenes) * pieces, f"{scene.name}: timing {len(good)} points")
        yield from time_rows(study, good)


def series_of(study: Study) -> list[Method]:
    """Return one method for each line of the picture: variants that differ in tolerance alone are one line."""
    lines = {series(method): method for method in study.methods if method.role != Role.TRUTH}
    return list(lines.values())


def points(study: Study, scene: Scene, method: Method) -> list[Case]:
    """Return the cases of one line, cheap to dear: steps, or tolerances of an adaptive method."""
    setting = tolerance_setting(method)
    if method.unsupported(scene):
        return [Case(study.name, scene, method, step_ladder.samples(scene, method))]  # its one row says so
    if method.order is not None:
        longest = step_ladder.LENGTH if method.order == 1 else None  # what comes after is dear and still far off
        grids = step_ladder.steps(scene, method)[:longest][:: 2 if study.quick else 1]
        return [Case(study.name, scene, method, grid) for grid in grids]
    grid = step_ladder.samples(scene, method)
    if setting is None:
        return [Case(study.name, scene, method, grid)]
    tolerances = {*step_ladder.TOLERANCES[:: 2 if study.quick else 1], getattr(method, setting)}
    return [Case(study.name, scene, at_tolerance(method, setting, value), grid) for value in sorted(tolerances, reverse=True)]


def error_rows(case: Case, outcome: Done | Failed, truth: Trajectory) -> list[Measurement]:
    """Return the errors of one point; of one that failed the time as well, all without values."""
    line = series(case.method)
    if isinstance(outcome, Failed):
        detail = f"{line}; {outcome.detail}" if outcome.detail else line
        return case.blanks([*WORK_PRECISION, (TIME, "s/s")], outcome.status, detail)
    found = {name: value for name, value, _ in errors.measure(outcome.trajectory, truth)}
    return [case.row(name, found[name], unit, detail=line) for name, unit in WORK_PRECISION]


def time_rows(study: Study, cases: list[Case]) -> Iterator[Measurement]:
    """Yield the times of all points of a scene, interleaved; the runs timed keep no sample but the last."""
    ready: dict[str, Timed] = {}
    for case in cases:
        bare = replace(case, grid=end_only(case.grid))
        outcome = attempt(bare)
        if isinstance(outcome, Done):
            ready[str(len(ready))] = Timed(*stretched(bare, outcome), outcome)
        else:
            yield from case.blanks([(TIME, "s/s")], outcome.status, series(case.method))
    runs = {key: timed.done.run for key, timed in ready.items()}
    timings = interleaved(runs, min(study.rounds, POINT_ROUNDS), min_time=CALL / 2, budget=study.timing_budget / 2)
    for key, timed in ready.items():
        yield timed.case.row(TIME, timings[key].minimum / timed.simulated, "s/s", detail=series(timed.case.method))
