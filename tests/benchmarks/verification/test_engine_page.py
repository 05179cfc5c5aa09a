"""The table of references/motions/my_engine_fails.md: sizes of errors on the ball of `readings` show the kind of a mistake."""

import pytest

from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.mistakes.readings import ATTITUDES, AXES, RATES, Reading
from conservative.benchmarks.verification.mistakes.scenes import SceneMistake
from conservative.benchmarks.verification.mistakes.times import Time
from conservative.benchmarks.verification.motions.files import read

BALL = {each["mistake"]: (each["attitude"], each["rates"]) for each in read("readings")["catches"]}
ALLOWED = next(row for row in read("readings")["tolerance"] if (row["order"], row["angle"]) == (2, 0.01))


def of_kind(is_of):
    return {name for name in BALL if name in BY_KEY and is_of(BY_KEY[name])}


def with_errors(fits):
    return {name for name, errors in BALL.items() if fits(*errors)}


def test_an_attitude_with_another_meaning():
    large = with_errors(lambda attitude, rates: attitude >= 0.2)
    readings = of_kind(lambda mistake: isinstance(mistake, Reading) and mistake.of in (ATTITUDES, AXES))
    starts = of_kind(lambda mistake: isinstance(mistake, SceneMistake) and mistake.start)
    assert large == readings | (starts - {"start in degrees", "start in world rates"})


def test_rates_with_another_meaning():
    large = with_errors(lambda attitude, rates: attitude <= ALLOWED["attitude"] and rates >= 0.2)
    assert large == of_kind(lambda mistake: isinstance(mistake, Reading) and mistake.of == RATES)


def test_a_body_that_stands_still_or_turns_twice_as_far():
    assert with_errors(lambda attitude, rates: attitude == 0.1) == {"sleep", "factor one half", "frozen motion"}


@pytest.mark.parametrize("share", [1, 2])
def test_samples_at_another_time(share):
    late = with_errors(lambda attitude, rates: attitude == 0.005 * share and rates == 0)
    steps = {1: "half a step", 2: "a step"}[share]
    assert late == of_kind(lambda mistake: isinstance(mistake, Time) and mistake.key.startswith(steps))


def test_what_a_ball_does_not_show():
    for name in ("no gyroscopic term", "sign of the gyroscopic term", "inverted inertia"):
        assert name not in BALL
        assert name in {each["mistake"] for each in read("gyroscopic_term")["catches"]}
    products = {each["mistake"] for each in read("products")["catches"]}
    assert {"no products of inertia", "sign of the products of inertia", "diagonal gyroscopic term"} <= products
    assert "no products of inertia" not in {each["mistake"] for each in read("gyroscopic_term")["catches"]}
