"""Bodies that fail among many: each gets the outcome that it has alone, and its neighbours stay as they are, bit for bit."""

import pickle
import signal
import threading
import time
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.integration import blocks
from conservative.method import Method, Role
from conservative.methods.many import Block, pause

from .many_bodies import scene, starts, tensors

N = 9
INNER = cv.Reduced()
SAMPLES = {"dt": 0.05, "t_end": 0.5, "sample_every": 2}


@dataclass(frozen=True)
class Damaged(Method):
    """The method `INNER` on lanes, which `damage` changes before they are looked at."""

    damage: Any

    family: ClassVar[str] = "damaged"
    role: ClassVar[Role] = Role.OURS
    order = INNER.order
    conserves = INNER.conserves

    def bounds(self, scene, grid):
        return INNER.bounds(scene, grid)

    def prepare(self, scene, grid):
        return INNER.prepare(scene, grid)

    def prepare_many(self, bodies, grid):
        def run():
            found = [INNER.solve(bodies.take(i), grid) for i in range(len(bodies))]
            samples = np.stack([each.R_WB for each in found]), np.stack([each.w_WB_B for each in found])
            block = Block(*samples, np.ones(len(bodies), dtype=bool))
            self.damage(block)
            return block

        return run


def leave_unfinished(block):
    block.finished[3] = False
    block.R_WB[3] = 7.0


def break_sample(block):
    block.w_WB_B[3, 2, 1] = np.nan


def drift(block):
    block.w_WB_B[3, -1] *= 1 + 1e-9


def shear(block):
    block.R_WB[3, 1, 0, 2] += 1e-9


@pytest.mark.parametrize("damage", [leave_unfinished, break_sample, drift, shear])
@pytest.mark.parametrize("own_inertia", [False, True])
def test_lanes_that_are_not_right_are_run_alone(damage, own_inertia, monkeypatch):
    given = {"w_WB_B0": starts(N)[1], "inertia": tensors(N) if own_inertia else None}
    right, alone = cv.integrate_many(scene(), **given, method=Damaged(repr), **SAMPLES), []  # which changes nothing
    monkeypatch.setattr(blocks, "run_alone", lambda *what: (alone.append(what[3]), run_alone(*what))[1])
    found = cv.integrate_many(scene(), **given, method=Damaged(damage), **SAMPLES)
    assert alone == [3]
    np.testing.assert_array_equal(found.R_WB, right.R_WB)
    np.testing.assert_array_equal(found.w_WB_B, right.w_WB_B)
    np.testing.assert_array_equal(found.drifts["energy"], right.drifts["energy"])
    assert found.ok.all()


run_alone = blocks.run_alone


def test_a_body_that_fails_has_the_outcome_that_it_has_alone():
    R, w = starts(N)
    w[4] *= 1e5  # of which a step of this length keeps less than it should
    found = cv.integrate_many(scene(), R, w, method=cv.Reduced(), **SAMPLES)
    others = np.delete(np.arange(N), 4)
    alone = cv.integrate(found.bodies.take(4), 0.05, cv.Reduced(), 0.5, 2, on_failure="return")
    assert not alone.ok
    assert list(found.failures) == [4]
    assert found.outcome(4) == alone.outcome == found[4].outcome
    assert list(found.ok) == [i != 4 for i in range(N)]
    np.testing.assert_array_equal(found[4].R_WB, alone.R_WB)
    assert np.isnan(found.R_WB[4, len(alone) :]).all()
    assert np.isnan(found.drifts["energy"][4])
    assert found[3:6].failures.keys() == {1}
    assert "8 ok, 1 not conserved (body 4)" in repr(found)
    assert found.to_pandas("bodies").loc[4, "outcome"] == str(alone.outcome)
    without = cv.integrate_many(scene(), R[others], w[others], method=cv.Reduced(), **SAMPLES)
    np.testing.assert_array_equal(found.R_WB[others], without.R_WB)
    single = cv.integrate_many(scene(), R[4:5], w[4:5], method=cv.Reduced(), **SAMPLES)
    assert single.outcome(0) == alone.outcome
    np.testing.assert_array_equal(single.R_WB[0], found.R_WB[4])


def test_a_body_that_the_method_does_not_take_is_not_run():
    inertia = np.array([[1.0, 1.0, 2.0]] * 3 + [[1.0, 1.4, 2.0]])
    given = {"inertia": inertia, "method": cv.Reduced(frame="non_spinning"), **SAMPLES}
    found = cv.integrate_many(scene(body=cv.RigidBody([1, 1, 2])), **given)
    assert list(found.failures) == [3]
    assert isinstance(found.failures[3], cv.NotRun)
    assert found.outcome(3).kind == cv.OutcomeKind.UNSUPPORTED
    assert len(found[3]) == 0


FAILURES = [
    cv.NotConverged(3, 0.1, 0.2, "singular"),
    cv.WrongBranch(3, 0.1, 0.2),
    cv.Diverged(0.1),
    cv.NotConserved(0.1, "energy", 1e-3, 1e-9),
    cv.InvalidResult("mine", "nothing"),
    cv.NotRun("it is for others"),
]


@pytest.mark.parametrize("failure", FAILURES)
def test_failures_come_back_from_other_processes(failure):
    again = pickle.loads(pickle.dumps(failure))
    assert type(again) is type(failure)
    assert vars(again) == vars(failure)
    assert str(again) == str(failure)


def wait_for_ever(block):
    """A run in pieces that does not end by itself."""
    while True:
        time.sleep(0.01)
        pause()


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_ends_all_threads(threads, monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    begun = threading.active_count()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        cv.integrate_many(scene(), *starts(N), method=Damaged(wait_for_ever), threads=threads, **SAMPLES)
    timer.join()
    assert threading.active_count() == begun


def test_a_failure_of_one_block_ends_the_others(monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 2)
    begun = threading.active_count()

    def fail(block):
        if len(block.finished) < 2:  # the last one
            raise RuntimeError("broken")
        wait_for_ever(block)

    with pytest.raises(RuntimeError, match="broken"):
        cv.integrate_many(scene(), *starts(3), method=Damaged(fail), threads=2, **SAMPLES)
    assert threading.active_count() == begun
