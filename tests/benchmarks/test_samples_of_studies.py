"""Values in the rows of single studies, and the lines of their pictures."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import conservative as cv
from conservative import Scene, registry
from conservative.attitude import angle_between, from_quaternion, rotation_about
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.measurement import Measurement, Samples
from conservative.benchmarks.measures.timing import Timing
from conservative.benchmarks.recommendation import recommend
from conservative.benchmarks.studies import long_runs, motion, speed, studies
from conservative.benchmarks.studies.case import Case, attempt
from conservative.benchmarks.studies.study import Study
from conservative.grid import Grid
from conservative.methods.symplectic import NoSquish
from conservative.outcome import OK, OutcomeKind
from conservative.references.exact.method import Exact

BRICK = registry.scene("brick_flip:t_end=1")


def findings(name, *methods, scenes=(BRICK,)):
    result = list(studies.findings(Study(name, scenes, methods, quick=True)))
    return [each for each in result if isinstance(each, Measurement)], [each for each in result if isinstance(each, Samples)]


def test_a_long_run_has_its_drifts_and_no_line():
    rows, lines = findings("long_runs", cv.Reduced())
    assert {row.dt for row in rows} == {BRICK.dt}
    assert lines == []
    largest = {row.quantity: row.value for row in rows if row.measure is Measure.DRIFT_MAX}
    assert set(largest) == {invariant.name for invariant in BRICK.invariants}
    assert max(largest.values()) < 1e-12  # measured 1e-14


def test_a_long_run_that_fails_has_rows_and_no_line():
    rows, lines = findings("long_runs", cv.Lame())
    assert lines == []
    assert {(row.quantity, row.outcome.kind) for row in rows} == {
        (invariant.name, OutcomeKind.UNSUPPORTED) for invariant in BRICK.invariants
    }


TURNED = rotation_about((1.0, 2.0, -0.5), 0.7)
TUMBLING = Scene(
    "tumbling", cv.RigidBody(TURNED @ np.diag((1.3, 0.5, 1.0)) @ TURNED.T), TURNED.T, TURNED @ (0.2, 0.3, 9.0), 1.0, dt=0.01
)
"""A body whose inertia has products, in a rotated frame."""


@pytest.mark.parametrize("scene", [TUMBLING, registry.scene("lagrange_top:t_end=0.1")], ids=lambda scene: scene.name)
def test_a_motion_has_the_states_of_its_first_duration_and_a_curve_on_the_unit_sphere(scene):
    rows, lines = findings("motion", cv.Reduced(), scenes=(scene,))
    largest, drifts = ([kind + invariant.name for invariant in scene.invariants] for kind in (motion.LARGEST, motion.SIGNED))
    quantities = [*motion.STATES, *largest, *drifts, *motion.AXES]
    second = len(quantities)
    with_error = [*motion.STATES, *largest, motion.ERROR, *drifts, *motion.AXES]
    assert [line.quantity for line in lines] == [*quantities, *with_error]
    assert {row.method for row in rows} == {"reduced"}
    for start, step in ((0, scene.t_end / motion.FRAMES), (second, scene.dt)):
        states = np.array([line.value for line in lines[start : start + 7]]).T
        grid = Grid(step, round(scene.t_end / step))
        method = Exact() if start == 0 else cv.Reduced()
        expected = method.solve(scene, grid)
        np.testing.assert_allclose(from_quaternion(states[:, :4]), expected.R_WB, atol=1e-12)  # measured 1e-15
        np.testing.assert_allclose(states[:, 4:], expected.w_WB_B, atol=1e-9)
    for curve in (lines[second - 3 : second], lines[-3:]):
        off = np.linalg.norm([line.value for line in curve], axis=0) - 1
        assert np.abs(off).max() < 1e-13  # measured 3e-16
        assert len(off) <= motion.SAMPLES


def test_a_motion_has_signed_drifts_and_the_errors_of_the_first_duration_at_the_step_of_the_users(monkeypatch):
    monkeypatch.setattr(NoSquish, "method_info", replace(NoSquish.method_info, usual_dt=0.004))
    rows, lines = findings("motion", NoSquish(), scenes=(TUMBLING,))
    assert {row.dt for row in rows} == {0.004}
    grid = Grid(0.004, 250)
    run, truth = NoSquish().solve(TUMBLING, grid), Exact().solve(TUMBLING, grid)
    errors = {(row.measure, row.quantity): row.value for row in rows}
    assert errors[Measure.ATTITUDE_MAX, ""] == pytest.approx(angle_between(truth.R_WB, run.R_WB).max(), rel=1e-9)
    long = NoSquish().solve(TUMBLING, Grid(0.004, 2500))
    energy = {line.quantity: line for line in lines if line.method == "no_squish"}["drift of energy"]
    assert energy.value.min() < -1e-7 or energy.value.max() > 1e-7
    np.testing.assert_allclose(energy.value[-1], long.energy[-1] / long.energy[0] - 1, atol=1e-13)


def test_hours_of_a_satellite_have_samples_that_fit_at_the_step_of_an_engine():
    scene, engine = registry.scene("librating_satellite"), registry.method("mujoco:RK4")
    (case,) = motion.list_runs(Study("motion", (scene,), (engine,), quick=True), scene, engine, drawn=True)
    assert case.grid.dt == engine.method_info.usual_dt
    assert case.grid.n_steps > 5 * motion.MOST_SAMPLES  # measured: 5,400,000; ten durations did not fit
    assert case.grid.n_samples <= motion.MOST_SAMPLES + 1


def test_a_motion_that_fails_has_rows_with_the_outcome():
    rows, lines = findings("motion", cv.Lame())
    assert {row.outcome.kind for row in rows} == {OutcomeKind.UNSUPPORTED}
    assert {line.method for line in lines} == {"exact"}


def test_speed_has_the_minimum_and_the_median():
    case = Case("speed", BRICK, cv.Reduced(), Grid(0.01, 10, 10))
    done = attempt(case)
    result = {row.measure: row.value for row in speed.times(case, done, Timing(1.0, 3.0, 5, 2))}
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
    probe = SimpleNamespace(outcome=OK, length=0.5, dt=0.01, method=cv.Reduced())
    conditions = SimpleNamespace(target=1e-3, scene=BRICK, time_limit=60.0)
    result = recommend.time_settings(conditions, {"a": SimpleNamespace(best=lambda target: probe)})
    assert result == {"a": pytest.approx(2.0 / 0.5)}


@pytest.mark.parametrize("name", ["motion", "long_runs"])
def test_long_runs_end_with_the_table_of_a_load(name):
    """A table that covers the duration of its scene ended a report with an error."""
    body, table = cv.RigidBody((2.0, 3.0, 4.0)), ([0.0, 0.2, 0.5], [[0.1, 0.0, 0.2], [0.3, 0.0, 0.1], [0.0, 0.0, 0.0]])
    scene = cv.Scene("driven", body, np.eye(3), (1.0, 0.5, -0.7), 0.4, dt=0.02, torque=cv.Torque(table))
    rows, _ = findings(name, cv.Reduced(), scenes=(scene,))
    assert rows
    assert all(row.outcome.ok for row in rows)
    assert long_runs.end_of(scene) == 0.5
    assert long_runs.end_of(registry.scene("brick_flip")) == 60.0
