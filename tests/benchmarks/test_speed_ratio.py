"""The cost of an error on a line of settings: isolated good settings are ignored, and nothing is extrapolated."""

import math

import numpy as np
import pandas as pd
import pytest

from conservative.benchmarks.speed_ratio import (
    SMALLEST,
    Cheapest,
    Ratios,
    SpeedRatio,
    bootstrap,
    cost,
    costs,
    credit,
    first_within,
    list_deciding,
)

ERRORS, TIMES = [1e-1, 1e-3, 1e-5], [1.0, 2.0, 4.0]


def test_a_setting_is_credited_with_the_worst_of_it_and_of_all_finer_ones():
    assert credit([1e-1, 1e-9, 1e-3, 1e-4]) == [1e-1, 1e-3, 1e-3, 1e-4]
    assert credit([1e-14, 2e-14]) == [2e-14, 2e-14]
    assert credit([1e-3, 0.0]) == [1e-3, SMALLEST]


def test_a_lucky_setting_gains_nothing():
    lucky = [1e-1, 1e-9, 1e-3, 1e-5]
    times = [1.0, 1.1, 2.0, 4.0]
    assert min(time for error, time in zip(lucky, times, strict=True) if error <= 1e-5) == 1.1  # what it would gain
    assert cost(lucky, times, 1e-5) == 4.0


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (1.0, 1.0),  # the coarsest is better than asked for
        (1e-1, 1.0),
        (1e-3, 2.0),
        (1e-4, math.sqrt(2.0 * 4.0)),  # halfway between 1e-3 and 1e-5, in logarithms
        (1e-5, 4.0),
        (1e-6, math.nan),
    ],
)
def test_between_two_settings_the_cost_is_interpolated(error, expected):
    assert cost(ERRORS, TIMES, error) == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_a_finer_setting_that_is_cheaper_counts():
    assert cost(ERRORS, [1.0, 5.0, 4.0], 1e-3) == 4.0


def test_a_setting_without_a_time_is_no_way_there():
    assert cost(ERRORS, [1.0, math.nan, 4.0], 1e-3) == 4.0
    assert math.isnan(cost(ERRORS, [1.0, 2.0, math.nan], 1e-5))
    assert cost([1e-1, 1e-9, 1e-3, 1e-5], [1.0, 1.1, math.nan, 4.0], 1e-4) == 4.0  # its error counts all the same


def test_a_method_of_an_order_is_interpolated_exactly():
    errors, times = ([(1 / n) ** 8 for n in (4, 16)], [4.0, 16.0])
    assert cost(errors, times, (1 / 8) ** 8) == pytest.approx(8.0, rel=1e-12)


def test_a_line_without_settings_has_no_cost():
    assert math.isnan(cost([], [], 1e-3))
    assert first_within([], 1e-3) is None


@pytest.mark.parametrize(("error", "deciding"), [(1.0, [0]), (1e-3, [1, 2]), (1e-6, [3, 4]), (1e-9, [])])
def test_the_settings_that_decide_are_the_first_that_is_credited_and_the_one_before(error, deciding):
    assert list_deciding([1e-1, 1e-2, 1e-7, 1e-4, 1e-8], error) == deciding


def speed_ratio(*values, name="0"):
    """Return a speed ratio with these ratios in as many processes."""
    return SpeedRatio(name, 1e-6, Cheapest(1.0, "ours", (1.0,) * len(values)), Cheapest(values[0], "theirs", values))


def ratios(*rows):
    return Ratios(tuple(speed_ratio(*row, name=str(i)) for i, row in enumerate(rows)))


def test_a_body_is_won_or_lost_only_outside_of_its_interval():
    won, lost, even = (
        speed_ratio(1.2, 1.3, 1.1, 1.2, 1.25),
        speed_ratio(0.8, 0.9, 0.85, 0.8, 0.9),
        speed_ratio(1.1, 0.95, 1.3, 1.2, 1.05),
    )
    assert won.ratio == pytest.approx((1.2 * 1.3 * 1.1 * 1.2 * 1.25) ** 0.2)
    assert won.interval == pytest.approx((1.12, 1.29), abs=0.02)  # with five processes about their range
    assert [(each.won, each.lost) for each in (won, lost, even)] == [(True, False), (False, True), (False, False)]
    found = Ratios((won, lost, even, SpeedRatio("3", 1e-6, None, Cheapest(1.0, "theirs", (1.0,) * 5))))
    assert (found.won, found.open, found.lost, found.only_theirs) == (1, 1, 2, 1)
    assert speed_ratio(0.99).lost  # a single process has no interval


def test_times_are_paired_by_process():
    """A process that is slow for both sides changes no ratio, and one without a time of a side has none."""
    ours, theirs = Cheapest(1.0, "ours", (1.0, 7.0, math.nan)), Cheapest(2.0, "theirs", (2.0, 14.0, 2.0))
    slow = SpeedRatio("0", 1e-6, ours, theirs)
    assert slow.interval == pytest.approx((2.0, 2.0))
    assert len(slow.logs) == 2


def test_costs_are_those_of_each_process():
    lines = {"scene": "s", "name": "a", "family": "a", "class": "c", "error": ERRORS}
    points = pd.DataFrame({**lines, "time": TIMES, "times": [(1.0, 2.0), (2.0, 4.0), math.nan]})
    found = costs(points, [1e-2, 1e-5])
    assert found["times"].tolist() == [pytest.approx((math.sqrt(2), 2 * math.sqrt(2)))]
    assert found["time"].tolist() == [pytest.approx(2)]


def share_within(bodies, processes, body=0.0, process=0.0, noise=0.0, trials=300):
    """Return how often the interval of the mean contains the true one, for a scatter of bodies, processes and both."""
    rng, inside = np.random.default_rng(7), 0
    for _ in range(trials):
        parts = rng.normal(0, body, (bodies, 1)), rng.normal(0, process, processes), rng.normal(0, noise, (bodies, processes))
        low, high = bootstrap(sum(parts).tolist())
        inside += low <= 1.0 <= high
    return inside / trials


@pytest.mark.parametrize(
    ("count", "scatter", "measured"),
    [
        ((10, 1), {"body": 0.3}, 0.933),
        ((1, 5), {"noise": 0.03}, 0.903),
        ((20, 5), {"body": 0.2, "noise": 0.05}, 0.947),
        ((20, 5), {"body": 0.05, "process": 0.05}, 0.95),
    ],
)
def test_the_interval_holds_the_mean_as_often_as_it_should(count, scatter, measured):
    assert share_within(*count, **scatter) == pytest.approx(measured, abs=0.03)


def test_without_the_scatter_of_processes_the_interval_would_be_too_narrow():
    rng = np.random.default_rng(7)
    logs = 0.05 * rng.normal(size=5) + 0.01 * rng.normal(size=(20, 1))
    both, bodies = (np.ptp(np.log(bootstrap(each.tolist()))) for each in (logs, logs.mean(axis=1, keepdims=True)))
    assert both > 3 * bodies
