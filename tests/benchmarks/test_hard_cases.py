"""The studies of stability and of hard cases."""

import math
import time
from functools import cache
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import rotation_about
from conservative.benchmarks.measures import errors
from conservative.benchmarks.measures.measure import Measure, Value
from conservative.benchmarks.studies import hard_cases, selection, stability, studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
from conservative.outcome import OK, OutcomeKind
from conservative.references.exact.method import Exact

from ..environments import PATIENCE
from .generic_study import TURN, truth

KINDS = ("not converged", "wrong branch", "diverged", "timeout", "unsupported", "crashed")
AXIS = cv.Scene("axis", cv.RigidBody((13, 5, 10)), TURN, (0, 0, 2.0), 2.0)
"""A spin about the middle axis, whose branch of solutions ends at |w| dt = 4.16."""


def rows(*methods, scene=AXIS):
    study = Study("stability", (scene,), methods, truth=truth)
    return {(row.method, row.measure): row for row in studies.rows(study)}


def fails_at(grid):
    """Whether a step of `AXIS` has |w| dt of 1 or more."""
    return grid.dt * 2.0 > 0.99


class Staged(cv.Method):
    """A method that fails as `how` requires, from a step of |w| dt = 1 on."""

    how: ClassVar[str]
    family: ClassVar[str] = "staged"
    role: ClassVar[Role] = Role.ENGINE

    @property
    def name(self):
        return self.how

    @property
    def order(self):
        return 2

    def prepare(self, scene, grid):
        if not fails_at(grid):
            return cv.Reduced().prepare(scene, grid)
        if self.how == "unsupported":
            raise cv.BadInput("dt", grid.dt, "a shorter step")
        good = Exact().prepare(scene, grid)()
        R, w = good.R_WB.copy(), good.w_WB_B.copy()
        failure = None
        if self.how == "wrong branch":
            R[1] = rotation_about((0, 0, 1), -1.5) @ R[0]
        elif self.how == "diverged":
            w[3:] *= 1.5
        elif self.how == "not converged":
            failure = cv.NotConverged(3, 1.0, 0.5)

        def run():
            if self.how == "crashed":
                raise RuntimeError("planted")
            if self.how == "timeout":
                time.sleep(PATIENCE)
            return cv.Trajectory(scene, grid.t, R, w, self.label, failure=failure)

        return run


def staged(how):
    return type("Planted", (Staged,), {"how": how})()


@pytest.mark.parametrize("how", KINDS)
def test_every_kind_of_failure_is_named(how, monkeypatch):
    within = stability.attempt_within

    def attempt_patiently(limit, case, *rest, **options):  # only the run that hangs reaches its limit
        return within(0.2 if how == "timeout" and fails_at(case.grid) else PATIENCE, case, *rest, **options)

    monkeypatch.setattr(stability, "attempt_within", attempt_patiently)
    measured = rows(staged(how))
    assert measured[how, Measure.LONGEST_STEP].value == pytest.approx(0.7)
    assert measured[how, Measure.LONGEST_STEP].outcome == OK
    assert measured[how, Measure.FAILING_STEP].value == pytest.approx(1.0)
    assert measured[how, Measure.FAILING_STEP].outcome.kind == how


def test_our_own_verdict_is_taken():
    measured = rows(cv.Reduced(), cv.Substepped())
    assert measured["reduced", Measure.LONGEST_STEP].value == pytest.approx(4.0)  # the branch ends at 4.16
    assert measured["reduced", Measure.FAILING_STEP].outcome.kind is OutcomeKind.WRONG_BRANCH
    assert measured["reduced", Measure.FAILING_STEP].outcome.reason == "no continuous solution"
    assert measured["substepped", Measure.LONGEST_STEP].value == pytest.approx(10.0)
    assert measured["substepped", Measure.FAILING_STEP].outcome == OK
    assert math.isnan(measured["substepped", Measure.FAILING_STEP].value)


def test_methods_without_a_step_have_no_row():
    assert rows(cv.MoserVeselov()) == {}


def test_a_body_at_rest_is_measured_in_its_own_steps():
    field = cv.UniformGravity(3.0, TURN.T @ (0, 0, -0.2))  # hanging straight down, to round-off
    rest = cv.Scene("rest", cv.RigidBody((2, 2, 2)), TURN, (0, 0, 0), 1.0, field, dt=0.01)
    assert rows(cv.Reduced(), scene=rest)["reduced", Measure.LONGEST_STEP].value == pytest.approx(10.0)


def test_the_scenes_of_the_study_are_registered():
    study = stability.STUDY.plan((cv.Reduced(),))
    assert tuple(scene.name for scene in study.scenes) == stability.SCENES
    assert np.all(np.diff(stability.STEP_SIZES) > 0)
    assert (stability.UNIT * stability.STEP_SIZES[0], stability.UNIT * stability.STEP_SIZES[-1]) == pytest.approx((0.1, 10.0))


METHODS = (cv.Reduced(), cv.Lame(), registry.method("mujoco:RK4"))


@cache
def table():
    scenes = (cv.scenes.brick_flip(), cv.scenes.simo_wong_top())
    study = Study("hard_cases", scenes, METHODS, truth=truth)
    return {(row.scene, row.method, Value(row.measure, row.value, row.quantity).key): row for row in studies.rows(study)}


def test_every_measure_and_outcome_of_every_pair():
    measured = table()
    for scene in (cv.scenes.brick_flip(), cv.scenes.simo_wong_top()):
        for method in METHODS:
            for blank in errors.blanks(scene):
                row = measured[scene.name, method.name, blank.key]
                assert math.isnan(row.value) == (not row.outcome.ok)


def test_an_unsupported_pair_is_a_row_with_the_reason():
    row = table()["brick_flip", "lame", "attitude error max"]
    assert row.outcome.kind is OutcomeKind.UNSUPPORTED
    assert "symmetric" in row.outcome.reason


def test_a_long_motion_is_cut_by_its_turn():
    brick = hard_cases.grid(cv.scenes.brick_flip())
    assert (brick.dt, brick.t[-1]) == (0.01, 6.0)
    scene = cv.scenes.lie_group_top()
    assert np.isclose(hard_cases.grid(scene).t[-1] * np.linalg.norm(scene.w_WB_B0), 60, rtol=0.01)
    rest = cv.scenes.hanging_rest()
    assert hard_cases.grid(rest).t[-1] == rest.t_end


def test_every_scene_and_every_engine_takes_part():
    methods = selection.methods()
    study = hard_cases.STUDY.plan(hard_cases.settings(methods))
    assert {scene.name for scene in study.scenes} == set(registry.list_scenes())
    chosen = study.methods
    families = {method.family for method in methods if method.role != Role.TRUTH}
    assert {method.family for method in chosen} == families
    assert max(sum(method.family == family for method in chosen) for family in families) == 2
    assert registry.method("mujoco:RK4") in chosen
    assert cv.MoserVeselov() in chosen
