"""Limits just below and just above: of steps, of points of a slow method, of how far times may differ; what is tried again."""

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures.errors import require_same_times
from conservative.benchmarks.studies.case import Case
from conservative.benchmarks.studies.convergence import FEWEST_POINTS, fits
from conservative.benchmarks.studies.study import Study
from conservative.benchmarks.studies.time_limit import attempt_within
from conservative.benchmarks.studies.work_precision import points
from conservative.method import grid_for
from conservative.references.engine import PACE_STEPS, STEP_LIMIT, limit_reason
from conservative.references.engines.scipy import SciPy

from .foreign_engines import Harmful
from .generic_study import SCENE, truth


def test_a_run_ends_early_where_it_would_take_ten_times_the_limit_alone():
    assert limit_reason(PACE_STEPS, PACE_STEPS / (9 * STEP_LIMIT)) == ""
    assert "out of reach" in limit_reason(PACE_STEPS, PACE_STEPS / (11 * STEP_LIMIT))


@pytest.mark.parametrize("made", range(2 * FEWEST_POINTS))
def test_a_slow_method_gets_the_fewest_points_and_no_more(made):
    study = Study("any", (SCENE,), (cv.Reduced(),), truth=truth)
    slow = 1.1 * study.longest_run
    assert fits(study, [1e-3] * made, slow) == (made < FEWEST_POINTS)


def trajectory(end, late=0.0):
    """Two samples, the second late by so many seconds."""
    R, w = np.repeat(SCENE.R_WB0[None], 2, axis=0), np.repeat(SCENE.w_WB_B0[None], 2, axis=0)
    return cv.Trajectory(SCENE, np.array([0.0, end + late]), R, w, "made up")


@pytest.mark.parametrize(("end", "late"), [(1e4, 5e-9), (1e-3, 5e-13)])
def test_times_may_differ_by_round_off_and_no_more(end, late):
    require_same_times(trajectory(end), trajectory(end, late))
    with pytest.raises(cv.BadInput, match="times that differ"):
        require_same_times(trajectory(end), trajectory(end, 4 * late))


def test_what_is_shorter_than_a_run_that_was_ended_is_tried():
    scene = SCENE.rename(SCENE.name)
    reasons = [
        attempt_within(0.2, Case("any", scene, Harmful("hang"), grid_for(scene, dt))).outcome.reason
        for dt in (0.05, 0.025, 0.1)
    ]
    assert reasons == ["ended after 0.2 s", "a run of 40 steps was ended after 0.2 s", "ended after 0.2 s"]


def test_a_line_of_tolerances_goes_from_cheap_to_dear():
    study = Study("any", (SCENE,), (SciPy(),), truth=truth)
    tolerances = [case.method.rtol for case in points(study, SCENE, SciPy())]
    assert tolerances == sorted(tolerances, reverse=True)
    assert len(set(tolerances)) == len(tolerances) > 3
