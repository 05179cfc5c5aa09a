"""Conversions and distances of attitudes against SciPy and definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from conservative import attitude

vectors = arrays(float, 3, elements=st.floats(-3, 3, allow_subnormal=False))


@given(vectors, vectors)
def test_hat_is_the_cross_product(a, b):
    np.testing.assert_allclose(attitude.hat(a) @ b, np.cross(a, b), atol=1e-14)  # measured 4e-15


@given(vectors)
def test_cayley_is_its_rational_map(v):
    half = attitude.hat(v) / 2
    expected = np.linalg.solve(np.eye(3) - half, np.eye(3) + half)
    np.testing.assert_allclose(attitude.cayley(v), expected, atol=1e-14)  # measured 2e-15


@given(vectors)
def test_quaternion_goes_to_a_matrix_and_back(v):
    R = expm(attitude.hat(v))
    q = attitude.to_quaternion(R)
    assert q[0] >= 0
    np.testing.assert_allclose(attitude.from_quaternion(q), R, atol=1e-14)  # measured 3e-15
    np.testing.assert_allclose(R, Rotation.from_quat(q, scalar_first=True).as_matrix(), atol=1e-14)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_have_a_quaternion(axis):
    R = 2 * np.outer(axis, axis) - np.eye(3)
    np.testing.assert_allclose(np.abs(attitude.to_quaternion(R)), [0, *axis], atol=1e-15)


def test_a_quaternion_that_lost_its_norm_shows_as_lost_orthonormality():
    q = np.array([0.5, 0.5, 0.5, 0.5]) * (1 + 1e-6)
    assert attitude.orthonormality(attitude.from_quaternion(q)) == pytest.approx(4e-6, rel=1e-4)


@pytest.mark.parametrize("angle", [0.0, 1e-15, 1e-9, 1e-3, 1.0, 3.0, np.pi])
def test_small_and_large_angles_are_measured_to_round_off(angle):
    R = attitude.rotation_about((1, -2, 0.5), 0.7)
    turned = R @ attitude.rotation_about((3, 1, 2), angle)
    # measured 2e-16 absolute below 1 rad; at pi the arcsine's slope leaves 1e-8
    tolerance = 5e-16 if angle < 2 else 5e-8
    assert attitude.angle_between(R, turned) == pytest.approx(angle, abs=tolerance, rel=1e-12)


def test_the_angle_to_nan_is_nan():
    assert np.isnan(attitude.angle_between(np.eye(3), np.full((3, 3), np.nan)))


def test_functions_are_vectorised():
    rng = np.random.default_rng(1)
    q = rng.normal(size=(4, 5, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    R = attitude.from_quaternion(q)
    assert R.shape == (4, 5, 3, 3)
    assert attitude.angle_between(R, R).shape == (4, 5)
    assert attitude.orthonormality(R).max() < 1e-15  # measured 4e-16
