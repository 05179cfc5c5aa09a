"""`conservative verify a.csv b.csv` of planted pairs, with the body and without it.

No right recording is called wrong, and no wrong one right. Of 60 pairs with one wrong recording it is named; without the body,
unless both recordings are free rotations of a body of their own. Its mistake is named, but for `NOT_NAMED`. `pytest` verifies
some pairs, `--all` all.
"""

import pytest

from ..sampling import sampled
from .planted import pairs

NOT_NAMED = (25, 48, 50, 51, 58, 68)
"""Pairs whose mistake the search does not find, with the body or without it: Störmer's method, rates that are early in the
first row, dead bands, a halt with few digits, and single rows in noise."""
NOT_FOUND = ((20, False),)
"""RK4 with an error of 1.6e-6 rad, which is undecided: the interval of the fitted body hides how it grows."""
CASES = [(number, with_body) for number in pairs.PAIRS for with_body in (True, False)]


@pytest.mark.parametrize(("number", "with_body"), sampled(CASES, 10))
def test_the_wrong_one_of_two_is_named(number, with_body, tmp_path):
    row = pairs.outcome(number, with_body, tmp_path)
    allowed = {"not named"} if number in NOT_NAMED else {"wrong one not found"} if (number, with_body) in NOT_FOUND else set()
    assert row["complaint"] in {"", *allowed}, row


@pytest.mark.parametrize(
    ("number", "name", "free"),
    [(70, "right", True), (3, "another body", True), (5, "inertia of the start", False), (8, "factor one half", False)],
)
def test_the_check_of_free_rotations_is_right(number, name, free):
    pair = pairs.plant(number)
    place = pair.wrong[0] if pair.wrong else 0
    about = pair.made[place].about
    assert pair.made[place].mistake == name
    assert pairs.is_free(*pair.motions[place], about["grain"], about["scale"]) == free
