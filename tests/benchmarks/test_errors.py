"""Errors and drifts of planted deviations, their slopes, and the number of flips."""

import math

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.measures.errors import blanks, count_turns_over, measure_drifts, measure_errors, secular_slope
from conservative.errors import BadInput
from conservative.references.exact.method import Exact
from conservative.trajectory import Trajectory

from .generic_study import START, TURN

INERTIA = TURN @ np.diag([1.7, 0.9, 2.3]) @ TURN.T
RATES = np.array([0.7, -1.3, 2.1])
FREE = cv.Scene("free", cv.RigidBody(INERTIA), START, RATES, 2.0)
HEAVY = cv.Scene("heavy", cv.RigidBody(INERTIA), START, RATES, 2.0, cv.UniformGravity(3.3, (0.2, -0.1, 0.4)))


@pytest.fixture(params=[FREE, HEAVY], ids=lambda scene: scene.name)
def exact(request):
    """A fine run that stands for the reference solution: only differences from it are used."""
    return cv.integrate(request.param, dt=0.01, sample_every=4)


def values(trajectory, truth):
    return {value.key: value.value for value in measure_errors(trajectory, truth)}


def changed(trajectory, R_WB=None, w_WB_B=None):
    R = trajectory.R_WB if R_WB is None else R_WB
    w = trajectory.w_WB_B if w_WB_B is None else w_WB_B
    return Trajectory(trajectory.scene, trajectory.t, R, w, "changed")


def test_a_trajectory_has_no_error_against_itself(exact):
    measured = values(exact, exact)
    assert all(measured[name] == 0 for name in measured if "error" in name)
    assert measured["energy drift max"] < 1e-14  # measured 6e-16 and 8e-16


def test_a_planted_turn_is_the_attitude_error(exact):
    angles = 1e-9 * (1 + np.arange(len(exact)))
    planted = changed(exact, np.array([R @ rotation_about((1, 2, 3), a) for R, a in zip(exact.R_WB, angles, strict=True)]))
    measured = values(planted, exact)
    assert measured["attitude error max"] == pytest.approx(
        angles[-1], rel=1e-6
    )  # measured 8e-10: round-off of R over the angle
    assert measured["attitude error final"] == measured["attitude error max"]
    assert measured["attitude error rms"] == pytest.approx(np.sqrt(np.mean(angles**2)), rel=1e-6)
    assert measured["orthonormality max"] < 1e-14  # measured 1.3e-15


def test_the_position_error_is_the_distance_of_the_centres_of_mass():
    exact = cv.integrate(HEAVY, dt=0.01)
    turn = rotation_about((0, 0, 1), math.pi)
    measured = values(changed(exact, turn @ exact.R_WB), exact)
    horizontal = np.linalg.norm((exact.R_WB @ HEAVY.potential.com_B)[:, :2], axis=1)
    assert measured["position error max"] == pytest.approx(2 * horizontal.max(), rel=1e-12)
    assert measured["position error final"] == pytest.approx(2 * horizontal[-1], rel=1e-12)


def test_rate_error_is_relative_to_the_largest_exact_rate(exact):
    off = np.array([0.0, 3e-4, 4e-4])
    measured = values(changed(exact, w_WB_B=exact.w_WB_B + off), exact)
    largest = np.linalg.norm(exact.w_WB_B, axis=1).max()
    assert measured["rate error max"] == pytest.approx(5e-4 / largest, rel=1e-9)
    assert measured["rate error final"] == pytest.approx(5e-4 / largest, rel=1e-9)


def test_a_planted_gain_of_energy_is_its_drift_and_slope():
    exact = cv.integrate(FREE, dt=0.01)
    gain = 3e-5
    measured = values(changed(exact, w_WB_B=exact.w_WB_B * np.sqrt(1 + gain * exact.t)[:, None]), exact)
    assert measured["energy drift final"] == pytest.approx(gain * 2.0, rel=1e-9)  # the free body's scale is its energy
    assert measured["energy drift max"] == measured["energy drift final"]
    assert measured["energy drift slope"] == pytest.approx(gain, rel=1e-9)
    assert measured["energy drift slope stderr"] < 1e-9 * gain  # measured 1e-12 of it
    assert measured["momentum drift final"] == pytest.approx(np.sqrt(1 + gain * 2.0) - 1, rel=1e-9)
    assert measured["momentum drift slope"] == pytest.approx(gain / 2, rel=1e-3)  # measured 1.5e-5 off: the root bends it


def test_a_start_that_a_method_spoilt_is_a_drift():
    exact = cv.integrate(FREE, dt=0.01)
    drift = values(changed(exact, w_WB_B=exact.w_WB_B * (1 + 1e-6)), exact)["energy drift max"]
    assert drift == pytest.approx(2e-6, rel=1e-5)


def test_energy_at_zero_has_a_scale():
    """A body hung level at rest has no kinetic and no potential energy."""
    scene = cv.Scene("level", cv.RigidBody(INERTIA), np.eye(3), (0, 0, 0), 1.0, cv.UniformGravity(2.0, (0.3, 0.0, 0.0)))
    measured = cv.integrate(scene, dt=0.01)
    assert abs(measured.energy[0]) < 1e-15  # J; measured 6e-17, from the turn to principal axes and back
    assert {value.key: value.value for value in measure_drifts(measured)}["energy drift max"] < 1e-14  # measured 5e-16


def test_lost_orthonormality_is_found(exact):
    R = exact.R_WB.copy()
    R[3] *= 1 + 1e-7
    assert values(changed(exact, R), exact)["orthonormality max"] == pytest.approx(2e-7, rel=1e-6)


def test_blanks_are_the_measures_without_values(exact):
    assert [value.key for value in measure_errors(exact, exact)] == [value.key for value in blanks(exact.scene)]
    assert all(math.isnan(value.value) for value in blanks(exact.scene))


def test_slope_of_a_line_with_noise_is_within_its_standard_error():
    t = np.linspace(0, 5, 400)
    noise = np.random.default_rng(3).standard_normal((200, 400))
    measured = [secular_slope(t, 0.2 * t + 0.01 * row) for row in noise]
    off = np.array([(slope - 0.2) / stderr for slope, stderr in measured])
    assert 0.8 < off.std() < 1.2  # measured 1.06 over 200 draws
    assert abs(off.mean()) < 0.25  # measured -0.03


def test_the_samples_of_a_run_that_ended_early_are_measured(exact):
    half = len(exact) // 2
    short = Trajectory(exact.scene, exact.t[:half], exact.R_WB[:half], exact.w_WB_B[:half], "short")
    assert values(short, exact)["attitude error max"] == 0


def test_a_truth_that_ends_early_and_an_empty_trajectory_are_refused(exact):
    short, empty = (Trajectory(exact.scene, exact.t[:n], exact.R_WB[:n], exact.w_WB_B[:n], "part") for n in (len(exact) - 1, 0))
    with pytest.raises(BadInput, match=r"truth: got .* samples"):
        measure_errors(exact, short)
    with pytest.raises(BadInput, match="no sample"):
        measure_errors(empty, exact)


def test_a_largest_error_in_the_middle_is_not_the_final_one():
    exact = cv.integrate(HEAVY, dt=0.01)
    bump = 1e-3 * np.sin(math.pi * exact.t / exact.t[-1])
    turned = np.array([R @ rotation_about((1, 2, 3), angle) for R, angle in zip(exact.R_WB, bump, strict=True)])
    measured = values(changed(exact, turned, exact.w_WB_B * (1 + bump)[:, None]), exact)
    speed = np.linalg.norm(exact.w_WB_B, axis=1)
    assert measured["attitude error max"] == pytest.approx(1e-3, rel=1e-6)
    assert measured["rate error max"] == pytest.approx((speed * bump).max() / speed.max(), rel=1e-9)
    spoilt = ("attitude error", "rate error", "position error", "energy drift", "vertical momentum drift")
    assert all(measured[f"{name} max"] > 1e-4 and measured[f"{name} final"] < 1e-12 for name in spoilt), measured


@pytest.mark.parametrize(
    ("t_end", "off", "same"), [(0.1, 0.9e-12, True), (0.1, 1.1e-12, False), (40.0, 3.9e-11, True), (40.0, 4.1e-11, False)]
)
def test_times_are_the_same_to_round_off(t_end, off, same):
    """Times may differ by 1e-12 s, or by 1e-12 of the last time if that is more."""
    t, R, w = np.linspace(0, t_end, 3), np.tile(START, (3, 1, 1)), np.tile(RATES, (3, 1))
    measured = Trajectory(FREE, t, R, w, "measured")
    truth = Trajectory(FREE, t + np.array([0.0, 0.0, off]), R, w, "truth")
    if same:
        assert {value.key: value.value for value in measure_errors(measured, truth)}["attitude error max"] == 0
    else:
        with pytest.raises(BadInput, match=f"the 3 times of the trajectory, to {t_end:g} s, or more"):
            measure_errors(measured, truth)


def test_three_samples_have_a_slope_and_two_have_none():
    t = np.array([0.0, 1.0, 3.0])
    assert all(map(math.isnan, secular_slope(t[:2], t[:2])))
    assert secular_slope(t, 2 * t) == pytest.approx((2.0, 0.0), abs=1e-12)
    assert secular_slope(t, np.outer(t, [3.0, 0.0, 4.0])) == pytest.approx((5.0, 0.0), abs=1e-12)
    bent = np.array([0.0, 2.0, 1.0])
    alone, turned = secular_slope(t, bent), secular_slope(t, np.outer(bent, [0.6, 0.0, 0.8]))
    assert turned == pytest.approx(alone)
    assert alone[1] > 0.1


def test_at_rest_rates_have_a_scale():
    rest = cv.Scene("rest", cv.RigidBody(INERTIA), START, (0, 0, 0), 1.0)
    t, R, w = np.array([0.0, 1.0]), np.tile(START, (2, 1, 1)), np.zeros((2, 3))
    measured = Trajectory(rest, t, R, np.array([[0.0, 0.0, 0.0], [3e-6, 0.0, 4e-6]]), "measured")
    assert values(measured, Trajectory(rest, t, R, w, "truth"))["rate error max"] == pytest.approx(5e-6)


TURNING = cv.RigidBody(TURN @ np.diag([13, 5, 10]) @ TURN.T)


def exact_motion(rates, t_end):
    """Return the exact motion of a body turned in its frame, for rates in its principal axes."""
    scene = cv.Scene("turned", TURNING, START, TURN @ rates, t_end, dt=0.01)
    return Exact().run(scene, 0.01)


def with_component(along):
    """Return a trajectory with these rates along the axis of its spin."""
    measured = exact_motion((0, 0, along[0]), 0.01)
    rates = np.asarray(along)[:, None] * TURN[:, 2]
    return cv.Trajectory(
        measured.scene, np.arange(len(along)) * 0.01, np.repeat(START[None], len(along), axis=0), rates, "made up"
    )


@pytest.mark.parametrize(("rates", "t_end", "count"), [((0, 0.05, 10), 6, 2), ((0, 10, 0.05), 6, 0), ((0, 0.05, 10), 1, 0)])
def test_exact_motions_turn_over_as_often_as_is_known(rates, t_end, count):
    assert count_turns_over(exact_motion(rates, t_end)) == count


@pytest.mark.parametrize(
    ("along", "count"), [((1, 0.1, -0.1, 0.1, 1), 0), ((1, -0.4, 1), 0), ((1, -0.6, 0.1, 0.7), 2), ((-2, 1.1), 1)]
)
def test_a_side_counts_from_half_of_the_start_on(along, count):
    assert count_turns_over(with_component(along)) == count
