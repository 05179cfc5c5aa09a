"""Verdicts on a whole follow from the verdicts on its parts."""

from itertools import combinations

import pytest

from conservative.benchmarks.verification.finding import EXIT_CODES, Verdict, join_verdicts

ORDER = (Verdict.WRONG, Verdict.UNDECIDED, Verdict.RIGHT, Verdict.NOT_TESTED)
"""The verdict of a whole is the first of these that a part has."""


@pytest.mark.parametrize("parts", [parts for n in range(1, 5) for parts in combinations(reversed(ORDER), n)], ids="-".join)
def test_the_first_verdict_in_order_decides(parts):
    assert join_verdicts(parts) is next(verdict for verdict in ORDER if verdict in parts)


def test_nothing_is_not_tested_and_only_right_ends_with_0():
    assert join_verdicts(()) is Verdict.NOT_TESTED
    assert [verdict for verdict in Verdict if EXIT_CODES[verdict] == 0] == [Verdict.RIGHT]
