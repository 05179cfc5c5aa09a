"""Adaptive methods end within a limit of steps, whatever they are asked for; each of these ran for ever."""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.references import engine
from conservative.references.engines import heyoka
from conservative.references.engines.heyoka import Heyoka
from conservative.references.engines.scipy import SciPy

BRICK = cv.scenes.brick_flip(t_end=1.0)
FAST = BRICK.rename("fast", w_WB_B0=(0.0, 1e30, 1e29))


@pytest.mark.parametrize("n_steps", [2, 20])
@pytest.mark.parametrize("name", ["scipy", "scipy:LSODA", "scipy:Radau", "precise:64"])
def test_a_run_that_would_take_for_ever_ends_at_once(name, n_steps):
    found = cv.integrate(FAST, 1 / n_steps, registry.method(name), on_failure="return")
    assert found.outcome.kind is cv.OutcomeKind.DIVERGED
    assert "step limit of 10000000 out of reach" in found.outcome.reason
    np.testing.assert_array_equal(found.w_WB_B, [FAST.w_WB_B0])


@pytest.mark.parametrize("n_steps", [2, 20])
def test_heyoka_ends_too(n_steps):
    found = cv.integrate(BRICK.rename("fast", w_WB_B0=(0.0, 1e20, 1e19)), 1 / n_steps, Heyoka(1e-9), on_failure="return")
    assert found.outcome.kind is cv.OutcomeKind.DIVERGED
    assert "step limit" in found.outcome.reason


@pytest.mark.parametrize("n_steps", [2, 20])
def test_heyoka_stops_at_the_limit_itself(monkeypatch, n_steps):
    for module in (engine, heyoka):
        monkeypatch.setattr(module, "STEP_LIMIT", 5)
    found = cv.integrate(BRICK, 1 / n_steps, Heyoka(1e-12), on_failure="return")
    assert found.outcome.reason == "step limit of 5 reached"
    assert 1 <= len(found) <= n_steps
    assert found.counters.steps == 5


def test_scipy_stops_at_the_limit_itself(monkeypatch):
    monkeypatch.setattr(engine, "STEP_LIMIT", 5)
    found = cv.integrate(BRICK, 0.1, SciPy(), on_failure="return")
    assert found.outcome.reason == "step limit of 5 reached"


def test_a_function_that_fails_in_an_engine_is_named():
    hook, calls = np.array([0.0, 0.1, 0.4]), []

    def gradient(R):
        calls.append(R)
        if len(calls) > 50:
            raise ZeroDivisionError("gone")
        return np.outer([0, 0, 1], 4 * (R[2] @ hook) ** 3 * hook)

    field = cv.FunctionPotential(lambda R: (R[2] @ hook) ** 4, gradient)
    scene = cv.Scene("s", BRICK.body, np.eye(3), (0.1, 0.2, 3.0), 1.0, field)
    with pytest.raises(cv.PotentialFailed) as caught:
        cv.integrate(scene, 0.1, SciPy())
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_what_is_timed_does_not_look_for_a_reason_again(monkeypatch):
    asked = []
    monkeypatch.setattr(heyoka, "pace_reason", lambda *given: asked.append(given) or "")
    run = Heyoka(1e-6).prepare(registry.scene("brick_flip"), cv.Grid(0.1, 10))
    for _ in range(3):
        assert run().outcome.ok
    assert len(asked) == 1
