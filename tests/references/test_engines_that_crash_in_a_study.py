"""An engine whose process ends, or hangs, in the studies of engines: a marked row, and another engine's rows beside it."""

import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.timing import time_interleaved
from conservative.benchmarks.studies import engines_at_one_step, studies, study
from conservative.benchmarks.studies.case import Case, Failure
from conservative.benchmarks.studies.study import Study
from conservative.benchmarks.studies.time_limit import attempt_apart, attempt_here, attempt_within
from conservative.method import grid_for
from conservative.outcome import OutcomeKind

from .trial_engine import Trial

SCENE = cv.scenes.brick_flip(t_end=0.2)
ENDS = {"segfault": OutcomeKind.CRASHED, "hang": OutcomeKind.TIMEOUT, "shape": OutcomeKind.CRASHED}


@pytest.fixture(autouse=True)
def short_limits(trial_cache, monkeypatch):
    monkeypatch.setattr(study, "HANG_LIMIT", 2.0)
    monkeypatch.setattr(engines_at_one_step, "FIRST_LIMIT", 2.0)


def rows(name, *methods):
    return list(studies.rows(Study(name, (SCENE,), methods, quick=True, time_limit=0.05)))


@pytest.mark.parametrize("name", studies.ENGINES)
@pytest.mark.parametrize("do", ENDS)
def test_a_crash_or_a_hang_is_a_row_and_no_more(name, do):
    found = rows(name, Trial(do), registry.method("pinocchio"), Trial())
    measured = [row for row in found if row.measure in (Measure.ATTITUDE_MAX, Measure.TIME)]
    wrong = [row for row in measured if row.method == Trial(do).name]
    assert wrong[0].outcome.kind is ENDS[do]
    assert not any(row.outcome.ok for row in wrong)
    for method in ("pinocchio", Trial().name):
        assert any(row.measure is Measure.TIME and row.outcome.ok and row.value > 0 for row in measured if row.method == method)


def test_a_run_that_crashes_while_it_is_timed_is_marked_and_the_others_are_timed():
    runs = {do: Trial(do).prepare(SCENE, grid_for(SCENE, 0.01)) for do in ("integrate", "abort")}
    timings = time_interleaved(runs, rounds=3, min_time=1e-3)
    assert timings["integrate"].outcome.ok
    assert timings["integrate"].minimum > 0
    assert timings["abort"].outcome.kind is OutcomeKind.CRASHED
    assert timings["abort"].minimum != timings["abort"].minimum


@pytest.mark.usefixtures("trial_registered")
@pytest.mark.parametrize("within", [attempt_apart, attempt_here, attempt_within])
def test_the_limit_of_a_study_ends_an_engine_that_hangs(within):
    found = within(0.5, Case("test", SCENE, Trial("hang"), grid_for(SCENE, 0.01)))
    assert isinstance(found, Failure)
    assert str(found.outcome) == "timeout (after 0.5 s)"
