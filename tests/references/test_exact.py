"""Closed forms of free bodies and tops: against multi-precision, published states, elementary motions and mpmath."""

import json
from pathlib import Path

import mpmath
import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, orthonormality, rotation_about
from conservative.errors import BadInput
from conservative.grid import Grid
from conservative.invariants import energy, momentum_W
from conservative.references.exact.digits import Phase, mp, rotation_phase
from conservative.references.exact.method import Exact, free_body, lagrange_top
from conservative.references.exact.theta import Lattice, Points, jacobi

from ..bodies import impossible_body
from ..sampling import sampled
from .exact_trials import FREE_BOUND, TOP_BOUND, Trial, draw_free, draw_top

R0 = rotation_about((0.3, -1, 0.4), 2.1)
CASES = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]


SPECIAL = list(enumerate([None, 1e-6, 1e-9, 1e-12]))
"""Seeds, and distances to the separatrix of a free body or to the pole of a top. `--attack` draws thousands."""


@pytest.mark.parametrize(("seed", "separatrix"), SPECIAL)
def test_agrees_with_multi_precision_on_random_bodies(seed, separatrix):
    attitude, rates = draw_free(np.random.default_rng(seed), separatrix).errors()
    assert attitude < FREE_BOUND  # measured 1.4e-15 over the 1,000 cases of the study; the bound is 1e-13
    assert rates < FREE_BOUND  # measured 8e-16


def numbers(texts):
    return np.array([float(x) for x in texts])


def solve(body, field, R_WB0, w_WB_B0, t):
    return free_body(body, R_WB0, w_WB_B0, t) if field is None else lagrange_top(body, field, R_WB0, w_WB_B0, t)


@pytest.mark.parametrize(
    ("name", "bound"),
    [
        *((name, 5e-14) for name in ("brick_flip", "brick_flip_1e-6", "brick_flip_1e-12", "hairer_vilmart", "gazebo_box")),
        *((name, 2e-13) for name in ("lagrange_top_steady", "heavy_top_lie_group", "sleeping_type_top")),
    ],
)
def test_agrees_with_the_published_states(name, bound):
    case = CASES[name]
    t, body = numbers([state["t"] for state in case["states"]]), cv.RigidBody(numbers(case["J"]))
    field = cv.UniformGravity(1.0, numbers(case["weight_com_B"])) if bound == 2e-13 else None
    start = from_quaternion(numbers(case["q0"])), numbers(case["w0"])
    R, w = solve(body, field, *start, t)
    # The file's decimals are rounded to doubles: relative 1e-16 of a rate, times up to 500 rad. Measured for free bodies 6e-16,
    # but 1.6e-14 (gazebo_box).
    assert angle_between(from_quaternion([numbers(state["q"]) for state in case["states"]]), R).max() < bound
    np.testing.assert_allclose(w, [numbers(state["w"]) for state in case["states"]], rtol=0, atol=bound * np.abs(w).max())


FREE_AND_TOP = pytest.mark.parametrize(
    ("body", "field", "w0"),
    [
        (cv.RigidBody([[2.1, 0.3, -0.2], [0.3, 1.4, 0.1], [-0.2, 0.1, 3.0]]), None, (0.4, 1.2, -0.9)),
        (cv.RigidBody((1.1, 1.1, 0.4)), cv.UniformGravity(3.0, (0, 0, 0.7)), (0.3, -0.8, 4.0)),
    ],
    ids=["free", "top"],
)


@FREE_AND_TOP
def test_a_motion_continues_from_any_of_its_states(body, field, w0):
    R, w = solve(body, field, R0, w0, [3.0, 8.0])
    R_on, w_on = solve(body, field, R[0], w[0], [5.0, -3.0])
    assert angle_between([R[1], R0], R_on).max() < 5e-14  # measured 6e-15
    np.testing.assert_allclose(w_on, [w[1], w0], atol=5e-14)


REVERSALS = [(0.05, 2.723121), (1e-3, 4.351845), (1e-6, 7.227773), (1e-9, 10.103701), (1e-12, 12.979629)]


@pytest.mark.parametrize(("disturbance", "interval"), sampled(REVERSALS, 2, [REVERSALS[0], REVERSALS[-1]]))
def test_the_brick_reverses_at_the_published_times(disturbance, interval):
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
    body = impossible_body(R_BP @ np.diag([J1, J1, J3]) @ R_BP.T)
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
    R, w = free_body(impossible_body(moments), R0, w0, t)
    speed = np.linalg.norm(w0)
    expected = [R0 @ rotation_about(w0 if speed else (1, 0, 0), speed * time) for time in t]
    assert angle_between(expected, R).max() < 1e-12  # measured 1.1e-13: `speed * time` at 2,300 rad is rounded here
    np.testing.assert_array_equal(w, np.tile(np.asarray(w0, dtype=float), (4, 1)))


@FREE_AND_TOP
def test_invariants_hold_at_any_time(body, field, w0):
    t = np.array([0, 1, 1e3, 1e6, 1e9, -1e12])
    R, w = solve(body, field, R0, w0, t)
    E, L = energy(body, field, R, w, np.zeros(len(R))), momentum_W(body, R, w)
    assert orthonormality(R).max() < 4e-15  # measured 9e-16
    assert np.ptp(E) < 1e-14 * np.abs(E).max()  # measured 1.1e-15
    assert np.abs((L - L[0])[:, 0 if field is None else 2 :]).max() < 1e-14 * np.abs(L).max()  # measured 8e-16


def test_results_have_the_shape_of_the_times():
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
def test_bad_input(argument, changes):
    good = {"body": cv.RigidBody((1, 2, 2.5)), "R_WB0": R0, "w_WB_B0": (1, 2, 3), "t": [1.0]}
    with pytest.raises(cv.BadInput, match=f"^{argument}: got .*; expected ") as caught:
        free_body(**{**good, **changes})
    assert caught.value.argument == argument


@pytest.mark.parametrize(("seed", "pole"), SPECIAL)
def test_agrees_with_multi_precision_on_random_tops(seed, pole):
    case = draw_top(np.random.default_rng(seed), pole)
    attitude, rates = case.errors()
    assert attitude < TOP_BOUND  # measured 1.2e-13 over the 1,000 tops of the study
    assert rates < TOP_BOUND  # measured 8.4e-14


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


def test_an_asymmetric_body_has_no_closed_form():
    with pytest.raises(cv.Unsupported, match=r"potential: got .*symmetric"):
        lagrange_top(cv.RigidBody((1, 2, 2.5)), cv.UniformGravity(1, (0, 0, 1)), R0, (1, 2, 3), [1.0])
    with pytest.raises(cv.BadInput, match=r"^potential: got None; expected a UniformGravity"):
        lagrange_top(cv.RigidBody((1, 2, 2.5)), None, R0, (1, 2, 3), [1.0])


def test_the_method_supports_free_bodies_tops_and_pendulums_only():
    method = Exact()
    assert registry.method("exact") == method
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


@pytest.mark.parametrize("m", [0.0, 0.3, 0.4999, 0.5001, 0.97, 1 - 1e-9])
def test_jacobi_functions_equal_those_of_mpmath(m):
    lattice = Lattice.of(mp.mpf(m), 1 - mp.mpf(m))
    v = np.linspace(-1, 1, 41) * float(lattice.K)
    points = Points(lattice, v)
    with mpmath.workdps(40):
        for name, function in zip(("sn", "cn", "dn"), jacobi(lattice), strict=True):
            known = np.array([float(mpmath.ellipfun(name, x, m=m)) for x in v])
            assert np.abs(points.quotient(function).real - known).max() < 4e-15  # measured 1.2e-15


@pytest.mark.parametrize("period", [2 * mp.pi, mp.mpf("61.7"), mp.mpf("1e-3")])
def test_a_phase_keeps_its_digits_at_late_times(period):
    clock = Phase(mp.mpf(1) / 3, mp.sqrt(2), period)
    t = np.array([0.0, -3.3, 1e3 + 0.1, 1e9 + 0.3, -1e12 - 0.7, 123456789012345.6])
    phase, odd = clock.reduce(t)
    for time, reduced, parity in zip(t, phase, odd, strict=True):
        off = (clock.start + clock.rate * mp.mpf(float(time)) - mp.mpf(float(reduced))) / period
        assert abs(off - mp.nint(off)) < 4e-16  # measured 1.1e-16
        assert int(mp.nint(off)) % 2 == parity
        assert abs(reduced) < 0.5000001 * period
    if period == 2 * mp.pi:
        turned = rotation_phase(clock.start, clock.rate).phasor(t)
        np.testing.assert_allclose(turned, np.exp(1j * phase), rtol=1e-15)


def test_a_phase_refuses_times_beyond_its_digits():
    clock = rotation_phase(mp.mpf(0), mp.mpf(1))
    clock.reduce(np.array([7e18]))
    with pytest.raises(BadInput, match=r"t: got .* periods; expected times of up to 2\^60 periods, 7.24e\+18 s"):
        clock.reduce(np.array([0.0, -7.3e18]))
