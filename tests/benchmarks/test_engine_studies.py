"""The studies of engines on the brick; the failure of an engine affects only its own rows."""

import math
from functools import cache

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.convergence_order import grows_with_shorter_steps
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.studies import engines_over_steps, studies
from conservative.benchmarks.studies.engine_selection import select_engines
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
    measured = rows("engines_at_one_step")
    assert {row.dt for row in measured} == {0.01}
    name = "pinocchio"
    assert (
        0.5 < value(measured, name, Measure.ATTITUDE_FINAL).value / 1.3e-6 < 2
    )  # as a plain script that calls an RK4 of it finds
    assert value(measured, name, Measure.DRIFT_MAX, "energy").detail == "lost"
    assert value(measured, name, Measure.TIME_PER_STEP).value > 0
    assert (value(measured, name, Measure.PRECISION).value, value(measured, name, Measure.ORDER_EXPECTED).value) == (64, 4)
    euler = "mujoco:integrator=Euler"
    assert 0.5 < value(measured, euler, Measure.DRIFT_MAX, "energy").value / 0.22 < 2
    assert value(measured, euler, Measure.DRIFT_MAX, "energy").detail == "gained"
    for method in (name, euler):
        assert (value(measured, method, Measure.TURNS_OVER).value, value(measured, method, Measure.TURNS_OVER_TRUE).value) == (
            2,
            2,
        )


def test_a_body_in_a_field_has_no_turns_over():
    measured = rows("engines_at_one_step", ("pinocchio:RK4",), TOP)
    assert not {row.measure for row in measured} & {Measure.TURNS_OVER, Measure.TURNS_OVER_TRUE}
    assert {row.quantity for row in measured} >= {"energy", "vertical momentum"}


def test_orders_and_times_over_steps():
    measured = rows("engines_over_steps")
    assert abs(value(measured, "pinocchio", Measure.ORDER).value - 4) < 0.5
    times = [row for row in measured if row.measure is Measure.TIME]
    errors = {(row.method, row.dt): row.value for row in measured if row.measure is Measure.ATTITUDE_MAX}
    assert times
    assert all(row.value > 0 and errors[row.method, row.dt] <= engines_over_steps.TIMED for row in times)
    assert any(error > engines_over_steps.TIMED for error in errors.values())  # what is another motion is not timed


@pytest.mark.parametrize("name", declared.ENGINES)
def test_a_failing_engine_costs_its_own_rows_only(name):
    broken = (Broken("raises"), Broken("unsupported"))
    measured = studied(name, (broken[0], registry.method("pinocchio"), broken[1]), cv.scenes.brick_flip(t_end=0.5))
    for method, kind in zip(broken, (OutcomeKind.CRASHED, OutcomeKind.UNSUPPORTED), strict=True):
        errors = [row for row in measured if row.method == method.name and row.measure is Measure.ATTITUDE_MAX]
        assert {row.outcome.kind for row in errors} == {kind}
    times = [row for row in measured if row.method == "pinocchio" and row.measure is Measure.TIME]
    assert times
    assert all(row.value > 0 and row.outcome.ok for row in times)


def test_a_growing_error_differs_from_one_at_its_floor():
    v_shaped = np.array([1.1, 0.6, 0.2, 0.24, 0.5, 0.9, 1.3, 2.5])
    assert grows_with_shorter_steps(STEPS, v_shaped)
    assert not grows_with_shorter_steps(STEPS, STEPS**2)
    assert not grows_with_shorter_steps(STEPS, [1e-6, 1e-9, 1e-13, 1e-14, 1e-14, 3e-14, 6e-14, 1e-13])  # round-off
    assert not grows_with_shorter_steps(STEPS, [math.nan] * 6 + [0.1, 0.5])  # too few


def test_a_slow_run_is_timed_over_its_first_steps_only():
    for limit, steps in ((60.0, 600), (1e-9, 1)):
        measured = studied("engines_at_one_step", (registry.method("pinocchio"),), time_limit=limit)
        assert value(measured, "pinocchio", Measure.TIME).detail.endswith(f" s, {steps} steps")


def test_runs_that_are_longer_than_planned_for_are_not_run_again_for_their_time():
    measured = studied("engines_over_steps", (registry.method("pinocchio"),), time_limit=1e-9)
    times = [row for row in measured if row.measure is Measure.TIME]
    assert times
    assert {row.detail for row in times} == {"a single run"}
    assert all(row.value > 0 for row in times)


def test_an_engine_with_expensive_preparation_has_fewer_steps(monkeypatch):
    monkeypatch.setattr(engines_over_steps, "PREPARATIONS", -1.0)
    measured = studied("engines_over_steps", (registry.method("pinocchio"),))
    errors = [row for row in measured if row.measure is Measure.ATTITUDE_MAX]
    assert [row.outcome.kind for row in errors] == [OutcomeKind.OK] + [OutcomeKind.SKIPPED] * (len(errors) - 1)
    assert len(errors) > 2


@pytest.mark.engine("exudyn")
def test_a_real_engine_in_its_environment():
    from conservative.references.environments.install import install

    install("exudyn")
    methods = select_engines(["exudyn"])
    measured = studied("engines_at_one_step", methods) + studied("engines_over_steps", methods)
    assert 0.5 < value(measured, "exudyn", Measure.ATTITUDE_FINAL).value / 1.3e-6 < 2
    assert abs(value(measured, "exudyn", Measure.ORDER).value - 4) < 0.3
    assert value(measured, "exudyn", Measure.TIME_PER_STEP).value > 0
    assert {row.version for row in measured} == {methods[0].environment.version}
