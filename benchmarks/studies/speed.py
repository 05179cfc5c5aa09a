"""The study of speed: wall time of every method at the scene's step, and the time to prepare a run.

Preparation and first call do not include compilation: a report runs other studies first, in the same process. Preparation is
then the conversion of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from conservative.grid import Grid, grid_for
from conservative.method import Run
from conservative.outcome import OK

from ..measures.measure import Measure, Value, blanks
from ..measures.measurement import Measurement
from ..measures.timing import Timing, time_interleaved, wall_time
from .case import Case, Failure, Success, fail_unsupported
from .study import HANG_LIMIT, Progress, Study
from .time_limit import attempt_here, attempt_within, is_known_to_end

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
"""Steps of the run that determines the speed of a foreign method."""
LONGEST = 2**16
"""Largest factor by which the number of steps of a timed run increases."""
Extend = Callable[[Grid, int], Grid]
"""Maps a grid and a factor to a grid with that many times as many steps."""
UNCOUNTED = fail_unsupported("its engine does not count steps").outcome


def keep_end(grid: Grid, times: int = 1) -> Grid:
    """Return a grid with `times` as many steps, initial and final state only."""
    return Grid(grid.dt, grid.n_steps * times, grid.n_steps * times)


def shorten(study: Study, case: Case) -> Case:
    """Return the case, with fewer steps if a foreign method would exceed the time budget."""
    few = replace(case, grid=keep_end(replace(case.grid, n_steps=min(TRIAL, case.grid.n_steps))))
    if is_known_to_end(case.method):
        return case
    trials = [attempt_within(study.hang_limit, few, skip_missing=True) for _ in range(2)]  # the first may compile
    spent = [trial.cost.first_call for trial in trials if isinstance(trial, Success)]
    if not spent:
        return few
    affordable = int(few.grid.n_steps * study.longest_run / max(min(spent), 1e-9))
    n = min(case.grid.n_steps, max(few.grid.n_steps, affordable))
    return replace(case, grid=Grid(case.grid.dt, n, n))


def lengthen(case: Case, done: Success, limit: float = HANG_LIMIT, extend: Extend = keep_end) -> tuple[Case, Success]:
    """Return the case with so many steps that a call takes about `CALL` s, or with the most steps that do not fail.

    No run may take more than `limit` s. `extend` determines the samples. The number is found in several rounds, because a short
    call is mostly overhead.
    """
    bare, times = case, 1
    while times < LONGEST and (spent := _shortest(done.run)) < CALL / 2:
        times = min(LONGEST, times * max(2, math.ceil(CALL / spent)))
        longer = replace(bare, grid=extend(bare.grid, times))
        outcome = attempt_here(limit, longer)
        if not isinstance(outcome, Success):
            break
        case, done = longer, outcome
    return case, done


def _shortest(run: Run) -> float:
    """Return the wall time of a call, s: the smallest of three, or the first if it is far too long."""
    spent = wall_time(run)
    return spent if spent > 10 * CALL else min(spent, wall_time(run), wall_time(run))


@dataclass(frozen=True, eq=False)
class TimedRun:
    """A case to be timed: the timed case, and the first call."""

    case: Case
    done: Success
    first: Success

    @property
    def simulated(self) -> float:
        """Simulated time of one timed call, s."""
        return self.case.grid.dt * self.case.grid.n_steps


def make_timed(study: Study, case: Case, extend: Extend = keep_end) -> TimedRun | Failure:
    """Return a case that is ready to be timed, with as many steps as fill a call, or its failure."""
    outcome = attempt_here(study.hang_limit, case, study.skip_missing)
    if isinstance(outcome, Failure):
        return outcome
    return TimedRun(*lengthen(case, outcome, study.hang_limit, extend), outcome)


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield wall times at the scene's step size, final state only: each method in its own loop, all interleaved."""
    tell = study.count(progress, len(study.competitors) + 1)
    for scene in study.scenes:
        ready: list[TimedRun] = []
        for method in study.competitors:
            tell(f"{scene.name}: preparing {method.name}")
            scene.forget()  # so that the scene is converted again; compiled code stays warm
            case = shorten(study, Case(study.name, scene, method, keep_end(grid_for(scene, scene.dt))))
            timed = make_timed(study, case)
            if isinstance(timed, Failure):
                yield from case.blanks(blanks(*MEASURES), timed.outcome)
            else:
                ready.append(timed)
        tell(f"{scene.name}: timing {len(ready)} methods")
        timings = time_interleaved({timed: timed.done.run for timed in ready}, study.rounds, budget=study.timing_budget)
        for timed, timing in timings.items():
            yield from times(timed, timing)


def times(timed: TimedRun, timing: Timing) -> Iterator[Measurement]:
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
    for measure, value in zip(MEASURES, values, strict=True):
        outcome = OK if not math.isnan(value) else UNCOUNTED if timing.outcome.ok else timing.outcome
        yield timed.case.row(Value(measure, value), outcome, detail if outcome.ok else "")
