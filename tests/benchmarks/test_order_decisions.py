"""Which measured errors a fit of the order uses, decision by decision."""

import numpy as np
import pytest

from conservative.benchmarks.measures.convergence_order import SHRINKING, observed_order

STEPS = 0.1 * 0.5 ** np.arange(10)


def decide(errors):
    """Return the points in the fit, numbered from the coarsest, and after a stroke the one that is the floor."""
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
    found = observed_order(STEPS[:8], errors_of(2, 2, 2, 2, *3 * [part * SHRINKING * 2]))
    assert np.isnan(found.floor) == (last == 7)
    if last == 4:
        assert found.floor == pytest.approx(errors_of(2, 2, 2, 2)[-1])


def test_one_lucky_zero_is_not_the_steepest_slope():
    errors = errors_of(2, 2, 2, 2, 2, 2, 2)
    errors[-1] = 0.0
    found = observed_order(STEPS[:8], errors)
    assert found.slope == pytest.approx(2, abs=1e-9)
    assert 7 not in found.used
    assert len(found.used) >= 3


@pytest.mark.parametrize(("error", "used"), [(1.1e-6, {0, 1, 2, 3}), (0.9e-6, {0, 1, 2})])
def test_points_within_ten_of_the_floor_are_left_out(error, used):
    found = observed_order(STEPS[:8], np.array([1e-3, 1e-4, 1e-5, error, 1e-7, 1e-7, 1e-7, 1e-7]))
    assert found.floor == pytest.approx(1e-7)
    assert set(found.used) == used
