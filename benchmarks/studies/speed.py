"""Wall time of every method at the scene's step, and the time to prepare a run.

Preparation and first call do not include compilation: a report runs other studies first, in the same process. Preparation is
then the conversion of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from conservative.attitude import angle_between
from conservative.grid import Grid, grid_for
from conservative.method import Run
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.environments.engine_method import EngineMethod
from conservative.references.worker.client import time_limit
from conservative.trajectory import Trajectory

from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from ..measures.timing import Timing, time_interleaved
from .case import Case, Success
from .declaration import Declaration
from .line import LinePoint
from .study import Progress, Study

MEASURES = (
    Measure.TIME_PER_STEP,
    Measure.TIME_PER_STEP_MEDIAN,
    Measure.TIME,
    Measure.TIME_MEDIAN,
    Measure.PREPARE,
    Measure.FIRST_CALL,
)
CALL = 1e-4
"""Shortest timed sample, s. A faster run is repeated within a sample, each time from the initial state over the same motion."""
SAME = 1e-12
"""Largest angle, rad, between two final attitudes that differ by round-off only."""
Runs = dict[tuple[Case, Measure], tuple[Case, Callable[[], Any]]]
"""Timed cases and their runs, by the case and the measure of their rows."""
UNCOUNTED = Outcome(OutcomeKind.UNSUPPORTED, "its engine does not count steps")


def keep_end(grid: Grid) -> Grid:
    """Return a grid over the same motion, initial and final state only."""
    return Grid(grid.dt, grid.n_steps, grid.n_steps)


def own_loop(run: Run) -> Callable[[], Any]:
    """Return the part of a run that is timed: without the conversion of its samples, if it can be run without one."""
    return getattr(run, "own_loop", run)


def final_call(run: Run) -> Callable[[], Any]:
    """Return the call of a user that delivers the final attitude R_WB and rates w_WB_B.

    It is the run itself, whose trajectory has both. An engine's run has a shorter one: the engine's own calls, and the
    conversion of the final state alone.
    """
    return getattr(run, "final_call", run)


_PARTS: dict[Measure, Callable[[Run], Callable[[], Any]]] = {
    Measure.TIME_SAMPLED: lambda run: run,
    Measure.TIME_DELIVERED: final_call,
}
"""The timed part of a run by the measure of its time. It is `own_loop` for any other one."""


def timed_part(run: Run, measure: Measure) -> Callable[[], Any]:
    """Return the part of a run that a measure times."""
    return _PARTS.get(measure, own_loop)(run)


def attempt_short(study: Study, case: Case) -> tuple[Case, Success | Outcome]:
    """Return the case and its result, with fewer steps if its steps are slow and would exceed the time budget.

    How long an engine in an environment of its own takes is known from its first run, which compiles nothing of ours.
    """
    case = shorten(study, case, study.expected_cost(case))
    done = study.attempt_here(case)
    if isinstance(case.method, EngineMethod) and isinstance(done, Success) and done.cost.first_call > study.longest_run:
        case = shorten(study, case, done.cost.first_call)
        done = study.attempt_here(case)
    return case, done


def shorten(study: Study, case: Case, cost: float) -> Case:
    """Return the case, whose run takes `cost` s, with as many steps as the time budget allows."""
    if cost <= study.longest_run:
        return case
    n = max(1, min(case.grid.n_steps, int(case.grid.n_steps * study.longest_run / cost)))
    return replace(case, grid=Grid(case.grid.dt, n, n))


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield wall times at the scene's step size, final state only: each method in its own loop, all interleaved."""
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        ready: dict[Case, Success] = {}
        for method in study.competitors:
            tell(f"{scene.name}: preparing {method.name}")
            scene.forget()  # so that the scene is converted again; compiled code stays warm
            case, done = attempt_short(study, Case(study.name, scene, method, keep_end(grid_for(scene, scene.dt))))
            if isinstance(done, Outcome):
                yield from case.rows(blanks(*MEASURES), done)
            else:
                ready[case] = done
        tell(f"{scene.name}: timing {len(ready)} methods")
        yield from time_steps(study, ready)


def time_steps(study: Study, ready: Mapping[Case, Success]) -> Iterator[Measurement]:
    """Yield the `MEASURES` of runs, all in interleaved rounds."""
    loops = {case: own_loop(done.run) for case, done in ready.items()}
    with time_limit(study.hang_limit):
        timings = time_interleaved(loops, study.rounds, CALL, study.timing_budget)
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


def check_end(credited: Trajectory, timed: Trajectory, error: float) -> Outcome:
    """Return `OK`, or the reason why a run is not timed: it ends further from the run with known errors than the error, rad.

    An integrator that starts again at samples takes other steps without them.
    """
    apart = float(angle_between(credited.R_WB[-1], timed.R_WB[-1]))
    if apart <= max(error, SAME):
        return OK
    return Outcome(OutcomeKind.SKIPPED, f"without samples it ends {apart:.1g} rad from the run with known errors")


def time_cases(study: Study, points: Iterable[LinePoint], processes: Processes) -> Iterator[Measurement]:
    """Yield the times of points, final state only; see `time_runs` and `check_end`."""
    ready: Runs = {}
    for point in points:
        case, timed = point.case, replace(point.case, grid=keep_end(point.case.grid))
        done = study.attempt_here(timed)
        if isinstance(done, Success) and isinstance(point.done, Success):
            same = check_end(point.done.trajectory, done.trajectory, point.errors[Measure.ATTITUDE_MAX])
            done = done if same.ok else same
        if isinstance(done, Outcome):
            yield case.row(Value(Measure.TIME, math.nan), done)
        elif is_timed_once(study, timed):
            yield time_once(case, Measure.TIME, done)
        else:
            ready[case, Measure.TIME] = timed, done.run
    yield from time_runs(study, ready, processes)


def is_timed_once(study: Study, case: Case) -> bool:
    """Return whether a run that calls Python functions is too long for rounds: five of them would take most of a report."""
    return case.scene.calls_python and study.expected_cost(case) > study.longest_run


def time_once(case: Case, measure: Measure, done: Success) -> Measurement:
    """Return the time of the only run of a case that is too long for rounds, s per simulated second."""
    spent = done.cost.first_call
    return case.time_rows(measure, [Timing(spent, spent, 1, 1)], case.grid.dt * case.grid.n_steps)[0]


def time_runs(study: Study, ready: Runs, processes: Processes) -> Iterator[Measurement]:
    """Yield the times of runs, s per simulated second, all in interleaved rounds, a row for each process.

    The measure of a run determines what is timed; see `timed_part`.
    """
    with time_limit(study.hang_limit):
        timings = processes.time(
            {key: timed_part(run, key[1]) for key, (_, run) in ready.items()},
            {key: partial(prepare_timed, case, key[1]) for key, (case, _) in ready.items()},
            limit=study.hang_limit * (1 + len(ready)),
            rounds=study.rounds,
            min_time=CALL,
            budget=study.timing_budget / 4,
            shared=list({case.scene: None for case, _ in ready}),
        )
    for key, of_processes in timings.items():
        case, _ = ready[key]
        yield from key[0].time_rows(key[1], of_processes, case.grid.dt * case.grid.n_steps)


def prepare_timed(case: Case, measure: Measure) -> Callable[[], Any]:
    """Return the part of a case that a measure times, prepared."""
    run = case.method.prepare(case.scene, case.grid)
    run()  # so that engines find their limits outside of the loop
    return timed_part(run, measure)


STUDY = Declaration(findings, named=True, timed=True)
