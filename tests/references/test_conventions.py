"""Every engine, on scenes where a wrong convention cannot hide: all must land on the same motion."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.method import Grid
from conservative.references.engines.heyoka import Heyoka
from conservative.references.engines.mujoco import MuJoCo
from conservative.references.engines.pinocchio import Pinocchio
from conservative.references.engines.scipy import SciPy
from conservative.references.precise import Precise

# Attitude and rates; measured beside: the largest over the four scenes.
TIGHT = [
    (SciPy(rtol=3e-14), 1e-12),  # measured 4e-13, its interpolant's
    (Heyoka(1e-16), 3e-14),  # measured 3e-15
    (Heyoka(1e-16, "non_spinning"), 3e-14),  # measured 2e-15
    (Heyoka(1e-16, "lean"), 3e-14),  # measured 3e-15
    (Heyoka(1e-16, "base_vectors"), 3e-14),  # measured 3e-15
    (MuJoCo("RK4"), 2e-8),  # measured 4e-9 at dt = 0.025
    (Pinocchio("RK4"), 2e-8),  # measured 7e-9
]


@pytest.mark.parametrize(("method", "bound"), TIGHT, ids=lambda value: getattr(value, "name", ""))
def test_an_engine_agrees_with_truth(method, bound, generic):
    if method.unsupported(generic):  # that it says so is tested elsewhere
        assert getattr(method, "frame", "") == "non_spinning"
        return
    truth = Precise(113).prepare(generic, Grid(0.025, 80))()
    found = method.prepare(generic, Grid(0.025, 80))()
    assert found.ok
    assert len(found) == 81
    assert angle_between(truth.R_WB, found.R_WB).max() < bound
    assert np.abs(truth.w_WB_B - found.w_WB_B).max() < bound


@pytest.mark.parametrize("method", [m for cls in (MuJoCo, Pinocchio, Heyoka, SciPy, Precise) for m in cls.variants()])
def test_a_run_starts_afresh_each_time_and_samples_do_not_change_it(method, top, heavy):
    run = method.prepare(top, Grid(0.05, 40))
    first = run()
    other = method.prepare(top.rename("other", w_WB_B0=(0.1, 0.2, 0.3)), Grid(0.05, 3))()
    second = run()
    np.testing.assert_array_equal(first.R_WB, second.R_WB)
    np.testing.assert_array_equal(first.w_WB_B, second.w_WB_B)
    assert len(other) == 4
    sparse = method.prepare(top, Grid(0.05, 40, 20))()
    assert sparse.t.tolist() == [0, 1, 2]
    # Adaptive ones cut steps at samples or do not: equal to their tolerance.
    bound = 0.0 if method.order else 1e-7 if "1e-06" in method.name else 1e-11  # measured 0, 8e-9, 9e-13
    assert angle_between(first.R_WB[::20], sparse.R_WB).max() <= bound
    np.testing.assert_allclose(first.R_WB[0], top.R_WB0, atol=1e-15)
    np.testing.assert_allclose(first.w_WB_B[0], top.w_WB_B0, atol=1e-15)


@pytest.mark.parametrize("method", [MuJoCo("RK4"), Pinocchio(), Heyoka(), Heyoka(frame="lean"), SciPy()], ids=lambda m: m.name)
def test_a_motion_does_not_depend_on_the_body_axes(method, free):
    """A body frame turned by B has inertia B'JB, attitude R B and rates B'w."""
    B = cv.attitude.rotation_about((-1, 0.4, 2), 2.2)
    turned = cv.Scene("turned", cv.RigidBody(B.T @ free.body.inertia @ B), free.R_WB0 @ B, B.T @ free.w_WB_B0, free.t_end)
    a, b = (method.prepare(scene, Grid(0.05, 40))() for scene in (free, turned))
    assert angle_between(a.R_WB @ B, b.R_WB).max() < 3e-14  # measured 3e-15
    assert np.abs(a.w_WB_B @ B - b.w_WB_B).max() < 3e-14  # measured 2e-15


STEEP = [MuJoCo("Euler"), MuJoCo("RK4"), Pinocchio("Euler"), Pinocchio("RK4"), SciPy()]
STEEP += [Heyoka(frame=frame) for frame in ("body", "lean", "base_vectors")]


@pytest.mark.parametrize("every", [1, 100])
@pytest.mark.parametrize("method", STEEP, ids=lambda m: m.name)
def test_a_run_that_ends_early_says_so_and_writes_no_file(method, every, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with np.errstate(over="ignore", invalid="ignore"):
        scene = cv.Scene("hopeless", cv.RigidBody((1, 2, 2.5)), np.eye(3), (1e30, 1e30, 1e30), 2.0, dt=0.1)
        found = method.run(scene, 0.01, sample_every=every)
    assert str(found.outcome).startswith("diverged after t = 0")
    assert len(found) <= 3  # Euler's method overflows in the third step
    assert isinstance(found.failure, cv.Diverged)
    assert not list(tmp_path.iterdir())


def test_explicit_steps_that_are_too_long_diverge():
    found = MuJoCo("Euler").run(cv.scenes.brick_flip(), 1.0, t_end=2000, sample_every=1)
    assert "MuJoCo warned of" in str(found.outcome)
    assert 0 < found.t[-1] < 2000
    assert np.isfinite(found.energy).all()
