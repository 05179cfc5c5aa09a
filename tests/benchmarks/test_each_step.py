"""The study of samples at each step: the coarsest sufficient setting, timed with all samples and with the final state only."""

from functools import cache

import conservative as cv
from conservative.attitude import angle_between
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import each_step, studies
from conservative.benchmarks.studies.each_step import ERROR, STEPS
from conservative.benchmarks.studies.study import Study
from conservative.grid import grid_for
from conservative.references.engines.heyoka import Heyoka
from conservative.registry import method

from .generic_study import SCENE, truth

METHODS = (cv.Reduced(), cv.Gauss(), method("moser_veselov"), method("taylor:tolerance=1e-6"), Heyoka(1e-9))
GRID = grid_for(SCENE, SCENE.dt)


@cache
def rows():
    return list(studies.rows(Study("each_step", (SCENE,), METHODS, quick=True, truth=truth)))


def of(measure, series):
    return [row for row in rows() if (row.measure, row.series) == (measure, series)]


def test_a_method_gets_no_finer_than_it_has_to():
    errors = {name: [row.value for row in of(Measure.ATTITUDE_MAX, name)] for name in {row.series for row in rows()}}
    assert len(errors) == len(METHODS)
    assert len(errors["reduced"]) == len(STEPS)  # of order 2: not good enough at any
    assert min(errors["reduced"]) > ERROR
    for name in set(errors) - {"reduced"}:
        *before, last = errors[name]
        assert last <= ERROR < min(before, default=1.0)


def test_both_times_are_of_the_setting_that_is_good_enough():
    for measure in (Measure.TIME_SAMPLED, Measure.TIME):
        assert of(measure, "reduced") == []
        for name in {row.series for row in rows()} - {"reduced"}:
            (row,) = of(measure, name)
            error = of(Measure.ATTITUDE_MAX, name)[-1]
            assert (row.method, row.dt) == (error.method, error.dt)
            assert row.value > 0


def test_an_engine_has_the_time_of_its_own_loop_too():
    engine, ours = ([row.value for row in of(Measure.TIME_OWN_LOOP, name)] for name in ("heyoka", "gauss"))
    assert len(engine) == 1
    assert engine[0] > 0
    assert ours == []


def test_errors_are_of_all_samples():
    row = of(Measure.ATTITUDE_MAX, "gauss")[-1]
    exact, trajectory = truth(SCENE, GRID).trajectory, cv.Gauss().solve(SCENE, GRID)
    assert (row.dt, row.value) == (GRID.dt, angle_between(exact.R_WB, trajectory.R_WB).max())


def test_times_are_of_the_motion_of_the_errors(monkeypatch):
    timed = []

    def keep(_, runs, prepares, **__):
        timed.extend((key, prepare()) for key, prepare in prepares.items())
        return {}

    monkeypatch.setattr(each_step.Processes, "time", keep)
    list(studies.rows(Study("each_step", (SCENE,), (cv.Gauss(), Heyoka(1e-9)), quick=True, truth=truth)))
    expected = {Measure.TIME_SAMPLED: (GRID.n_samples, SCENE.t_end), Measure.TIME: (2, SCENE.t_end)}
    for (_, measure), run in timed:
        if measure == Measure.TIME_OWN_LOOP:
            assert len(run()[0]) == GRID.n_samples  # states, before their conversion
        else:
            assert (len(run()), run().t[-1]) == expected[measure]
    assert len(timed) == 5
