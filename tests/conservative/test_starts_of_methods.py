"""Coefficients and starts as kernels get them, in principal axes and in the frame that does not spin."""

import math

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import to_quaternion
from conservative.methods import gauss, non_spinning, principal_axes, projected, units
from conservative.methods.coefficients import gauss_legendre

from .exact_motion import START, free, in_field, top

TOP, FREE, GRAVITY, SPRUNG = top(), free((1, 1.4, 2), (0.3, -1.9, 0.3)), in_field("gravity"), in_field("spring")


@pytest.mark.parametrize("stages", [1, 2, 3, 7])
def test_gauss_legendre_coefficients(stages):
    table = gauss_legendre.tableau(stages)
    nodes, weights = np.polynomial.legendre.leggauss(stages)
    np.testing.assert_allclose(table.c, (1 + nodes) / 2, atol=1e-15)
    np.testing.assert_allclose(table.b, weights / 2, atol=1e-15)
    for k in range(stages):
        np.testing.assert_allclose(table.A @ table.c**k, table.c ** (k + 1) / (k + 1), atol=1e-14)
        np.testing.assert_allclose(table.E @ table.c**k, ((1 + table.c) ** (k + 1) - 1) / (k + 1), atol=2e-12)
    assert np.abs(table.b_low).max() < 1e-16
    assert math.fsum([*table.b, *table.b_low, -1.0]) == pytest.approx(0, abs=1e-30)
    padded = gauss.pad_tableau(stages)
    width = -(-stages // 4) * 4
    assert [each.shape for each in padded] == [(stages * width,), (stages * width,), (width,), (width,)]
    np.testing.assert_array_equal(padded[0].reshape(stages, width)[:, :stages], table.A.T)
    assert not padded[0].reshape(stages, width)[:, stages:].any()
    np.testing.assert_array_equal(padded[2][:stages], table.b)
    np.testing.assert_array_equal(padded[3][:stages], table.b_low)


def test_as_many_stages_as_have_been_checked():
    assert gauss_legendre.MOST_STAGES == 10
    assert gauss_legendre.DIGITS >= 50


def test_frames():
    assert non_spinning.resolve_frame("auto", TOP) == "non_spinning"
    assert non_spinning.resolve_frame("auto", FREE) == non_spinning.resolve_frame("auto", free((1, 1, 1), (0, 1, 0))) == "body"
    assert non_spinning.resolve_frame("auto", free((1, 1, 1 + 1e-9), (0, 1, 0))) == "non_spinning"
    assert non_spinning.resolve_frame("non_spinning", FREE) == "non_spinning"
    with pytest.raises(cv.BadInput, match="frame"):
        principal_axes.principal_start(FREE, "non_spinning")


def test_a_start_in_principal_axes_and_in_the_slow_frame():
    start = principal_axes.principal_start(GRAVITY)
    R, J = GRAVITY.body.R_BP, GRAVITY.body.moments
    np.testing.assert_allclose(start.J, J)
    np.testing.assert_allclose(start.J_inverse, 1 / J)
    np.testing.assert_allclose(start.L, R.T @ GRAVITY.body.inertia @ GRAVITY.w_WB_B0, atol=1e-14)
    np.testing.assert_allclose(np.abs(start.q), np.abs(to_quaternion(START @ R)), atol=1e-14)
    np.testing.assert_allclose(start.R_BP, R)
    assert start.spin is None
    slow = principal_axes.principal_start(TOP, "non_spinning")
    np.testing.assert_allclose((slow.J, slow.J_inverse), np.ones((2, 3)), rtol=1e-14)
    assert slow.spin == pytest.approx(((1.0 - 0.3) / 0.3 * slow.L[2], 1 / 0.3))
    assert slow.L[2] == pytest.approx(0.3 * 9)
    assert (slow.field.x, slow.field.y) == (0, 0)
    assert slow.field.z == pytest.approx(5)
    assert principal_axes.principal_start(top(turn=np.eye(3)), "non_spinning").R_BP is None


def test_units_of_the_closed_system():
    model = gauss.closed_system(principal_axes.principal_start(GRAVITY))
    size = np.linalg.norm(principal_axes.principal_start(GRAVITY).L)
    assert 0.5 < size / model.unit <= 1
    np.testing.assert_allclose(model.J_inverse, model.unit / GRAVITY.body.moments)
    assert math.log2(model.unit).is_integer()
    np.testing.assert_allclose(model.gamma, START[2] @ GRAVITY.body.R_BP, atol=1e-15)
    rest = gauss.closed_system(principal_axes.principal_start(free((1, 1.4, 2), (0, 0, 0))))
    assert (rest.unit, rest.L) == (1.0, (0.0, 0.0, 0.0))
    hanging = cv.Scene("at rest", GRAVITY.body, START, (0, 0, 0), 1.0, GRAVITY.potential)
    moment = 2.0 * np.linalg.norm((0.2, 0.1, 0.4))
    expected = 2.0 ** math.ceil(math.log2(math.sqrt(2.0 * moment)))
    assert gauss.closed_system(principal_axes.principal_start(hanging)).unit == expected
    assert np.linalg.norm(gauss.closed_system(principal_axes.principal_start(FREE)).gamma) == pytest.approx(1)


def test_scales_and_axis_of_the_projection():
    energy, momentum = projected.invariant_scales(GRAVITY)
    assert energy == GRAVITY.energy_scale
    assert momentum == pytest.approx(math.sqrt(2 * energy * 2.0))
    assert projected.field_axis(GRAVITY) == pytest.approx((0, 0, 1))
    axis = np.array([0.5, 0.2, 0.3])
    np.testing.assert_allclose(np.abs(projected.field_axis(SPRUNG)), axis / np.linalg.norm(axis))
    assert projected.field_axis(FREE) is None


@pytest.mark.parametrize(
    ("method", "scene"),
    [
        (cv.Convected(), FREE),
        (cv.Gauss(2), FREE),
        (cv.Lame(), TOP),
        (cv.MoserVeselov(), FREE),
        (cv.Projected(), GRAVITY),
        (cv.Reduced(), FREE),
    ],
    ids=lambda value: value.name,
)
def test_all_methods_look_for_units_of_their_own(method, scene, monkeypatch):
    steps = []
    monkeypatch.setattr(units, "find_units", lambda scene, dt: steps.append(dt) or units.SI)
    method.prepare(scene, cv.Grid(0.01, 1))
    assert 0.01 in steps
