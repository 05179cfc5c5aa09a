"""A process that ends while it prepares a run: that is the run's outcome, as a second try would hide it."""

import pytest

import conservative as cv
from conservative.outcome import OutcomeKind
from conservative.references.environments.client import Worker
from conservative.references.environments.failures import EngineCrashed

from .trial_engine import Trial

SCENE = cv.scenes.brick_flip(t_end=0.5)


@pytest.fixture
def first_preparation_is_lost(monkeypatch):
    """Have the process killed in the first preparation, and in no other one."""
    lost, ask = [], Worker.ask

    def ask_once_in_vain(self, do, **values):
        if do == "prepare" and not lost:
            lost.append(do)
            raise EngineCrashed("signal 9 (SIGKILL)")
        return ask(self, do, **values)

    monkeypatch.setattr(Worker, "ask", ask_once_in_vain)


def test_a_kill_in_a_preparation_is_an_outcome(trial_cache, first_preparation_is_lost):
    killed = cv.integrate(SCENE, 0.01, Trial(), on_failure="return")
    assert (killed.outcome.kind, killed.outcome.reason) == (OutcomeKind.CRASHED, "signal 9 (SIGKILL)")
    assert cv.integrate(SCENE, 0.01, Trial()).ok
