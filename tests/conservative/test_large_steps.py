"""Steps of a radian and more: the solution lies on the continuous branch, or the outcome reports that there is none."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, hat, rotation_about
from conservative.methods.coefficients.gauss_legendre import tableau
from conservative.registry import method

from ..bodies import impossible_body
from .one_body import TURN, body_in_axes, drift


def free_body(seed: int, rate: float = 1.0) -> cv.Scene:
    """Return a random body with a full tensor and a random spin of `rate` rad/s."""
    draw = np.random.default_rng(seed)
    a, b, c = draw.exponential(size=3)
    body = body_in_axes(TURN, b + c, a + c, a + b)
    w = draw.normal(size=3)
    return cv.Scene("generic", body, rotation_about(w, 0.8), rate * w / np.linalg.norm(w), 100.0)


def on_axis(disturbance: float) -> cv.Scene:
    """Return the brick spun about its middle axis at 1 rad/s, with a disturbance."""
    return cv.Scene("axis", cv.RigidBody((13, 5, 10)), TURN, (0, disturbance, 1.0), 100.0)


def homotopy(scene: cv.Scene, h: float, parts: int = 100) -> np.ndarray:
    """Return the momentum after one step of h, followed from a step of 0 in tiny parts: plain NumPy, free bodies, body axes."""
    J, L = scene.body.inertia, scene.body.momentum(scene.w_WB_B0)
    a = np.zeros(3)
    for part in np.linspace(0, h, parts + 1)[1:]:
        for _ in range(3):
            tangent = J + np.cross(a, J.T).T - np.cross(J @ a, np.eye(3)).T
            assert np.linalg.det(tangent) > 0
            a = a - np.linalg.solve(tangent, J @ a + np.cross(a, J @ a) - part / 2 * L)
    return L + 4 / h * np.cross(J @ a, a)


def heavy_body(seed: int) -> cv.Scene:
    """Return the random body in gravity strong enough to raise 1 rad/s to 3.4 rad/s within a second."""
    return free_body(seed).rename("heavy", potential=cv.UniformGravity(2.0, (0.5, -0.3, 0.8)))


def collocated(scene: cv.Scene, stages: int, h: float, parts: int = 80) -> np.ndarray | None:
    """Return the momentum after a step of Gauss collocation, followed from a step of 0 in tiny parts; None if the branch ends.

    Plain NumPy on momentum and vertical, body axes: L' = L x w + gamma x c, gamma' = gamma x w.
    """
    A, b = tableau(stages).A, tableau(stages).b
    inverse, c = scene.body.inverse, scene.potential.moment_B
    U = np.concatenate([scene.body.momentum(scene.w_WB_B0), scene.R_WB0[2]])
    D = np.zeros((stages, 6))
    for part in np.linspace(0, h, parts + 1)[1:]:
        for _ in range(4):
            L, gamma = np.hsplit(U + D, 2)
            w = L @ inverse
            F = np.hstack([np.cross(L, w) + np.cross(gamma, c), np.cross(gamma, w)])
            blocks = [
                np.block([[hat(L[j]) @ inverse - hat(w[j]), -hat(c)], [hat(gamma[j]) @ inverse, -hat(w[j])]])
                for j in range(stages)
            ]
            tangent = np.eye(6 * stages) - part * np.block(
                [[A[i, j] * blocks[j] for j in range(stages)] for i in range(stages)]
            )
            D = D + np.linalg.solve(tangent, (part * A @ F - D).ravel()).reshape(D.shape)
        if np.linalg.slogdet(tangent)[0] < 0:
            return None
    return (U + h * b @ F)[:3]


@pytest.mark.parametrize(("stages", "h", "solved"), [(1, 1.0, 6), (2, 1.5, 3), (4, 2.0, 4)])
def test_gauss_stays_on_the_continuous_branch_or_fails_at_once(stages: int, h: float, solved: int) -> None:
    ok = 0
    for seed in range(8):
        scene = heavy_body(seed)
        run = cv.Gauss(stages).run(scene, h, h)
        if not run.ok:
            assert type(run.failure) is cv.NotConverged
            assert run.counters.iterations <= 120
            continue
        expected = collocated(scene, stages, h)
        assert expected is not None
        off = scene.body.momentum(run.w_WB_B[-1]) - expected
        assert np.linalg.norm(off) / np.linalg.norm(expected) < 1e-12  # measured 3e-15; other branches are off by 0.8 to 5
        ok += 1
    assert ok == solved


def test_one_long_step_of_many_stages_is_near_the_truth() -> None:
    for seed in range(10):
        truth, step = (cv.Gauss(10).run(heavy_body(seed), dt, 1.0).R_WB[-1] for dt in (0.01, 1.0))
        assert angle_between(truth, step) < 2e-8  # measured 4e-9; |w| dt is 3.4 rad at the end


@pytest.mark.parametrize("turn", [0.5, 2.0, 4.0, 8.0])
def test_large_steps_stay_on_the_continuous_branch(turn: float) -> None:
    off = []
    for seed in range(6):
        scene = free_body(seed)
        run = cv.Reduced().run(scene, turn, turn)
        assert run.ok
        size = np.linalg.norm(scene.body.momentum(scene.w_WB_B0))
        off.append(np.linalg.norm(scene.body.momentum(run.w_WB_B[-1]) - homotopy(scene, turn)) / size)
    assert max(off) < 1e-12  # measured 1.2e-15


def test_newton_alone_would_have_taken_another_branch() -> None:
    # Spun about the middle axis the steady spin solves the equation at any step, but from |w| dt = 4.16 on it is not what a
    # disturbed spin leads to continuously.
    scene, h = on_axis(1e-3), 6.0
    L0 = scene.body.momentum(scene.w_WB_B0)
    L1 = scene.body.momentum(cv.Reduced().run(scene, h, h).w_WB_B[-1])
    assert np.linalg.norm(L1 - homotopy(scene, h)) < 1e-11  # measured 8e-15
    assert np.linalg.norm(L1 - L0) > 0.3 * np.linalg.norm(L0)  # measured 1.1; the steady spin has 1e-3


def test_the_end_of_a_branch_is_reported() -> None:
    scene = on_axis(0.0)  # without a disturbance the branch ends where the two that a disturbance leads to begin
    assert cv.Reduced().run(scene, 4.0, 4.0).ok
    run = cv.Reduced().run(scene, 6.0, 18.0)
    assert isinstance(run.failure, cv.WrongBranch)
    assert isinstance(run.failure, cv.NotConverged)
    assert str(run.outcome).startswith("wrong branch in step 1 at t = 0 s (no continuous solution; residual ")
    assert 0.1 < run.failure.residual < 1  # measured 0.31: the right side is that much longer than the branch reaches
    with pytest.raises(cv.WrongBranch, match="Use a shorter step"):
        cv.integrate(scene, 6.0, t_end=18.0)


@pytest.mark.parametrize("order", [2, 4])
def test_samples_counters_and_invariants_are_right_when_every_stage_follows_the_branch(order: int) -> None:
    scene = free_body(3, 1.0)
    run = cv.Reduced(order).run(scene, 5.0, 150.0, sample_every=4)
    assert run.ok
    assert np.array_equal(run.t, np.append(np.arange(0, 30, 4), 30) * 5.0)
    assert run.counters.steps == 30
    assert run.counters.iterations > 5 * run.counters.stages
    assert drift(run) < 1e-13  # measured 2e-15
    every = cv.Reduced(order).run(scene, 5.0, 150.0)
    assert np.array_equal(every.R_WB[[0, 4, 8, 30]], run.R_WB[[0, 1, 2, -1]])


def test_a_body_at_rest_to_round_off_stays_there() -> None:
    # Its Cayley vector is round-off, so an iteration never converges relative to it.
    field = cv.UniformGravity(3.0, TURN.T @ (0, 0, -0.2))
    scene = cv.Scene("hanging", cv.RigidBody((2, 3, 2.5)), TURN, (0, 0, 0), 1.0, field)
    for dt in (0.01, 0.1, 0.5, 1.0):
        run = cv.Reduced().run(scene, dt, 100 * dt)
        assert run.ok
        assert np.abs(run.R_WB - TURN).max() < 1e-14  # measured 3e-16


def test_substepping_is_offered_by_name_and_never_silent() -> None:
    scene = on_axis(0.0)
    run = method("substepped:reduced,most=8").run(scene, 6.0, 18.0, sample_every=2)
    assert run.ok
    assert run.label.endswith("substepped:most=8, 2 parts a step")
    assert np.array_equal(run.t, [0, 12, 18])
    assert run.counters.steps == 6
    plain = cv.Reduced().run(scene, 3.0, 18.0, sample_every=4)
    assert np.array_equal(run.R_WB, plain.R_WB)
    short = method("substepped:most=8").run(scene, 1.0, 9.0)
    assert short.label.endswith("substepped:most=8")
    assert np.array_equal(short.R_WB, cv.Reduced().run(scene, 1.0, 9.0).R_WB)
    failed = cv.Substepped(most=1).run(scene, 6.0, 18.0)
    assert isinstance(failed.failure, cv.WrongBranch)
    assert cv.Substepped(most=2).run(scene, 6.0, 18.0).ok  # as many parts as are allowed


def test_substepping_has_the_properties_of_its_method() -> None:
    found = method("substepped:method=reduced:order=4/frame=auto,most=16")
    assert found.inner == cv.Reduced(4, frame="auto")
    assert method(found.name) == found
    assert found.order == 4
    assert found.conserves == found.inner.conserves
    top = cv.Substepped("reduced:order=2/frame=non_spinning")
    assert top.unsupported(cv.scenes.brick_flip()) == top.inner.unsupported(cv.scenes.brick_flip())


EXTREME = [  # one overflows, two have a singular matrix
    (cv.Convected(), 8e17, (4e5, 4e6, 1e30), (3e29, 2e9, 2e-23)),
    (cv.Gauss(2), 3.5e18, [2.7e21] * 3, (2.3e29, 1.6e-24, 2.3e-21)),
    (cv.Convected(), 1.2786236075884442e15, [437731692.49836576] * 3, (1.8e-20, 1.9e29, 6.0)),
]


@pytest.mark.parametrize(("method", "dt", "moments", "w"), EXTREME)
def test_an_extreme_step_is_an_outcome(method, dt, moments, w) -> None:
    scene = cv.Scene("extreme", impossible_body(moments), np.eye(3), w, 10 * dt)
    run = cv.integrate(scene, dt, method, on_failure="return")
    assert run.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    assert 1 <= len(run) < 10
