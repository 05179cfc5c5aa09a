"""The study of runs that store every step of a scene: the time for an attitude error.

`work_precision` reads twelve samples, so a method of high order can take one step from sample to sample. Samples at short
intervals cost more: a method with a step size takes one or more steps per interval, and a method with a tolerance interpolates
within its longer steps.

* The setting of a method is the coarsest whose largest attitude error over all samples is at most `ERROR`. A method without
  such a setting has errors and no time.
* It is timed twice, interleaved with all others: with all samples stored as attitude matrices and rates, which for an engine
  includes the conversion of its state (heyoka takes 0.4 to 0.7 µs per sample on the brick, of which about 0.2 are its own); and
  with the final state only, as in all other studies.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator

from conservative.attitude import angle_between
from conservative.grid import Grid, grid_for
from conservative.method import Method
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from .case import Case, Failure
from .convergence import attempt_each
from .selection import at_tolerance, tolerance_setting
from .speed import Extend, keep_end
from .study import Progress, Study
from .work_precision import one_of_each_series, time_rows

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
    methods = one_of_each_series(study)
    tell = study.count(progress, len(methods) + 1)
    for scene in study.scenes:
        truth = study.truth(scene, grid_for(scene, scene.dt)).trajectory
        chosen: list[Case] = []
        for method in methods:
            tell(f"{scene.name}: errors of {method.name}")
            chosen += yield from coarsest(study, cases(study, scene, method), truth)
        tell(f"{scene.name}: timing {len(chosen)} methods")
        yield from time_rows(study, chosen, KEPT)


def cases(study: Study, scene: Scene, method: Method) -> list[Case]:
    """Return the settings of a method, coarse to fine; a single case if the method does not support the scene."""
    setting, grid = tolerance_setting(method), grid_for(scene, scene.dt)
    if method.unsupported(scene) or (setting is None and method.order is None):
        return [Case(study.name, scene, method, grid)]
    if setting is None:
        return [Case(study.name, scene, method, Grid(grid.dt / k, grid.n_steps * k, k)) for k in STEPS]
    return [
        Case(study.name, scene, at_tolerance(method, setting, value), grid) for value in TOLERANCES[:: 2 if study.quick else 1]
    ]


def coarsest(study: Study, settings: list[Case], truth: Trajectory) -> Generator[Measurement, None, list[Case]]:
    """Yield the errors of a method's settings; return a list of the first setting that reaches `ERROR`, or an empty list."""
    for case, outcome in attempt_each(study, settings):
        if isinstance(outcome, Failure):
            yield case.row(Value(Measure.ATTITUDE_MAX, math.nan), outcome.outcome)
            continue
        error = float(angle_between(truth.R_WB, outcome.trajectory.R_WB).max())
        yield case.row(Value(Measure.ATTITUDE_MAX, error))
        if error <= ERROR:
            return [case]
    return []
