"""What only rare steps show: samples after a step that is solved by continuation, and quaternions that get too long."""

import numpy as np
import pytest

import conservative as cv
from conservative.kernels import gauss, reduced
from conservative.methods.reduced import convert, find_coefficients

BRICK = cv.scenes.brick_flip()


@pytest.mark.parametrize("pause", [4, 5, 7])
def test_samples_are_where_they_are_without_pauses(pause):
    model, coefficients = convert(BRICK, cv.Reduced())[2], find_coefficients(2, None, 1e-20, 0.01)
    found = []
    for length in (0, pause):
        q, L = np.zeros((8, 4)), np.zeros((8, 3))
        reduced.enter(*model, *coefficients, 20, 3, length, q, L)
        found.append((q, L))
    for whole, parts in zip(*found, strict=True):
        np.testing.assert_allclose(parts, whole, rtol=1e-12, atol=1e-14)


def test_a_long_quaternion_is_divided_with_what_it_lost():
    q, carry = (1.3, -0.4, 0.7, 0.2), (1e-3, -2e-3, 3e-3, 4e-3)
    ends = (0.0, 0.6, 0.8), (0.6, 0.0, 0.8)
    long = gauss.LONGEST
    short, left = gauss.carry_attitude(q, carry, (0.0, 0.0, 1.0), 1.0, *ends)
    divided = gauss.carry_attitude(tuple(long * x for x in q), tuple(long * x for x in carry), (0.0, 0.0, 1.0), 1.0, *ends)
    assert divided == (short, left)
    assert max(map(abs, left)) > 0
