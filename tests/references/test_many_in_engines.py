"""Engines that run many bodies at once: the motion of each body equals its single run."""

import numpy as np
import pytest

from conservative import BadInput, registry
from conservative.batch import Batch
from conservative.benchmarks.studies.ensembles import draw
from conservative.grid import Grid
from conservative.potentials.point_to_point import PointAttraction
from conservative.references.engine import principal_axes
from conservative.references.engines import mujoco
from conservative.references.environments.plain_numbers import describe_many, read_many
from conservative.references.heyoka_equations import formulations
from conservative.references.solvers import heyoka
from conservative.references.worker.program import Runs

GRID = Grid(0.01, 50, 20)
TOPS, FREE, ONE = (draw(kind, 5, seed=3) for kind in ("heavy_tops", "free_bodies", "one_body"))
ATTRACTION = TOPS.scene.rename("attracted", potential=PointAttraction(2.0, (0.3, -0.2, 0.4), (1.0, 0.5, 2.0)))
ATTRACTED = Batch(ATTRACTION, TOPS.R_WB0, TOPS.w_WB_B0, TOPS.inertia, {"strength": np.arange(1.0, 6)})
HEYOKA = "heyoka:tol=1e-15,frame=base_vectors"


def differences(block, method, bodies):
    """Return the largest difference of each body from its single run."""
    alone = [method.solve(bodies.take(i), GRID) for i in range(len(bodies))]
    R, w = (np.array([getattr(each, name) for each in alone]) for name in ("R_WB", "w_WB_B"))
    return np.maximum(np.abs(block.R_WB - R).max(axis=(1, 2, 3)), np.abs(block.w_WB_B - w).max(axis=(1, 2)))


@pytest.mark.parametrize(
    ("name", "bodies", "allowed"),
    [
        (HEYOKA, TOPS, 1e-13),  # measured 5e-15
        (f"{HEYOKA},driver=ensemble", TOPS, 1e-13),  # the same
        ("heyoka:tol=1e-15,frame=lean", FREE, 1e-13),  # measured 0
        (f"{HEYOKA},width=8,numbers=compiled", ONE, 1e-13),  # measured 0
        ("mujoco:RK4", TOPS, 1e-14),  # measured 9e-16
        ("mujoco:RK4,threads=2", FREE, 1e-14),
        ("mujoco:RK4,threads=2", ATTRACTED, 1e-14),
        ("pinocchio:scheme=RK4", TOPS, 1e-14),
        ("pinocchio:scheme=RK4", ATTRACTED, 1e-14),
    ],
)
def test_many_bodies_equal_their_single_runs(name, bodies, allowed):
    method = registry.method(name)
    run = method.prepare_many(bodies, GRID)
    first, again = run(), run()
    assert first.finished.all()
    assert differences(first, method, bodies).max() < allowed
    assert np.array_equal(first.R_WB, again.R_WB)
    other = Batch(bodies.scene, bodies.R_WB0[::-1].copy(), bodies.w_WB_B0, bodies.inertia, bodies.parameters)
    assert differences(first, method, other)[0] > 1e-3


def test_a_batch_at_the_limit_of_steps_is_not_finished(monkeypatch):
    monkeypatch.setattr(heyoka, "STEP_LIMIT", 1)
    block = registry.method(HEYOKA).prepare_many(TOPS, GRID)()
    assert not block.finished.any()
    assert np.isnan(block.R_WB[:, -1]).all()


def test_a_rollout_that_diverges_is_not_finished():
    rates = TOPS.w_WB_B0.copy()
    rates[2] = 1e4
    many = Batch(TOPS.scene, TOPS.R_WB0, rates, TOPS.inertia, TOPS.parameters)
    block = registry.method("mujoco:RK4").prepare_many(many, GRID)()
    assert block.finished.tolist() == [True, True, False, True, True]
    assert np.isnan(block.R_WB[2, -1]).all()
    assert np.isfinite(block.R_WB[[0, 1, 3, 4]]).all()


def test_a_rollout_in_pieces_is_the_same(monkeypatch):
    run = registry.method("mujoco:RK4").prepare_many
    whole = run(TOPS, GRID)()
    monkeypatch.setattr(mujoco, "ROOM", 7 * 8 * 5)
    assert np.array_equal(run(TOPS, GRID)().R_WB, whole.R_WB)


def test_a_worker_receives_many_bodies():
    axes = [principal_axes(TOPS.take(i)) for i in range(5)]
    runs = Runs()
    numbers = describe_many(axes, GRID)
    number = runs.prepare(mujoco.__file__, {"integrator": "RK4", "threads": 1}, **numbers)["run"]
    block = read_many(axes, GRID)(runs.run(number))
    assert differences(block, registry.method("mujoco:RK4"), TOPS).max() < 1e-14  # measured 9e-16


def test_compiled_numbers_are_constants_of_one_body():
    scene = ONE.take(0)
    for numbers, stored in (("parameters", 9), ("compiled", 0)):
        method = registry.method(f"heyoka:tol=1e-9,frame=base_vectors,numbers={numbers}")
        integrators = method.integrators(formulations.base_vectors(scene))
        with integrators.borrow() as integrator:
            assert len(integrator.pars) == stored
    with pytest.raises(BadInput, match="bodies that differ"):
        method.prepare_many(TOPS, GRID)


@pytest.mark.parametrize("settings", ["width=0", "width=65", "driver=other", "numbers=other"])
def test_bad_settings_of_batches(settings):
    with pytest.raises(BadInput):
        registry.method(f"heyoka:{settings}")


def test_bodies_that_cannot_run_at_once_are_refused():
    at_rest = FREE.w_WB_B0 * [[0], [1], [1], [1], [1]]  # a body at rest has no momentum to turn about: another form
    other = Batch(FREE.scene, FREE.R_WB0, at_rest, FREE.inertia, FREE.parameters)
    assert registry.method("heyoka:frame=lean").prepare_many(other, GRID) is None
    small = Batch(TOPS.scene, TOPS.R_WB0, TOPS.w_WB_B0, TOPS.inertia * 1e-29, TOPS.parameters)
    assert registry.method("mujoco:RK4").prepare_many(small, GRID) is None
