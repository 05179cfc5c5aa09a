"""The study of samples at each step: the coarsest sufficient setting, timed with all samples and with the final state only."""

import math
from functools import cache

import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import each_step, studies
from conservative.benchmarks.studies.each_step import ERROR, STEPS
from conservative.benchmarks.studies.line import LinePoint
from conservative.benchmarks.studies.study import Study
from conservative.grid import grid_for
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.solvers.heyoka import Heyoka
from conservative.registry import method

from .generic_study import SCENE, truth

METHODS = (cv.Reduced(), cv.Gauss(), method("moser_veselov"), method("taylor:tolerance=1e-6"), Heyoka(1e-9))
GRID = grid_for(SCENE, SCENE.dt)


@cache
def rows():
    return list(studies.rows(Study("each_step", (SCENE,), METHODS, quick=True, truth=truth)))


def of(measure, series):
    return [row for row in rows() if (row.measure, row.series) == (measure, series)]


def test_both_times_are_of_the_coarsest_setting_that_is_good_enough():
    errors = {name: of(Measure.ATTITUDE_MAX, name) for name in {row.series for row in rows()}}
    assert len(errors) == len(METHODS)
    assert len(errors["reduced"]) == len(STEPS)  # of order 2: not good enough at any
    assert min(row.value for row in errors.pop("reduced")) > ERROR
    for measure in (Measure.TIME_SAMPLED, Measure.TIME):
        assert of(measure, "reduced") == []
        for name in errors:
            (row,) = of(measure, name)
            chosen = next(error for error in errors[name] if error.value <= ERROR)
            assert (row.method, row.dt) == (chosen.method, chosen.dt)
            assert row.value > 0


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ([1e-4, 1e-7, 1e-9, 1e-10], 1),
        ([1e-4, 1e-7, 1e-5, 1e-10], 3),  # the second is accurate by accident
        ([1e-4, 1e-7, math.nan, 1e-10], 1),  # a run that failed has no error
        ([1e-7, 1e-7, 1e-7, 1e-5], None),
    ],
)
def test_a_finer_setting_with_a_larger_error_disqualifies_a_coarser_one(errors, expected, monkeypatch):
    def measure(study, cases, *_):
        for case, error in zip(cases, errors, strict=True):
            yield LinePoint(case, Outcome(OutcomeKind.TIMEOUT) if math.isnan(error) else None, {Measure.ATTITUDE_MAX: error})

    monkeypatch.setattr(each_step, "measure_line", measure)
    monkeypatch.setattr(
        each_step, "time_chosen", lambda study, chosen, _: iter([[round(GRID.dt / c.case.grid.dt) for c in chosen]])
    )
    *_, chosen = each_step.findings(Study("each_step", (SCENE,), (cv.Gauss(),), quick=True, truth=truth), lambda *_: None)
    assert chosen == ([] if expected is None else [STEPS[expected]])


def test_an_engine_has_the_time_of_its_own_loop_too():
    engine, ours = ([row.value for row in of(Measure.TIME_OWN_LOOP, name)] for name in ("heyoka", "gauss"))
    assert len(engine) == 1
    assert engine[0] > 0
    assert ours == []


def test_errors_are_of_all_samples():
    row = of(Measure.ATTITUDE_MAX, "gauss")[0]
    exact, trajectory = truth(SCENE, GRID).trajectory, cv.Gauss().solve(SCENE, GRID)
    assert (row.dt, row.value) == (GRID.dt, angle_between(exact.R_WB, trajectory.R_WB).max())


def test_times_are_of_the_motion_of_the_errors(monkeypatch):
    timed = []

    def keep(_, runs, prepares, **__):
        timed.extend((key, prepare()) for key, prepare in prepares.items())
        return {}

    monkeypatch.setattr(each_step.Processes, "time", keep)
    list(studies.rows(Study("each_step", (SCENE,), (cv.Gauss(), Heyoka(1e-9)), quick=True, truth=truth)))
    for (_, measure), run in timed:
        if measure == Measure.TIME_SAMPLED:
            assert (len(run()), run().t[-1]) == (GRID.n_samples, SCENE.t_end)
        elif measure == Measure.TIME_OWN_LOOP:
            assert len(run()) == GRID.n_samples  # states, before their conversion
    assert len(timed) == 5
