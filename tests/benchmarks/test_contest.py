"""The cost of an error on a line of settings: isolated good settings are ignored, and nothing is extrapolated."""

import math

import numpy as np
import pytest

from conservative.benchmarks.contest import SMALLEST, Cheapest, Contest, Ratios, cost, credit, first_within, list_deciding

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


def ratios(*values):
    return Ratios(
        tuple(Contest(str(i), 1e-6, Cheapest(1.0, "ours"), Cheapest(value, "theirs")) for i, value in enumerate(values))
    )


def test_the_interval_of_the_mean_is_that_of_the_logarithms():
    result = ratios(2.0, 4.0, 8.0)
    half = 4.302652729911275 * math.log(2) / math.sqrt(3)  # Student's t of two degrees of freedom, 97.5 %
    assert result.mean == pytest.approx(4.0)
    assert result.interval == pytest.approx((4.0 * math.exp(-half), 4.0 * math.exp(half)))
    assert all(map(math.isnan, ratios(2.0).interval))


def test_the_interval_holds_the_mean_as_often_as_it_should():
    rng = np.random.default_rng(7)
    result = [ratios(*np.exp(rng.normal(0.5, 0.3, 10))).interval for _ in range(400)]
    assert 0.92 < np.mean([low <= math.exp(0.5) <= high for low, high in result]) < 0.98  # measured 0.935
