"""Grids of steps and samples, methods by name, failures of a run, and limits of memory."""

from fractions import Fraction

import numpy as np
import pytest

import conservative as cv
from conservative import grid as grids
from conservative import registry
from conservative.grid import Grid, grid_for, most_samples, require_memory

BRICK = cv.scenes.brick_flip()


@pytest.mark.parametrize(
    ("dt", "t_end", "every", "n_steps", "times"),
    [
        (0.01, 6, 100, 600, [0, 1, 2, 3, 4, 5, 6]),
        (0.1, 0.35, 1, 4, [0, 0.1, 0.2, 0.3, 0.4]),  # the last step is the first at or past the end
        (0.1, 0.5, 2, 5, [0, 0.2, 0.4, 0.5]),  # the last state is kept whatever `every` says
        (0.1, 0.1, 7, 1, [0, 0.1]),
        (1 / 3, 1.0, 1, 3, [0, 1 / 3, 2 / 3, 1]),
    ],
)
def test_grid_of_steps_and_samples(dt, t_end, every, n_steps, times):
    grid = grid_for(BRICK, dt, t_end, every)
    assert grid.n_steps == n_steps
    np.testing.assert_allclose(grid.t, times, rtol=1e-15)
    assert grid.n_samples == len(grid.t)


@pytest.mark.parametrize("done", range(8))
def test_grid_counts_the_samples_of_a_run_that_stopped(done):
    grid = Grid(0.1, 7, 3)
    assert grid.count_samples(done) == np.searchsorted(grid.steps, done, side="right")


def test_a_grid_converts_its_numbers_to_float_and_int():
    grid = Grid(Fraction(1, 4), np.int64(8), np.uint8(2))
    assert grid == Grid(0.25, 8, 2)
    assert [type(value) for value in (grid.dt, grid.n_steps, grid.every)] == [float, int, int]
    np.testing.assert_array_equal(grid.t, [0, 0.5, 1, 1.5, 2])


def test_a_setting_may_come_without_its_name():
    assert registry.method("convected:1e-10") == cv.Convected(tol=1e-10)
    assert registry.scene("brick_flip:1e-6").w_WB_B0[1] == 1e-6


def test_the_method_of_a_given_step_is_the_papers_map():
    assert cv.integrate(BRICK, dt=0.01, t_end=0.1).label == f"conservative=={cv.__version__}/reduced"


def test_a_step_without_solution_is_an_error_with_its_step_or_a_shorter_trajectory():
    with pytest.raises(cv.NotConverged) as caught:
        cv.integrate(BRICK, dt=0.5, method=cv.Convected(tol=1e-30))
    assert (caught.value.step, caught.value.time) == (1, 0)
    assert caught.value.residual > 0
    trajectory = cv.integrate(BRICK, dt=0.5, method=cv.Convected(tol=1e-30), on_failure="return")
    assert str(trajectory.outcome).startswith("not converged in step 1 at t = 0")
    assert len(trajectory) == 1
    assert not trajectory.ok
    np.testing.assert_allclose(trajectory.w_WB_B[0], BRICK.w_WB_B0, rtol=1e-15)


@pytest.mark.parametrize(
    ("method", "scene"),
    [
        (cv.Reduced(), BRICK),
        (cv.Gauss(2), BRICK),
        (cv.MoserVeselov(), BRICK),
        (cv.Lame(), cv.scenes.lagrange_top()),
        (cv.Projected(), cv.scenes.asymmetric_top()),
        (cv.Taylor(), cv.scenes.asymmetric_top()),
        (cv.Taylor(tolerance=1e-10), cv.scenes.asymmetric_top()),
    ],
    ids=lambda value: value.name,
)
def test_samples_do_not_depend_on_their_number(method, scene):
    every, few = (method.solve(scene, Grid(0.01, 100, n)) for n in (1, 7))
    np.testing.assert_array_equal(few.R_WB[:-1], every.R_WB[::7])
    np.testing.assert_array_equal(few.R_WB[-1], every.R_WB[-1])
    np.testing.assert_array_equal(few.w_WB_B[:-1], every.w_WB_B[::7])


def test_a_body_at_rest_stays():
    scene = cv.Scene("rest", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0, 0, 0), 1.0)
    trajectory = cv.integrate(scene, 0.1)
    np.testing.assert_array_equal(trajectory.R_WB, np.broadcast_to(np.eye(3), (11, 3, 3)))
    np.testing.assert_array_equal(trajectory.w_WB_B, np.zeros((11, 3)))


def test_samples_farther_apart_than_the_run_are_its_initial_and_final_state():
    found = cv.integrate(BRICK, 0.1, sample_every=10**30)
    np.testing.assert_array_equal(found.t, [0, 6])
    assert len(cv.integrate(BRICK, error=1e-3, sample_every=10**30)) == 2


def test_memory_for_samples_is_checked_before_the_run(monkeypatch):
    monkeypatch.setattr(grids, "most_samples", lambda: 101)
    with pytest.raises(cv.BadInput) as caught:
        cv.integrate(BRICK, 0.01)
    assert caught.value.argument == "sample_every"
    assert caught.value.allowed.startswith("6 or more, or longer steps")
    assert len(cv.integrate(BRICK, 0.01, sample_every=6)) == 101


@pytest.mark.parametrize("rest", [0, 1, 3])
def test_the_smallest_interval_of_samples_that_fits_is_named(rest):
    n_steps = 10 * (most_samples() - 1) + rest
    least = 10 if rest == 0 else 11
    require_memory("sample_every", n_steps, least)
    with pytest.raises(cv.BadInput) as caught:
        require_memory("sample_every", n_steps, least - 1)
    assert caught.value.allowed.startswith(f"{least} or more")


def test_default_step():
    body = cv.RigidBody((0.7, 1.3, 0.9))
    assert cv.Scene("body", body, np.eye(3), (0, 0, 10.0), 6.0).dt == pytest.approx(0.05 / 10)
    assert cv.Scene("body", body, np.eye(3), (0, 0, 0.01), 6.0).dt == pytest.approx(0.06)
    assert cv.integrate(BRICK, method="reduced", t_end=0.1).t[1] == BRICK.dt
