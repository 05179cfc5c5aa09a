"""The work-precision study: error and wall time over step sizes, and over tolerances of adaptive methods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from conservative.method import Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.timing import time_interleaved
from . import step_ladder
from .case import Case, Failure, Success
from .convergence import attempt_each
from .selection import at_tolerance, series, tolerance_setting
from .speed import CALL, Extend, TimedRun, keep_end, make_timed
from .study import Progress, Study

ERRORS = (Measure.ATTITUDE_FINAL, Measure.ATTITUDE_MAX)
ROUNDS = 5
"""Largest number of rounds for each of the hundreds of points."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield error and time of every point. Rows of a point share scene, method and dt; those of a line share their series."""
    methods = one_of_each_series(study)
    tell = study.count(progress, len(methods) + 1)
    for scene in study.scenes:
        good: list[Case] = []
        for method in methods:
            tell(f"{scene.name}: errors of {method.name}")
            truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
            for case, outcome in attempt_each(study, points(study, scene, method)):
                yield from error_rows(case, outcome, truth)
                good += [case] * isinstance(outcome, Success)
        tell(f"{scene.name}: timing {len(good)} points")
        yield from time_rows(study, good, {Measure.TIME: keep_end})


def one_of_each_series(study: Study) -> list[Method]:
    """Return one method for each line of the chart. Variants that differ only in their tolerance are one line."""
    return list({series(method): method for method in study.competitors}.values())


def points(study: Study, scene: Scene, method: Method) -> list[Case]:
    """Return the cases of one line, coarse to fine: step sizes, or tolerances of an adaptive method."""
    setting = tolerance_setting(method)
    if method.unsupported(scene):
        return [Case(study.name, scene, method, step_ladder.samples(scene, method))]  # unsupported: a single row
    if method.order is not None:
        longest = step_ladder.LENGTH if method.order == 1 else None  # finer steps are slow and still inaccurate
        grids = step_ladder.steps(scene, method)[:longest][:: 2 if study.quick else 1]
        return [Case(study.name, scene, method, grid) for grid in grids]
    grid = step_ladder.samples(scene, method)
    if setting is None:
        return [Case(study.name, scene, method, grid)]
    tolerances = {*(step_ladder.TOLERANCES[1::3] if study.quick else step_ladder.TOLERANCES), getattr(method, setting)}
    return [Case(study.name, scene, at_tolerance(method, setting, value), grid) for value in sorted(tolerances, reverse=True)]


def error_rows(case: Case, outcome: Success | Failure, truth: Trajectory) -> list[Measurement]:
    """Return the errors of one point, or all its rows without values if it failed."""
    if isinstance(outcome, Failure):
        return case.blanks(blanks(*ERRORS, Measure.TIME), outcome.outcome)
    by_measure = {value.measure: value for value in errors.measure_errors(outcome.trajectory, truth)}
    return [case.row(by_measure[measure]) for measure in ERRORS]


def time_rows(study: Study, cases: list[Case], kept: Mapping[Measure, Extend]) -> Iterator[Measurement]:
    """Yield the times of cases, s per simulated second, all in interleaved rounds.

    `kept` has what is timed of each, and the grid of its runs: that of the case, with so many times as many steps.
    """
    ready: dict[tuple[Case, Measure], TimedRun] = {}
    for case in cases:
        for measure, keep in kept.items():
            timed = make_timed(study, replace(case, grid=keep(case.grid, 1)), keep)
            if isinstance(timed, Failure):
                yield from case.blanks(blanks(measure), timed.outcome)
            else:
                ready[case, measure] = timed
    runs = {key: timed.done.run for key, timed in ready.items()}
    timings = time_interleaved(runs, min(study.rounds, ROUNDS), min_time=CALL / 2, budget=study.timing_budget / 2)
    for (case, measure), timing in timings.items():
        value = Value(measure, timing.minimum / ready[case, measure].simulated)
        yield ready[case, measure].case.row(value, timing.outcome, str(timing) if timing.outcome.ok else "")
