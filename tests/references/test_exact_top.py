import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import conservative as cv
from conservative.attitude import angle_between, from_quaternion, orthonormality, rotation_about
from conservative.invariants import energy, momentum_W
from conservative.method import Grid
from conservative.references.exact.method import Exact, lagrange_top

from .exact_trials import TOP_BOUND, Trial, draw_top

R0 = rotation_about((0.3, -1, 0.4), 2.1)
CASES = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]


@settings(max_examples=8, deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.sampled_from([None, 1e-6, 1e-9, 1e-12]))
def test_agrees_with_multi_precision_on_random_tops(seed, pole):
    case = draw_top(np.random.default_rng(seed), pole)
    attitude, rates = case.errors()
    assert attitude < TOP_BOUND  # measured 1.2e-13 over the 1,000 tops of the study
    assert rates < TOP_BOUND  # measured 8.4e-14


def numbers(texts):
    return np.array([float(x) for x in texts])


@pytest.mark.parametrize(
    ("name", "bound"), [("lagrange_top_steady", 2e-13), ("heavy_top_lie_group", 2e-13), ("sleeping_type_top", 2e-13)]
)
def test_agrees_with_the_published_states(name, bound):
    case = CASES[name]
    t = numbers([state["t"] for state in case["states"]])
    body, field = cv.RigidBody(numbers(case["J"])), cv.UniformGravity(1.0, numbers(case["weight_com_B"]))
    R, w = lagrange_top(body, field, from_quaternion(numbers(case["q0"])), numbers(case["w0"]), t)
    # The file's decimals are rounded to doubles: relative 1e-16 of a rate, times up to 500 rad.
    assert angle_between(from_quaternion([numbers(state["q"]) for state in case["states"]]), R).max() < bound
    np.testing.assert_allclose(w, [numbers(state["w"]) for state in case["states"]], rtol=0, atol=bound * np.abs(w).max())


UP, TILTED, DOWN = np.eye(3), rotation_about((1, 2, 0), 1.0), np.diag([1.0, -1, -1])
STARTS = {
    "centre of mass below the pivot": ((2, 2, 0.7), (0, 0, -1.3), R0, (1, 2, 3)),
    "axis 1 is that of symmetry": ((0.7, 2, 2), (1.3, 0, 0), R0, (1, 2, 3)),
    "slow": ((2, 2, 0.7), (0, 0, 13), R0, (0.1, 0.2, 0.3)),
    "no spin": ((2, 2, 0.7), (0, 0, 1.3), R0, (1, 2, 0)),
    "released from rest": ((2, 2, 0.7), (0, 0, 1.3), R0, (0, 0, 0)),
    "cusps": ((2, 2, 0.7), (0, 0, 1.3), TILTED, (0, 0, 9)),
    "kicked from upright": ((2, 2, 0.7), (0, 0, 1.3), UP, (1, 0.3, 3)),
    "kicked from hanging": ((2, 2, 0.7), (0, 0, 1.3), DOWN, (1, 0.5, 3)),
    "pendulum over the top": ((2, 2, 0.7), (0, 0, 1.3), DOWN, (1.3, 1.1, 0)),
    "pendulum": ((2, 2, 0.7), (0, 0, 1.3), DOWN, (0.3, 0.1, 0)),
    "pendulum on its separatrix": ((2, 2, 1), (0, 0, 2), [[1, 0, 0], [0, 0, -1], [0, 1, 0]], (1, 1, 0)),
    "awake by 1e-6": ((5, 5, 1), (0, 0, 20), rotation_about((1, 0, 0), 1e-6), (0, 0, 50)),
    "falling from 1e-6": ((5, 5, 1), (0, 0, 20), rotation_about((1, 0, 0), 1e-6), (0, 0, 15)),
    "falling from 1e-12": ((5, 5, 1), (0, 0, 20), rotation_about((1, 0.2, 0), 1e-12), (0, 0, 5)),
    "asleep": ((5, 5, 1), (0, 0, 20), UP, (0, 0, 50)),
    "standing": ((5, 5, 1), (0, 0, 20), UP, (0, 0, 0)),
    "a sphere off its centre": ((2, 2, 2), (0.3, 0.4, 1), R0, (1, 2, 3)),
    "no weight": ((1, 2, 2.5), (0, 0, 0), R0, (1, 2, 3)),
}


@pytest.mark.parametrize("name", STARTS)
def test_special_starts_agree_with_multi_precision(name):
    moments, moment, R, w0 = STARTS[name]
    body, field = cv.RigidBody(moments), cv.UniformGravity(1.0, moment)
    case = Trial(body, field, np.array(R, dtype=float), np.array(w0, dtype=float), np.array([0.3, 2.0, 8.0]))
    attitude, rates = case.errors()
    assert attitude < 2e-14  # measured 1.2e-15 at most
    assert rates < 2e-14  # measured 1.3e-15 at most


def test_steady_precession_is_the_elementary_motion():
    scene = cv.scenes.lagrange_top()
    t = np.linspace(0, 2, 9)
    R, _ = lagrange_top(scene.body, scene.potential, scene.R_WB0, scene.w_WB_B0, t)
    spin = scene.w_WB_B0[2] - 10 * math.cos(math.pi / 3)
    expected = [rotation_about((0, 0, 1), 10 * s) @ scene.R_WB0 @ rotation_about((0, 0, 1), spin * s) for s in t]
    # The scene's rates make it steady but for rounding, over 270 rad.
    assert angle_between(expected, R).max() < 1e-12  # measured 1e-13


def test_the_lie_group_top_passes_next_to_straight_down():
    # (1 + cos theta) = 2.6e-13 there: where Euler's angles, or a root taken by subtraction, lose everything
    case = CASES["heavy_top_lie_group"]
    body, field = cv.RigidBody(numbers(case["J"])), cv.UniformGravity(1.0, numbers(case["weight_com_B"]))
    # Tilts from the vertical, sampled finely: the smallest is 7e-7 rad
    t = np.linspace(0, 2, 400_001)
    R, w = lagrange_top(body, field, np.eye(3), numbers(case["w0"]), t)
    tilt = np.hypot(R[:, 0, 1], R[:, 1, 1])
    assert tilt.min() < 1e-4
    E = energy(body, field, R, w, np.zeros(len(R)))
    assert np.ptp(E) < 1e-13 * np.abs(E).max()  # measured 6e-15
    assert orthonormality(R).max() < 4e-15


def test_invariants_hold_at_any_time():
    body, field = cv.RigidBody((1.1, 1.1, 0.4)), cv.UniformGravity(3.0, (0, 0, 0.7))
    t = np.array([0, 1, 1e3, 1e6, 1e9, -1e12])
    R, w = lagrange_top(body, field, R0, (0.3, -0.8, 4.0), t)
    E, L = energy(body, field, R, w, np.zeros(len(R))), momentum_W(body, R, w)
    assert np.ptp(E) < 1e-14 * np.abs(E).max()  # measured 1.1e-15
    assert np.ptp(L[:, 2]) < 1e-14 * np.abs(L).max()  # measured 5e-16
    np.testing.assert_array_equal(w[:, 2], 4.0)
    assert orthonormality(R).max() < 4e-15


def test_going_on_from_a_state_is_the_same_motion():
    body, field = cv.RigidBody((1.1, 1.1, 0.4)), cv.UniformGravity(3.0, (0, 0, 0.7))
    R, w = lagrange_top(body, field, R0, (0.3, -0.8, 4.0), [3.0, 8.0])
    R_on, w_on = lagrange_top(body, field, R[0], w[0], [5.0, -3.0])
    assert angle_between([R[1], R0], R_on).max() < 5e-14  # measured 6e-15
    np.testing.assert_allclose(w_on, [w[1], (0.3, -0.8, 4.0)], atol=5e-14)


def test_an_asymmetric_body_has_no_closed_form():
    with pytest.raises(cv.Unsupported, match=r"potential: got .*symmetric"):
        lagrange_top(cv.RigidBody((1, 2, 2.5)), cv.UniformGravity(1, (0, 0, 1)), R0, (1, 2, 3), [1.0])
    with pytest.raises(cv.BadInput, match=r"^potential: got None; allowed: a UniformGravity"):
        lagrange_top(cv.RigidBody((1, 2, 2.5)), None, R0, (1, 2, 3), [1.0])


def test_the_method_does_free_bodies_tops_and_pendulums_and_nothing_else():
    method = Exact()
    assert cv.registry.method("exact") == method if hasattr(cv, "registry") else True
    pendulum = cv.Scene("p", cv.RigidBody((1.3, 0.9, 0.7)), np.eye(3), (2.0, 0, 0), 3.0, cv.UniformGravity(8, (0, 0.1, -0.4)))
    for scene in (cv.scenes.brick_flip(), cv.scenes.lagrange_top(), pendulum):
        trajectory = cv.integrate(scene, dt=scene.t_end / 7, method=method)
        assert trajectory.ok
        assert len(trajectory) == 8
    heavy = cv.Scene("h", cv.RigidBody((1.3, 0.9, 0.7)), R0, (2.0, 0, 0), 3.0, cv.UniformGravity(8, (0, 0.1, -0.4)))
    with pytest.raises(cv.Unsupported, match="symmetric"):
        cv.integrate(heavy, method=method)


def test_a_compound_pendulum_agrees_with_multi_precision():
    from conservative.references.precise import Precise

    scene = cv.Scene("p", cv.RigidBody((1.3, 0.9, 0.7)), np.eye(3), (2.0, 0, 0), 4.0, cv.UniformGravity(8, (0, 0.1, -0.4)))
    grid = Grid(0.5, 8)
    ours, true = (method.prepare(scene, grid)() for method in (Exact(), Precise()))
    assert angle_between(true.R_WB, ours.R_WB).max() < 1e-14  # measured 7e-16
    np.testing.assert_allclose(ours.w_WB_B, true.w_WB_B, atol=1e-14)
