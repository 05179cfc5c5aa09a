import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, orthonormality, rotation_about
from conservative.invariants import energy, momentum_W
from conservative.references.exact.method import free_body

from .exact_trials import FREE_BOUND, Trial, draw_free

R0 = rotation_about((0.3, -1, 0.4), 2.1)
CASES = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]
FREE = ["brick_flip", "brick_flip_1e-6", "brick_flip_1e-12", "hairer_vilmart", "gazebo_box"]


@settings(max_examples=8, deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.sampled_from([None, 1e-6, 1e-9, 1e-12]))
def test_agrees_with_multi_precision_on_random_bodies(seed, separatrix):
    attitude, rates = draw_free(np.random.default_rng(seed), separatrix).errors()
    assert attitude < FREE_BOUND  # measured 1.4e-15 over the 1,000 cases of the study; the bound is 1e-13
    assert rates < FREE_BOUND  # measured 8e-16


def numbers(texts):
    return np.array([float(x) for x in texts])


@pytest.mark.parametrize("name", FREE)
def test_agrees_with_the_published_states(name):
    case = CASES[name]
    t = numbers([state["t"] for state in case["states"]])
    R, w = free_body(cv.RigidBody(numbers(case["J"])), from_quaternion(numbers(case["q0"])), numbers(case["w0"]), t)
    # measured 6e-16, but where rates or moments of the file are rounded to doubles: 1.6e-14 (gazebo_box)
    assert angle_between(from_quaternion([numbers(state["q"]) for state in case["states"]]), R).max() < 5e-14
    np.testing.assert_allclose(w, [numbers(state["w"]) for state in case["states"]], rtol=0, atol=5e-14 * np.abs(w).max())


@pytest.mark.parametrize(
    ("disturbance", "interval"), [(0.05, 2.723121), (1e-3, 4.351845), (1e-6, 7.227773), (1e-9, 10.103701), (1e-12, 12.979629)]
)
def test_the_brick_reverses_when_it_should(disturbance, interval):
    t = np.linspace(0, 25, 250_001)
    w3 = free_body(cv.RigidBody((13, 5, 10)), R0, (0, disturbance, 10), t)[1][:, 2]
    before = np.flatnonzero(np.diff(np.sign(w3)))
    crossings = t[before] - w3[before] * np.diff(t)[before] / np.diff(w3)[before]
    assert np.diff(crossings)[0] == pytest.approx(interval, abs=6e-7)  # the figures end there


# 4 (5 - 4) 3^2 = 9 (9 - 5) 1^2: on the separatrix exactly, in doubles too
SEPARATRIX = cv.RigidBody((4, 5, 9)), (3, 0.7, 1)


def test_the_separatrix_itself():
    body, w0 = SEPARATRIX
    t = np.array([-50.0, -1.0, 0.0, 0.4, 2.0, 9.0])
    case = Trial(body, None, R0, np.array(w0, dtype=float), t[t > 0])
    attitude, rates = case.errors()
    assert attitude < 1e-14  # measured 7e-16
    assert rates < 1e-14  # measured 3e-16
    w = free_body(body, R0, w0, [*t, 1e3, 1e9])[1]
    size = np.sqrt((9 * 4 + 0.7**2 * 5 + 9) / 5)  # 2 T = J2 size^2: the unstable spin that it starts from and ends in
    np.testing.assert_allclose(w[[0, -2, -1]], [[0, -size, 0], [0, size, 0], [0, size, 0]], atol=1e-14 * size)


def test_a_symmetric_body_precesses_as_the_elementary_formula_says():
    J1, J3, w0 = 0.7, 1.9, np.array([0.4, -0.3, 1.1])
    R_BP = rotation_about((1, 2, -1), 0.9)
    body = cv.RigidBody(R_BP @ np.diag([J1, J1, J3]) @ R_BP.T)
    L = np.array([J1, J1, J3]) * w0
    t = np.linspace(-3, 40, 11)
    R, w = free_body(body, R0, R_BP @ w0, t)
    for time, R_now, w_now in zip(t, R, w, strict=True):
        slow = rotation_about(R0 @ R_BP @ L, np.linalg.norm(L) / J1 * time)
        spin = rotation_about((0, 0, 1), (1 / J3 - 1 / J1) * L[2] * time)
        assert angle_between(slow @ R0 @ R_BP @ spin @ R_BP.T, R_now) < 1e-13  # measured 2.1e-14: 100 rad, rounded here
        np.testing.assert_allclose(w_now, R_BP @ spin.T @ w0, atol=1e-13)


@pytest.mark.parametrize(
    ("moments", "w0"),
    [((2, 2, 2), (1, -2, 0.5)), ((1, 2, 3), (0, 4, 0)), ((1, 2, 3), (0, 0, 0)), ((1, 3, 3), (0, 1, 2)), ((3, 1, 1), (2, 0, 0))],
)
def test_steady_turns_and_rest(moments, w0):
    t = np.array([0, 0.7, -3, 1e3])
    R, w = free_body(cv.RigidBody(moments), R0, w0, t)
    speed = np.linalg.norm(w0)
    expected = [R0 @ rotation_about(w0 if speed else (1, 0, 0), speed * time) for time in t]
    assert angle_between(expected, R).max() < 1e-12  # measured 1.1e-13: `speed * time` at 2,300 rad is rounded here
    np.testing.assert_array_equal(w, np.tile(np.asarray(w0, dtype=float), (4, 1)))


def test_it_is_periodic_and_conserves_at_any_time():
    body = cv.RigidBody([[2.1, 0.3, -0.2], [0.3, 1.4, 0.1], [-0.2, 0.1, 3.0]])
    t = np.array([0, 1, 1e3, 1e6, 1e9, -1e12])
    R, w = free_body(body, R0, (0.4, 1.2, -0.9), t)
    assert orthonormality(R).max() < 4e-15  # measured 9e-16
    E, L = energy(body, None, R, w, np.zeros(len(R))), momentum_W(body, R, w)
    assert np.ptp(E) < 1e-14 * E[0]  # measured 9e-16
    assert np.abs(L - L[0]).max() < 1e-14 * np.linalg.norm(L[0])  # measured 8e-16


def test_going_on_from_a_state_is_the_same_motion():
    body = cv.RigidBody([[2.1, 0.3, -0.2], [0.3, 1.4, 0.1], [-0.2, 0.1, 3.0]])
    R, w = free_body(body, R0, (0.4, 1.2, -0.9), [3.0, 8.0])
    R_on, w_on = free_body(body, R[0], w[0], [5.0, -3.0])
    assert angle_between([R[1], R0], R_on).max() < 2e-14  # measured 2e-15
    np.testing.assert_allclose(w_on, [w[1], (0.4, 1.2, -0.9)], atol=2e-14)


def test_a_turned_body_frame_tells_the_same_motion():
    F = rotation_about((1, -2, 0.5), 1.3)
    J, w0, t = np.diag([13.0, 5, 10]), np.array([0.1, 0.05, 10]), np.linspace(0, 2, 5)
    R, w = free_body(cv.RigidBody(J), R0, w0, t)
    R_turned, w_turned = free_body(cv.RigidBody(F @ J @ F.T), R0 @ F.T, F @ w0, t)
    assert angle_between(R, R_turned @ F).max() < 1e-13  # measured 5e-15: the same bodies but for rounding of the tensor
    np.testing.assert_allclose(w_turned @ F, w, atol=1e-12)


def test_shapes_follow_those_of_the_times():
    body = cv.RigidBody((1, 2, 2.5))
    for t in (0.5, [], [0.1, 0.2], [[0.1, 0.2, 0.3]]):
        R, w = free_body(body, R0, (1, 2, 3), t)
        assert R.shape == (*np.shape(t), 3, 3)
        assert w.shape == (*np.shape(t), 3)


@pytest.mark.parametrize(
    ("argument", "changes"),
    [
        ("body", {"body": (1, 2, 3)}),
        ("R_WB0", {"R_WB0": np.ones((3, 3))}),
        ("R_WB0", {"R_WB0": -np.eye(3)}),
        ("w_WB_B0", {"w_WB_B0": (1, 2)}),
        ("w_WB_B0", {"w_WB_B0": (1, 2, np.inf)}),
        ("t", {"t": [0, np.nan]}),
        ("t", {"t": [[1], [1, 2]]}),
        ("t", {"t": "soon"}),
    ],
)
def test_bad_input_is_named(argument, changes):
    good = {"body": cv.RigidBody((1, 2, 2.5)), "R_WB0": R0, "w_WB_B0": (1, 2, 3), "t": [1.0]}
    with pytest.raises(cv.BadInput, match=f"^{argument}: got .*; allowed: ") as caught:
        free_body(**{**good, **changes})
    assert caught.value.argument == argument
