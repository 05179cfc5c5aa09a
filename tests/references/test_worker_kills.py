"""The attack by kills on the processes of engines, in small, and that it sees what it should."""

from dataclasses import replace

import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.measures.timing import time_interleaved
from conservative.benchmarks.studies.case import Case, Failure, attempt
from conservative.benchmarks.studies.time_limit import attempt_apart, attempt_here, attempt_within
from conservative.benchmarks.verification import worker_kills
from conservative.method import grid_for
from conservative.outcome import OutcomeKind

from .trial_engine import Trial

pytestmark = pytest.mark.usefixtures("trial_cache", "trial_registered")
SCENE, DT = cv.scenes.brick_flip(t_end=0.5), 0.01


def test_kills_at_random_moments_mark_one_row_at_most():
    wrong = CliRunner().invoke(worker_kills.main, ["--method", "trial@1.0", "--count", "3"])
    assert wrong.exit_code == 0, wrong.output
    assert "3 rounds of 4 rows" in wrong.output


def test_a_row_that_is_lost_or_differs_would_be_found():
    case = Case("test", SCENE, Trial(), grid_for(SCENE, DT))
    whole = attempt(case)
    other = attempt(replace(case, scene=cv.scenes.turned_brick(t_end=0.5)))
    crashed = attempt(replace(case, method=Trial("abort")))
    assert list(worker_kills.mistakes([whole], [whole])) == []
    for rows in ([], [other], [crashed], [crashed, crashed]):
        assert list(worker_kills.mistakes([whole], rows))


def test_a_run_that_crashes_while_it_is_timed_is_marked_and_the_others_are_timed():
    runs = {do: Trial(do).prepare(SCENE, grid_for(SCENE, DT)) for do in ("integrate", "abort")}
    timings = time_interleaved(runs, rounds=3, min_time=1e-3)
    assert timings["integrate"].outcome.ok
    assert timings["integrate"].minimum > 0
    assert timings["abort"].outcome.kind is OutcomeKind.CRASHED
    assert timings["abort"].minimum != timings["abort"].minimum


@pytest.mark.parametrize("within", [attempt_apart, attempt_here, attempt_within])
def test_the_limit_of_a_study_ends_an_engine_that_hangs(within):
    found = within(0.5, Case("test", SCENE, Trial("hang"), grid_for(SCENE, DT)))
    assert isinstance(found, Failure)
    assert str(found.outcome) == "timeout (after 0.5 s)"
