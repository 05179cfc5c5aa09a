"""The study of runs that store every step of a scene: the time for an attitude error.

`work_precision` reads twelve samples, so a method of high order can take one step from sample to sample. Samples at short
intervals cost more: a method with a step size takes one or more steps per interval, and a method with a tolerance interpolates
within its longer steps.

* The setting of a method is the coarsest whose largest attitude error over all samples is at most `ERROR`. A method without
  such a setting has errors and no time.
* It is timed twice, interleaved with all others: with all samples stored as attitude matrices and rates, which for an engine
  includes the conversion of its state (heyoka takes 0.4 to 0.7 µs per sample on the brick, including about 0.2 µs of its own);
  and with the final state only, as in all other studies.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator

from conservative.grid import Grid, grid_for
from conservative.method import Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measure import Measure
from ..measures.measurement import Measurement
from ..measures.processes import Processes
from .case import Case
from .line import list_settings, measure_line
from .speed import Extend, keep_end, time_cases
from .study import Progress, Study

ERROR = 1e-6
"""Attitude error, rad, that a timed method has to reach."""
STEPS = (1, 2, 4, 8)
"""Steps per interval."""
TOLERANCES = tuple(10.0**-k for k in range(4, 13))


def keep_each(grid: Grid, times: int = 1) -> Grid:
    """Return a grid with `times` as many steps and as many samples."""
    return Grid(grid.dt, grid.n_steps * times, grid.every)


KEPT: dict[Measure, Extend] = {Measure.TIME_SAMPLED: keep_each, Measure.TIME: keep_end}
"""The timed measures, and the functions that lengthen the grid of their runs."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield the errors of every method up to the setting that reaches `ERROR`, and both times of that setting."""
    tell = study.count(progress, len(study.lines) + 1)
    with Processes(study.processes) as processes:
        for scene in study.scenes:
            truth = study.truth(scene, grid_for(scene, scene.dt)).trajectory
            chosen: list[Case] = []
            for method in study.lines:
                tell(f"{scene.name}: errors of {method.name}")
                chosen += yield from choose_setting(study, scene, method, truth)
            tell(f"{scene.name}: timing {len(chosen)} methods")
            yield from time_cases(study, chosen, KEPT, processes)


def choose_setting(study: Study, scene: Scene, method: Method, truth: Trajectory) -> Generator[Measurement, None, list[Case]]:
    """Yield the errors of a method's settings, coarse to fine; return the first that reaches `ERROR`, or an empty list."""
    grid = grid_for(scene, scene.dt)
    grids, tolerances = [Grid(grid.dt / k, grid.n_steps * k, k) for k in STEPS], TOLERANCES[:: 2 if study.quick else 1]
    settings = list_settings(Case(study.name, scene, method, grid), grids, tolerances)
    for point in measure_line(study, settings, truth, [Measure.ATTITUDE_MAX]):
        yield from point.rows()
        if point.errors[Measure.ATTITUDE_MAX] <= ERROR:
            return [point.case]
    return []
