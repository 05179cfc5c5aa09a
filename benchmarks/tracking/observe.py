"""Observe one version of an engine: a run at the scene's step, a few beside it, and the errors at shorter steps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from conservative.invariants import Invariant, sizes
from conservative.method import Grid, Method, grid_for
from conservative.outcome import OutcomeKind
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures.errors import measure_errors
from ..measures.measure import Measure
from ..studies import convergence, step_ladder
from ..studies.case import Case, Failure, Success
from ..studies.study import Study
from ..studies.time_limit import attempt_within
from .observation import Observation, Point, Spread

MORE_STEPS = (0, 1, 2)
"""Steps that runs have beside those of the scene's dt: what one or two more steps change is no difference of versions."""
SAMPLES = 1000
"""Samples of a run, about."""
NO_TIME = (OutcomeKind.SKIPPED, OutcomeKind.TIMEOUT)


def observe(study: Study, scene: Scene, method: Method, version: str) -> Observation:
    """Return what is seen of a method on a scene; the study says how long a run may take and where the truth comes from."""
    cases = [Case(study.name, scene, method, grid) for grid in _grids(scene)]
    names = _names(cases[0], version)
    first = attempt_within(study.hang_limit, cases[0], study.skip_missing)
    if isinstance(first, Failure):
        return replace(names, outcome=first.outcome)
    done = [first, *(attempt_within(study.hang_limit, case, study.skip_missing) for case in cases[1:])]
    runs = [each.trajectory for each in done if isinstance(each, Success)]
    return replace(
        names,
        points=tuple(_points(study, scene, method)),
        error=Spread.of(_largest_error(study, run, case.grid) for run, case in zip(runs, cases, strict=False)),
        drifts={invariant.name: Spread.of(_largest_change(run, invariant) for run in runs) for invariant in scene.invariants},
    )


def _grids(scene: Scene) -> list[Grid]:
    n = grid_for(scene, scene.dt).n_steps
    counts = [n + more for more in MORE_STEPS]
    return [Grid(scene.t_end / count, count, math.ceil(count / SAMPLES)) for count in counts]


def _names(case: Case, version: str) -> Observation:
    label = case.method.label
    return Observation(scene=case.scene.name, setting=label.partition("/")[2], version=version, label=label, dt=case.grid.dt)


def _largest_error(study: Study, run: Trajectory, grid: Grid) -> float:
    truth = study.truth(run.scene, grid).trajectory
    return next(each.value for each in measure_errors(run, truth) if each.measure is Measure.ATTITUDE_MAX)


def _largest_change(run: Trajectory, invariant: Invariant) -> float:
    """Return the largest change of an invariant, relative; with its sign, if it has one."""
    change = run.drift(invariant)
    place = int(np.argmax(sizes(change)))
    return float(change[place]) if change.ndim == 1 else float(sizes(change)[place])


def _points(study: Study, scene: Scene, method: Method) -> Iterator[Point]:
    """Yield the errors over shorter and shorter steps."""
    if method.order is None:
        return
    truth = study.truth(scene, step_ladder.samples(scene, method)).trajectory
    cases = [Case(study.name, scene, method, grid) for grid in step_ladder.steps(scene, method)]
    for case, done in convergence.attempt_each(study, cases):
        if isinstance(done, Success):
            found = {each.measure: each.value for each in measure_errors(done.trajectory, truth)}
            yield Point(case.grid.dt, found[Measure.ATTITUDE_MAX], found[Measure.RATES_MAX])
        else:
            yield Point(case.grid.dt, math.nan, math.nan, reached=done.outcome.kind not in NO_TIME)
