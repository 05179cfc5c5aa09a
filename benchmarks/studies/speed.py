"""The study of speed: wall time of every method at the scene's step, and the time to prepare a run.

Preparation and first call do not include compilation: a report runs other studies first, in the same process. Preparation is
then the conversion of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from conservative.grid import Grid, grid_for
from conservative.method import Run
from conservative.outcome import OK, Outcome, OutcomeKind

from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from ..measures.timing import Timing, time_interleaved, wall_time
from .case import Case, Success
from .declaration import Declaration
from .study import Progress, Study
from .time_limit import is_known_to_end

MEASURES = (
    Measure.TIME_PER_STEP,
    Measure.TIME_PER_STEP_MEDIAN,
    Measure.TIME,
    Measure.TIME_MEDIAN,
    Measure.PREPARE,
    Measure.FIRST_CALL,
)
CALL = 0.004
"""Target duration of a timed call, s, for which the overhead of a call is a few percent."""
TRIAL = 8
"""Number of steps of the run that determines the speed of a foreign method."""
LONGEST = 2**16
"""Largest factor by which the number of steps of a timed run increases."""
ROUNDS = 5
"""Largest number of rounds for each of hundreds of points."""
Runs = dict[tuple[Case, Measure], tuple[Case, Callable[[], Any]]]
"""Timed cases and runs, by the case and the measure of their rows."""
UNCOUNTED = Outcome(OutcomeKind.UNSUPPORTED, "its engine does not count steps")


def keep_end(grid: Grid, times: int = 1) -> Grid:
    """Return a grid with `times` as many steps, initial and final state only."""
    return Grid(grid.dt, grid.n_steps * times, grid.n_steps * times)


def make_timed(study: Study, case: Case) -> tuple[Case, Success] | Outcome:
    """Return a case to be timed and its result, with the cost of the first run, or the outcome of its failure.

    It has so many steps that a call takes about `CALL` s, or the most steps that do not fail. Their number is determined in
    several rounds, because a short call is mostly overhead.
    """
    done = study.attempt_here(case)
    if isinstance(done, Outcome):
        return done
    longest, cost, times = case, done.cost, 1
    while times < LONGEST and (spent := _shortest(done.run)) < CALL / 2:
        times = min(LONGEST, times * max(2, math.ceil(CALL / spent)))
        longer = replace(case, grid=keep_end(case.grid, times))
        again = study.attempt_here(longer)
        if isinstance(again, Outcome):
            break
        longest, done = longer, again
    return longest, replace(done, cost=cost)


def _shortest(run: Run) -> float:
    """Return the wall time of a call, s: the smallest of three, or the first if it is far too long."""
    spent = wall_time(run)
    return spent if spent > 10 * CALL else min(spent, wall_time(run), wall_time(run))


def shorten(study: Study, case: Case) -> Case:
    """Return the case, with fewer steps if a foreign method would exceed the time budget."""
    if is_known_to_end(case.method):
        return case
    few = replace(case, grid=keep_end(replace(case.grid, n_steps=min(TRIAL, case.grid.n_steps))))
    trials = [study.attempt(few) for _ in range(2)]  # the first may compile
    spent = [trial.cost.first_call for trial in trials if isinstance(trial, Success)]
    if not spent:
        return few
    affordable = int(few.grid.n_steps * study.longest_run / max(min(spent), 1e-9))
    n = min(case.grid.n_steps, max(few.grid.n_steps, affordable))
    return replace(case, grid=Grid(case.grid.dt, n, n))


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield wall times at the scene's step size, final state only: each method in its own loop, all interleaved."""
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        ready: dict[Case, Success] = {}
        for method in study.competitors:
            tell(f"{scene.name}: preparing {method.name}")
            scene.forget()  # so that the scene is converted again; compiled code stays warm
            case = shorten(study, Case(study.name, scene, method, keep_end(grid_for(scene, scene.dt))))
            timed = make_timed(study, case)
            if isinstance(timed, Outcome):
                yield from case.rows(blanks(*MEASURES), timed)
            else:
                ready.update([timed])
        tell(f"{scene.name}: timing {len(ready)} methods")
        yield from time_steps(study, ready)


def time_steps(study: Study, ready: Mapping[Case, Success]) -> Iterator[Measurement]:
    """Yield the `MEASURES` of runs, all in interleaved rounds."""
    timings = time_interleaved({case: done.run for case, done in ready.items()}, study.rounds, budget=study.timing_budget)
    for case, timing in timings.items():
        yield from times(case, ready[case], timing)


def times(case: Case, done: Success, timing: Timing) -> Iterator[Measurement]:
    """Yield the rows of one method."""
    steps, simulated = done.trajectory.counters.steps or math.nan, case.grid.dt * case.grid.n_steps
    values = (
        timing.minimum / steps,
        timing.median / steps,
        timing.minimum / simulated,
        timing.median / simulated,
        done.cost.prepare,
        done.cost.first_call,
    )
    detail = f"{timing} of {simulated:.4g} s, {steps} steps"
    for measure, value in zip(MEASURES, values, strict=True):
        outcome = OK if not math.isnan(value) else UNCOUNTED if timing.outcome.ok else timing.outcome
        yield case.row(Value(measure, value), outcome, detail if outcome.ok else "")


def time_cases(study: Study, cases: Iterable[Case], processes: Processes) -> Iterator[Measurement]:
    """Yield the times of cases, final state only; see `time_runs`."""
    ready: Runs = {}
    for case in cases:
        timed = make_timed(study, replace(case, grid=keep_end(case.grid)))
        if isinstance(timed, Outcome):
            yield case.row(Value(Measure.TIME, math.nan), timed)
        else:
            longest, done = timed
            ready[case, Measure.TIME] = longest, done.run
    yield from time_runs(study, ready, processes)


def time_runs(
    study: Study,
    ready: Runs,
    processes: Processes,
    rounds: int = 0,
    min_time: float = CALL / 2,
    budget: float = 0.0,
    own_loop: tuple[Measure, ...] = (Measure.TIME_OWN_LOOP,),
) -> Iterator[Measurement]:
    """Yield the times of runs, s per simulated second, all in interleaved rounds, a row for each process.

    For rounds, min_time and budget see `time_interleaved`; 0 stands for those of the study. `own_loop` are the measures of runs
    without the conversion of samples.
    """
    timings = processes.time(
        {key: run for key, (_, run) in ready.items()},
        {key: partial(prepare_loop, case, key[1] in own_loop) for key, (case, _) in ready.items()},
        limit=study.hang_limit * (1 + len(ready)),
        rounds=rounds or min(study.rounds, ROUNDS),
        min_time=min_time,
        budget=budget or study.timing_budget / 2,
        shared=list({case.scene: None for case, _ in ready}),
    )
    for key, each in timings.items():
        case, _ = ready[key]
        yield from key[0].time_rows(key[1], each, case.grid.dt * case.grid.n_steps)


def prepare_loop(case: Case, own: bool) -> Callable[[], Any]:
    """Return the run of a case; if `own`, without the conversion of its samples, if it can be run without one."""
    run = case.method.prepare(case.scene, case.grid)
    run()  # so that engines find their limits outside of the loop
    return getattr(run, "own_loop", run) if own else run


STUDY = Declaration(findings, timed=True)
