"""Reference scales of drifts, default step sizes, and bodies whose moments are far apart."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import from_quaternion
from conservative.methods.principal_axes import principal_start
from conservative.outcome import OutcomeKind

BODY = cv.RigidBody((0.7, 1.3, 0.9))
RNG = np.random.default_rng(4)
ATTITUDES = from_quaternion((lambda q: q / np.linalg.norm(q, axis=1)[:, None])(RNG.normal(size=(4000, 4))))


@pytest.mark.parametrize(
    "potential",
    [
        cv.UniformGravity(2.3, (0.1, 0.3, -0.2)),
        cv.LinearSpring(3.1, (0.4, -0.2, 0.3), (0.5, 0.6, -0.7)),
        cv.GravityGradient(1.2, BODY.inertia, (1, 2, -0.5)),
    ],
    ids=lambda potential: type(potential).__name__,
)
def test_the_scale_of_a_field_is_its_largest_energy(potential):
    largest = np.abs(potential.energy(ATTITUDES)).max()
    assert 0.95 * potential.scale() < largest <= potential.scale() * (1 + 1e-12)


def test_the_scale_of_an_attraction_is_its_energy_at_right_angles():
    potential = cv.PointAttraction(-1.7, (3, 0, 0), (0, 0, 4))
    assert potential.scale() == pytest.approx(1.7 / 5, rel=1e-14) == potential.energy(np.eye(3))


def scales(w_WB_B0):
    scene = cv.Scene("body", BODY, np.eye(3), w_WB_B0, 1.0, cv.UniformGravity(3.0, (0, 0.3, 0.4)))
    return {invariant.name: invariant.scale for invariant in scene.invariants}


def test_energy_is_relative_to_motion_and_field_and_momentum_to_that_of_the_start():
    found = scales((0, 2.0, 0))
    assert found["energy"] == pytest.approx(1.3 * 4 / 2 + 3.0 * 0.5)
    assert found["vertical momentum"] == pytest.approx(1.3 * 2)


def test_at_rest_momentum_is_relative_to_what_the_field_can_make():
    found = scales((0, 0, 0))
    assert found["energy"] == pytest.approx(3.0 * 0.5)
    assert found["vertical momentum"] == pytest.approx(np.sqrt(1.3 * 1.5))


def test_default_step():
    assert cv.Scene("body", BODY, np.eye(3), (0, 0, 10.0), 6.0).dt == pytest.approx(0.05 / 10)
    assert cv.Scene("body", BODY, np.eye(3), (0, 0, 0.01), 6.0).dt == pytest.approx(0.06)
    assert cv.integrate(cv.scenes.brick_flip(), t_end=0.1).t[1] == 0.01


def test_the_scale_of_a_long_spring_is_that_of_its_rest_length():
    spring = cv.LinearSpring(3.0, (0, 0, 1), (0, 2, 0), 1e6)
    assert spring.scale() == pytest.approx(1.5e12)
    assert spring.scale() == pytest.approx(spring.energy(np.eye(3)), rel=1e-5)
    assert cv.integrate(cv.Scene("pushed", BODY, np.eye(3), (0, 0, 1), 0.1, spring), 1e-4).ok


def test_an_overflow_in_a_step_is_an_outcome():
    body = cv.RigidBody((4e5, 4e6, 1e30))
    scene = cv.Scene("far apart", body, np.eye(3), (3e29, 2e9, 2e-23), 8e18)
    assert not cv.integrate(scene, 8e17, cv.Convected(), on_failure="return").ok


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
