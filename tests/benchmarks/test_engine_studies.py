"""Engines in the studies of all methods, on the brick; the failure of an engine affects only its own rows."""

import math
from functools import cache

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.convergence_order import grows_with_shorter_steps
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import line, speed, studies
from conservative.benchmarks.studies.engine_selection import select_engines
from conservative.benchmarks.studies.paper import AS_INSTALLED
from conservative.benchmarks.studies.study import Study
from conservative.outcome import OutcomeKind

from .. import declared
from ..environments import PATIENCE
from .generic_study import Broken, truth

BRICK = cv.scenes.brick_flip()
TOP = cv.scenes.lagrange_top(t_end=0.2)
ENGINES = ("mujoco:Euler", "mujoco:RK4", "pinocchio:RK4")
STEPS = 0.1 * 0.5 ** np.arange(8)


@cache
def rows(name, engines=ENGINES, scene=BRICK):
    return studied(
        name, tuple(map(registry.method, engines)), scene, time_limit=PATIENCE
    )  # no point is left out on a busy machine


def studied(name, methods, scene=BRICK, **options):
    exact = {"truth": truth} if scene.free else {}
    return list(studies.rows(Study(name, (scene,), methods, quick=True, **exact, **options)))


def value(measured, method, measure, quantity=""):
    (row,) = [row for row in measured if (row.method, row.measure, row.quantity) == (method, measure, quantity)]
    return row


def test_an_engine_is_measured_at_the_step_of_the_scene():
    measured = [row for row in rows("paper") if row.dt == BRICK.dt]
    name, euler = "pinocchio", "mujoco:integrator=Euler"
    assert (
        0.5 < value(measured, name, Measure.ATTITUDE_FINAL).value / 1.3e-6 < 2
    )  # as a plain script that calls an RK4 of it finds
    assert value(measured, name, Measure.DRIFT_MAX, "energy").detail == "lost"
    assert (value(measured, name, Measure.PRECISION).value, value(measured, name, Measure.ORDER_EXPECTED).value) == (64, 4)
    assert [value(measured, method, Measure.PRECISION).detail for method in (name, euler)] == ["", AS_INSTALLED]
    assert 0.5 < value(measured, euler, Measure.DRIFT_MAX, "energy").value / 0.22 < 2
    assert value(measured, euler, Measure.DRIFT_MAX, "energy").detail == "gained"
    for method in (name, euler):
        assert (value(measured, method, Measure.TURNS_OVER).value, value(measured, method, Measure.TURNS_OVER_TRUE).value) == (
            2,
            2,
        )


def test_a_body_in_a_field_has_no_turns_over():
    measured = rows("paper", ("pinocchio:RK4",), TOP)
    assert not {row.measure for row in measured} & {Measure.TURNS_OVER, Measure.TURNS_OVER_TRUE}
    assert {row.quantity for row in measured} >= {"energy", "vertical momentum"}


@pytest.mark.parametrize("name", declared.NAMED)
def test_a_failing_engine_costs_its_own_rows_only(name):
    broken = (Broken("raises"), Broken("unsupported"))
    methods, scene = (broken[0], registry.method("pinocchio"), broken[1]), cv.scenes.brick_flip(t_end=0.5)
    measured = studied(name, methods, scene, time_limit=PATIENCE)
    for method, kind in zip(broken, (OutcomeKind.CRASHED, OutcomeKind.UNSUPPORTED), strict=True):
        kinds = {row.outcome.kind for row in measured if row.method == method.name}
        assert kind in kinds
        assert kinds <= {kind, OutcomeKind.NO_ORDER}
    assert all(
        row.outcome.ok for row in measured if row.method == "pinocchio" and row.measure in (Measure.ATTITUDE_MAX, Measure.TIME)
    )


def test_a_growing_error_differs_from_one_at_its_floor():
    v_shaped = np.array([1.1, 0.6, 0.2, 0.24, 0.5, 0.9, 1.3, 2.5])
    assert grows_with_shorter_steps(STEPS, v_shaped)
    assert not grows_with_shorter_steps(STEPS, STEPS**2)
    assert not grows_with_shorter_steps(STEPS, [1e-6, 1e-9, 1e-13, 1e-14, 1e-14, 3e-14, 6e-14, 1e-13])  # round-off
    assert not grows_with_shorter_steps(STEPS, [math.nan] * 6 + [0.1, 0.5])  # too few


def is_elsewhere(monkeypatch):
    """Let a method of this process be taken for one in an environment of its own."""
    for module in (line, speed):
        monkeypatch.setattr(module, "EngineMethod", type(registry.method("pinocchio")))


def test_a_slow_engine_in_its_environment_is_timed_over_its_first_steps(monkeypatch):
    is_elsewhere(monkeypatch)
    for limit, steps in ((60.0, 600), (1e-9, 1)):
        measured = studied("speed", (registry.method("pinocchio"),), time_limit=limit)
        assert value(measured, "pinocchio", Measure.TIME).detail.endswith(f" s, {steps} steps")


@pytest.mark.parametrize(("slow", "most", "left"), [(math.inf, 0.0, 1), (0.0, math.inf, 4), (math.inf, math.inf, 8)])
def test_an_engine_with_expensive_preparation_has_fewer_steps(slow, most, left, monkeypatch):
    is_elsewhere(monkeypatch)
    monkeypatch.setattr(line, "SLOW_PREPARATION", slow)
    monkeypatch.setattr(line, "PREPARATIONS", most)
    measured = studied("convergence", (registry.method("pinocchio"),), time_limit=PATIENCE)
    kinds = [row.outcome.kind for row in measured if row.measure is Measure.ATTITUDE_MAX]
    assert (kinds.count(OutcomeKind.OK), kinds.count(OutcomeKind.SKIPPED)) == (left, 8 - left)
    assert kinds[0] is OutcomeKind.OK


@pytest.mark.engine("exudyn")
def test_a_real_engine_in_its_environment():
    from conservative.references.environments.install import install

    install("exudyn")
    methods = select_engines(["exudyn"])
    measured = studied("paper", methods) + studied("convergence", methods) + studied("speed", methods)
    at_step = [row for row in measured if row.dt == BRICK.dt]
    assert 0.5 < value(at_step, "exudyn", Measure.ATTITUDE_FINAL).value / 1.3e-6 < 2
    assert abs(value(measured, "exudyn", Measure.ORDER).value - 4) < 0.3
    assert value(measured, "exudyn", Measure.TIME_PER_STEP).value > 0
    assert {row.version for row in measured if row.method} == {methods[0].environment.version}
