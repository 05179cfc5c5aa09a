"""What the one runner makes of a kernel's result, whatever the kernel: samples, and why they end early."""

from types import SimpleNamespace

import numpy as np
import pytest

import conservative as cv
from conservative.method import Grid
from conservative.methods.principal_axes import principal_start
from conservative.methods.run_kernel import prepare_run

SCENE = cv.Scene("free", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.3, 0.2, 1), 1.0)
GRID = Grid(0.1, 6)


def run(done=GRID.n_steps, bad=(), elsewhere=False):
    """The trajectory that a kernel leads to which takes `done` steps; the states of the samples in `bad` are no numbers."""

    def enter(n_steps, every, pause, q, L):
        q[:], L[:] = (1.0, 0.0, 0.0, 0.0), (0.3, 0.4, 2.5)
        for sample in bad:
            q[sample] = np.nan
        return done, done, 0, None, 0.25, elsewhere

    kernel = SimpleNamespace(enter=enter, FAILURE="planted", PAUSE=7)
    return prepare_run(SCENE, GRID, "planted", principal_start(SCENE), kernel, (), ())()


def test_a_run_to_the_end_is_ok():
    found = run()
    assert found.ok
    np.testing.assert_array_equal(found.t, GRID.t)


@pytest.mark.parametrize("bad", [(3,), (3, 4, 5, 6), (6,), (1,)])
def test_a_state_that_is_not_finite_is_a_failure_that_ends_the_samples_before_it(bad):
    found = run(bad=bad)
    assert isinstance(found.failure, cv.Diverged)
    assert len(found) == bad[0]
    assert found.outcome.time == found.t[-1] == GRID.t[bad[0] - 1]
    assert np.isfinite(found.R_WB).all()


@pytest.mark.parametrize(("elsewhere", "kind"), [(False, cv.NotConverged), (True, cv.WrongBranch)])
def test_a_step_without_a_solution_is_named_with_the_time_of_the_last_good_state(elsewhere, kind):
    found = run(done=2, bad=(3, 4, 5, 6), elsewhere=elsewhere)
    assert type(found.failure) is kind
    assert (found.outcome.step, found.outcome.time, found.outcome.residual) == (3, 2 * GRID.dt, 0.25)
    assert len(found) == 3


def test_what_is_built_whole_is_what_the_constructor_builds():
    found = run()
    built = cv.Trajectory(SCENE, found.t, found.R_WB, found.w_WB_B, found.label, cv.Counters(6, 6, 0, None))
    assert vars(found).keys() == vars(built).keys()
    assert vars(found.counters) == vars(built.counters)
    assert (found.failure, found.choice, found.label) == (None, None, "planted")


def test_runs_of_one_preparation_share_no_samples():
    again = prepare_run(SCENE, GRID, "planted", principal_start(SCENE), SimpleNamespace(enter=stand, PAUSE=7), (), ())
    one, other = again(), again()
    for name in ("t", "R_WB", "w_WB_B"):
        assert not np.shares_memory(getattr(one, name), getattr(other, name))
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def stand(n_steps, every, pause, q, L):
    q[:], L[:] = (1.0, 0.0, 0.0, 0.0), (0.3, 0.4, 2.5)
    return n_steps, n_steps, 0, None, 0.0, False
