"""Accuracy at the paper's steps: drifts, errors, work, flips, and the precision and expected order of each method."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from conservative.grid import Grid, grid_for
from conservative.invariants import find_energy
from conservative.method import Role
from conservative.outcome import OK, Outcome
from conservative.references.truth import Disagreement, Truth
from conservative.scene import Scene
from conservative.trajectory import Trajectory

from ..measures import errors
from ..measures.measure import Measure, Value
from ..measures.measurement import Measurement
from .case import Case, Success
from .declaration import Declaration
from .selection import Missing, bits_of
from .study import Progress, Study, without_truth

FRACTIONS = (1.0, 0.5, 0.25)
"""Steps of the paper's figures, relative to the scene's own."""
PROPERTIES = (Measure.PRECISION, Measure.ORDER_EXPECTED)
"""Measures of a method itself, which have a value also if its run failed."""
AS_INSTALLED = "as installed"
"""Detail of the precision of an engine as installed."""
APPROXIMATE = "approximate"
"""Detail of the agreement of a reference solution that is not known more accurately."""


def findings(study: Study, progress: Progress) -> Iterator[Measurement]:
    """Yield drifts, errors and work of every method at the paper's step sizes, with every step stored."""
    tell = study.count(progress, len(study.methods) + 1)
    for scene in study.scenes:
        grids = [grid_for(scene, scene.dt * fraction) for fraction in FRACTIONS]
        tell(f"{scene.name}: truth")
        # Neither accuracy nor samples of a method without an order depend on dt.
        ranks = [
            [Case(study.name, scene, method, grid) for method in study.methods if grid is grids[0] or method.order is not None]
            for grid in grids
        ]
        skipped = study.skip_slow(*ranks)
        truths: dict[Grid, Trajectory | Outcome] = {}
        for grid, rank in zip(grids, ranks, strict=True):
            if not skipped or any(case not in skipped and not case.method.unsupported(scene) for case in rank):
                try:
                    truth = study.truth(scene, grid)
                except Disagreement as failure:
                    truths[grid] = without_truth(failure)
                else:
                    truths[grid] = truth.trajectory
                    yield agreement_row(study, scene, grid.dt, truth)
        for method in study.methods:
            tell(f"{scene.name}: {method.name}")
            for case in (case for rank in ranks for case in rank if case.method is method):
                done = skipped.get(case) or study.attempt(case)
                if isinstance(done, Outcome):
                    yield from case.rows(errors.blanks(scene), done)
                else:
                    yield from measure_accuracy(case, done, truths[case.grid])
                if case.grid is grids[0]:
                    yield from describe(case, done)
                    yield from count_turns(case, done, truths)


def agreement_row(study: Study, scene: Scene, dt: float, truth: Truth) -> Measurement:
    """Return the agreement of the two reference solutions, in a row with both labels."""
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


def measure_accuracy(case: Case, done: Success | Outcome, truth: Trajectory | Outcome) -> list[Measurement]:
    """Return a row for every measure and counter (see `Case.accuracy_rows`); without values if the run failed."""
    if isinstance(done, Outcome):
        return case.rows(errors.blanks(case.scene), done)
    counters = done.trajectory.counters
    work = {
        Measure.STEPS: counters.steps,
        Measure.NEWTON_ITERATIONS: counters.iterations,
        Measure.EVALUATIONS: counters.evaluations,
    }
    counts = [Value(measure, float(count)) for measure, count in work.items() if count is not None]
    with np.errstate(over="ignore", invalid="ignore"):  # a diverging motion can be finite for some time
        rows = case.accuracy_rows(done.trajectory, truth)
        if energy := find_energy(case.scene.invariants):
            direction = "gained" if done.trajectory.drift(energy)[-1] > 0 else "lost"
            place = next(i for i, row in enumerate(rows) if (row.measure, row.quantity) == (Measure.DRIFT_MAX, energy.name))
            rows[place] = replace(rows[place], detail=direction)
    return rows + case.rows(counts)


def describe(case: Case, done: Success | Outcome) -> list[Measurement]:
    """Return the precision and the expected order of a method that is installed, with the outcome of its run."""
    method, outcome = case.method, done if isinstance(done, Outcome) else OK
    if isinstance(method, Missing):
        return []
    order = math.nan if method.order is None else float(method.order)
    properties = map(Value, PROPERTIES, (float(bits_of(method)), order))
    return case.rows(properties, outcome, AS_INSTALLED if method in method.settings_for("as_installed") else "")


def count_turns(case: Case, done: Success | Outcome, truths: Mapping[Grid, Trajectory | Outcome]) -> list[Measurement]:
    """Return how often a free body turned over, and how often in the exact motion; without a value for a motion that failed."""
    if not case.scene.free:
        return []
    motions = (done, done) if isinstance(done, Outcome) else (done.trajectory, truths[case.grid])
    return [
        case.row(Value(measure, math.nan), motion)
        if isinstance(motion, Outcome)
        else case.row(Value(measure, float(errors.count_turns_over(motion))))
        for measure, motion in zip((Measure.TURNS_OVER, Measure.TURNS_OVER_TRUE), motions, strict=True)
    ]


STUDY = Declaration(findings, named=True)
