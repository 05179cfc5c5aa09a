"""Time limits of studies with engines that are slow, hang or end their process."""

import math
import threading

import numpy as np
import psutil
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import rotation_about
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import line, studies, study
from conservative.benchmarks.studies.case import Case, Success, attempt
from conservative.benchmarks.studies.line import FEWEST_POINTS, LINE_LIMIT, attempt_each
from conservative.benchmarks.studies.paper import PROPERTIES
from conservative.benchmarks.studies.study import Study
from conservative.benchmarks.studies.time_limit import attempt_here, attempt_within
from conservative.benchmarks.studies.work_precision import list_cases
from conservative.grid import Grid, grid_for
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.engine import PACE_STEPS, STEP_LIMIT, limit_reason
from conservative.references.worker.client import close_workers

from ..environments import PATIENCE
from ..sampling import sampled
from .foreign_engines import Fast, Harmful, Slow
from .generic_study import SCENE, truth

HOOK = np.array([0.1, 0.2, 0.4])
FIELD = cv.FunctionPotential(lambda R: float((R[2] @ HOOK) ** 4), lambda R: np.outer([0, 0, 1], 4 * (R[2] @ HOOK) ** 3 * HOOK))
SPRUNG = cv.Scene(
    "from lambdas", cv.RigidBody((1.7, 0.9, 2.3)), rotation_about((0.3, -0.8, 0.5), 1.1), (0.7, -1.3, 2.1), 2.0, FIELD
)


def rows(name, *methods, **settings):
    return list(studies.rows(Study(name, (SCENE,), methods, truth=truth, **settings)))


def copy_of(scene):
    """Return the same scene as another object: runs that timed out are not repeated on the same object."""
    return scene.rename(scene.name)


@pytest.mark.parametrize("scene", [SCENE, SPRUNG], ids=lambda scene: scene.name)
@pytest.mark.parametrize("name", ["scipy", "mujoco:RK4", "heyoka", "pinocchio"])
def test_a_run_in_a_worker_is_the_same_bit_for_bit(scene, name):
    case = Case("any", scene, registry.method(name), grid_for(scene, 0.05))
    here, there = attempt(case), attempt_within(PATIENCE, case, apart=True)
    if isinstance(here, Outcome):
        assert here == there
        return
    again = there.run()
    for measured in (there.trajectory, again):
        assert measured.scene is scene
        assert (measured.label, measured.counters) == (here.trajectory.label, here.trajectory.counters)
        for part in ("t", "R_WB", "w_WB_B"):
            assert np.array_equal(getattr(measured, part), getattr(here.trajectory, part))


@pytest.mark.parametrize(
    ("how", "limit", "kind", "reason", "attempt_so"),
    sampled(
        [
            (*ending, attempt_so)
            for attempt_so in (attempt_within, attempt_here)
            for ending in (
                ("hang", 0.5, OutcomeKind.TIMEOUT, "after 0.5 s"),
                ("exit", PATIENCE, OutcomeKind.CRASHED, "exit code 3"),
                ("abort", PATIENCE, OutcomeKind.CRASHED, "signal 6 (SIGABRT)"),
            )
        ],
        3,
    ),
)
def test_a_hanging_or_crashing_engine_is_an_outcome(how, limit, kind, reason, attempt_so):
    close_workers()
    before = threading.enumerate()
    done = attempt_so(limit, Case("any", copy_of(SCENE), Harmful(how), grid_for(SCENE, 0.05)))
    assert (done.kind, done.reason) == (kind, reason)
    assert threading.enumerate() == before
    assert psutil.Process().children(recursive=True) == []


def test_a_run_that_timed_out_is_not_repeated():
    case = Case("any", copy_of(SCENE), Harmful("hang"), grid_for(SCENE, 0.05))
    assert attempt_within(0.2, case).reason == "after 0.2 s"
    assert attempt_within(0.1, case).reason == "a run of 40 steps was ended after 0.2 s"
    assert attempt_within(0.3, case).reason == "after 0.3 s"


def test_a_shorter_motion_is_tried_though_a_longer_one_of_fewer_samples_was_ended():
    scene = copy_of(SCENE)
    assert attempt_within(0.2, Case("any", scene, Harmful("hang"), Grid(2.0, 1))).reason == "after 0.2 s"
    assert attempt_within(0.2, Case("any", scene, Harmful("hang"), Grid(0.1, 10))).reason == "after 0.2 s"
    assert attempt_within(0.2, Case("any", scene, Harmful("hang"), Grid(0.05, 20))).reason.startswith("a run of 10")


def test_the_limit_is_an_option_of_all_studies():
    planned = [each.plan((cv.Reduced(),), time_limit=3.0) for each in studies.STUDIES.values()]
    assert {study.longest_run for study in planned} == {3.0}


def test_a_method_that_cannot_be_sent_runs_here():
    class Held(Fast):
        lock = threading.Lock()

        def prepare(self, scene, grid):
            with self.lock:
                return super().prepare(scene, grid)

    assert isinstance(attempt_within(PATIENCE, Case("any", SCENE, Held(), grid_for(SCENE, 0.05))), Success)


@pytest.mark.parametrize(
    "name", sampled(["paper", "convergence", "speed", "work_precision", "long_runs", "motion", "stability"], 2)
)
def test_an_engine_that_hangs_does_not_hold_up_a_study(name, monkeypatch):
    monkeypatch.setattr(study, "HANG_LIMIT", 0.5)
    monkeypatch.setattr(studies.stability, "FIRST_LIMIT", 0.5)
    scene = copy_of(SCENE)
    measured = list(
        studies.rows(Study(name, (scene,), (Harmful("hang"), cv.Reduced()), quick=True, truth=truth, time_limit=0.05))
    )
    mine = [row for row in measured if row.method == Harmful("hang").name]
    assert {row.outcome.kind for row in mine} <= {OutcomeKind.TIMEOUT, OutcomeKind.SKIPPED, OutcomeKind.NO_ORDER}
    assert all(math.isnan(row.value) for row in mine if row.measure not in PROPERTIES)
    assert any(row.outcome.kind is OutcomeKind.TIMEOUT for row in mine)
    assert any(row.outcome.ok for row in measured if row.method == "reduced")


@pytest.fixture
def on_an_idle_machine(monkeypatch):
    """Count only the pauses of `Slow` as its wall time, because the machine may be busy."""

    def pauses(case):
        return case.grid.n_steps * getattr(case.method, "pause", 0.0)

    monkeypatch.setattr(study, "HANG_LIMIT", PATIENCE)
    monkeypatch.setattr(line, "cost_of_run", lambda study, case, done, first: pauses(case))
    monkeypatch.setattr(Study, "expected_cost", lambda study, case: pauses(case))


def test_a_slow_engine_has_a_line_of_fewer_points(on_an_idle_machine):
    slow = Slow(pause=0.001)
    measured = rows("work_precision", slow, time_limit=0.04)  # 12, 24, 48 and 96 steps, of up to 1536
    timed = [row for row in measured if row.measure is Measure.TIME and row.outcome.ok]
    assert len(timed) >= 3
    assert all(row.value > 0.001 / row.dt for row in timed)
    errors = [row.value for row in measured if row.measure is Measure.ATTITUDE_MAX and row.outcome.ok]
    assert len(errors) == len(timed)
    assert errors[-1] < errors[0] / 50
    left = [row for row in measured if not row.outcome.ok]
    assert left
    assert {row.outcome.kind for row in left} == {OutcomeKind.SKIPPED}
    assert all("more than 0.04 s" in row.outcome.reason for row in left)


def test_a_slow_engine_has_an_order(on_an_idle_machine):
    measured = {
        row.measure: row for row in rows("convergence", Slow(pause=0.001), time_limit=0.05) if row.measure is Measure.ORDER
    }
    assert measured[Measure.ORDER].value == pytest.approx(4, abs=0.5)


def test_a_slow_engine_is_timed_over_fewer_steps(on_an_idle_machine):
    measured = rows("speed", Slow(pause=0.01), cv.Reduced(), quick=True, time_limit=0.1)
    mine = {row.measure: row for row in measured if row.method.startswith("foreign_slow")}
    assert all(row.outcome.ok and row.value > 0 for row in mine.values())
    assert mine[Measure.TIME_PER_STEP].value >= 0.01
    steps = int(mine[Measure.TIME].detail.split()[-2])
    assert 8 <= steps < SCENE.t_end / SCENE.dt
    assert mine[Measure.TIME].value == pytest.approx(mine[Measure.TIME_PER_STEP].value / SCENE.dt)


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan, math.inf, "long"])
def test_a_limit_is_a_duration(limit):
    with pytest.raises(cv.BadInput) as caught:
        Study("speed", (SCENE,), (cv.Reduced(),), time_limit=limit)
    assert caught.value.argument == "time_limit"


def test_the_limits_of_a_study():
    limits = {quick: Study("speed", (SCENE,), (cv.Reduced(),), quick) for quick in (False, True)}
    assert (limits[False].longest_run, limits[True].longest_run) == (0.6, 0.15)
    assert limits[False].hang_limit == 60.0
    given = Study("speed", (SCENE,), (cv.Reduced(),), time_limit=10.0)
    assert (given.longest_run, given.hang_limit) == (10.0, 100.0)


def test_a_run_ends_early_only_beyond_ten_times_the_limit():
    assert limit_reason(PACE_STEPS, PACE_STEPS / (9 * STEP_LIMIT)) == ""
    assert "out of reach" in limit_reason(PACE_STEPS, PACE_STEPS / (11 * STEP_LIMIT))


@pytest.mark.parametrize(("spent", "points"), [(0.9, 9), (1.1, FEWEST_POINTS), (0.4 * LINE_LIMIT, 2)])
def test_a_slow_method_gets_the_fewest_points_within_the_limit_of_a_line(spent, points, monkeypatch):
    """Runs that take `spent` time budgets each."""
    study = Study("any", (SCENE,), (cv.Reduced(),), truth=truth)
    monkeypatch.setattr(line, "cost_of_run", lambda *_, **__: spent * study.longest_run)
    cases = [Case("any", SCENE, cv.Reduced(), Grid(0.01, 10))] * 9
    assert sum(isinstance(done, Success) for _, done in attempt_each(study, cases)) == points


@pytest.mark.parametrize("name", ["scipy", "reduced", "mujoco:Euler", "gauss:stages=4"])
def test_a_line_goes_from_coarse_to_fine(name):
    method = registry.method(name)
    cases = list_cases(Study("any", (SCENE,), (method,), truth=truth), SCENE, method)
    settings = [getattr(case.method, "rtol", case.grid.dt) for case in cases]
    assert settings == sorted(settings, reverse=True)
    assert len(set(settings)) == len(settings) > 3
