"""What of measured errors is fitted, decision by decision: three parts of the data, and what is said of them."""

import random

import numpy as np
import pytest

from conservative.benchmarks.measures.convergence_order import observed_order

STEPS = 0.1 * 0.5 ** np.arange(10)
DECISIONS = """
none/5 none/7 3456789 3456789 none/9 234567/8 0123456/7 none/5 23456789 123/5 234/9 0123/5 456789 123456789 1234/9
none/3 none/4 456789 456789 56789 01234/8 23456789 none/5 none/5 12345678 01234/9 3456/9 0123456789 none/6 123/7 0123/7
none/9 01234/8 01234/5 012/5 0123/6 012345/9 345/9 none/4 none/6 0123456789 none/4 234/6 none/9 3456789 23456789 123/7
none/7 56789 456789 0123456789 none/5 none/8 567/8 none/5 0123456789 45678 none/8 012345/7 0123/9 01234/6 2345/8 0123/6
123/6 3456/9 01234/8 23456789 789 567/9 0123/4 none/4 0123456789 none/8 012345/8 0123456789 none/4 none/6 3456789 none/7
none/9 none/8 3456789 012/8 789 123/4 none/8 none/4 0123456789 none/5 none/6
"""
"""Points in the fit, from the coarsest, and after a stroke the one that is the floor; for the draws 0, 1, 2, ..."""


def draw(seed):
    """Errors that fall by slopes which change, down to a floor of which each has another share."""
    given = random.Random(seed)
    slope = given.choice([1.0, 2.0, 4.0])
    slopes = [slope * given.choice([1.0, 1.0, 1.0, 0.55, 0.4, 0.3, -0.2, 1.3]) for _ in STEPS[1:]]
    floor = 1e-2 * 0.5 ** (slope * given.uniform(4, 14))
    return 1e-2 * 0.5 ** np.cumsum([0.0, *slopes]) + floor * np.array([given.uniform(0.2, 1.0) for _ in STEPS])


def decide(errors):
    """What is fitted, and which point is the floor."""
    order = observed_order(STEPS[: len(errors)], errors)
    floor = "" if np.isnan(order.floor) else f"/{int(np.argmin(np.abs(errors - order.floor)))}"
    return ("".join(map(str, order.used)) or "none") + floor


def test_decisions_are_what_they_were():
    """Looked at one by one when they were written down; ties, where rounding decides, are not among them."""
    expected = DECISIONS.split()
    assert [decide(draw(seed)) for seed in range(len(expected))] == expected


def errors_of(*slopes):
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


def test_the_text_has_the_floor_where_there_is_one():
    assert str(observed_order(STEPS[:5], errors_of(2, 2, 2, 2))) == "2.00 +- 0.00 from 5 points"
    errors = errors_of(2, 2, 2, 2, 2, 0, 0)
    errors[-3:] = 3.21e-7
    assert str(observed_order(STEPS[:8], errors)) == "2.00 +- 0.00 from 5 points above a floor of 3.2e-07"
