import math
from functools import cache

import numpy as np

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures import errors
from conservative.benchmarks.measures.measure import key
from conservative.benchmarks.studies import hard_cases, selection, studies
from conservative.benchmarks.studies.study import Study
from conservative.method import Role
from conservative.outcome import OutcomeKind
from conservative.references.exact.method import Exact
from conservative.references.truth import Truth

METHODS = (cv.Reduced(), cv.Lame(), registry.method("mujoco:RK4"))


@cache
def truth(scene, grid):
    return Truth(Exact().prepare(scene, grid)(), 2e-15, ("exact", "other"), scene.t_end)


@cache
def table():
    scenes = (cv.scenes.brick_flip(), cv.scenes.simo_wong_top())
    study = Study("hard_cases", scenes, METHODS, truth=truth)
    return {(row.scene, row.method, key(row.measure, row.quantity)): row for row in studies.rows(study)}


def test_every_measure_and_outcome_of_every_pair():
    found = table()
    for scene in (cv.scenes.brick_flip(), cv.scenes.simo_wong_top()):
        for method in METHODS:
            for blank in errors.blanks(scene):
                row = found[scene.name, method.name, blank.key]
                assert math.isnan(row.value) == (not row.outcome.ok)


def test_what_is_not_supported_is_a_row_that_says_so():
    row = table()["brick_flip", "lame", "attitude error max"]
    assert row.outcome.kind is OutcomeKind.UNSUPPORTED
    assert "symmetric" in row.outcome.reason


def test_values_are_those_of_the_run():
    scene = cv.scenes.brick_flip()
    grid = hard_cases.grid(scene)
    assert grid.dt == scene.dt
    assert grid.t[-1] == 6.0
    direct = {
        value.key: value.value
        for value in errors.measure_errors(cv.Reduced().run(scene, grid.dt), truth(scene, grid).trajectory)
    }
    assert table()["brick_flip", "reduced", "rate error max"].value == direct["rate error max"]


def test_a_long_motion_is_cut_by_its_turn():
    scene = cv.scenes.lie_group_top()
    assert np.isclose(hard_cases.grid(scene).t[-1] * np.linalg.norm(scene.w_WB_B0), 60, rtol=0.01)
    rest = cv.scenes.hanging_rest()
    assert hard_cases.grid(rest).t[-1] == rest.t_end


def test_every_scene_and_every_engine_takes_part():
    methods = selection.methods()
    study = studies.list_hard_studies(methods)[1]
    assert {scene.name for scene in study.scenes} == set(registry.list_scenes())
    chosen = study.methods
    families = {method.family for method in methods if method.role != Role.TRUTH}
    assert {method.family for method in chosen} == families
    assert max(sum(method.family == family for method in chosen) for family in families) == 2
    assert registry.method("mujoco:RK4") in chosen
    assert cv.MoserVeselov() in chosen
