"""Times of two versions: slower versions fail, slow periods of the machine do not; both are measured in new processes."""

import math

import numpy as np
import pytest

from conservative.benchmarks.versions.times import (
    LAYOUTS,
    MOST_TURNS,
    PROCESSES,
    Clock,
    compare_times,
    ratio_of,
    settle,
)

from .made_up import STEP, TIMED, Side


def compare(base, head, *, processes=PROCESSES):
    (row,) = compare_times(base, head, [TIMED], processes).values()
    return row


def test_the_same_is_not_slower_and_is_measured_once():
    base, head = Side(), Side()
    row = compare(base, head)
    assert not row.failed
    assert row.again is None
    assert row.first.value == pytest.approx(1, abs=0.002)  # 0.9997
    assert row.first.low < row.first.value < row.first.high
    assert (row.was, row.now) == (pytest.approx(STEP, rel=0.02), pytest.approx(STEP, rel=0.02))
    assert (base.processes, head.processes) == (PROCESSES, PROCESSES)


@pytest.mark.parametrize("factor", [1.08, 1.1, 1.2, 3.0])
def test_a_slower_version_is_measured_again_in_new_processes_and_fails(factor):
    base, head = Side(), Side(factor)
    row = compare(base, head)
    assert row.failed
    assert row.first.value == pytest.approx(factor, rel=0.01)
    assert row.again.slower
    assert row.again.value == pytest.approx(factor, rel=0.01)
    assert (base.processes, head.processes) == (2 * PROCESSES, 2 * PROCESSES)


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.03])
def test_a_faster_or_slightly_slower_version_passes(factor):
    row = compare(Side(), Side(factor))
    assert not row.failed
    assert row.again is None


def test_a_slow_period_of_the_machine_is_no_failure():
    row = compare(Side(), Side(spells=lambda process: 1.2 if process <= PROCESSES else 1.0))
    assert row.first.slower
    assert not row.again.slower
    assert not row.failed


def test_a_few_slow_processes_are_no_failure():
    row = compare(Side(), Side(spells=lambda process: 1.07 if process % 2 else 1.0))
    assert not row.failed
    assert row.first.value < 1.02


def test_an_open_ratio_is_measured_in_more_processes():
    row = compare(Side(), Side(1.08, spells=lambda process: (0.97, 1.0, 1.03)[process % 3]))
    assert row.first.processes > PROCESSES
    clock = Clock(Side(), Side(1.08, spells=lambda process: (0.96, 1.0, 1.05)[process % 3]))
    assert len(settle(clock, [TIMED], 3)[TIMED]) == 3 * MOST_TURNS


def test_a_crashing_version_fails_only_its_row():
    other = ("brick_flip", "gauss")

    class Fragile(Side):
        def timed(self, scene, method, n_steps):
            self.crash = 3 if method == "gauss" else None
            return super().timed(scene, method, n_steps)

    timed_rows = compare_times(Side(), Fragile(), [TIMED, other])
    assert timed_rows[other].failed
    assert timed_rows[other].reason == "crashed (signal 11)"
    assert timed_rows[other].first.processes == 2
    assert not timed_rows[TIMED].failed


def test_no_rows_start_no_process():
    base = Side()
    assert compare_times(base, Side(), []) == {}
    assert base.processes == 0


def test_each_process_has_its_data_in_several_places():
    class Counting(Side):
        prepared = 0

        def timed(self, *arguments):
            self.prepared += 1
            return super().timed(*arguments)

    head = Counting()
    compare(Side(), head)
    assert head.prepared == LAYOUTS * PROCESSES


def test_the_interval_has_its_confidence():
    # The ends hold with 99 % each: of 400 samples of a ratio of 1 with 7 processes, few are outside.
    rng = np.random.default_rng(4)
    outside = 0
    for _ in range(400):
        ratio = ratio_of(np.exp(rng.normal(0, 0.01, (7, 2))))
        outside += not ratio.low <= 1 <= ratio.high
    assert outside <= 40  # 28: a bootstrap of seven is a little too sure of itself


def test_one_process_has_no_interval():
    for times in ([], [(1.0, 2.0)]):
        ratio = ratio_of(times)
        assert math.isnan(ratio.value)
        assert not ratio.slower
