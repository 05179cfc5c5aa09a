"""Free bodies: exact steps and their orders, one at a time and many in lanes; degenerate bodies; refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, orthonormality, rotation_about, to_quaternion
from conservative.batch import Batch
from conservative.kernels import COMPILED
from conservative.methods import columns
from conservative.methods.many import Block
from conservative.references.precise import Precise

DATA = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]
FREE = [name for name, case in DATA.items() if not any(map(float, case["weight_com_B"]))]


def random_free(seed: int, t_end: float = 10.0) -> cv.Scene:
    """A body that exists, in axes of its own, of any size, turning at 3 rad/s."""
    random = np.random.default_rng(seed)
    masses = np.exp(random.uniform(-1, 1, 3)) * 10 ** random.uniform(-3, 3)
    turn = rotation_about(random.normal(size=3), random.uniform(0.3, 3))
    w = random.normal(size=3)
    inertia = turn @ np.diag(masses.sum() - masses) @ turn.T
    start = rotation_about(random.normal(size=3), random.uniform(0.3, 3))
    return cv.Scene(f"random {seed}", cv.RigidBody(inertia), start, 3 * w / np.linalg.norm(w), t_end)


def drifts(trajectory: cv.Trajectory) -> float:
    """Largest of the drifts of energy and world momentum, relative, and of the loss of orthonormality."""
    energy, momentum = trajectory.energy, trajectory.momentum_W
    size = np.linalg.norm(momentum[0])
    return max(
        float(np.ptp(energy) / energy[0]),
        float(np.abs(momentum - momentum[0]).max() / size),
        float(orthonormality(trajectory.R_WB).max()),
    )


@pytest.mark.parametrize("turn_per_step", [6.0, 1.45, 0.3, 0.01])
@pytest.mark.parametrize("name", FREE)
def test_exact_order_has_round_off_only_on_published_states(name: str, turn_per_step: float) -> None:
    """Steps turn the body by so many rad, or are the longest ones."""
    case = DATA[name]
    w0 = np.array([float(x) for x in case["w0"]])
    last = case["states"][-1]
    t_end = float(last["t"])
    start = from_quaternion([float(x) for x in case["q0"]])
    scene = cv.Scene(name, cv.RigidBody([float(x) for x in case["J"]]), start, w0, t_end)
    longest = cv.MoserVeselov().longest_step(scene)
    steps = int(np.ceil(t_end / min(longest, turn_per_step / np.linalg.norm(w0))))
    trajectory = cv.MoserVeselov().run(scene, t_end / steps)
    R, w = from_quaternion([float(x) for x in last["q"]]), np.array([float(x) for x in last["w"]])
    assert angle_between(R, trajectory.R_WB[-1]) < 5e-13  # measured 1.9e-13, brick and its flips at 1e-12 included
    assert np.abs(trajectory.w_WB_B[-1] - w).max() / np.linalg.norm(w) < 3e-13  # measured 1.2e-13
    assert drifts(trajectory) < 5e-15  # measured 1.5e-15


@pytest.mark.parametrize("longest", [1.49, 6.0])
@pytest.mark.parametrize("seed", range(8))
def test_exact_order_has_round_off_only_on_random_bodies(seed: int, longest: float) -> None:
    """Steps that turn the body by up to so many rad."""
    scene = random_free(seed)
    wanted = np.random.default_rng(seed).uniform(0.1, longest)
    steps = int(np.ceil(10 / min(wanted / 3, cv.MoserVeselov().longest_step(scene))))
    trajectory = cv.MoserVeselov().run(scene, 10 / steps)
    truth = Precise().run(scene, 10.0)
    assert angle_between(truth.R_WB[-1], trajectory.R_WB[-1]) < 1e-12  # measured 5e-14
    assert np.abs(truth.w_WB_B[-1] - trajectory.w_WB_B[-1]).max() < 1e-12  # measured 1.1e-13
    assert drifts(trajectory) < 5e-15  # measured 1.4e-15


def calibration(trajectory: cv.Trajectory, dt: float) -> np.ndarray:
    """K (n, 3) in principal axes that the DMV equations need for each step: c_i = K_i (h/2) (1 + |c|^2) (L0 + L1)_i / 2."""
    R_BP, L = trajectory.scene.body.R_BP, trajectory.scene.body.momentum(trajectory.w_WB_B)
    turned = np.swapaxes(trajectory.R_WB[:-1], 1, 2) @ trajectory.R_WB[1:]
    q = to_quaternion(R_BP.T @ turned @ R_BP)
    c = q[:, 1:] / q[:, :1]
    mean = (L[:-1] + L[1:]) / 2 @ R_BP
    return c / (dt / 2 * (1 + np.sum(c * c, axis=1))[:, None] * mean)


@pytest.mark.parametrize("order", [2, 4, 6, 8, 10, "exact"])
def test_every_step_obeys_the_discrete_moser_veselov_equations(order: int | str) -> None:
    scene, dt = random_free(3), 0.21
    K = calibration(cv.MoserVeselov(order).run(scene, dt), dt)
    over_J = 1 / scene.body.moments
    # The same K in every step, affine in 1/J: that is what css and cdd are.
    assert np.abs(K / K[0] - 1).max() < 1e-11  # measured 1.1e-13, where a component of the mean momentum is near 0
    gaps = np.diff(K[0]) / np.diff(over_J)
    assert gaps[0] == pytest.approx(gaps[1], rel=1e-11)  # measured 1e-13
    if order == 2:
        np.testing.assert_allclose(K[0], over_J, rtol=1e-12)  # measured 2e-14
    if order == "exact":
        assert abs(K[0, 0] / over_J[0] - 1) > 1e-3  # and the calibration is not empty


@pytest.mark.parametrize("order", [2, 4, 6, 8, 10])
def test_orders_observed(order: int) -> None:
    scene = random_free(1, t_end=8.0)
    truth = cv.MoserVeselov().run(scene, 0.05).R_WB[-1]
    steps = np.array({2: (128, 256, 512), 4: (96, 144, 216), 6: (64, 90, 128), 8: (56, 72, 96), 10: (48, 60, 75)}[order])
    errors = [float(angle_between(truth, cv.MoserVeselov(order).run(scene, 8 / n).R_WB[-1])) for n in steps]
    slope = np.polyfit(np.log(1 / steps), np.log(errors), 1)[0]
    assert abs(slope - order) < 0.3  # measured within 0.12


DEGENERATE = {
    "oblate": ((1, 1, 1.7), (0.4, -0.3, 2)),
    "prolate": ((1.7, 1, 1.7), (0.4, -0.3, 2)),
    "symmetric across": ((1, 1, 1.7), (0.4, -0.3, 0)),
    "prolate across": ((0.5, 1.7, 1.7), (0, -0.3, 1.1)),
    "nearly symmetric": ((1, 1 + 1e-12, 1.7), (0.4, -0.3, 2)),
    "spherical": ((1.3, 1.3, 1.3), (0.4, -0.3, 2)),
    "nearly spherical": ((1.3, 1.3 + 1e-14, 1.3), (0.4, -0.3, 2)),
    "about least": ((1, 2, 2.5), (2, 0, 0)),
    "about middle": ((1, 2, 2.5), (0, -2, 0)),
    "about most": ((1, 2, 2.5), (0, 0, -2)),
    "almost about most": ((1, 2, 2.5), (1e-9, 0, -2)),
    "planar": ((1, 2, 3), (0.5, 1.5, -1)),
    "needle": ((1.7231e-4, 6.58e-6, 1.7243e-4), (1.0, 2.0, 0.3)),
    "separatrix": ((2, 3, 6), (1.0, 2.0, 0.5)),
    "no body has it": ((1, 2, 5), (0.5, 1.5, -1)),
}


@pytest.mark.parametrize("order", [6, "exact"])
@pytest.mark.parametrize("kind", DEGENERATE)
def test_degenerate_bodies(kind: str, order: int | str) -> None:
    J, w = DEGENERATE[kind]
    if kind == "separatrix":  # L^2 = 2 E J2: w3^2 = w1^2 J1 (J2 - J1) / (J3 (J3 - J2))
        w = (w[0], w[1], w[0] * np.sqrt(J[0] * (J[1] - J[0]) / (J[2] * (J[2] - J[1]))))
    start = rotation_about((1, -2, 0.5), 0.9)
    scene = cv.Scene(kind, cv.RigidBody(J), start, w, 3.0)
    trajectory = cv.MoserVeselov(order).run(scene, 0.1)
    truth = Precise().run(scene, 3.0)
    bound = 1e-13 if order == "exact" else 1e-5  # measured 2.6e-15 and 9e-7
    assert angle_between(truth.R_WB[-1], trajectory.R_WB[-1]) < bound
    assert drifts(trajectory) < 5e-15  # measured 1.1e-15


def test_a_body_at_rest_stays_and_a_small_step_is_no_worse() -> None:
    rest = cv.MoserVeselov().run(cv.Scene("rest", cv.RigidBody((1, 2, 3)), rotation_about((1, 1, 0), 1), (0, 0, 0), 1.0), 0.1)
    assert np.abs(rest.R_WB - rest.R_WB[0]).max() == 0
    assert np.abs(rest.w_WB_B).max() == 0
    scene = random_free(2, t_end=1e-3)
    trajectory = cv.MoserVeselov().run(scene, 1e-7, sample_every=1000)
    coarse = cv.MoserVeselov().run(scene, 1e-3)
    assert angle_between(coarse.R_WB[-1], trajectory.R_WB[-1]) < 1e-13  # measured 4e-15


def test_nothing_drifts_in_a_million_steps() -> None:
    scene = random_free(4)
    trajectory = cv.MoserVeselov().run(scene, 0.4, t_end=4e5, sample_every=1000)
    assert drifts(trajectory) < 5e-15  # measured 2.1e-15: no more than in a hundred steps


def test_what_it_refuses() -> None:
    scene = cv.scenes.brick_flip()
    with pytest.raises(cv.BadInput, match=r"dt: got 0.15, .*expected a step with \|w\| dt < 1.5: below 0.149998 s"):
        cv.integrate(scene, 0.15, cv.MoserVeselov(6))
    with pytest.raises(cv.BadInput, match=r"dt: got 0.6, .*expected a step with \|w\| dt < 6 and shorter than half a period"):
        cv.integrate(scene, 0.6, cv.MoserVeselov())
    assert cv.integrate(scene, cv.MoserVeselov().longest_step(scene), cv.MoserVeselov()).ok
    with pytest.raises(cv.Unsupported, match="free bodies"):
        cv.integrate(cv.scenes.lagrange_top(), 0.01, cv.MoserVeselov())
    with pytest.raises(cv.BadInput, match=r"dt: got 0\.14, for which moser_veselov:order=2 has no step"):
        cv.integrate(scene, 0.14, cv.MoserVeselov(2))


SCENE = cv.Scene("one of many", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0.3, -1.0, 0.7), 30.0)
KINDS = (
    ((1, 1, 1.7), (0.4, -0.3, 2)),
    ((1.7, 1, 1.7), (0.4, -0.3, 0)),
    ((0.5, 1.7, 1.7), (0, -0.3, 1.1)),
    ((1, 1 + 1e-12, 1.7), (0.4, -0.3, 2)),
    ((1.3, 1.3, 1.3), (0.4, -0.3, 2)),
    ((1, 2, 2.5), (0, -2, 0)),
    ((1, 2, 2.5), (0, 0, 0)),
    ((1e-30, 2e-30, 2.5e-30), (1, 2, 0.3)),
    ((2, 3, 6), (1.0, 2.0, 1 / 3)),  # on the separatrix, where w3^2 = w1^2 J1 (J2 - J1) / (J3 (J3 - J2))
    ((2, 3, 6), (1.0, 2.0, 1 / 3 + 1e-9)),
)


def mixed(n: int) -> Batch:
    """Bodies of all kinds, in axes that are those of the body first and then turned, and random ones."""
    random = np.random.default_rng(14)
    masses = 10 ** random.uniform(-1, 0, (n, 3)) * 10.0 ** random.integers(-9, 9, (n, 1))
    moments, w, turned = masses.sum(axis=1, keepdims=True) - masses, random.normal(size=(n, 3)), np.empty((n, 3, 3))
    moments[: len(KINDS)], w[: len(KINDS)] = ([kind[part] for kind in KINDS] for part in (0, 1))
    for i in range(n):
        turned[i] = np.eye(3) if i < len(KINDS) else rotation_about(random.normal(size=3), 2.0)
    inertia = turned @ (moments[:, :, None] * turned.transpose(0, 2, 1))
    start = np.array([rotation_about(random.normal(size=3), random.uniform(0, 3)) for _ in range(n)])
    return Batch(SCENE, start, w, (inertia + inertia.transpose(0, 2, 1)) / 2, {})


def run(bodies: Batch, dt: float = 0.3, order: int | str = "exact", steps: int = 40, every: int = 7) -> Block:
    """The block of a run in lanes."""
    found = cv.MoserVeselov(order).prepare_many(bodies, cv.Grid(dt, steps, every))
    assert found is not None
    return found()


@pytest.mark.parametrize(("order", "dt"), [("exact", 0.3), (6, 0.1)])
def test_many_are_those_of_one_at_a_time(order: int | str, dt: float) -> None:
    """21 bodies: two lanes of eight, and five in the third."""
    bodies = mixed(21)
    block = run(bodies, dt, order)
    assert block.finished.all()
    for i in range(len(bodies)):
        alone = cv.MoserVeselov(order).solve(bodies.take(i), cv.Grid(dt, 40, 7))
        np.testing.assert_allclose(block.R_WB[i], alone.R_WB, rtol=0, atol=1e-14, err_msg=str(i))  # measured 9e-16
        np.testing.assert_allclose(block.w_WB_B[i], alone.w_WB_B, rtol=0, atol=1e-14, err_msg=str(i))


def test_one_inertia_is_for_all() -> None:
    bodies = mixed(11)
    turn = rotation_about((3, -1, 2), 1.3)
    inertia = turn @ np.diag([1.0, 1.4, 2.0]) @ turn.T
    shared = cv.Scene("turned", cv.RigidBody(inertia), np.eye(3), (0, 0, 1), 1.0)
    found = run(Batch(shared, bodies.R_WB0, bodies.w_WB_B0, None, {}))
    wanted = run(Batch(SCENE, bodies.R_WB0, bodies.w_WB_B0, np.tile(shared.body.inertia, (11, 1, 1)), {}))
    np.testing.assert_allclose(found.R_WB, wanted.R_WB, rtol=0, atol=1e-14)  # measured 2e-15: axes of two eigensolvers


def test_a_body_does_not_depend_on_its_neighbours() -> None:
    """Not even in its last bit: neighbours that rest, are on the separatrix, too fast or nothing at all, and other places."""
    bodies = mixed(240)
    block, w, inertia = run(bodies, 1.2, steps=9), bodies.w_WB_B0.copy(), bodies.inertia.copy()
    w[1::8], w[3::8], w[5::8], w[7] = 0.0, 50.0, w[9], np.nan
    inertia[5::8] = inertia[9]
    other, moved = run(Batch(SCENE, bodies.R_WB0, w, inertia, {}), 1.2, steps=9), run(bodies[5:], 1.2, steps=9)
    np.testing.assert_array_equal(other.R_WB[::2], block.R_WB[::2])
    np.testing.assert_array_equal(other.w_WB_B[::2], block.w_WB_B[::2])
    np.testing.assert_array_equal(moved.R_WB, block.R_WB[5:])
    assert other.finished[::2].all()
    assert not other.finished[3::8].any()
    assert not other.finished[7]


def test_who_has_no_step_is_left_alone() -> None:
    bodies = mixed(12)
    w = bodies.w_WB_B0 / np.maximum(np.linalg.norm(bodies.w_WB_B0, axis=1, keepdims=True), 1e-9)
    still, slow, fast = np.zeros(3), 1e-70 * w[10], 21.0 * w[11]
    some = Batch(SCENE, bodies.R_WB0[9:12], np.array([still, slow, fast]), bodies.inertia[9:12], {})
    assert run(some).finished.tolist() == [True, False, False]
    if COMPILED:  # in plain Python, the root of a negative number leaves all to be run alone
        assert run(some, order=4).finished.tolist() == [True, False, False]
    assert run(Batch(SCENE, bodies.R_WB0[:6], 4.9 * w[:6], bodies.inertia[:6], {}), order=4).finished.tolist() == [True] * 6


def test_pieces_and_repetitions_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies, grid = mixed(21)[5:14], cv.Grid(0.3, 40, 7)
    again = cv.MoserVeselov().prepare_many(bodies, grid)
    assert again is not None
    whole = again()
    monkeypatch.setattr(columns, "PIECE", 0.0)  # a piece is a step
    for block in (again(), again()):
        np.testing.assert_array_equal(block.R_WB, whole.R_WB)
        np.testing.assert_array_equal(block.w_WB_B, whole.w_WB_B)


TURN = Rotation.from_rotvec((0.3, -0.5, 0.8)).as_matrix()


@pytest.mark.parametrize("apart", [1e-15, 3e-14, 1e-13, -9e-13, 1e-11, -1e-8])
def test_exact_steps_of_a_nearly_symmetric_body_are_ok(apart):
    body = cv.RigidBody(TURN @ np.diag((1.7, 1.7 * (1 + apart), 1.6)) @ TURN.T)
    scene = cv.Scene("nearly symmetric", body, TURN.T, (3, 4, 0.5), 10.0)
    assert cv.integrate(scene, 0.1, cv.MoserVeselov()).outcome.ok  # momentum about the axis is off by up to 1e-11
