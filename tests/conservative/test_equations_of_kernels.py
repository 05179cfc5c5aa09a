"""The equations that kernels solve, one by one, against NumPy, SciPy and difference quotients."""

import math

import numpy as np
import pytest
from scipy.special import ellipj

import conservative as cv
from conservative.kernels import gauss, moser_veselov, reduced

from .exact_motion import TURN, free, in_field

J = np.array([1.0, 1.4, 2.0])
L = np.array([0.8, -1.9, 1.1])
Q = (0.5, -0.5, 0.5, 0.5)
A = np.array([0.21, -0.32, 0.13])
FIELD = in_field("gravity").potential.kernel_field(TURN)
EPSILON = 1e-6


def triple(v):
    return tuple(float(x) for x in v)


def equation(h, a, field=None):
    """J a + a x (J a) - (h/2) (L + (h/2) (T - a x T))"""
    T = np.zeros(3) if field is None else np.array(reduced.finite_torque(field, Q, triple(a))[0])
    return J * a + np.cross(a, J * a) - h / 2 * (L + h / 2 * (T - np.cross(a, T)))


def end(h, a, field=None):
    """Cay(2a)' (L + h T)"""
    T = np.zeros(3) if field is None else np.array(reduced.finite_torque(field, Q, triple(a))[0])
    hat = np.cross(np.eye(3), a)
    cayley = np.linalg.solve(np.eye(3) - hat, np.eye(3) + hat)
    return cayley.T @ (L + h * T)


@pytest.mark.parametrize("field", [None, FIELD])
def test_reduced_residual_and_its_tangent(field):
    np.testing.assert_allclose(
        reduced.residual(0.3, triple(J), field, Q, triple(L), triple(A)), equation(0.3, A, field), atol=1e-14
    )
    tangent = [
        (equation(0.3, A + EPSILON * e, field) - equation(0.3, A - EPSILON * e, field)) / (2 * EPSILON) for e in np.eye(3)
    ]
    rows = reduced.inverse_tangent(0.3, triple(J), field, Q, triple(A))
    np.testing.assert_allclose(np.array(rows) @ np.transpose(tangent), np.eye(3), atol=1e-8)


@pytest.mark.parametrize("field", [None, FIELD])
def test_reduced_newton(field):
    for h in (0.05, 0.3):
        guess = reduced.explicit_guess(h, triple(1 / J), field, Q, triple(L))
        found = reduced.newton_solve(h, triple(J), field, Q, triple(L), (0.0, 0.0, 0.0), guess, 0.25, 1e-10)
        a, gain, corrections, size, trusted = found
        assert trusted
        assert np.abs(equation(h, np.array(a), field)).max() < 1e-15
        np.testing.assert_allclose(L + gain, end(h, np.array(a), field), atol=2e-15)
        assert corrections == 3
        assert 1e-12 < size < 1e-4


def test_reduced_first_guess_is_of_third_order():
    errors = []
    for h in (0.02, 0.01):
        guess = reduced.explicit_guess(h, triple(1 / J), FIELD, Q, triple(L))
        a = reduced.newton_solve(h, triple(J), FIELD, Q, triple(L), (0.0, 0.0, 0.0), guess, 0.25, 1e-10)[0]
        errors.append(np.abs(np.subtract(a, guess)).max())
    assert 7 < errors[0] / errors[1] < 9


def test_reduced_takes_along_what_the_momentum_lost_to_rounding():
    for field in (None, FIELD):
        carry = (3e-9, -5e-9, 7e-9)
        guess = reduced.explicit_guess(0.2, triple(1 / J), field, Q, triple(L))
        ends = []
        for momentum, lost in ((L, carry), (L - carry, (0.0, 0.0, 0.0))):
            gain = reduced.newton_solve(0.2, triple(J), field, Q, triple(momentum), lost, guess, 0.25, 1e-10)[1]
            ends.append(momentum - np.array(lost) + gain)
        np.testing.assert_allclose(ends[0], ends[1], atol=2e-15)


def test_reduced_extrapolates_polynomials_of_degree_five():
    coefficients = [0.3, -1.0, 0.7, 2.0, -0.2, 0.1]
    past = tuple((0.0, math.nan, float(np.polyval(coefficients, -k))) for k in range(1, 7))
    assert reduced.extrapolate(2, past) == pytest.approx(0.1, abs=1e-10)
    assert reduced.extrapolate(0, past) == 0.0


@pytest.mark.parametrize("offset", [0.005, 0.02])
def test_reduced_does_not_trust_a_far_answer(offset):
    guess = reduced.explicit_guess(0.1, triple(1 / J), None, Q, triple(L))
    far = triple(np.add(guess, [offset, 0, 0]))
    found = reduced.newton_solve(0.1, triple(J), None, Q, triple(L), (0.0, 0.0, 0.0), far, 0.01, 1e-8)
    assert found[4] == (offset < 0.01)


def follow(h, field=None, parts=40):
    """Return a(h) on the branch from a(0) = 0 in many short parts, by Newton's method with a difference quotient."""
    a = np.zeros(3)
    for part in np.linspace(0, h, parts + 1)[1:]:
        for _ in range(6):
            tangent = [
                (equation(part, a + EPSILON * e, field) - equation(part, a - EPSILON * e, field)) / (2 * EPSILON)
                for e in np.eye(3)
            ]
            a = a - np.linalg.solve(np.array(tangent).T, equation(part, a, field))
    return a


@pytest.mark.parametrize("field", [None, FIELD])
@pytest.mark.parametrize("h", [0.4, 1.5])
def test_reduced_follows_the_branch_to_long_steps(field, h):
    found = reduced.continue_branch(h, triple(J), triple(1 / J), field, Q, triple(L), (0.0, 0.0, 0.0), 1e-10)
    a, gain, corrections, size, reached = found
    assert reached
    np.testing.assert_allclose(a, follow(h, field), atol=1e-9)
    np.testing.assert_allclose(L + gain, end(h, np.array(a), field), atol=1e-14)
    assert corrections < 60
    assert size < 1e-3
    assert reduced.find_solution(0.4, triple(J), triple(1 / J), field, Q, triple(L))


def test_reduced_says_where_the_branch_ends():
    scene = cv.scenes.lagrange_top()
    failed = cv.integrate(scene, dt=0.6, on_failure="return")
    assert failed.outcome.kind in (cv.OutcomeKind.NOT_CONVERGED, cv.OutcomeKind.WRONG_BRANCH)
    assert failed.counters.steps == failed.outcome.step - 1 == len(failed) - 1
    assert 1e-4 < failed.outcome.residual < 10


@pytest.mark.parametrize("factor", [60, 200])
def test_reduced_and_composition_over_long_steps_keep_energy_and_momentum(factor):
    scene = free((1, 1.4, 2), (0.3, 1.9, 0.3))
    for method in (cv.Reduced(), cv.Reduced(4)):
        run = method.prepare(scene, cv.Grid(0.005 * factor, 12, 1))()
        assert run.outcome.kind is cv.OutcomeKind.OK
        for invariant in scene.invariants:
            assert abs(run.drift(invariant)).max() < 4e-15
        back = cv.Scene("back", scene.body, run.R_WB[-1], -run.w_WB_B[-1], 1.0)
        again = method.prepare(back, cv.Grid(0.005 * factor, 12, 1))()
        np.testing.assert_allclose(again.R_WB[::-1], run.R_WB, atol=1e-10)  # the steps are symmetric in time


Z = np.array([[0.3, -0.2, 0.5], [0.7, 0.1, -0.4], [0.2, 0.9, 0.6], [0.1, 0.5, -0.8], [0.6, -0.3, 0.4], [0.2, 0.8, 0.3]])
C = (0.2, -0.5, 0.9)


def closed_rates(u):
    """L' = L x w + gamma x c, gamma' = gamma x w"""
    w = u[:3] / J
    return np.concatenate([np.cross(u[:3], w) + np.cross(u[3:], C), np.cross(u[3:], w)])


def test_gauss_rates():
    F = np.full(48, np.nan)
    for state in Z.T:
        gauss.hold_rates(triple(1 / J), C, triple(state[:3]), triple(state[3:]), F, 8)
        for found in F.reshape(6, 8).T:
            np.testing.assert_allclose(found, closed_rates(state), atol=1e-15)


@pytest.mark.parametrize("potential", [None, "gravity"])
@pytest.mark.parametrize(("stages", "dt"), [(2, 0.4), (3, 0.5), (5, 0.6)])
def test_gauss_over_long_steps_keeps_its_invariants(potential, stages, dt):
    """Steps of a rad, and back."""
    scene = free((1, 1.4, 2), (0.3, 1.9, 0.3)) if potential is None else in_field(potential)
    run = cv.Gauss(stages).prepare(scene, cv.Grid(dt, 6, 1))()
    assert run.ok
    for invariant in scene.invariants:
        assert abs(run.drift(invariant)).max() < 1e-13
    back = cv.Scene("back", scene.body, run.R_WB[-1], -run.w_WB_B[-1], 1.0, scene.potential)
    again = cv.Gauss(stages).prepare(back, cv.Grid(dt, 6, 1))()
    np.testing.assert_allclose(again.R_WB[-1], run.R_WB[0], atol=1e-10)


def test_gauss_ends_where_its_sweeps_do():
    run = cv.Gauss(2).prepare(free((1, 1.4, 2), (0.3, 1.9, 0.3)), cv.Grid(10.0, 3, 1))()
    assert run.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    assert (run.counters.steps, run.counters.stages, run.outcome.step, len(run)) == (0, 0, 1, 1)
    assert run.counters.iterations < 10  # measured 5


@pytest.mark.parametrize("mc", [1.0, 0.9, 0.3, 1e-5, 0.0])
def test_moser_veselov_elliptic_functions_are_scipys(mc):
    for u in (0.0, 0.3, -1.1, 2.4, 5.0):
        expected = ellipj(u, 1 - mc)[:3]
        np.testing.assert_allclose(moser_veselov.jacobi(u, mc), expected, atol=2e-14)


def test_moser_veselov_power_series():
    a, b = np.arange(1.0, moser_veselov.TERMS + 1), np.cos(np.arange(moser_veselov.TERMS))
    product = np.convolve(a, b)
    assert [moser_veselov.multiply(a, b, n) for n in (0, 3, 11)] == pytest.approx([product[0], product[3], product[11]])
    quotient = moser_veselov.divide(a, b)
    np.testing.assert_allclose(np.convolve(quotient, b)[: moser_veselov.TERMS], a, rtol=1e-12)


@pytest.mark.parametrize("moments", [(0.9, 1.4, 2.3), (2.3, 1.4, 0.9), (1, 1, 2), (2, 1, 1)])
def test_moser_veselov_polhode(moments):
    """Amplitudes and the start on the curve: L = (A1 c, A2 s, A3 d), with the energy and the length of L."""
    momentum = np.array([0.2, -0.3, 1.9])
    size, energy = np.linalg.norm(momentum), 0.5 * np.sum(momentum**2 / moments)
    p = moser_veselov.polhode(*map(float, moments), *momentum)
    np.testing.assert_allclose([p.A1 * p.c, p.A2 * p.s, p.A3 * p.d], momentum, atol=1e-14)
    assert (p.l, p.E) == pytest.approx((size, energy))
    assert p.m + p.mc == pytest.approx(1)
    assert p.s**2 + p.c**2 == pytest.approx(1)
    assert p.d**2 == pytest.approx(p.mc + p.m * p.c**2)
