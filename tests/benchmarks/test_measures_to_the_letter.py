"""What other tests of the measures leave open: thresholds, defaults, exact times, and what is compared as an object."""

import dataclasses
import os

import numpy as np
import pytest

from conservative.benchmarks.measures import origin, samples, timing
from conservative.benchmarks.measures.convergence_order import SHRINKING, observed_order
from conservative.method import Role

STEPS = 0.1 * 0.5 ** np.arange(8)


def errors_of(*slopes):
    """Errors whose local slopes, from coarse to fine, are these."""
    return 1e-2 * 0.5 ** np.concatenate([[0.0], np.cumsum(slopes)])


@pytest.mark.parametrize(("part", "last"), [(0.9, 4), (1.1, 7)])
def test_an_error_shrinks_while_its_slope_is_above_a_third_of_the_steepest(part, last):
    found = observed_order(STEPS, errors_of(2, 2, 2, 2, *3 * [part * SHRINKING * 2]))
    assert np.isnan(found.floor) == (last == 7)
    if last == 4:
        assert found.floor == pytest.approx(errors_of(2, 2, 2, 2)[-1])


def test_one_lucky_zero_is_not_the_steepest_slope():
    errors = errors_of(2, 2, 2, 2, 2, 2, 2)
    errors[-1] = 0.0
    found = observed_order(STEPS, errors)
    assert found.slope == pytest.approx(2, abs=1e-9)
    assert 7 not in found.used
    assert len(found.used) >= 3


@pytest.mark.parametrize(("error", "used"), [(1.1e-6, {0, 1, 2, 3}), (0.9e-6, {0, 1, 2})])
def test_points_within_ten_of_the_floor_are_left_out(error, used):
    found = observed_order(STEPS, np.array([1e-3, 1e-4, 1e-5, error, 1e-7, 1e-7, 1e-7, 1e-7]))
    assert found.floor == pytest.approx(1e-7)
    assert set(found.used) == used


@pytest.fixture
def clock(monkeypatch):
    """A clock, ns, that only goes on when it is told."""
    now = [7 * 10**9]
    monkeypatch.setattr(timing, "perf_counter_ns", lambda: now[0])

    def rest(seconds):
        now[0] += round(seconds * 1e9)

    return rest


def test_preparation_and_first_call_are_told_apart(clock):
    def prepare():
        clock(0.25)
        return lambda: clock(0.5) or "result"

    run, result, spent = timing.prepare_and_run(prepare)
    assert (result, callable(run)) == ("result", True)
    assert (spent.prepare, spent.first_call, spent.total) == pytest.approx((0.25, 0.5, 0.75), rel=1e-12)


def test_samples_last_a_hundredth_of_a_second_and_there_are_seven(clock):
    found = timing.time_interleaved({"run": lambda: clock(1e-3)})["run"]
    assert (found.rounds, found.calls) == (7, 10)
    assert (found.minimum, found.median) == pytest.approx((1e-3, 1e-3))


@pytest.mark.parametrize(("first", "calls"), [(0.0999, 2), (0.1001, 1)])
def test_a_first_call_ten_times_as_long_as_a_sample_is_enough(clock, first, calls):
    rests = iter([first, *[0.005] * 9])
    assert timing.count_calls(lambda: clock(next(rests)), 0.01) == calls


@pytest.mark.parametrize(("each", "calls"), [(0.0009, 2 * 2 * 2 * 2), (0.0011, 10)])
def test_calls_double_while_too_short_to_be_trusted(clock, each, calls):
    """A sample of less than a tenth says little: twice as many then; else as many as are wanted."""
    assert timing.count_calls(lambda: clock(each), 0.01) == (12 if each < 0.001 else calls)


def test_a_sample_that_is_too_short_sets_no_number_of_calls(clock):
    """One call that looks a hundred times as quick as the others is followed by two, not by a thousand."""
    rests = iter([1e-3, 1e-5, *[1e-3] * 100])
    assert timing.count_calls(lambda: clock(next(rests)), 0.01) == 10


@pytest.mark.parametrize(("budget", "rounds"), [(0.0399, 3), (0.0401, 4), (0.0601, 6), (1.0, 7)])
def test_a_budget_is_what_the_next_round_must_not_exceed(clock, budget, rounds):
    assert timing.time_interleaved({"run": lambda: clock(0.01)}, budget=budget)["run"].rounds == rounds


def test_cores_are_those_of_the_process(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {1, 4, 6} if process == 0 else set(), raising=False)
    assert origin.machine().cores == "3"
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 17)
    assert origin.machine().cores == "17"


def test_what_git_says_is_text_in_time(monkeypatch, tmp_path):
    asked = []

    def run(arguments, **options):
        asked.append((arguments, options))
        return origin.subprocess.CompletedProcess(arguments, 0, stdout=" abc\n")

    monkeypatch.setattr(origin.subprocess, "run", run)
    assert origin.git(tmp_path, "status") == "abc"
    ((arguments, options),) = asked
    assert arguments == ["git", "-C", str(tmp_path), "status"]
    assert options["text"] is options["check"] is options["capture_output"] is True
    assert 5 <= options["timeout"] <= 30


def test_lines_are_compared_as_objects():
    common = {"study": "s", "scene": "s", "method": "m", "label": "l", "role": Role.OURS, "series": "m", "dt": 0.1}
    line = samples.Samples(**common, quantity="q", t=np.zeros(2), value=np.zeros(2))
    assert dataclasses.replace(line) != line
    assert line.family == line.version == line.setting == line.series_setting == ""
