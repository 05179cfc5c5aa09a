"""A run whose energy is no longer that of its start is a failure: for the gate, and for who would accept it as a baseline."""

import math
from dataclasses import replace

import pytest

from conservative.benchmarks.gate import baseline, compare, results
from conservative.benchmarks.gate.results import Results, Row, Status
from conservative.errors import BadInput

ROW = Row("file.py::test[b]", "top", "gauss", Status.PASSED, "", "other", {"rate error max": 1.0}, {}, None)
KEPT = baseline.update_baseline(None, [Results("here", {"a": replace(ROW, id="a", method="reduced")})], "first")


@pytest.mark.parametrize(("drift", "failed"), [(0.36, False), (1.0, False), (1.01, True), (2.7e11, True), (math.nan, True)])
def test_a_run_that_ran_away_is_a_failure_and_no_baseline(drift, failed):
    values = {results.ENERGY_DRIFT: drift}
    found = Results("here", {ROW.id: replace(ROW, values=values)})
    (*_, each) = compare.judge(KEPT, found).violations
    assert (each.measure == results.ENERGY_DRIFT) == failed  # a row of which the baseline knows nothing
    assert bool(results.find_runaway(values)) == failed
    if failed:
        assert (each.was, each.allowed) == ("missing", "at most 1")
        with pytest.raises(BadInput, match=r"a failure is not accepted|not a number is not accepted"):
            baseline.update_baseline(None, [found], "accept it")
    else:
        baseline.update_baseline(None, [found], "accept it")


def test_a_run_that_ran_away_fails_whatever_the_baseline_has_of_it():
    values = {results.ENERGY_DRIFT: 2.7e11}
    old = baseline.BaselineRow("top", "gauss", "", "other", {results.ENERGY_DRIFT: baseline.Allowed(2.7e11, 0, 1, 2.8e11)})
    row = replace(ROW, values=values)
    (each,) = compare.judge(baseline.Baseline({row.id: old}, []), Results("here", {row.id: row})).violations
    assert (each.was, each.now, each.allowed) == ("2.7e+11", "2.7e+11", "at most 1")
