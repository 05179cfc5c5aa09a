"""Slow motions: the motions of other scenes, through the same attitudes, slow enough for engines that limit rates."""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.references.environments.engine_method import rate_limit_reason
from conservative.scenes import slow_motion

LIMIT = 100.0
"""Rate, rad/s, that PhysX and Bullet keep bodies below as they are installed."""
SLOWER = [
    *("cusped_top", "falling_top", "lagrange_top", "lie_group_top", "looping_top"),
    *("needle", "nutating_top", "sleeping_top", "unduloid_top"),
]


def fastest_rate(scene):
    return np.linalg.norm(cv.integrate(scene, scene.dt).w_WB_B, axis=1).max()


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
    assert max(fastest_rate(registry.scene(f"{name}:slow=4")) for name in SLOWER) < LIMIT / 2  # measured 46.8


def test_an_engine_that_limits_rates_names_the_slow_motion():
    assert rate_limit_reason(cv.scenes.lagrange_top(slow=4), LIMIT) is None
    reason = (
        "as installed it limits rates to 100 rad/s, and the scene starts with 141 rad/s; lagrange_top:slow=4 is a slower one"
    )
    assert rate_limit_reason(cv.scenes.lagrange_top(), LIMIT) == reason
    assert rate_limit_reason(cv.scenes.lagrange_top().rename("mine"), LIMIT).endswith("starts with 141 rad/s")


def test_a_slow_motion_needs_a_field_that_can_be_scaled():
    for scene in (cv.scenes.sprung_body(), cv.scenes.kovalevskaya_top()):
        with pytest.raises(cv.BadInput) as caught:
            slow_motion(scene)
        assert caught.value.argument == "scene"
