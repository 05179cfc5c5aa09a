"""Values in the rows of single studies, and the lines of their pictures."""

from types import SimpleNamespace

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.measures.timing import Timing
from conservative.benchmarks.recommendation import recommend
from conservative.benchmarks.studies import long_runs, paper_figures, speed, sphere_curves, studies
from conservative.benchmarks.studies.case import Case, attempt
from conservative.benchmarks.studies.study import Study
from conservative.grid import Grid
from conservative.outcome import OK, OutcomeKind

BRICK = registry.scene("brick_flip:t_end=1")


def findings(name, *methods, scenes=(BRICK,)):
    result = list(studies.findings(Study(name, scenes, methods, quick=True)))
    return [each for each in result if isinstance(each, Measurement)], [each for each in result if isinstance(each, Samples)]


def test_a_long_run_has_a_line_for_everything_that_stays():
    rows, lines = findings("long_runs", cv.Reduced())
    assert {row.dt for row in rows} == {BRICK.dt}
    names = [invariant.name for invariant in BRICK.invariants]
    assert [line.quantity for line in lines] == [*names, long_runs.ORTHONORMALITY]
    largest = {row.quantity: row.value for row in rows if row.measure is Measure.DRIFT_MAX}
    for line in lines[:-1]:
        assert line.t[-1] == pytest.approx(long_runs.DURATIONS * BRICK.t_end, rel=1e-12)
        assert np.all(np.diff(line.value) >= 0)
        assert line.value[-1] == largest[line.quantity]
        assert len(line.t) <= long_runs.SAMPLES


def test_a_long_run_that_fails_has_rows_and_no_line():
    rows, lines = findings("long_runs", cv.Lame())
    assert lines == []
    assert {(row.quantity, row.outcome.kind) for row in rows} == {
        (invariant.name, OutcomeKind.UNSUPPORTED) for invariant in BRICK.invariants
    }


@pytest.mark.parametrize("scene", [BRICK, registry.scene("lagrange_top:t_end=0.1")], ids=lambda scene: scene.name)
def test_a_curve_lies_on_the_unit_sphere(scene):
    rows, lines = findings("sphere_curves", cv.Reduced(), registry.method("exact"), scenes=(scene,))
    assert rows == []
    assert [line.method for line in lines] == ["exact"] * 3 + ["reduced"] * 3
    assert [line.quantity for line in lines] == [*sphere_curves.AXES] * 2
    for three in (lines[:3], lines[3:]):
        off = np.linalg.norm([line.value for line in three], axis=0) - 1
        assert np.abs(off).max() < 1e-13  # measured 3e-16
        assert len(off) <= sphere_curves.SAMPLES


def test_the_papers_figures_are_those_of_its_scenes():
    rows, lines = findings("paper_figures", cv.Reduced())
    assert rows == []
    rates = {line.quantity for line in lines if line.method == paper_figures.PAPER_MAP}
    assert rates == {*paper_figures.RATES, paper_figures.ENERGY, paper_figures.MOMENTUM}
    assert findings("paper_figures", cv.Reduced(), scenes=(registry.scene("needle"),)) == ([], [])


def test_speed_has_the_minimum_and_the_median():
    case = Case("speed", BRICK, cv.Reduced(), Grid(0.01, 10, 10))
    done = attempt(case)
    result = {row.measure: row.value for row in speed.times(speed.TimedRun(case, done, done), Timing(1.0, 3.0, 5, 2))}
    assert result == {
        Measure.TIME_PER_STEP: pytest.approx(0.1),
        Measure.TIME_PER_STEP_MEDIAN: pytest.approx(0.3),
        Measure.TIME: pytest.approx(10.0),
        Measure.TIME_MEDIAN: pytest.approx(30.0),
        Measure.PREPARE: done.cost.prepare,
        Measure.FIRST_CALL: done.cost.first_call,
    }


def test_the_cost_of_a_setting_is_the_least_time_of_a_simulated_second(monkeypatch):
    timed = lambda runs, *_, **__: dict.fromkeys(runs, Timing(2.0, 3.0, 7, 1))  # noqa: E731
    monkeypatch.setattr(recommend, "time_interleaved", timed)
    probe = SimpleNamespace(outcome=OK, cost=recommend.RUN_TIME / 0.5, dt=0.01, method=cv.Reduced())
    conditions = SimpleNamespace(target=1e-3, scene=BRICK, time_limit=60.0)
    result = recommend.time_settings(conditions, {"a": SimpleNamespace(best=lambda target: probe)})
    assert result == {"a": pytest.approx(2.0 / 0.5)}
