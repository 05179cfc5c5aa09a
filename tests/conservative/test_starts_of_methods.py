"""Coefficients and starts as kernels get them, in principal axes and in the frame that does not spin."""

import math

import numpy as np
import pytest

import conservative as cv
from conservative.methods import gauss, principal_axes, units

from .one_body import START, free, in_field, top

TOP, FREE, GRAVITY = top(), free((1, 1.4, 2), (0.3, -1.9, 0.3)), in_field("gravity")


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
