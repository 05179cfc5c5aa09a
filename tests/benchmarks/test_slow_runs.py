"""Studies of scenes whose Python functions are slow: a run that would take too long is a row with a reason instead."""

import math
import time

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import studies, study
from conservative.benchmarks.studies.case import Case
from conservative.benchmarks.studies.paper import PROPERTIES
from conservative.benchmarks.studies.study import SLOW_FACTOR, Study
from conservative.benchmarks.studies.time_limit import TRIAL, find_trial, is_quick
from conservative.grid import Grid, grid_for
from conservative.outcome import OutcomeKind

from ..sampling import sampled
from .foreign_engines import Slow
from .generic_study import SCENE

METHODS = cv.Reduced(), cv.Splitting(), cv.Projected()


class Counted:
    """The functions of a potential, which count their calls and sleep."""

    def __init__(self, pause=0.0):
        self.calls, self.pause = 0, pause

    def energy(self, R):
        self.calls += 1
        time.sleep(self.pause)
        return 0.5 * R[2, 2] ** 2 - 0.2 * R[0, 2]

    def gradient(self, R):
        self.calls += 1
        time.sleep(self.pause)
        slope = np.zeros((3, 3))
        slope[0, 2], slope[2, 2] = -0.2, R[2, 2]
        return slope


def scene_of(functions, t_end=1.0):
    potential = cv.FunctionPotential(functions.energy, functions.gradient)
    return cv.Scene("own", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.1, 0.2, 2.0), t_end, potential, dt=0.02)


@pytest.fixture
def costs(monkeypatch):
    """Each step of a method takes the seconds that are set here, whatever the machine does."""
    per_step = {}

    def expected(self, case):
        return per_step.get(case.method.family, 0.0) * case.grid.n_steps

    monkeypatch.setattr(Study, "expected_cost", expected)
    return per_step


def plan(name, scene, methods=METHODS, **settings):
    return Study(name, (scene,), methods, quick=True, **{"time_limit": 0.1, **settings})  # 10 s for slow runs


def test_only_cases_that_may_be_slow_are_tried():
    own, torque = scene_of(Counted()), cv.Torque(lambda t: np.zeros(3))
    driven = cv.Scene("driven", SCENE.body, np.eye(3), (0, 1, 2), 1.0, torque=torque, dt=0.02)
    constant = cv.Scene("constant", SCENE.body, np.eye(3), (0, 1, 2), 1.0, torque=cv.Torque((0, 0, 1)), dt=0.02)
    for scene, quick in ((SCENE, True), (own, False), (driven, False), (constant, True)):
        assert is_quick(Case("any", scene, cv.Reduced(), grid_for(scene, scene.dt))) is quick
    assert not is_quick(Case("any", SCENE, Slow(), grid_for(SCENE, SCENE.dt)))
    functions = Counted()
    measured = plan("long_runs", SCENE)
    assert measured.expected_cost(Case("any", SCENE, cv.Reduced(), grid_for(SCENE, SCENE.dt))) == 0.0
    assert functions.calls == 0


def test_a_short_run_tells_the_cost_once():
    functions = Counted(pause=1e-4)
    scene = scene_of(functions)
    case = Case("any", scene, cv.Splitting(), Grid(0.02, 1000))
    before = functions.calls
    trial = find_trial(60.0, 60.0, case)
    steps = functions.calls - before
    assert trial.grid == Grid(0.02, TRIAL)
    assert trial.expect(case) == pytest.approx(trial.spent * 1000 / TRIAL)
    assert trial.spent >= TRIAL * 1e-4
    assert find_trial(60.0, 60.0, case) is trial
    assert functions.calls - before == steps < 200  # measured 38
    assert find_trial(1e-6, 60.0, Case("any", scene_of(functions), cv.Splitting(), Grid(0.02, 1000))).grid.n_steps == 1


@pytest.mark.parametrize("name", sampled(["paper", "motion", "long_runs"], 1))
def test_slow_runs_are_rows_with_a_reason_and_the_others_are_measured(name, costs):
    functions = Counted()
    costs |= {"reduced": 1.0, "splitting": 0.01}  # 50 steps in a duration: 50 s and 0.5 s
    rows = list(studies.rows(plan(name, scene_of(functions))))
    kinds = {
        family: {row.outcome.kind for row in rows if row.family == family} for family in ("reduced", "splitting", "projected")
    }
    assert kinds["reduced"] == {OutcomeKind.SKIPPED}
    skipped = [row for row in rows if row.family == "reduced"]
    assert all(math.isnan(row.value) for row in skipped if row.measure not in PROPERTIES)
    assert all("would take about" in row.outcome.reason for row in skipped)
    assert OutcomeKind.OK in kinds["splitting"]
    assert kinds["projected"] == {OutcomeKind.OK}


def test_the_scenes_own_step_comes_before_shorter_ones(costs):
    """50, 100 and 200 steps: 4, 8 and 16 s of 10 s for one method; of two, both have the first, and none the second."""
    costs["reduced"] = 0.08
    rows = list(studies.rows(plan("paper", scene_of(Counted()), (cv.Reduced(),))))
    done = {row.dt: row.outcome.kind for row in rows if row.measure is Measure.ATTITUDE_MAX}
    assert done == {0.02: OutcomeKind.OK, 0.01: OutcomeKind.SKIPPED, 0.005: OutcomeKind.SKIPPED}
    agreements = [row.dt for row in rows if row.measure is Measure.AGREEMENT]
    assert agreements == [0.02]  # no reference solution is made for steps that are not taken
    costs["splitting"] = 0.08
    rows = list(studies.rows(plan("paper", scene_of(Counted()), METHODS[:2])))
    assert {row.family for row in rows if row.outcome.ok and row.measure is Measure.ATTITUDE_MAX} == {"reduced", "splitting"}


def test_a_motion_of_ten_durations_falls_back_to_one(costs):
    costs["reduced"] = 0.1  # 5 s and 50 s
    found = list(studies.findings(plan("motion", scene_of(Counted()), (cv.Reduced(),))))
    assert {each.t[-1] for each in found if getattr(each, "quantity", "") == "q_w" and each.role == "ours"} == {1.0}


@pytest.mark.parametrize("name", sampled(["convergence", "work_precision"], 1))
def test_lines_of_slow_runs_have_the_points_that_they_can_afford(name, costs):
    """12 and 24 steps take 0.24 and 0.48 s of 0.8 s, more have to take at most 0.1 s."""
    costs["splitting"] = 0.02
    functions = Counted()
    rows = [
        row for row in studies.rows(plan(name, scene_of(functions), (cv.Splitting(),))) if row.measure is Measure.ATTITUDE_MAX
    ]
    good = [row for row in rows if row.outcome.ok]
    assert len(good) == 4 or 1 <= len(good) < len(rows)
    assert all(row.outcome.kind is OutcomeKind.SKIPPED for row in rows if not row.outcome.ok)


def test_a_report_of_slow_functions_calls_them_a_bounded_number_of_times():
    """All studies of a quick report, at a budget of 1 ms a run, which one step exceeds."""
    functions = Counted(pause=1e-4)
    scene = scene_of(functions)
    shared = study.remember_truths()
    before = functions.calls
    for name in ("motion", "paper", "convergence", "speed", "work_precision", "long_runs"):
        rows = list(studies.rows(plan(name, scene, time_limit=1e-3, truth=shared)))
        assert {row.family for row in rows if row.family} == {"reduced", "splitting", "projected"}, name
        assert all(row.outcome.reason for row in rows if not row.outcome.ok)
    assert functions.calls - before < 15_000  # measured 1,651; 89,362 without bounds
    assert SLOW_FACTOR == 100
