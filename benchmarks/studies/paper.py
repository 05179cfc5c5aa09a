"""The study of accuracy at the paper's steps: drifts, errors and work."""

from __future__ import annotations

from collections.abc import Iterator

from conservative.grid import grid_for
from conservative.method import Role
from conservative.references.truth import Truth
from conservative.scene import Scene
from conservative.trajectory import Counters, Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from .case import Case, Failure, Success
from .study import Progress, Study
from .time_limit import attempt_within

FRACTIONS = (1.0, 0.5, 0.25)
"""Steps of the paper's figures, relative to the scene's own."""
APPROXIMATE = "approximate"
"""Detail of the row of an agreement where nothing below it is known."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield drifts, errors and work of every method at the paper's steps; every step is a sample."""
    total = len(study.scenes) * len(study.methods)
    for i, scene in enumerate(study.scenes):
        grids = [grid_for(scene, scene.dt * fraction) for fraction in FRACTIONS]
        progress(i * len(study.methods), total, f"{scene.name}: truth")
        truths = [study.truth(scene, grid) for grid in grids]
        yield from (agreement(study, scene, grid.dt, truth) for grid, truth in zip(grids, truths, strict=True))
        for j, method in enumerate(study.methods):
            progress(i * len(study.methods) + j, total, f"{scene.name}: {method.name}")
            for grid, truth in zip(grids, truths, strict=True):
                case = Case(study.name, scene, method, grid)
                outcome = attempt_within(study.hang_limit, case, study.skip_missing)
                yield from accuracy(case, outcome, truth.trajectory)
                if method.order is None:
                    break  # accuracy does not depend on dt, nor does what the samples show


def agreement(study: Study, scene: Scene, dt: float, truth: Truth) -> Measurement:
    """Return how well the two truths agree: a row of no one method, with the labels of both."""
    return Measurement(
        study=study.name,
        scene=scene.name,
        method="",
        label=" and ".join(truth.names),
        role=Role.TRUTH,
        series="",
        dt=dt,
        measure=Measure.AGREEMENT,
        value=truth.agreement_rad,
        detail=APPROXIMATE if truth.approximate else "",
    )


def accuracy(case: Case, outcome: Success | Failure, truth: Trajectory) -> list[Measurement]:
    """Return a row for every measure, and for the work done; without values where the run did not reach its end."""
    if isinstance(outcome, Failure):
        return case.blanks(errors.blanks(case.scene), outcome.outcome)
    found = errors.measure_errors(outcome.trajectory, truth) + work(outcome.trajectory.counters)
    return [case.row(value) for value in found]


def work(counters: Counters) -> list[Value]:
    """Return the counters that the method has."""
    counts = (
        (Measure.STEPS, counters.steps),
        (Measure.NEWTON_ITERATIONS, counters.iterations),
        (Measure.EVALUATIONS, counters.evaluations),
    )
    return [Value(measure, float(count)) for measure, count in counts if count is not None]
