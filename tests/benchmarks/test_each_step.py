"""The study of samples at each step: the coarsest sufficient setting, timed with all samples and with the final state only."""

from functools import cache

import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import studies
from conservative.benchmarks.studies.each_step import ERROR, KEPT, STEPS, keep_each
from conservative.benchmarks.studies.study import Study
from conservative.grid import Grid, grid_for
from conservative.registry import method

from .generic_study import SCENE, truth

METHODS = (cv.Reduced(), cv.Gauss(), method("moser_veselov"), method("taylor:tolerance=1e-6"))
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
    for measure in KEPT:
        assert of(measure, "reduced") == []
        for name in {row.series for row in rows()} - {"reduced"}:
            (row,) = of(measure, name)
            error = of(Measure.ATTITUDE_MAX, name)[-1]
            assert (row.method, row.dt) == (error.method, error.dt)
            assert row.value > 0


def test_errors_are_of_all_samples():
    row = of(Measure.ATTITUDE_MAX, "gauss")[-1]
    exact, trajectory = truth(SCENE, GRID).trajectory, cv.Gauss().solve(SCENE, GRID)
    assert (row.dt, row.value) == (GRID.dt, angle_between(exact.R_WB, trajectory.R_WB).max())


@pytest.mark.parametrize("times", [1, 7])
def test_a_longer_run_keeps_samples_as_often(times):
    longer = keep_each(Grid(0.5, 12, 3), times)
    assert (longer.n_samples, longer.t[1]) == (4 * times + 1, 1.5)
