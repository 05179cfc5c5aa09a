"""Costs, drifts and times in tables are in the unit of their header, and the right way up."""

from itertools import chain
from types import SimpleNamespace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures.measure import Measure
from conservative.outcome import OK
from conservative.reports.run import single_run
from conservative.reports.tables import recommendation, runs, scene_contests
from conservative.reports.tables.work_precision import points
from conservative.trajectory import Trajectory

from .rows import frame, point, row


def test_contests_are_in_microseconds():
    lines = [*point("gauss", "ours", 1e-3, 2e-6), *point("scipy", "engine", 1e-3, 8e-6), *point("lame", "ours", 1e-3, 1e-6)]
    header, (_, _, line) = scene_contests.contests(points(frame(lines)), 0.5)
    assert [name for name in header if "µs" in name] == ["µs per s", "µs a sample"] * 3
    sides = (["gauss", "2.00", "1.00"], ["scipy", "8.00", "4.00"], ["4.00"], ["lame", "1.00", "0.500"], ["8.00"])
    assert line == ["1e-3", *chain.from_iterable(sides)]


def advice(reached):
    probe = SimpleNamespace(
        method=cv.Reduced(), dt=0.25, setting=0.25, drifts=(), expected=2e-5, error=1e-5, holds=7.0, length=3.0, outcome=OK
    )
    return SimpleNamespace(best=probe, reached=reached, cost=4e-6, line="reduced", order=None, probes=(probe,))


def test_a_recommendation_is_in_microseconds_and_tells_how_long_an_error_holds():
    answer = SimpleNamespace(conditions=SimpleNamespace(cost_limit=1.0), advice=(advice(True), advice(False)))
    reaching, failing, probes = recommendation.tables(answer)
    assert dict(zip(reaching.header, reaching.rows[0], strict=True)) == {
        "method": "reduced",
        "setting": "dt = 0.25 s",
        "µs per simulated s": "4",
        "error to expect, rad": "2.0e-05",
        "drift to expect": "kept",
    }
    shown = dict(zip(failing.header, failing.rows[0], strict=True))
    assert (shown["µs per simulated s"], shown["keeps the error for"], shown["to expect, rad"]) == ("4", "7 s", "2.0e-05")
    assert dict(zip(probes.header, probes.rows[0], strict=True))["run, s"] == "3"


def test_truths_are_told_with_their_agreement():
    found = [row("paper", "exact", Measure.AGREEMENT, 2.5e-15, 0.01, role="truth", label="exact and heyoka")]
    header, body = runs.truths(frame(found))
    assert header[1:] == ["dt, s", "truths", "largest angle between them, rad"]
    assert body == [["made_up", "0.01", "exact and heyoka", "2.5e-15"]]


@pytest.fixture
def bumped():
    """A run whose energy is off by 2e-3 in the middle and right in the end."""
    exact = cv.integrate(cv.scenes.brick_flip(), 0.1)
    bump = 1 + 1e-3 * np.sin(np.pi * np.arange(len(exact)) / (len(exact) - 1))
    return Trajectory(exact.scene, exact.t, exact.R_WB, exact.w_WB_B * bump[:, None], "bumped")


def test_the_largest_drift_is_shown_and_not_the_last(bumped):
    assert bumped.drift(bumped.scene.invariants[0])[-1] < 1e-12
    assert "2.00e-03 (relative)" in bumped._repr_html_()
    summary = single_run.summarize(bumped, cv.Reduced(), 0.1)
    assert summary["drift"]["energy"] == pytest.approx(2.001e-3, rel=1e-6)
    assert "2.00e-03 (relative)" in single_run.summary_text(summary)
    assert (summary["last"]["t"], summary["last"]["energy"]) == (bumped.t[-1], bumped.energy[-1])


def test_columns_of_samples_are_what_they_are_called(bumped):
    found = bumped.to_pandas()
    np.testing.assert_array_equal(found["energy"], bumped.energy)
    np.testing.assert_array_equal(found[[f"momentum_W_{axis}" for axis in "123"]], bumped.momentum_W)
    np.testing.assert_array_equal(found[[f"w_WB_B_{axis}" for axis in "123"]], bumped.w_WB_B)
    np.testing.assert_array_equal(found["R_WB_13"], bumped.R_WB[:, 0, 2])
