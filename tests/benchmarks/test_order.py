"""The observed order of convergence, the errors in its fit, and the line through them."""

import math

import numpy as np
import pytest
from scipy.stats import linregress

from conservative.benchmarks.measures.convergence_order import SHRINKING, fit_line, observed_order
from conservative.errors import BadInput

STEPS = 0.1 / 2.0 ** np.arange(9)


def noisy(errors, size, seed):
    return errors * np.exp(size * np.random.default_rng(seed).standard_normal(len(errors)))


@pytest.mark.parametrize("p", [1, 2, 4, 6])
def test_exact_powers_give_their_order_from_all_points(p):
    order = observed_order(STEPS, 3.7 * STEPS**p)
    assert abs(order.slope - p) < 1e-12  # measured 9e-16 to 4e-15
    assert len(order.used) == 9
    assert math.isnan(order.floor)


@pytest.mark.parametrize("p", [1, 2, 3.8, 4])
@pytest.mark.parametrize("seed", range(20))
def test_noise_is_averaged_over_the_points_and_shows_in_the_standard_error(p, seed):
    order = observed_order(STEPS, noisy(STEPS**p, 0.1, seed))
    assert abs(order.slope - p) < 0.08  # measured up to 0.060 over 200 draws with 10 % noise
    assert 0.003 < order.stderr < 0.05  # measured 0.004 to 0.032 over 200 draws
    assert len(order.used) >= 6  # measured 7 to 9


@pytest.mark.parametrize("p", [2, 4, 8])
@pytest.mark.parametrize("seed", range(20))
def test_points_on_and_near_the_floor_are_left_out(p, seed):
    steps = 1 / 2.0 ** (np.arange(14) / (2 if p == 8 else 1))
    level = 1e-6 if p == 2 else 1e-11
    errors = 1e-2 * steps**p + level * np.abs(np.random.default_rng(seed).standard_normal(14))
    order = observed_order(steps, errors)
    assert abs(order.slope - p) < 0.08  # measured up to 0.052, 0.007, 0.013 over 200 draws
    assert level / 5 < order.floor < 8 * level  # measured 0.29 to 5.4 levels
    assert (errors[list(order.used)] > 3 * level).all()  # measured 3.9 levels and more
    assert len(order.used) >= 4


def test_a_floor_alone_seldom_looks_like_an_order():
    draws = [1e-15 * np.abs(np.random.default_rng(seed).standard_normal(9)) for seed in range(500)]
    fitted = [observed_order(STEPS, errors) for errors in draws]
    assert sum(not order.reason for order in fitted) < 30  # measured 16: three random numbers can fall like an order


def test_round_off_that_grows_as_steps_shrink_is_a_floor():
    steps = 0.1 / 2.0 ** np.arange(12)
    order = observed_order(steps, steps**4 + 1e-14 / steps)
    assert abs(order.slope - 4) < 0.01  # measured 7e-4
    assert order.floor == pytest.approx(1e-14 / steps[-1], rel=1e-3)


@pytest.mark.parametrize("p", [2, 4])
def test_coarse_points_that_do_not_converge_yet_are_left_out(p):
    errors = np.minimum(50 * (STEPS / 0.1) ** p / (1 + 3 * STEPS / 0.1), 3.1)
    errors[1] = 2.5  # a wandering error of the order of half a turn
    order = observed_order(STEPS, errors)
    assert min(order.used) >= 3
    assert abs(order.slope - p) < 0.1  # measured 0.06 and 0.08: what is left of the bend


def test_a_lucky_zero_is_not_a_floor():
    """One error a hundred times too small cuts the data in two; the larger part still has the order."""
    errors = STEPS**4
    errors[4] *= 1e-2
    assert observed_order(STEPS, errors).slope == pytest.approx(4, rel=1e-9)


def test_of_two_sequences_of_equal_slopes_the_finer_one_has_the_order():
    errors = np.where(STEPS[4] > STEPS, STEPS**2, STEPS**2 * (STEPS / STEPS[4]) ** 0.08)
    order = observed_order(STEPS, errors)
    assert order.slope == pytest.approx(2, rel=1e-12)
    assert order.used == (4, 5, 6, 7, 8)


def test_order_of_the_input_and_failed_runs_do_not_matter():
    errors = noisy(STEPS**2, 0.05, 1)
    errors[3] = math.nan
    shuffled = np.random.default_rng(2).permutation(9)
    straight, mixed = observed_order(STEPS, errors), observed_order(STEPS[shuffled], errors[shuffled])
    assert straight.slope == pytest.approx(mixed.slope, rel=1e-13)
    assert 3 not in straight.used
    assert [shuffled[i] for i in mixed.used] == list(straight.used)


@pytest.mark.parametrize(
    "errors",
    [
        [1e-3, 2.5e-4],
        [1e-3, math.nan, math.nan, 1e-5],
        [3e-15, 1e-15, 4e-15, 2e-15, 5e-15],
        [1e-3, 1e-3, 1e-3, 1e-3],
        [0.0, 0.0, 0.0, 0.0],
        [1e-3, 1e-14, 2e-14, 1e-14],
    ],
    ids=["two points", "two that ran", "all floor", "constant", "zero", "one above the floor"],
)
def test_too_few_points_have_no_order_but_a_reason(errors):
    order = observed_order(STEPS[: len(errors)], errors)
    assert math.isnan(order.slope)
    assert math.isnan(order.stderr)
    assert order.used == ()
    assert "a fit takes 3" in order.reason
    assert str(order) == order.reason


@pytest.mark.parametrize(
    ("steps", "errors", "argument"),
    [
        ([0.1, 0.2], [1.0], "steps"),
        ([0.1, 0.1, 0.2], [1.0, 1.0, 2.0], "steps"),
        ([0.1, -0.1, 0.2], [1.0, 1.0, 2.0], "steps"),
        ([0.1, math.nan, 0.2], [1.0, 1.0, 2.0], "steps"),
        ([0.4, 0.1, 0.2], [1.0, -1.0, 2.0], "errors"),
    ],
)
def test_bad_input(steps, errors, argument):
    with pytest.raises(BadInput) as caught:
        observed_order(steps, errors)
    assert caught.value.argument == argument


def decide(errors):
    """Return the points in the fit, numbered from the coarsest, and after a slash the point at the floor."""
    order = observed_order(STEPS[: len(errors)], errors)
    floor = "" if np.isnan(order.floor) else f"/{int(np.argmin(np.abs(errors - order.floor)))}"
    return ("".join(map(str, order.used)) or "none") + floor


def errors_of(*slopes):
    """Return errors with these local slopes, from coarse to fine."""
    return 1e-2 * 0.5 ** np.cumsum([0.0, *slopes])


@pytest.mark.parametrize(
    ("slopes", "decision"),
    [
        ((2, 2, 2, 2, 0.9), "01234"),
        ((2, 2, 2, 2, 1.1), "012345"),
        ((6, 6, 6, 6, 3.5), "012345"),
        ((6, 6, 6, 6, 2.5), "01234"),
        ((2, 2, 0.9), "012"),
        ((2, 2), "012"),
        ((2, 0.9), "012"),
    ],
)
def test_a_last_pair_with_less_than_half_the_slope_is_left_out(slopes, decision):
    assert decide(errors_of(*slopes)) == decision


@pytest.mark.parametrize(
    ("slopes", "decision"),
    [
        ((2.12, 2, 2, 2), "1234"),
        ((2.08, 2, 2, 2), "01234"),
        ((2.12, 2, 2), "123"),
        ((1.88, 2, 2, 2), "1234"),
        ((2.12, 2), "012"),
    ],
)
def test_a_coarsest_pair_that_is_off_by_a_twentieth_is_left_out(slopes, decision):
    assert decide(errors_of(*slopes)) == decision


@pytest.mark.parametrize(("part", "last"), [(0.9, 4), (1.1, 7)])
def test_an_error_shrinks_while_its_slope_is_above_a_third_of_the_steepest(part, last):
    fitted = observed_order(STEPS[:8], errors_of(2, 2, 2, 2, *3 * [part * SHRINKING * 2]))
    assert np.isnan(fitted.floor) == (last == 7)
    if last == 4:
        assert fitted.floor == pytest.approx(errors_of(2, 2, 2, 2)[-1])


def test_one_lucky_zero_is_not_the_steepest_slope():
    errors = errors_of(2, 2, 2, 2, 2, 2, 2)
    errors[-1] = 0.0
    fitted = observed_order(STEPS[:8], errors)
    assert fitted.slope == pytest.approx(2, abs=1e-9)
    assert 7 not in fitted.used
    assert len(fitted.used) >= 3


@pytest.mark.parametrize(("error", "used"), [(1.1e-6, {0, 1, 2, 3}), (0.9e-6, {0, 1, 2})])
def test_points_within_ten_of_the_floor_are_left_out(error, used):
    fitted = observed_order(STEPS[:8], np.array([1e-3, 1e-4, 1e-5, error, 1e-7, 1e-7, 1e-7, 1e-7]))
    assert fitted.floor == pytest.approx(1e-7)
    assert set(fitted.used) == used


RK4 = (3.31509003e-02, 1.43802374e-03, 6.63162345e-05, 3.40866668e-06, 1.92134500e-07, 1.15091405e-08, 7.05239449e-10)
"""Errors of RK4 on the brick: their slopes are 4.53, 4.44, 4.28, 4.15, 4.06 and 4.03."""


def test_the_order_of_a_few_coarse_steps_and_of_all_agree_within_their_intervals():
    """A slow program reaches four steps; its order was 4.42 +- 0.04, and that of a fast one 4.08 +- 0.02."""
    few, every = (observed_order(STEPS[:count], RK4[:count]) for count in (4, 7))
    assert few.slope == pytest.approx(4.42, abs=0.01)
    assert every.slope == pytest.approx(4.04, abs=0.01)  # of the finest three, whose slopes agree
    assert every.used == (4, 5, 6)
    assert abs(every.slope - 4) < every.stderr  # measured 0.07
    assert abs(few.slope - 4.06) < few.stderr  # measured 0.37
    assert abs(few.slope - every.slope) < few.stderr + every.stderr


X = np.linspace(-2.0, 3.0, 40)


def test_a_line_through_noise_is_that_of_scipy():
    y = 0.3 * X - 1 + 0.1 * np.random.default_rng(1).normal(size=len(X))
    fitted, expected = fit_line(X, y), linregress(X, y)
    assert (fitted.slope, fitted.stderr) == pytest.approx((expected.slope, expected.stderr), rel=1e-12)
    assert 0.08 < fitted.scatter < 0.12  # 0.1 was put in


def test_the_scatter_of_points_nearly_on_a_line_keeps_its_digits():
    noise = 1e-11 * np.random.default_rng(2).normal(size=len(X))
    far, near = fit_line(X, noise), fit_line(X, X + noise)
    assert near.slope == pytest.approx(1, abs=1e-11)
    assert near.scatter == pytest.approx(far.scatter, rel=1e-3)  # measured 5e-6; linregress is off by a factor
    assert near.stderr == pytest.approx(far.stderr, rel=1e-3)
