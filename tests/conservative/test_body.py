import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.invariants import axial_direction


def test_moments_and_tensor_describe_the_same_body():
    R = rotation_about((1, 2, 3), 0.8)
    body = cv.RigidBody(R @ np.diag([1.0, 2.0, 2.5]) @ R.T)
    np.testing.assert_allclose(body.moments, [1, 2, 2.5], rtol=1e-14)
    np.testing.assert_allclose(body.R_BP @ np.diag(body.moments) @ body.R_BP.T, body.inertia, atol=1e-14)
    assert np.linalg.det(body.R_BP) == pytest.approx(1)
    np.testing.assert_allclose(body.inverse @ body.inertia, np.eye(3), atol=1e-14)


def test_principal_moments_keep_their_axes_and_order():
    body = cv.RigidBody((13, 5, 10))
    np.testing.assert_array_equal(body.moments, [13, 5, 10])
    np.testing.assert_array_equal(body.R_BP, np.eye(3))


@pytest.mark.parametrize(
    ("moments", "axis"), [((2, 2, 1), 2), ((1, 2, 2), 0), ((2, 1, 2), 1), ((2, 2, 2), 2), ((1, 2, 3), None)]
)
def test_symmetry_axis(moments, axis):
    assert cv.RigidBody(moments).symmetry_axis() == axis


def test_a_body_cannot_be_changed():
    body = cv.RigidBody((1, 2, 2.5))
    with pytest.raises(AttributeError):
        body.inertia = np.eye(3)
    with pytest.raises(ValueError, match="read-only"):
        body.inertia[0, 0] = 3.0


def test_repr_is_an_expression():
    body = cv.RigidBody((1, 2, 2.5))
    again = eval(repr(body), {"RigidBody": cv.RigidBody})
    np.testing.assert_array_equal(again.inertia, body.inertia)


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9])
def test_a_body_that_is_nearly_symmetric_has_no_axis(off):
    nearly = cv.RigidBody((1, 1 + off, 2))
    assert axial_direction(nearly, None) is None
    assert axial_direction(nearly, cv.UniformGravity(1, (0, 0, 1))) is None
    assert axial_direction(cv.RigidBody((1, 1, 2)), cv.UniformGravity(1, (off, 0, 1))) is None
    assert axial_direction(cv.RigidBody((1, 1 + off, 1)), cv.UniformGravity(1, (0.2, 0.3, 0.4))) is None


def test_a_body_that_is_symmetric_but_for_round_off_has_its_axis():
    round_off = 4 * np.finfo(float).eps
    np.testing.assert_array_equal(axial_direction(cv.RigidBody((1, 1 + round_off, 2)), None), (0, 0, 1))
    field = cv.UniformGravity(1, (round_off, 0, -1))
    np.testing.assert_array_equal(axial_direction(cv.RigidBody((1, 1, 2)), field), (0, 0, -1))
