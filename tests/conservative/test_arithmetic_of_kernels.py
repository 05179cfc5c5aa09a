"""What kernels are made of, against NumPy and exact fractions."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conservative.kernels import samples, simd_numpy, twofold, vector

RNG = np.random.default_rng(7)
A, B = (tuple(float(x) for x in RNG.normal(size=3)) for _ in range(2))
Q, P = (tuple(float(x) for x in RNG.normal(size=4)) for _ in range(2))


def plain(function: Any) -> Any:
    """A kernel as Python, so that nothing is compiled for a test."""
    return getattr(function, "py_func", function)


def matrix(q):
    return Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=4e-15)


def test_vectors():
    a, b = np.array(A), np.array(B)
    assert plain(vector.dot)(A, B) == pytest.approx(a @ b, rel=1e-14)
    close(plain(vector.cross)(A, B), np.cross(a, b))
    close(plain(vector.add)(A, B), a + b)
    close(plain(vector.subtract)(A, B), a - b)
    close(plain(vector.scale)(0.7, A), 0.7 * a)
    close(plain(vector.times)(A, B), a * b)
    columns = RNG.normal(size=(3, 3))
    close(vector.inverse(tuple(tuple(map(float, column)) for column in columns)), np.linalg.inv(columns.T))
    close(vector.apply(tuple(tuple(map(float, row)) for row in columns), B), columns @ b)


def test_quaternions():
    product = plain(vector.product)(Q, P)
    close(matrix(product), matrix(Q) @ matrix(P))
    assert np.linalg.norm(product) == pytest.approx(np.linalg.norm(Q) * np.linalg.norm(P), rel=1e-14)
    half = tuple(0.5 * x for x in Q)
    for q in (Q, half):
        close(plain(vector.vertical)(q), matrix(Q)[2])


def test_a_compensated_sum_keeps_what_it_rounds_away():
    total, carry = 1.0, 0.0
    for _ in range(1000):
        total, carry = plain(vector.accumulate)(total, carry, 1e-17)
    assert total == 1.0 + 45 * 2.0**-52  # 1e-14
    assert total - carry == pytest.approx(1.0 + 1e-14, abs=3e-16)


def exact(x):
    return Fraction(x[0]) + Fraction(x[1])


@pytest.mark.parametrize("seed", range(4))
def test_twofold_numbers_have_thirty_digits(seed):
    rng = np.random.default_rng(seed)

    def number():
        high = float(rng.normal())
        return (high, float(high * 1e-17 * rng.uniform(-1, 1)))

    x, y, f = number(), number(), float(rng.normal())
    for found, expected in (
        (twofold.plus(x, y), exact(x) + exact(y)),
        (twofold.minus(x, y), exact(x) - exact(y)),
        (twofold.times(x, y), exact(x) * exact(y)),
        (twofold.scale(f, x), Fraction(f) * exact(x)),
        (twofold.over(x, y), exact(x) / exact(y)),
        (twofold.two(f), Fraction(f)),
    ):
        size = max(abs(expected), abs(exact(x)), abs(exact(y))) if expected else 1
        assert abs(exact(found) - expected) <= size * Fraction(1, 10**30)
        assert found[0] + found[1] == found[0]


@pytest.mark.parametrize("spin", [None, (0.8, 1 / 3)])
@pytest.mark.parametrize("turn", [None, matrix(P)])
def test_samples_in_body_axes(spin, turn):
    n, J_inverse = 3, (1.0, 0.5, 0.25)
    t, q, L = np.array([0.0, 0.7, 1.9]), RNG.normal(size=(n, 4)), RNG.normal(size=(n, 3))
    R, w = np.empty((n, 3, 3)), np.empty((n, 3))
    assert samples.to_body_axes(t, q, L, J_inverse, spin, turn, R, w) == n
    frame = np.eye(3) if turn is None else turn
    for i in range(n):
        angle, rates = (0.0, L[i] * J_inverse) if spin is None else (spin[0] * t[i], L[i] * (*J_inverse[:2], spin[1]))
        own = Rotation.from_rotvec([0, 0, angle]).as_matrix()
        close(R[i], matrix(q[i]) @ own @ frame.T)
        close(w[i], frame @ own.T @ rates)


@pytest.mark.parametrize("broken", [0, 1, 2])
@pytest.mark.parametrize("turn", [None, matrix(P)])
def test_samples_that_are_not_finite_are_counted_from_the_first(broken, turn):
    t, q, L = np.zeros(3), np.tile(Q, (3, 1)), np.tile(A, (3, 1))
    for place in (q[broken, 1:2], L[broken, 2:], L[broken, :1]):
        kept = place.copy()
        place[:] = np.nan
        found = samples.to_body_axes(t, q, L, (1.0, 1.0, 1.0), None, turn, np.empty((3, 3, 3)), np.empty((3, 3)))
        assert found == broken
        place[:] = kept


def test_four_lanes():
    stored = np.arange(10.0)
    close(simd_numpy.four(stored, 3), [3, 4, 5, 6])
    simd_numpy.put(stored, 2, np.array([9.0, 8.0, 7.0, 6.0]))
    close(stored, [0, 1, 9, 8, 7, 6, 6, 7, 8, 9])
    close(simd_numpy.splat(2.5), [2.5] * 4)
    close(simd_numpy.spread(stored, 4), [7.0] * 4)
    close(simd_numpy.join(1.0, 2.0, 3.0, 4.0), [1, 2, 3, 4])
    four = simd_numpy.join(1.0, -2.0, 3.0, -4.0)
    assert [simd_numpy.lane(four, i) for i in range(4)] == [1, -2, 3, -4]
    close(simd_numpy.fuse(four, simd_numpy.splat(2.0), simd_numpy.splat(1.0)), [3, -3, 7, -7])
    assert simd_numpy.LANES == 4
