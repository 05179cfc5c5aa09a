"""The rule by which two values differ, and that nothing but it decides."""

import math
from dataclasses import replace

import pytest

from conservative.benchmarks.gate import compare
from conservative.benchmarks.measures.change import Range, direction, exact
from conservative.benchmarks.versions import changes, times
from conservative.benchmarks.versions.project import decide

from .versions.made_up import comparison, row, timed
from .versions.made_up_engine import BAD, GOOD, TIMES

SLOW = (2.0, 1.9, 2.1)


@pytest.mark.parametrize(
    ("was", "now", "options", "expected"),
    [
        (Range(2.0, 1.0, 3.0), Range(4.0, 3.0, 5.0), {}, 0),  # ranges that touch
        (Range(2.0, 1.0, 3.0), Range(4.0, 3.1, 5.0), {}, 1),
        (Range(4.0, 3.1, 5.0), Range(2.0, 1.0, 3.0), {}, -1),
        (exact(1.0), Range(2.0, 1.4, 3.0), {"factor": 1.5}, 0),
        (exact(1.0), Range(2.0, 1.6, 3.0), {"factor": 1.5}, 1),
        (exact(1.0), exact(0.6), {"margin": 0.5}, 0),
        (exact(1.0), exact(0.4), {"margin": 0.5}, -1),
        (exact(math.nan), exact(1.0), {}, 0),
        (exact(1.0), exact(math.inf), {}, 1),
    ],
)
def test_values_differ_if_their_ranges_do(was, now, options, expected):
    assert direction(was, now, **options) == expected


@pytest.mark.parametrize(
    ("signed", "size"),
    [(Range(0.1, -1, 2), Range(0.1, 0, 2)), (Range(-2, -3, -1), Range(2, 1, 3)), (Range(2, 1, 3), Range(2, 1, 3))],
)
def test_the_size_of_a_range_around_0_begins_at_0(signed, size):
    assert signed.size == size


def test_no_other_rule_decides(monkeypatch):
    worse = comparison((row(), row(energy_drift_max=0.5), timed(SLOW, SLOW)))
    slow = tuple(2 * time for time in TIMES)
    assert len(decide(worse).violations) == 2
    assert len(changes.find_changes(GOOD, BAD, TIMES, slow)) == 5
    for module in (compare, times, changes):
        monkeypatch.setattr(module, "direction", lambda *values, **options: 0)
    assert decide(worse).violations == ()
    # An attitude that becomes lost is reported whatever its interval.
    assert [change.lost for change in changes.find_changes(GOOD, replace(BAD, drifts=GOOD.drifts), TIMES, slow)] == [True]
    assert [change.lost for change in changes.find_changes(GOOD, BAD, TIMES, slow)] == [True]
