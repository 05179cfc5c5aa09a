"""Studies report what their measures are called: minimums and medians, first calls, durations, energies that are lost."""

from types import SimpleNamespace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.timing import Timing
from conservative.benchmarks.recommendation import recommend
from conservative.benchmarks.studies import long_runs, speed, stability
from conservative.benchmarks.studies.case import Case, attempt
from conservative.method import Grid
from conservative.outcome import OK
from conservative.trajectory import Trajectory

BRICK = cv.scenes.brick_flip()


def test_speed_tells_minimum_and_median_apart():
    case = Case("speed", BRICK, cv.Reduced(), Grid(0.01, 10, 10))
    done = attempt(case)
    found = {row.measure: row.value for row in speed.times(speed.TimedRun(case, done, done), Timing(1.0, 3.0, 5, 2))}
    assert found == {
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
    found = recommend.time_settings(conditions, {"a": SimpleNamespace(best=lambda target: probe)})
    assert found == {"a": pytest.approx(2.0 / 0.5)}


def test_long_runs_are_ten_times_as_long():
    case = long_runs.case_for("long_runs", BRICK, cv.Reduced())
    assert case.grid.t[-1] == pytest.approx(10 * BRICK.t_end)
    assert case.grid.dt == BRICK.dt


@pytest.mark.parametrize(("gain", "kind"), [(-1.5, "diverged"), (1.5, "diverged"), (-0.9, None), (0.9, None)])
def test_energy_that_is_lost_is_as_bad_as_energy_that_is_gained(gain, kind):
    scene = cv.Scene("up", cv.RigidBody((1, 1, 2)), np.eye(3), (0, 0, 0), 1.0, cv.UniformGravity(1, (0, 0, 1)))
    height = min(1.0, 1 + gain)  # of the centre of mass; the rest of the energy is in the spin
    tilt = cv.attitude.rotation_about((1, 0, 0), np.arccos(height))
    spin = np.sqrt(max(gain, 0.0))
    found = Trajectory(scene, np.array([0, 1.0]), np.array([np.eye(3), tilt]), np.array([[0, 0, 0], [0, 0, spin]]), "made up")
    outcome = stability.detect_divergence(found)
    assert (outcome and outcome.kind) == kind
