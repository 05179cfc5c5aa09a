"""The attack by kills on the processes of engines, in small, and that it sees what it should."""

from dataclasses import replace

import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.studies.case import Case, attempt
from conservative.benchmarks.verification import worker_kills
from conservative.method import grid_for

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
