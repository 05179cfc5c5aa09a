"""Fields in machine code against their potentials in NumPy and against difference quotients."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conservative import LinearSpring
from conservative.kernels import brief
from conservative.kernels import fields as kernel_fields

from .one_body import FIELDS, TURN, in_field, torque


class fields:  # noqa: N801
    """The functions of fields in machine code, as kernels call them."""

    energy = staticmethod(brief(lambda field, q: kernel_fields.energy(field, q)))
    body_torque = staticmethod(brief(lambda field, q: kernel_fields.body_torque(field, q)))
    finite_torque = staticmethod(brief(lambda field, q, a: kernel_fields.finite_torque(field, q, a)))
    finite_derivative = staticmethod(brief(lambda field, q0, q1: kernel_fields.finite_derivative(field, q0, q1)))


FIELDS_WITH_REST = {**FIELDS, "spring at 0": LinearSpring(3.0, (0.2, 0.1, 0.4), (0.5, 0.2, 0.3))}
SCENES = {name: in_field("gravity").rename(name, potential=field) for name, field in FIELDS_WITH_REST.items()}
Q = (0.9, -0.5, 0.7, 1.1)
A = np.array([0.31, -0.22, 0.43])
EPSILON = 1e-5


def matrix(q):
    return Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()


def turned(a):
    """Return the attitude after a step whose half has the Cayley vector a."""
    return matrix(Q) @ matrix((1.0, *a))


def columns(R):
    return np.ascontiguousarray(R.T).reshape(9)


@pytest.fixture(params=SCENES)
def case(request):
    """Return a scene, and its field in principal axes, which differ from the axes of the body."""
    scene = SCENES[request.param]
    return scene, scene.potential.kernel_field(TURN)


def test_energy_is_the_potentials(case):
    scene, field = case
    for scale in (1.0, 0.5):
        q = tuple(scale * x for x in Q)
        assert fields.energy(field, q) == pytest.approx(float(scene.potential.energy(matrix(Q) @ TURN.T)), rel=1e-13)


def test_torque_is_that_of_the_gradient(case):
    scene, field = case
    for scale in (1.0, 0.5):
        q = tuple(scale * x for x in Q)
        np.testing.assert_allclose(fields.body_torque(field, q), TURN.T @ torque(scene, matrix(Q) @ TURN.T), atol=1e-9)


def test_torque_of_a_step_does_the_work_of_the_step(case):
    """V1 - V0 = -2 a.T, and T is the moment of the finite derivative about the mean base vectors."""
    scene, field = case
    T, _ = fields.finite_torque(field, Q, tuple(A))
    work = scene.potential.energy(turned(A) @ TURN.T) - scene.potential.energy(matrix(Q) @ TURN.T)
    assert pytest.approx(float(work), abs=2e-14) == -2 * A @ T
    R0, R1 = matrix(Q), turned(A)
    V_star, _ = fields.finite_derivative(field, columns(R0), columns(R1))
    mean = 0.5 * (R0 + R1)
    moment = sum(np.cross(mean[:, j], -V_star[3 * j : 3 * j + 3]) for j in range(3))
    np.testing.assert_allclose(T, R0.T @ moment, atol=1e-13)
    np.testing.assert_allclose(fields.finite_torque(field, Q, (0.0, 0.0, 0.0))[0], fields.body_torque(field, Q), atol=1e-9)


def test_derivative_of_the_torque_of_a_step(case):
    _, field = case
    _, dT = fields.finite_torque(field, Q, tuple(A))
    for k, e in enumerate(EPSILON * np.eye(3)):
        ends = [np.array(fields.finite_torque(field, Q, tuple(A + side * e))[0]) for side in (1, -1)]
        np.testing.assert_allclose(dT[k], (ends[0] - ends[1]) / (2 * EPSILON), atol=3e-9)


def test_finite_derivative_is_the_potentials(case):
    scene, field = case
    R0, R1 = matrix(Q), turned(A)
    V_star, dV_star = fields.finite_derivative(field, columns(R0), columns(R1))
    difference = float(scene.potential.energy(R1 @ TURN.T) - scene.potential.energy(R0 @ TURN.T))
    assert V_star @ (columns(R1) - columns(R0)) == pytest.approx(difference, abs=2e-14)
    expected = np.asarray(scene.potential.finite_derivative(R0 @ TURN.T, R1 @ TURN.T)) @ TURN
    np.testing.assert_allclose(V_star, columns(expected), atol=1e-12)
    for k, e in enumerate(EPSILON * np.eye(9)):
        ends = [fields.finite_derivative(field, columns(R0), columns(R1) + side * e)[0] for side in (1, -1)]
        np.testing.assert_allclose(dV_star[:, k], (ends[0] - ends[1]) / (2 * EPSILON), atol=3e-9)
