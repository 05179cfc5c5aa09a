import gc

import pytest

from conservative.benchmarks.measures import timing
from conservative.benchmarks.measures.timing import count_calls, prepare_and_run, time_interleaved
from conservative.errors import BadInput

READING = 1
"""Time, ns, between two readings of the clock."""


@pytest.fixture(autouse=True)
def rest(monkeypatch):
    """Replace the clock by one that advances when it is read, and when a run rests."""
    now = [0]

    def read():
        now[0] += READING
        return now[0]

    def rest(seconds):
        now[0] += round(seconds * 1e9)

    monkeypatch.setattr(timing, "perf_counter_ns", read)
    return rest


def test_every_round_takes_each_run_once_and_the_order_changes(rest):
    calls = []
    runs = {name: (lambda name=name: (calls.append(name), rest(1e-3))) for name in "abc"}
    timings = time_interleaved(runs, rounds=6, min_time=1e-4)
    assert all((timing.rounds, timing.calls) == (6, 1) for timing in timings.values())
    rounds = ["".join(calls[-18:][i : i + 3]) for i in range(0, 18, 3)]
    assert all(sorted(order) == ["a", "b", "c"] for order in rounds)
    assert len(set(rounds)) > 1


def test_the_first_call_is_not_counted(rest):
    rests = iter([0.05] + [1e-3] * 10**6)
    sample = time_interleaved({"slow at first": lambda: rest(next(rests))}, rounds=3, min_time=1e-4)["slow at first"]
    assert sample.minimum == sample.median == pytest.approx(1e-3, rel=1e-5)  # measured 1e-6: one reading of the clock


def test_minimum_and_median_of_the_rounds(rest):
    rests = iter([1e-3, 1e-3, 5e-3, 2e-3, 3e-3, 9e-3, 4e-3])  # two before the rounds, to see how many calls make a sample
    sample = time_interleaved({"run": lambda: rest(next(rests))}, rounds=5, min_time=1e-3)["run"]
    assert (sample.minimum, sample.median) == pytest.approx((2e-3, 4e-3), rel=1e-3)


def test_a_budget_is_of_all_calls_of_a_sample(rest):
    sample = time_interleaved({"fast": lambda: rest(1e-6)}, rounds=8, min_time=1e-3, budget=5.5e-3)["fast"]
    assert (sample.rounds, sample.calls) == (5, 1000)


@pytest.mark.parametrize(("each", "calls"), [(1e-5, 1000), (0.0009, 12), (0.0011, 10), (0.02, 1)])
def test_calls_double_while_too_short_to_be_trusted(rest, each, calls):
    """Below a tenth of the shortest time the number of calls doubles; otherwise it follows from the time."""
    assert count_calls(lambda: rest(each), 0.01) == calls


def test_a_sample_that_is_too_short_sets_no_number_of_calls(rest):
    """A call that looks a hundred times as fast as the others is followed by two calls, not by a thousand."""
    rests = iter([1e-3, 1e-5, *[1e-3] * 100])
    assert count_calls(lambda: rest(next(rests)), 0.01) == 10


@pytest.mark.parametrize(("budget", "rounds"), [(0.0399, 3), (0.0401, 4), (0.0601, 6), (1.0, 7)])
def test_the_next_round_must_fit_into_the_budget(rest, budget, rounds):
    assert time_interleaved({"run": lambda: rest(0.01)}, budget=budget)["run"].rounds == rounds


def test_the_collector_is_off_while_timing_and_on_afterwards(rest):
    seen = []
    time_interleaved({"look": lambda: (seen.append(gc.isenabled()), rest(1e-3))}, rounds=3, min_time=1e-6)
    assert seen[-1] is False
    assert gc.isenabled()


def test_the_collector_comes_back_after_an_error(rest):
    count = iter(range(100))

    def fails_late():
        if next(count) > 3:
            raise RuntimeError("planted")
        rest(1e-3)

    with pytest.raises(RuntimeError, match="planted"):
        time_interleaved({"run": fails_late}, rounds=9, min_time=1e-4)
    assert gc.isenabled()


def test_preparation_and_first_call_are_apart(rest):
    def prepare():
        rest(2e-3)
        return lambda: (rest(1e-3), "result")[1]

    run, result, cost = prepare_and_run(prepare)
    assert result == run() == "result"
    assert (cost.prepare, cost.first_call) == pytest.approx((2e-3, 1e-3), rel=2e-3)


@pytest.mark.parametrize("bad", [{"rounds": 0}, {"rounds": 2.5}, {"min_time": 0}, {"min_time": float("nan")}])
def test_bad_input(bad):
    with pytest.raises(BadInput) as caught:
        time_interleaved({}, **bad)
    assert caught.value.argument == next(iter(bad))
