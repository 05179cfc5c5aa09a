from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, orthonormality, rotation_about, to_quaternion
from conservative.methods.coefficients.gauss_legendre import MOST_STAGES, tableau

from .one_body import body_in_axes, drift


def generic(kind: str, seed: int = 0) -> cv.Scene:
    """Return a scene with a full tensor: free, asymmetric in gravity, or symmetric with its centre of mass on either side."""
    random = np.random.default_rng(seed)
    turn = rotation_about(random.normal(size=3), random.uniform(0.5, 3))
    moments = (1.1, 1.1, 0.6) if kind.startswith("symmetric") else (0.9, 1.7, 1.2)
    points = {"asymmetric": random.normal(size=3), "symmetric+": 0.5 * turn[:, 2], "symmetric-": -0.5 * turn[:, 2]}
    com = points.get(kind)
    return cv.Scene(
        kind,
        body_in_axes(turn, *moments),
        rotation_about(random.normal(size=3), random.uniform(0.5, 3)),
        3 * random.normal(size=3),
        2.0,
        None if com is None else cv.UniformGravity(4.0, com),
    )


KINDS = ("free", "asymmetric", "symmetric+", "symmetric-")


def state_by_scipy(scene: cv.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the final attitude and rates by DOP853 on quaternion and momentum, independent of the methods under test."""
    body, potential = scene.body, scene.potential

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, L = y[:4], y[4:]
        w = body.inverse @ L
        torque = 0 if potential is None else np.cross(from_quaternion(q / np.linalg.norm(q))[2], potential.moment_B)
        return np.concatenate([[-q[1:] @ w / 2], (q[0] * w + np.cross(q[1:], w)) / 2, np.cross(L, w) + torque])

    start = np.concatenate([to_quaternion(scene.R_WB0), body.momentum(scene.w_WB_B0)])
    y = solve_ivp(rates, (0, scene.t_end), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return from_quaternion(y[:4] / np.linalg.norm(y[:4])), body.inverse @ y[4:]


@pytest.mark.parametrize("stages", range(1, MOST_STAGES + 1))
def test_coefficients_conserve_quadratic_invariants_and_have_their_order(stages: int) -> None:
    table = tableau(stages)
    weighted = table.b[:, None] * table.A
    assert np.abs(weighted + weighted.T - np.outer(table.b, table.b)).max() < 5e-17  # measured 2.8e-17
    for power in range(2 * stages):
        assert table.b @ table.c**power == pytest.approx(1 / (power + 1), rel=1e-14)  # measured 3e-15
    assert table.E @ np.ones(stages) == pytest.approx(table.c, abs=1e-10)  # measured 1.5e-11, for ten stages


@pytest.mark.parametrize("kind", KINDS)
def test_agrees_with_an_independent_solver(kind: str) -> None:
    scene = generic(kind)
    R_WB, w_WB_B = state_by_scipy(scene)
    trajectory = cv.integrate(scene, 0.05, cv.Gauss(8))
    assert angle_between(R_WB, trajectory.R_WB[-1]) < 1e-12  # measured up to 2.1e-13, mostly SciPy's
    assert np.abs(w_WB_B - trajectory.w_WB_B[-1]).max() < 3e-12  # measured up to 6e-13


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stages", [1, 2, 3, 5, 8, 10])
def test_conserves_every_invariant(kind: str, stages: int) -> None:
    trajectory = cv.integrate(generic(kind), 0.1, cv.Gauss(stages), t_end=100.0)
    assert drift(trajectory) < 3e-14  # measured up to 6e-15
    assert orthonormality(trajectory.R_WB).max() < 1e-14  # measured 4e-15, of the axis that eigh gives the symmetric body


@pytest.mark.parametrize("kind", ["free", "asymmetric", "symmetric-"])
@pytest.mark.parametrize(("stages", "steps"), [(1, (400, 800)), (2, (100, 200)), (3, (50, 100)), (4, (40, 80))])
def test_is_of_order_twice_the_stages(kind: str, stages: int, steps: tuple[int, int]) -> None:
    scene = generic(kind)
    truth = cv.integrate(scene, 0.02, cv.Gauss(10)).R_WB[-1]
    coarse, fine = (angle_between(truth, cv.integrate(scene, 2.0 / n, cv.Gauss(stages)).R_WB[-1]) for n in steps)
    assert np.log2(coarse / fine) == pytest.approx(2 * stages, abs=0.3)  # measured within 0.2


@pytest.mark.parametrize("kind", ["symmetric+", "symmetric-"])
def test_both_frames_give_the_same_motion(kind: str) -> None:
    scene = generic(kind, seed=3)
    body = cv.integrate(scene, 0.04, cv.Gauss(8, frame="body"))
    slow = cv.integrate(scene, 0.04, cv.Gauss(8, frame="non_spinning"))
    assert angle_between(body.R_WB, slow.R_WB).max() < 1e-13  # measured 1.4e-14
    assert np.abs(body.w_WB_B - slow.w_WB_B).max() < 1e-13  # measured 2e-14
    label = f"conservative=={cv.VERSION}/gauss:stages=8,frame=non_spinning"
    assert cv.integrate(scene, 0.04, cv.Gauss(8)).label == slow.label == label


def test_sweeps_converge_over_long_steps() -> None:
    # h |w| = 2.5: a plain iteration from the last state diverges for few stages and converges slowly for many.
    for stages in (2, 3, 4, 6, 8):
        trajectory = cv.integrate(cv.scenes.brick_flip(disturbance=0.5), 0.25, cv.Gauss(stages), t_end=50.0)
        assert trajectory.ok
        assert drift(trajectory) < 1e-14  # measured 2e-15


def test_one_stage_is_the_midpoint_rule_on_momentum() -> None:
    scene = generic("asymmetric")
    L = cv.integrate(scene, 0.01, cv.Gauss(1), t_end=0.01)
    momenta = scene.body.momentum(L.w_WB_B)
    mean, gamma = momenta.mean(axis=0), L.R_WB[:, 2].mean(axis=0)
    assert scene.potential is not None
    expected = 0.01 * (np.cross(mean, scene.body.inverse @ mean) + np.cross(gamma, scene.potential.moment_B))
    assert np.abs(momenta[1] - momenta[0] - expected).max() < 1e-14  # measured 2e-15


@pytest.mark.parametrize("potential", [None, cv.UniformGravity(2.0, (0.3, 0.1, -0.2))])
def test_starts_from_rest(potential: cv.UniformGravity | None) -> None:
    scene = cv.Scene("rest", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0, 0, 0), 10.0, potential)
    trajectory = cv.integrate(scene, 0.1, cv.Gauss(6))
    assert trajectory.ok
    assert drift(trajectory) < 1e-14  # measured 2e-15


def test_round_off_of_invariants_does_not_grow() -> None:
    trajectory = cv.integrate(generic("asymmetric"), 0.1, cv.Gauss(4), t_end=1e4, sample_every=100)
    assert drift(trajectory) < 1e-14  # measured 2e-15; 1e-13 where it is not taken off


@pytest.mark.parametrize("potential", [None, cv.UniformGravity(2.0, (0.0, 0.0, 0.8))])
@pytest.mark.parametrize("spin", [0.0, 3.0])
def test_the_rate_about_the_axis_of_a_rod_does_not_drift(potential, spin) -> None:
    # Round-off of the axial momentum, divided by the moment of the rod, was a rate of 1e-4 rad/s after 5 s.
    rod = cv.Scene("rod", cv.RigidBody((1, 1, 1e-12)), rotation_about((0.3, 0.4, -0.8), 0.9), (0.7, -0.4, spin), 5.0, potential)
    run = cv.integrate(rod, 0.01, cv.Gauss())
    assert np.abs(run.w_WB_B[:, 2] - spin).max() < 1e-15 * max(spin, 1)  # measured 0; before up to 1.3e-4
    exact = cv.integrate(rod, 0.01, cv.registry.method("exact"))
    assert run.error(exact).max() < 1e-13  # measured 2.1e-15
