"""Drifts of many bodies are those of each alone: `Trajectory.drift`, and the sizes that bounds are relative to."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import orthonormality
from conservative.integration.drifts import find_drifts, list_drifts
from conservative.integration.inputs import read_bodies
from conservative.invariants import Invariant, kept_sizes, momentum_W, sizes
from conservative.trajectory import Trajectory

from .many_bodies import BODY, TURN, fields, scene, starts, tensors

N, SAMPLES = 5, 4
T = np.linspace(0.0, 1.5, SAMPLES)


def samples():
    """Attitudes and rates of no motion at all, so that drifts are large; attitudes are not quite orthonormal."""
    R, w = starts(N * SAMPLES, seed=1)
    R += 1e-3 * np.random.default_rng(2).normal(size=R.shape)
    return R.reshape(N, SAMPLES, 3, 3), w.reshape(N, SAMPLES, 3)


def require_same(bodies):
    """Compare with each body alone; return the names that were compared."""
    R, w = samples()
    found, compared = find_drifts(bodies, T, R, w), set()
    for i in range(N):
        own = bodies.take(i)
        alone = cv.Scene("alone", own.body, own.R_WB0, own.w_WB_B0, 2.0, own.potential)
        if bodies.scene.extra_invariants:
            alone = alone.rename("alone", extra_invariants=bodies.scene.extra_invariants)
        trajectory = Trajectory(alone, T, R[i], w[i], "")
        kept = kept_sizes(alone, frozenset(each.name for each in alone.invariants))
        for column, name in enumerate(list_drifts(bodies)):
            invariant = next((each for each in alone.invariants if each.name == name), None)
            if invariant is None and column > 0:
                assert np.isnan(found.values[i, column])
                continue
            off = orthonormality(R[i]) if invariant is None else sizes(trajectory.drift(invariant))
            assert found.values[i, column] == pytest.approx(off.max(), rel=1e-13)  # 5e-15
            scale = 1.0 if invariant not in kept else invariant.scale / kept[invariant]
            assert found.bounded[i, column] == pytest.approx(off.max() * scale, rel=1e-13)
            compared.add(name)
    return compared


@pytest.mark.parametrize("name", fields(1))
@pytest.mark.parametrize("own_inertia", [False, True])
def test_drifts_are_those_of_each_body_alone(name, own_inertia):
    potential, parameters = fields(N)[name]
    if own_inertia and hasattr(getattr(potential, "potential", potential), "inertia") != ("inertia" in parameters):
        pytest.skip("a field with the inertia of the body")
    bodies = read_bodies(scene(potential), *starts(N), tensors(N) if own_inertia else None, parameters)
    assert len(require_same(bodies)) >= 2


def test_without_numbers_of_their_own_bodies_have_the_field_of_the_scene():
    for potential, _ in fields(N).values():
        require_same(read_bodies(scene(potential), *starts(N), None, None))


def test_bodies_at_rest_have_the_scale_of_what_their_field_can_do():
    R, w = starts(N)
    require_same(read_bodies(scene(cv.UniformGravity(3.0, (0.1, 0.2, 0.3))), R, 0 * w, None, None))
    require_same(read_bodies(scene(), R, 0 * w, None, None))


def test_axial_momentum_is_that_of_the_bodies_that_have_one():
    symmetric = cv.RigidBody(TURN @ np.diag([1.0, 1.0, 2.0]) @ TURN.T)
    inertia = tensors(N)
    inertia[2] = 3 * symmetric.inertia
    for own in (None, inertia):
        assert "axial momentum" in require_same(read_bodies(scene(body=symmetric), *starts(N), own, None))


def test_invariants_of_the_scene_itself_count_where_all_have_its_body():
    extra = Invariant("first momentum", "kg m^2/s", 2.0, lambda R, w: momentum_W(BODY, R, w)[..., 0])
    with_extra = scene(extra_invariants=(extra,))
    assert "first momentum" in require_same(read_bodies(with_extra, *starts(N), None, None))
    assert "first momentum" not in list_drifts(read_bodies(with_extra, *starts(N), tensors(N), None))


def test_a_sample_that_is_not_finite_has_no_drift():
    bodies, (R, w) = read_bodies(scene(), *starts(N), None, None), samples()
    R[1, 2, 0, 0], w[3, 0, 2] = np.nan, np.inf
    found = find_drifts(bodies, T, R, w).values
    assert np.isnan(found[[1, 3]]).all()
    assert np.isfinite(found[[0, 2, 4]]).all()
