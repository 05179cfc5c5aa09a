"""What is said of a run beside its samples: its work, how far it was good, and that long ones have every sample."""

from types import SimpleNamespace

import mujoco
import mujoco.rollout
import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.method import Grid
from conservative.references.engine import principal_axes
from conservative.references.engines.heyoka import Heyoka
from conservative.references.engines.inside.mujoco import prepare_with
from conservative.references.engines.mujoco import MuJoCo
from conservative.references.engines.pinocchio import Pinocchio
from conservative.references.engines.scipy import SciPy
from conservative.references.environments.plain_numbers import describe
from conservative.references.exact.method import Exact
from conservative.references.exact.motion import _BLOCK
from conservative.trajectory import Counters


@pytest.mark.parametrize("method", [*MuJoCo.variants(), *Pinocchio.variants()], ids=lambda method: method.name)
def test_evaluations_are_those_of_the_stages_of_each_step(method, free):
    counters = method.run(free, 0.1, t_end=0.7).counters
    assert (counters.steps, counters.evaluations) == (7, 7 * (4 if method.order == 4 else 1))


def test_evaluations_of_an_adaptive_method_are_more_than_its_steps(free):
    counters = SciPy("DOP853").run(free, 0.5).counters
    assert counters.evaluations >= 12 * counters.steps > 12  # twelve stages a step


def test_steps_from_sample_to_sample_are_all_counted(free):
    few, many = (Heyoka(1e-9).prepare(free, Grid(free.t_end / n, n))() for n in (4, 40))
    assert few.counters.steps >= many.counters.steps > 4  # steps that are cut at samples are not fewer


@pytest.mark.parametrize("bad", [1, 3])
def test_a_run_was_good_up_to_the_last_sample_that_is_finite(bad, free):
    grid = Grid(0.1, 5)
    R = np.broadcast_to(np.eye(3), (6, 3, 3))
    w = np.ones((6, 3))
    w[bad] = np.nan
    found = principal_axes(free).trajectory(grid, "planted", R, w, Counters(5))
    assert len(found) == bad
    assert isinstance(found.failure, cv.Diverged)
    assert found.outcome.time == found.t[-1] == grid.t[bad - 1]


def test_a_closed_form_has_every_sample_of_many(top):
    n = 2 * _BLOCK + 3
    many = Exact().prepare(top, Grid(2.0 / n, n))()
    for k in (_BLOCK - 1, _BLOCK, 2 * _BLOCK - 1, n):
        alone = Exact().prepare(top, Grid(float(many.t[k]), 1))()
        assert angle_between(alone.R_WB[-1], many.R_WB[k]) < 1e-13, k  # measured 1e-16
        np.testing.assert_allclose(alone.w_WB_B[-1], many.w_WB_B[k], atol=1e-13)


class Counted:
    """A module whose function `mj_step` is counted: the steps of each call."""

    def __init__(self, module):
        self.module, self.steps = module, []

    def __getattr__(self, name):
        return getattr(self.module, name)

    def mj_step(self, model, data, nstep=1):
        self.steps.append(nstep)
        return self.module.mj_step(model, data, nstep)


def test_mujoco_makes_the_steps_between_samples_in_one_call(free):
    """A loop over `mj_step` in Python has the same states and takes many times as long."""
    mj, grid = Counted(mujoco), Grid(0.01, 60, 20)
    prepare_with(mj, SimpleNamespace(integrator="RK4", **describe(principal_axes(free), grid)))()
    assert mj.steps == [20, 20, 20]


def test_mujoco_makes_close_samples_in_one_call(free, monkeypatch):
    mj, grid, calls = Counted(mujoco), Grid(0.01, 60, 2), []
    rollout = mujoco.rollout.rollout
    monkeypatch.setattr(mujoco.rollout, "rollout", lambda *args, **how: calls.append(how["nstep"]) or rollout(*args, **how))
    prepare_with(mj, SimpleNamespace(integrator="RK4", **describe(principal_axes(free), grid)))()
    assert calls == [60]
    assert mj.steps == []
