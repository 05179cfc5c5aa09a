"""`cv.integrate(scene)` and `conservative run SCENE` give the same answer for every registered scene."""

import json
import warnings

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between
from conservative.reports.cli.main import main

DEAR = ("separatrix",)
"""Scenes whose error is limited by rounding: answers of other samples differ by as much."""


def run(*arguments, code=0):
    done = CliRunner(env={"COLUMNS": "200"}).invoke(main, ["run", *arguments, "--json"])
    assert done.exit_code == code, done.output
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", registry.list_scenes())
def test_python_and_the_command_line_answer_alike(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cv.AccuracyNotReached)
        found = cv.integrate(registry.scene(name))
    asked = run(name, "--no-truth")
    assert asked["outcome"]["kind"] == found.outcome.kind.value
    assert asked["method"] == found.choice.method.name
    assert asked["choice"]["error"] == found.choice.error == 1e-6
    assert asked["choice"]["reached"] == found.choice.reached == (name not in DEAR)
    assert asked["last"]["t"] == pytest.approx(found.t[-1], rel=1e-12)
    allowed = max(2e-6, 2 * found.choice.estimate)
    assert angle_between(np.array(asked["last"]["R_WB"]), found.R_WB[-1]) < allowed  # measured: at most 1e-14


def test_the_top_is_integrated_to_the_error_of_the_command():
    """It was "ok" and 2.21 rad off, with `Reduced` and steps of 0.01 s for any body."""
    top = cv.scenes.lagrange_top()
    found = cv.integrate(top)
    exact = cv.integrate(top, method="exact", t_eval=[0.0, top.t_end])
    assert angle_between(found.R_WB[-1], exact.R_WB[-1]) < 1e-6  # measured: 1.1e-14


def test_a_method_alone_takes_the_step_of_the_scene():
    for scene in (cv.scenes.brick_flip(), cv.scenes.stable_satellite()):
        found = cv.integrate(scene, method="taylor")
        assert found.t[1] == scene.dt
        many = cv.integrate_many(scene, w_WB_B0=scene.w_WB_B0[None] * [[1.0], [1.1]], method="taylor", threads=1)
        assert many.grid.dt == scene.dt
    short = cv.integrate(cv.scenes.stable_satellite(), method="taylor", t_end=1.0)
    assert short.t[-1] == 1.0


def test_many_bodies_without_a_step_are_integrated_to_the_same_error():
    top = cv.scenes.lagrange_top()
    starts = top.w_WB_B0 * [[1.0], [1.01]]
    many = cv.integrate_many(top, w_WB_B0=starts, threads=1)
    assert many.choice.error == 1e-6
    for i, w in enumerate(starts):
        alone = cv.integrate(top.rename("own", w_WB_B0=w), error=1e-9)
        assert angle_between(many.R_WB[i, -1], alone.R_WB[-1]) < 1e-6  # measured: 0, both are closed forms


def test_an_inaccurate_run_has_the_exit_code_1():
    found = run("lagrange_top", "--methods", "reduced", code=1)
    assert found["status"].startswith("inaccurate")
    assert run("brick_flip", "--methods", "reduced")["status"] == "ok"
    table = run("lagrange_top", "--methods", "reduced,taylor", code=1)
    assert [each["status"].partition(":")[0] for each in table] == ["inaccurate", "ok"]
