"""What kernels return of runs that end, and what only very long runs would reach."""

import numpy as np
import pytest

import conservative as cv
from conservative.deferred_imports import kernels
from conservative.kernels import gauss, lame, vector
from conservative.kernels.protocol import Result

from .exact_motion import free, in_field, top

FREE, GRAVITY = free((1, 1.4, 2), (0.3, -1.9, 0.3)), in_field("gravity")
RUNS = [
    (cv.Reduced(), FREE, 10, None),
    (cv.Reduced(4), GRAVITY, 50, None),
    (cv.Gauss(3), FREE, 30, None),
    (cv.MoserVeselov(), FREE, 10, None),
    (cv.MoserVeselov(4), FREE, 10, None),
    (cv.Lame(), top(), 10, None),
    (cv.Projected(), GRAVITY, 120, 120),
    (cv.Taylor(9), GRAVITY, 90, 90),
    (cv.Taylor(), FREE, 140, 140),
]


@pytest.mark.parametrize(("method", "scene", "stages", "evaluations"), RUNS, ids=[run[0].name for run in RUNS])
def test_a_run_that_ends_is_done_and_has_a_small_last_correction(method, scene, stages, evaluations, monkeypatch):
    kernel, returned = kernels(method.kernel), []
    enter = kernel.enter

    def note(*loose):
        returned.append(Result(*enter(*loose)))
        return tuple(returned[-1])

    monkeypatch.setattr(kernel, "enter", note)
    method.prepare(scene, cv.Grid(0.02, 10, 5))()
    (found,) = returned
    assert (found.done, found.stages, found.evaluations, found.elsewhere) == (10, stages, evaluations, False)
    assert 0 <= found.size < 1e-6
    assert (found.corrections == 0) == (method.kernel in ("lame", "moser_veselov")) or method.kernel == "projected"


@pytest.mark.parametrize("scale", [1.0, 2.0**70])
def test_gauss_divides_a_long_quaternion_by_a_power_of_two(scale):
    """Its length grows from step to step; what it lost to rounding is divided with it."""
    q, lost = np.array([0.5, -0.4, 0.3, 0.7]), np.array([1e-18, -2e-18, 3e-18, 4e-18])
    a, g0, g1 = (0.1, 0.2, 0.95), (0.05, 0.25, 0.96), (0.15, 0.15, 0.97)
    size = float(np.linalg.norm(a))
    short = gauss.carry_attitude(tuple(q), tuple(lost), a, size, g0, g1)
    found = gauss.carry_attitude(tuple(float(x) for x in scale * q), tuple(float(x) for x in scale * lost), a, size, g0, g1)
    factor = scale / (2.0**64 if scale > 1 else 1.0)
    np.testing.assert_array_equal(found[0], factor * np.array(short[0]))
    np.testing.assert_array_equal(found[1], factor * np.array(short[1]))


def test_gauss_turns_one_unit_vector_onto_another_by_the_shortest_way():
    g, a = (np.array(v) / np.linalg.norm(v) for v in ((0.3, -0.5, 0.8), (0.1, 0.9, 0.4)))
    q = np.array(gauss.minimal_rotation(tuple(map(float, g)), tuple(map(float, a))))
    turned = vector.product(vector.product(tuple(map(float, q)), (0.0, *map(float, g))), (float(q[0]), *map(float, -q[1:])))
    np.testing.assert_allclose(np.array(turned[1:]) / (q @ q), a, atol=1e-15)
    assert abs(q[1:] @ g) < 1e-15


def test_lame_restores_invariants_by_one_damped_correction():
    """Least squares in (dw0, dw1) / rate and the turn, with damping on both residuals."""
    E, z, k, rate = 3.0, 1.2, 0.7, 1.9
    gamma, w = np.array([0.36, 0.48, 0.8]), np.array([0.4, -1.1, 1.7])
    rows = np.zeros((2, 5))
    rows[0] = [rate * gamma[0], rate * gamma[1], *np.cross(w, gamma)]
    rows[1] = [w[0], w[1], -k * gamma[1] / rate, k * gamma[0] / rate, 0.0]
    left = np.array([z - w @ gamma, (E - 0.5 * w @ w - k * gamma[2]) / rate])
    damped = rows @ rows.T + lame.DAMPING * rate**2 * np.eye(2)
    expected = rows.T @ np.linalg.solve(damped, left)
    dw, turn = lame.restore_invariants(E, z, k, rate, tuple(map(float, gamma)), tuple(map(float, w)))
    np.testing.assert_allclose(dw, rate * expected[:2], rtol=1e-12)
    np.testing.assert_allclose(turn, expected[2:], rtol=1e-12)


@pytest.mark.parametrize(
    ("g2", "g3", "B", "expected"), [(16.0, 1.0, (0, 0, 0), 2.0), (1.0, -8.0, (0, 1, 0), 2**0.5), (1.0, 1.0, (0, 1, -25), 5.0)]
)
def test_lame_rates_are_those_of_the_largest_root(g2, g3, B, expected):
    found = lame.scale_of((g2, 1e-17), (g3, 1e-17), np.array([(float(b), 0.0) for b in B]))
    assert found == pytest.approx(expected)
