"""Runs that store every step: the time to reach an attitude error.

`work_precision` reads twelve samples, so a method of high order can take one step from sample to sample. Samples at short
intervals cost more: a method with a step size takes one or more steps per interval, and a method with a tolerance interpolates
within its longer steps.

* The setting of a method is the coarsest that is credited (see `speed_ratio`) with an attitude error over all samples of at
  most `ERROR`: a finer setting with a larger error disqualifies it. A method without such a setting has errors and no time.
* It is timed twice, interleaved with all others: with all samples stored as attitude matrices and rates, and with the final
  state only, as in all other studies. For an engine the first includes the conversion of its states, which one compiled loop
  does for all engines in 10 to 40 ns per sample; the engine's own loop is timed as well, without it.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator
from dataclasses import replace

from conservative.grid import Grid, grid_for
from conservative.method import Method, Role
from conservative.outcome import Outcome
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from ..speed_ratio import credit, first_within
from .case import Case, Success
from .declaration import Declaration, Extent
from .line import LinePoint, list_settings, measure_line
from .speed import Runs, check_end, is_timed_once, keep_end, time_once, time_runs
from .study import Progress, Study

ERROR = 1e-6
"""Attitude error, rad, that a timed method has to reach."""
STEPS = (1, 2, 4, 8)
"""Steps per interval."""
TOLERANCES = tuple(10.0**-k for k in range(4, 13))
"""Tolerances of methods that have one."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the errors of the settings of every method, and both times of the coarsest that is credited with `ERROR`."""
    tell = study.count(progress, len(study.lines) + 1)
    with Processes(study.processes) as processes:
        for scene in study.scenes:
            truth = study.truth(scene, grid_for(scene, scene.dt)).trajectory
            chosen: list[LinePoint] = []
            for method, same in study.programs(scene):
                tell(f"{scene.name}: errors of {method.name}")
                if same:
                    yield Case(study.name, scene, method, grid_for(scene, scene.dt)).row(Value(Measure.TIME, math.nan), same)
                    continue
                chosen += yield from choose_setting(study, scene, method, truth)
            tell(f"{scene.name}: timing {len(chosen)} methods")
            yield from time_chosen(study, chosen, processes)


def choose_setting(
    study: Study, scene: Scene, method: Method, truth: Trajectory
) -> Generator[Measurement, None, list[LinePoint]]:
    """Yield the errors of a method's settings; return the coarsest that is credited with `ERROR`, or an empty list."""
    grid = grid_for(scene, scene.dt)
    grids, tolerances = [Grid(grid.dt / k, grid.n_steps * k, k) for k in STEPS], TOLERANCES[:: 2 if study.quick else 1]
    settings = list_settings(Case(study.name, scene, method, grid), grids, tolerances)
    line: list[LinePoint] = []
    for point in measure_line(study, settings, truth, [Measure.ATTITUDE_MAX]):
        yield from point.rows()
        if point.outcome.ok:
            line.append(point)
    first = first_within(credit([point.errors[Measure.ATTITUDE_MAX] for point in line]), ERROR)
    return [] if first is None else [line[first]]


def time_chosen(study: Study, chosen: Iterable[LinePoint], processes: Processes) -> Iterator[Measurement]:
    """Yield the times of a scene's points over the motion of their errors, s per simulated second, a row for each process."""
    ready: Runs = {}
    for point in chosen:
        case = point.case
        for measure, grid in ((Measure.TIME_SAMPLED, case.grid), (Measure.TIME, keep_end(case.grid))):
            timed = replace(case, grid=grid)
            done = study.attempt_here(timed)
            if isinstance(done, Success) and isinstance(point.done, Success):
                same = check_end(point.done.trajectory, done.trajectory, point.errors[Measure.ATTITUDE_MAX])
                done = done if same.ok else same
            if isinstance(done, Outcome):
                yield case.row(Value(measure, math.nan), done)
                continue
            if is_timed_once(study, timed):
                yield time_once(case, measure, done)
                continue
            ready[case, measure] = timed, done.run
            if measure == Measure.TIME_SAMPLED and case.method.role == Role.ENGINE and hasattr(done.run, "own_loop"):
                ready[case, Measure.TIME_OWN_LOOP] = timed, done.run
    yield from time_runs(study, ready, processes)


STUDY = Declaration(findings, Extent.FULL, timed=True, in_turn=True)
