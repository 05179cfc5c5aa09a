import gc
import time

import pytest

from conservative.benchmarks.measures.timing import count_calls, prepare_and_run, time_interleaved
from conservative.errors import BadInput


def test_every_round_takes_each_run_once_and_the_order_changes():
    calls = []
    runs = {name: (lambda name=name: (calls.append(name), time.sleep(1e-3))) for name in "abc"}
    timings = time_interleaved(runs, rounds=6, min_time=1e-4)
    assert all((timing.rounds, timing.calls) == (6, 1) for timing in timings.values())
    rounds = ["".join(calls[-18:][i : i + 3]) for i in range(0, 18, 3)]
    assert all(sorted(order) == ["a", "b", "c"] for order in rounds)
    assert len(set(rounds)) > 1


def test_the_first_call_is_not_counted():
    naps = iter([0.05] + [0.0] * 10**6)
    timing = time_interleaved({"slow at first": lambda: time.sleep(next(naps))}, rounds=3, min_time=1e-4)["slow at first"]
    assert timing.median < 0.025


def test_fast_runs_are_repeated_within_a_sample():
    assert count_calls(lambda: None, 1e-3) > 100
    assert count_calls(lambda: time.sleep(2e-3), 1e-3) == 1


def test_minimum_is_at_most_the_median_and_near_the_truth():
    timing = time_interleaved({"nap": lambda: time.sleep(2e-3)}, rounds=5, min_time=1e-3)["nap"]
    assert 2e-3 <= timing.minimum <= timing.median


def test_a_run_over_its_budget_gets_three_rounds():
    runs = {"slow": lambda: time.sleep(5e-3), "fast": lambda: None}
    timings = time_interleaved(runs, rounds=8, min_time=1e-4, budget=1e-3)
    assert timings["slow"].rounds == 3
    assert timings["fast"].rounds > 3


def test_the_collector_is_off_while_timing_and_on_afterwards():
    seen = []
    time_interleaved({"look": lambda: seen.append(gc.isenabled())}, rounds=3, min_time=1e-6)
    assert seen[-1] is False
    assert gc.isenabled()


def test_the_collector_comes_back_after_an_error():
    count = iter(range(100))

    def fails_late():
        if next(count) > 3:
            raise RuntimeError("planted")
        time.sleep(1e-3)

    with pytest.raises(RuntimeError, match="planted"):
        time_interleaved({"run": fails_late}, rounds=9, min_time=1e-4)
    assert gc.isenabled()


def test_preparation_and_first_call_are_apart():
    def prepare():
        time.sleep(2e-3)
        return lambda: (time.sleep(1e-3), "result")[1]

    run, result, cost = prepare_and_run(prepare)
    assert result == run() == "result"
    assert cost.prepare >= 2e-3
    assert cost.first_call >= 1e-3
    assert cost.total == cost.prepare + cost.first_call


@pytest.mark.parametrize("bad", [{"rounds": 0}, {"rounds": 2.5}, {"min_time": 0}, {"min_time": float("nan")}])
def test_bad_input(bad):
    with pytest.raises(BadInput) as caught:
        time_interleaved({}, **bad)
    assert caught.value.argument == next(iter(bad))
