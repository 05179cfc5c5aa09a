"""What drifts are relative to, and what is taken where nobody says: sizes that follow from the scene."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import from_quaternion

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


def test_the_step_that_nobody_names():
    assert cv.Scene("body", BODY, np.eye(3), (0, 0, 10.0), 6.0).dt == pytest.approx(0.05 / 10)
    assert cv.Scene("body", BODY, np.eye(3), (0, 0, 0.01), 6.0).dt == pytest.approx(0.06)
    assert cv.integrate(cv.scenes.brick_flip(), t_end=0.1).t[1] == 0.01


def test_a_spring_much_longer_at_rest_than_it_ever_gets_is_measured_by_its_rest_length():
    spring = cv.LinearSpring(3.0, (0, 0, 1), (0, 2, 0), 1e6)
    assert spring.scale() == pytest.approx(1.5e12)
    assert spring.scale() == pytest.approx(spring.energy(np.eye(3)), rel=1e-5)
    assert cv.integrate(cv.Scene("pushed", BODY, np.eye(3), (0, 0, 1), 0.1, spring), 1e-4).ok


def test_what_overflows_in_a_step_is_an_outcome():
    body = cv.RigidBody((4e5, 4e6, 1e30))
    scene = cv.Scene("far apart", body, np.eye(3), (3e29, 2e9, 2e-23), 8e18)
    assert not cv.integrate(scene, 8e17, cv.Convected(), on_failure="return").ok
