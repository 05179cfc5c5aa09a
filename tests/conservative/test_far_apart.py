"""Bodies whose moments are far apart: what is symmetric, and what a singular step is."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import from_quaternion
from conservative.methods.principal_axes import principal_start
from conservative.outcome import OutcomeKind


def test_moments_are_equal_relative_to_each_other():
    assert cv.RigidBody((1, 1e-13, 5e-13)).symmetry_axis(1e-12) is None
    assert cv.RigidBody((1, 1e-13, 1e-13)).symmetry_axis(1e-12) == 0
    assert cv.RigidBody((1, 1, 1e-13)).symmetry_axis(1e-12) == 2


def test_rounding_a_tensor_leaves_a_body_symmetric():
    draw = np.random.default_rng(0)
    for _ in range(100):
        q = draw.normal(size=4)
        R = from_quaternion(q / np.linalg.norm(q))
        tensor = R @ np.diag([1e-9, 1e-9, 1.0]) @ R.T
        assert cv.RigidBody((tensor + tensor.T) / 2).symmetry_axis(1e-12) == 2


@pytest.mark.parametrize("small", [1e-3, 1e-15, 1e-28])
def test_a_rod_keeps_all_digits_of_its_small_moment(small):
    scene = cv.Scene("rod", cv.RigidBody((small, 1.0, small)), np.eye(3), (0.1, 0.2, 0.3), 1.0)
    start = principal_start(scene, "non_spinning")
    assert (small, small, small) == start.J
    assert start.spin[1] == 1.0


SINGULAR = {
    cv.Gauss(2): (3.5e18, cv.RigidBody([2.7e21] * 3), (2.3e29, 1.6e-24, 2.3e-21)),
    cv.Convected(): (1.2786236075884442e15, cv.RigidBody([437731692.49836576] * 3), (1.8e-20, 1.9e29, 6.0)),
}


@pytest.mark.parametrize("method", SINGULAR, ids=str)
def test_a_singular_step_is_an_outcome(method):
    dt, body, w = SINGULAR[method]
    found = cv.integrate(cv.Scene("fast", body, np.eye(3), w, 10 * dt), dt, method, on_failure="return")
    assert found.outcome.kind is OutcomeKind.NOT_CONVERGED
    assert 1 <= len(found) < 10
