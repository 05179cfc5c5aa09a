"""Registered scenes are complete and refuse bad numbers; published scenes have the published numbers."""

from __future__ import annotations

import inspect
import json
import math
from pathlib import Path

import numpy as np
import pytest

import conservative as cv
from conservative import deferred_imports, registry
from conservative.attitude import angle_between, from_quaternion, rotation_about
from conservative.invariants import JACOBI_INTEGRAL
from conservative.references.environments.adapter import rate_limit_reason
from conservative.scenes import slow_motion
from conservative.scenes.transforms import in_body_frame

NAMES = tuple(registry.list_scenes())
REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "reference_states.json").read_text())["cases"]
BUILDERS = {
    "brick_flip": cv.scenes.brick_flip,
    "brick_flip_1e-6": cv.scenes.near_separatrix,
    "brick_flip_1e-12": lambda: cv.scenes.near_separatrix(1e-12),
    "lagrange_top_steady": cv.scenes.lagrange_top,
    "heavy_top_lie_group": cv.scenes.lie_group_top,
    "sleeping_type_top": cv.scenes.simo_wong_top,
    "hairer_vilmart": cv.scenes.hairer_vilmart,
    "asymmetric_heavy_top": cv.scenes.asymmetric_top,
    "gazebo_box": cv.scenes.gazebo_box,
    "kovalevskaya_top": cv.scenes.kovalevskaya_top,
}


def numbers(case, key):
    return np.array([float(text) for text in case[key]])


@pytest.mark.parametrize("name", NAMES)
def test_a_registered_scene_is_complete_and_conserves_its_energy(name):
    scene = registry.scene(name)
    assert (scene.name, scene.group != "your own", bool(scene.source)) == (name, True, True)
    assert 5 <= scene.t_end / scene.dt <= 3e4  # a run with the defaults is short
    for invariant in scene.invariants:
        value = scene.initial_value(invariant)
        assert np.abs(value).max() < 1e3 * invariant.scale < math.inf
    method = cv.Projected() if isinstance(scene.potential, cv.Turning) else cv.Reduced()
    trajectory = cv.integrate(scene, scene.dt, method, t_end=20 * scene.dt)
    assert scene.invariants[0].name == (JACOBI_INTEGRAL if isinstance(scene.potential, cv.Turning) else "energy")
    assert np.abs(trajectory.drift(scene.invariants[0])).max() < 1e-14  # measured 7e-16


@pytest.mark.parametrize("name", NAMES)
def test_registered_builders_refuse_parameters_that_are_not_finite(name):
    builder = deferred_imports.list_entries(deferred_imports.SCENES)[name].load()
    for parameter in inspect.signature(builder).parameters:
        for bad in (math.nan, math.inf, "much"):
            with pytest.raises(cv.BadInput) as caught:
                builder(**{parameter: bad})
            assert caught.value.argument == parameter


@pytest.mark.parametrize(
    ("text", "argument"),
    [
        ("looping_top:precession=1", "precession"),
        ("unduloid_top:precession=11", "precession"),
        ("stable_spin:spin=0", "spin"),
        ("axis_spin:axis=4", "axis"),
        ("pendulum_over_top:excess=0", "excess"),
        ("gazebo_box:t_end=0", "t_end"),
    ],
)
def test_builder_names_the_argument_it_refuses(text, argument):
    with pytest.raises(cv.BadInput) as caught:
        registry.scene(text)
    assert caught.value.argument == argument


def test_turned_scenes_have_a_full_tensor_and_the_same_motion():
    F = rotation_about((1, 2, 3), 0.7)
    for name, plain in (("turned_brick", cv.scenes.brick_flip()), ("turned_top", cv.scenes.asymmetric_top())):
        turned, straight = (cv.integrate(scene, 0.01, t_end=2) for scene in (registry.scene(name), plain))
        assert angle_between(turned.R_WB @ F, straight.R_WB).max() < 1e-12  # measured 3.0e-14
        assert np.abs(turned.scene.body.inertia[0, 1]) > 0.01
    with pytest.raises(cv.BadInput, match="F: got a reflection"):
        in_body_frame(plain, -F, "turned")


@pytest.mark.parametrize("case", REFERENCE)
def test_a_published_scene_has_the_reference_parameters_and_invariants(case):
    scene, reference = BUILDERS[case](), REFERENCE[case]
    moment = np.zeros(3) if scene.potential is None else scene.potential.moment_B
    np.testing.assert_allclose(np.diag(scene.body.inertia), numbers(reference, "J"), rtol=1e-15)  # measured 7.7e-16
    np.testing.assert_allclose(moment, numbers(reference, "weight_com_B"), rtol=1e-15)  # measured 6.4e-16
    np.testing.assert_allclose(scene.w_WB_B0, numbers(reference, "w0"), rtol=4e-16)  # measured 2.2e-16
    assert angle_between(scene.R_WB0, from_quaternion(numbers(reference, "q0"))) < 6e-16  # measured 3.4e-16
    assert np.count_nonzero(scene.body.inertia - np.diag(np.diag(scene.body.inertia))) == 0
    states = reference["states"]
    R = from_quaternion(np.array([numbers(state, "q") for state in states]))
    w = np.array([numbers(state, "w") for state in states])
    for invariant in scene.invariants:
        start = invariant.evaluate(scene.R_WB0[None], scene.w_WB_B0[None])
        assert np.abs(invariant.evaluate(R, w) - start).max() < 2e-15 * invariant.scale  # measured 3.3e-16


def test_separatrix_follows_its_closed_form_to_the_unstable_axis():
    scene = cv.scenes.separatrix(t_end=1)
    w = cv.integrate(scene, 1e-4).w_WB_B[-1]
    Ja, Jc, Jb = 13, 5, 10
    k = 10 * math.sqrt((Ja - Jb) * (Jb - Jc) / (Ja * Jc))
    exact = np.array([scene.w_WB_B0[0] / math.cosh(k), scene.w_WB_B0[1] / math.cosh(k), 0])
    exact[2] = math.copysign(10 * math.tanh(k), w[2])
    assert np.abs(w - exact).max() < 1e-5  # measured 1e-8, of order dt^2


@pytest.mark.parametrize(
    ("name", "figure"),
    [("cusped_top", "cusps"), ("looping_top", "loops"), ("unduloid_top", "waves"), ("nutating_top", "waves")],
)
def test_nutating_tops_draw_cusps_loops_and_waves(name, figure):
    scene = registry.scene(name)
    trajectory = cv.integrate(scene, 0.0005)
    x, y, _ = np.moveaxis(trajectory.R_WB[:, :, 2], 1, 0)
    rate = np.gradient(np.unwrap(np.arctan2(y, x)), trajectory.t)[2:-2]
    lowest, highest = rate.min(), rate.max()
    assert highest > 5
    if figure == "cusps":
        assert abs(lowest) < 0.02 * highest  # measured 6e-5
    else:
        assert (lowest < -1) == (figure == "loops")


def test_sleeping_top_sleeps_and_falling_top_falls_at_its_rate():
    asleep = cv.integrate(cv.scenes.sleeping_top(), 0.001)
    tilt = np.arccos(np.clip(asleep.R_WB[:, 2, 2], -1, 1))
    assert tilt.max() < 0.01  # measured 0.0050: 1/sqrt(1 - 1/1.05) = 4.6 times the tilt at the start
    scene = cv.scenes.falling_top(stability=0.5, tilt=1e-6, t_end=1)
    falling = cv.integrate(scene, 0.0002)
    tilt = np.linalg.norm(falling.R_WB[:, :2, 2], axis=1)
    J1 = scene.body.moments[0]
    rate = math.sqrt(scene.potential.moment_B[2] / J1 * (1 - 0.5))
    late = falling.t > 0.6
    grown = np.polyfit(falling.t[late], np.log(tilt[late]), 1)[0]
    assert abs(grown / rate - 1) < 1e-3  # measured 9e-6


def test_rests_stay_at_rest_and_the_pendulum_passes_the_top():
    for scene in (cv.scenes.hanging_rest(), cv.scenes.inverted_rest()):
        assert np.array_equal(cv.integrate(scene).R_WB[-1], np.eye(3))
    heights = -cv.integrate(cv.scenes.pendulum_over_top()).R_WB[:, 2, 2]
    assert heights.max() > 0.999  # measured 0.99999999


def test_stable_spin_stays_within_its_polhode():
    w = cv.integrate(cv.scenes.stable_spin(1000), sample_every=50).w_WB_B
    assert np.abs(w[:, 1:]).max() < 0.2  # measured 0.153, the polhode's half-axes
    assert w[:, 0].min() > 9.999  # measured 9.99968


LIMIT = 100.0
"""Rate limit of PhysX and Bullet as installed, rad/s."""
SLOWER = [
    *("cusped_top", "falling_top", "lagrange_top", "lie_group_top", "looping_top"),
    *("needle", "nutating_top", "sleeping_top", "unduloid_top"),
]


@pytest.mark.parametrize("name", SLOWER)
def test_a_slow_motion_has_the_attitudes_of_the_fast_one(name):
    slow, fast = registry.scene(f"{name}:slow=4"), registry.scene(name)
    here, there = (cv.integrate(scene, scene.dt, t_end=100 * scene.dt) for scene in (slow, fast))
    assert np.array_equal(here.R_WB, there.R_WB)
    assert np.array_equal(4 * here.w_WB_B, there.w_WB_B)
    assert slow.name == f"{name}:slow=4"


def test_every_scene_that_is_too_fast_for_game_engines_has_a_slow_motion():
    rates = {name: np.linalg.norm(registry.scene(name).w_WB_B0) for name in registry.list_scenes()}
    assert {name for name, rate in rates.items() if rate > LIMIT} == set(SLOWER)
    for name in SLOWER:
        scene = registry.scene(f"{name}:slow=4")
        assert np.linalg.norm(cv.integrate(scene, scene.dt).w_WB_B, axis=1).max() < LIMIT / 2  # measured up to 46.8


def test_an_engine_that_limits_rates_names_the_slow_motion():
    assert rate_limit_reason(cv.scenes.lagrange_top(slow=4), LIMIT) is None
    assert "lagrange_top:slow=4" in rate_limit_reason(cv.scenes.lagrange_top(), LIMIT)
    assert "slow" not in rate_limit_reason(cv.scenes.lagrange_top().rename("mine"), LIMIT)


def test_the_fourth_integral_of_any_kovalevskaya_top_is_constant():
    top = cv.scenes.kovalevskaya_top(axial=1.7, moment=2.3, t_end=3.0)
    found = cv.integrate(top, 0.01, "taylor")
    assert np.abs(found.drift("Kovalevskaya integral")).max() < 1e-12  # measured 1.2e-15


def test_a_slow_motion_needs_a_field_that_can_be_scaled():
    for scene in (cv.scenes.sprung_body(), cv.scenes.kovalevskaya_top()):
        with pytest.raises(cv.BadInput) as caught:
            slow_motion(scene)
        assert caught.value.argument == "scene"
