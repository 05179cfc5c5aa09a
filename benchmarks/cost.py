"""The studies of cost: wall time of every method at the scene's step, and error against wall time over steps and tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from conservative.method import Grid, Method, grid_for
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from . import errors, ladder
from .accuracy import climb
from .cases import Case, Outcome, attempt
from .measurement import Measurement
from .selection import at_tolerance, series, tolerance_setting
from .timing import Timing, elapsed, interleaved

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
STRETCH = 256
"""Limit of the stretching."""


def end_only(grid: Grid, times: int = 1) -> Grid:
    """Return a grid of `times` as many steps that keeps the start and the end alone."""
    return Grid(grid.dt, grid.n_steps * times, grid.n_steps * times)


def stretched(case: Case, outcome: Outcome) -> tuple[Case, Outcome]:
    """Return the case over so long a time that a call lasts `CALL` s; as it was where the method fails on the way there."""
    assert outcome.run is not None
    times = min(STRETCH, math.ceil(CALL / elapsed(outcome.run)))
    if times == 1:
        return case, outcome
    longer = replace(case, grid=end_only(case.grid, times))
    found = attempt(longer)
    return (longer, found) if found.ok else (case, outcome)


def speed(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield wall times at the scene's own step: each method in its own loop, all interleaved, sampled at the end only."""
    total = len(study.scenes) * (len(study.methods) + 1)
    for i, scene in enumerate(study.scenes):
        grid = end_only(grid_for(scene, scene.dt))
        timed: dict[str, tuple[Case, Outcome, Outcome]] = {}
        for j, method in enumerate(study.methods):
            progress(i * (len(study.methods) + 1) + j, total, f"{scene.name}: preparing {method.name}")
            case = Case(study.name, scene, method, grid)
            outcome = attempt(case, study.skip_missing)
            if outcome.ok:
                timed[method.name] = (*stretched(case, outcome), outcome)
            else:
                yield from case.blanks(SPEED, outcome.status, outcome.detail)
        progress((i + 1) * (len(study.methods) + 1) - 1, total, f"{scene.name}: timing {len(timed)} methods")
        runs = {name: longer.run for name, (_, longer, _) in timed.items() if longer.run is not None}
        timings = interleaved(runs, study.rounds, budget=study.longest_run * study.rounds)
        for name, (case, longer, first) in timed.items():
            yield from speed_rows(case, longer, first, timings[name])


def speed_rows(case: Case, longer: Outcome, first: Outcome, timing: Timing) -> Iterator[Measurement]:
    """Yield the rows of one method; the case is the stretched one, `first` the outcome of the first call ever."""
    assert longer.trajectory is not None
    assert first.cost is not None
    steps, simulated = longer.trajectory.counters.steps, case.grid.dt * case.grid.n_steps
    nan = float("nan")
    values = (
        timing.minimum / steps if steps else nan,
        timing.median / steps if steps else nan,
        timing.minimum / simulated,
        timing.median / simulated,
        first.cost.prepare,
        first.cost.first_call,
    )
    detail = f"{timing} of {simulated:.4g} s, {steps} steps"
    for (measure, unit), value in zip(SPEED, values, strict=True):
        if math.isnan(value):
            yield case.row(measure, value, unit, "unsupported", "its engine does not count steps")
        else:
            yield case.row(measure, value, unit, detail=detail)


def work_precision(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield error and time of every point; rows of one point share scene, method and dt, those of one line their `detail`."""
    methods = series_of(study)
    total = len(study.scenes) * (len(methods) + 1)
    for i, scene in enumerate(study.scenes):
        truth = study.truth(scene, ladder.samples(scene)).trajectory
        timed: list[tuple[Case, Outcome]] = []
        for j, method in enumerate(methods):
            progress(i * (len(methods) + 1) + j, total, f"{scene.name}: errors of {method.name}")
            for case, outcome in climb(points(study, scene, method), study.longest_run, study.skip_missing):
                yield from error_rows(case, outcome, truth)
                if outcome.ok:
                    timed.append((case, outcome))
        progress((i + 1) * (len(methods) + 1) - 1, total, f"{scene.name}: timing {len(timed)} points")
        yield from time_rows(study, timed)


def series_of(study: Study) -> list[Method]:
    """Return one method for each line of the picture: variants that differ in tolerance alone are one line."""
    lines = {series(method): method for method in study.methods if method.room != "truth"}
    return list(lines.values())


def points(study: Study, scene: Scene, method: Method) -> list[Case]:
    """Return the cases of one line, cheap to dear: steps, or tolerances of an adaptive method."""
    setting = tolerance_setting(method)
    if method.order is not None:
        grids = ladder.steps(scene, method)[:: 2 if study.quick else 1]
        return [Case(study.name, scene, method, grid) for grid in grids]
    grid = ladder.samples(scene)
    if setting is None:
        return [Case(study.name, scene, method, grid)]
    tolerances = ladder.TOLERANCES[:: 2 if study.quick else 1]
    return [Case(study.name, scene, at_tolerance(method, setting, tolerance), grid) for tolerance in tolerances]


def error_rows(case: Case, outcome: Outcome, truth: Trajectory) -> list[Measurement]:
    """Return the errors of one point."""
    line = series(case.method)
    if not outcome.ok or outcome.trajectory is None:
        rows = case.blanks([*WORK_PRECISION, (TIME, "s/s")], outcome.status)
        return [replace(row, detail="; ".join(filter(None, (line, outcome.detail)))) for row in rows]
    found = {name: value for name, value, _ in errors.measure(outcome.trajectory, truth)}
    return [case.row(name, found[name], unit, detail=line) for name, unit in WORK_PRECISION]


def time_rows(study: Study, timed: list[tuple[Case, Outcome]]) -> Iterator[Measurement]:
    """Yield the times of all points of a scene, interleaved; the runs timed keep no sample but the last."""
    ready = []
    for case, _ in timed:
        bare = replace(case, grid=end_only(case.grid))
        ready.append(stretched(bare, attempt(bare)))
    runs = {str(k): outcome.run for k, (_, outcome) in enumerate(ready) if outcome.run is not None}
    timings = interleaved(runs, study.rounds, min_time=CALL / 2, budget=study.longest_run)
    for k, (case, _) in enumerate(ready):
        simulated = case.grid.dt * case.grid.n_steps
        yield case.row(TIME, timings[str(k)].minimum / simulated, "s/s", detail=series(case.method))
