"""The paper's equations, identity by identity, on generic parameters."""

from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.kernels import convected as paper
from conservative.potentials.uniform_gravity import UniformField

RNG = np.random.default_rng(20)
A, B = RNG.normal(size=(2, 9))
Q = rotation_about((1, -2, 0.5), 0.9)
ORTHONORMAL = np.ascontiguousarray(Q.T).reshape(9)
J = Q @ np.diag([1.3, 2.1, 2.9]) @ Q.T


def test_exchange_identities_of_the_matrices():
    np.testing.assert_allclose(paper.G(A) @ B, -paper.G(B) @ A, atol=1e-15)
    np.testing.assert_allclose(paper.C(A) @ B, paper.C(B) @ A, atol=1e-15)
    nu, kappa = RNG.normal(size=3), RNG.normal(size=6)
    np.testing.assert_allclose(paper.G(A).T @ nu, paper.H(nu) @ A, atol=1e-15)
    np.testing.assert_allclose(paper.C(A).T @ kappa, paper.S(kappa) @ A, atol=1e-15)


def test_identities_9_and_10_on_orthonormal_base_vectors():
    G, C = paper.G(ORTHONORMAL), paper.C(ORTHONORMAL)
    np.testing.assert_allclose(paper.G(A) @ A, 0, atol=1e-15)
    np.testing.assert_allclose(C @ G.T, 0, atol=1e-15)
    np.testing.assert_allclose(G @ G.T, 2 * np.eye(3), atol=1e-15)


def test_conjugate_momentum_obeys_12_and_17():
    w = RNG.normal(size=3)
    p = paper.conjugate_momentum(ORTHONORMAL, J @ w)
    np.testing.assert_allclose(paper.G(ORTHONORMAL) @ p, -J @ w, atol=1e-14)
    np.testing.assert_allclose(paper.C(ORTHONORMAL) @ p, 0, atol=1e-15)


@pytest.mark.parametrize("field", [None, UniformField(0.7, -1.1, 2.3)])
def test_tangent_29_is_the_derivative_of_the_residual(field):
    q0, p0 = ORTHONORMAL, paper.conjugate_momentum(ORTHONORMAL, RNG.normal(size=3))
    u = np.concatenate([q0, p0]) + 0.1 * RNG.normal(size=18)

    def linearised(u):
        V_star = (None, None) if field is None else paper.finite_gradient(field, q0, u[:9])
        return paper.residual_and_tangent(0.3, np.linalg.inv(J), *V_star, q0, p0, u[:9], u[9:])

    def residual(u):
        return linearised(u)[0]

    tangent = linearised(u)[1]
    step = 1e-5
    columns = [(residual(u + step * e) - residual(u - step * e)) / (2 * step) for e in np.eye(18)]
    np.testing.assert_allclose(tangent, np.array(columns).T, atol=1e-8)  # measured 2e-10, the difference quotient's own error


def test_newton_converges_quadratically():
    trajectory = cv.integrate(cv.scenes.brick_flip(), 0.01, cv.Convected(tol=1e-8))
    assert trajectory.counters.iterations <= 3 * 600  # measured exactly 3 a step


def test_papers_brick():
    scene = cv.scenes.brick_flip()
    trajectory = cv.integrate(scene, 0.01, cv.Convected(tol=1e-8))
    length = np.linalg.norm(trajectory.momentum_W, axis=1)
    gram = np.swapaxes(trajectory.R_WB, 1, 2) @ trajectory.R_WB - np.eye(3)
    assert np.abs(trajectory.energy / trajectory.energy[0] - 1).max() < 1e-10  # measured 1.5e-15
    assert np.abs(length / length[0] - 1).max() < 1e-10  # measured 1.1e-15
    assert np.abs(gram).max() < 1e-10  # measured 3e-15
    # what the repaired equations gave when they were first checked
    np.testing.assert_allclose(trajectory.w_WB_B[-1], [-0.2856185, 0.36022433, 9.99151229], atol=1e-7)  # measured 5e-9


def test_papers_top():
    scene = cv.scenes.lagrange_top()
    trajectory = cv.integrate(scene, 0.01, cv.Convected(tol=1e-8))
    energy, vertical = trajectory.energy, trajectory.momentum_W[:, 2]
    assert np.abs(energy - energy[0]).max() / scene.energy_scale < 1e-9  # measured 3.7e-10
    assert np.abs(vertical / vertical[0] - 1).max() < 1e-9  # measured 2.6e-10
    centre = trajectory.R_WB[63] @ scene.potential.com_B
    np.testing.assert_allclose(centre, [-0.0589061, -0.02962542, 0.03574081], atol=1e-7)  # measured 5e-9


@pytest.mark.parametrize(("dt", "error"), [(0.01, 0.0600), (0.005, 0.0205), (0.0025, 0.0050)])
def test_papers_period_error_of_the_top(dt, error):
    """Steady precession: the exact centre of mass goes round the vertical at 10 rad/s.

    The figures are errors of the x1 coordinate, which the paper draws; as distances they are 0.0696, 0.0206 and 0.0051 m.
    """
    scene = cv.scenes.lagrange_top()
    trajectory = cv.integrate(scene, dt, cv.Convected(tol=1e-10))
    exact = rotation_about((0, 0, 1), 10 * trajectory.t[-1]) @ scene.R_WB0 @ scene.potential.com_B
    off = abs((trajectory.R_WB[-1] @ scene.potential.com_B - exact)[0])
    assert off == pytest.approx(error, abs=1e-4)  # measured 0.05999, 0.02044, 0.00509


def off_start(rate: Any) -> Any:
    """Return a method whose first sample has another rate, rad/s."""

    class Off(cv.Convected):
        def prepare(self, scene, grid):
            run = super().prepare(scene, grid)

            def moved():
                found = run()
                found.w_WB_B[0] += rate
                return found

            return moved

    return Off()


@pytest.mark.parametrize(
    ("J", "off"), [((1, 1, 1e-12), (1e-5, 0, 0)), ((1, 1, 1e-12), (0, 0, 0.01)), ((1, 2, 2), (0, 0, 1e-5))]
)
def test_a_first_sample_of_a_rod_is_compared_up_to_round_off_of_its_momentum(J: Any, off: Any) -> None:
    # The momentum has round-off of 1e-16, which over 1e-12 is a rate of 1e-4 rad/s about the axis, and no mistake.
    scene = cv.Scene("rod", cv.RigidBody(J), rotation_about((0.3, 0.4, -0.8), 0.9), (0.7, -0.4, 0.0), 0.1)
    kinds = [method.solve(scene, cv.Grid(1e-3, 10, 1)).outcome.kind for method in (cv.Convected(), off_start(off))]
    assert kinds[0] is not cv.OutcomeKind.INVALID
    assert kinds[1] is cv.OutcomeKind.INVALID
