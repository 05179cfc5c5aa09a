"""`run(R_WB0, w_WB_B0)`: a run from another start is the run of the scene with that start, for every method."""

from __future__ import annotations

import copy
import pickle
from itertools import product
from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import from_quaternion
from conservative.scenes.random_body import random_body
from tests.sampling import sampled

RNG = np.random.default_rng(20)
STARTS = [
    (from_quaternion(q / np.linalg.norm(q)), w) for q, w in zip(RNG.normal(size=(6, 4)), RNG.normal(size=(6, 3)), strict=True)
]
"""Attitudes and rates relative to the scene's speed. The free body turns about both of its stable axes."""


def tensor(scene: cv.Scene) -> cv.Scene:
    """Return a scene with body axes that are not principal axes."""
    return scene.rename("tensor", body=cv.RigidBody([[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 3.5]]))


FREE = cv.Scene("free", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.3, 0.2, 1.0), 4.0)
SCENES = {
    "free": FREE,
    "tensor": tensor(FREE),
    "rod": FREE.rename("rod", body=cv.RigidBody((1e-6, 2.0, 2.0))),
    "symmetric": FREE.rename("symmetric", body=cv.RigidBody((2.0, 2.0, 1.0))),
    "rotor": FREE.rename("rotor", body=cv.RigidBody((1.0, 2.0, 2.5), rotor_momentum=(0.1, 0.2, 0.3))),
    "small": FREE.rename("small", body=cv.RigidBody((1e-9, 2e-9, 2.5e-9))),
    "torque": FREE.rename("torque", torque=cv.Torque((0.1, 0.2, 0.1))),
    "damping": FREE.rename("damping", damping=cv.Damping(0.1 * np.eye(3))),
    "top": cv.scenes.lagrange_top(),
    **{field: random_body(field, 5, 0) for field in ("gravity", "spring", "attraction", "fixed_gradient", "gradient")},
}
METHODS = (
    *(
        method
        for family in registry.list_families().values()
        for method in dict.fromkeys((*family.settings_in_tables(), *family.settings_for("report")))
    ),
    cv.Projected(tolerance=1e-9),
)
CASES = [(scene, method.name) for (scene, held), method in product(SCENES.items(), METHODS) if method.unsupported(held) is None]


def speed(scene: cv.Scene) -> float:
    return float(np.linalg.norm(scene.w_WB_B0))


def grid_of(scene: cv.Scene) -> cv.Grid:
    return cv.Grid(min(scene.dt, scene.t_end / 100), 20, 7)


def begin(run: Any, start: tuple[Any, Any]) -> cv.Trajectory | type[Exception]:
    try:
        return run(*start)
    except cv.BadInput as refused:
        return type(refused)


@pytest.mark.parametrize(("name", "setting"), sampled(CASES, 40))
def test_a_run_from_another_start_is_the_run_of_the_scene_with_that_start(name: str, setting: str) -> None:
    scene, method = SCENES[name], registry.method(setting)
    grid = grid_of(scene)
    run = method.prepare(scene, grid)
    own = run()
    for R_WB0, w in STARTS:
        start = R_WB0, w * speed(scene)
        there = scene.rename(scene.name, R_WB0=start[0], w_WB_B0=start[1])
        found, expected = begin(run, start), begin(lambda *_, there=there: method.prepare(there, grid)(), start)
        if isinstance(expected, type):  # a step that is too long for this start
            assert found is expected
            continue
        assert isinstance(found, cv.Trajectory)
        assert type(found.failure) is type(expected.failure)
        np.testing.assert_array_equal(found.t, expected.t)
        np.testing.assert_array_equal(found.scene.R_WB0, start[0])
        np.testing.assert_array_equal(found.scene.w_WB_B0, start[1])
        # measured 2e-14 with Taylor, whose numbers are made by other code; otherwise 0
        np.testing.assert_allclose(found.R_WB, expected.R_WB, rtol=0, atol=1e-12)
        # The round-off of a momentum, over the moment of a rod, is a rate about its axis: measured 0.2 times this.
        moments = scene.body.moments
        rounding = np.finfo(float).eps * np.linalg.norm(scene.body.momentum(start[1])) / moments.min()
        off = 1e-12 * np.abs(expected.w_WB_B).max() + rounding
        np.testing.assert_allclose(found.w_WB_B, expected.w_WB_B, rtol=0, atol=off)
        assert (found.supplied is None) == (expected.supplied is None)
        assert found.counters.steps == expected.counters.steps
    np.testing.assert_array_equal(run().R_WB, own.R_WB)
    assert run().scene is scene


STARTED = [(name, method) for name in SCENES for method in (cv.Taylor(12), cv.Taylor(tolerance=1e-9))]
STARTED = [(name, method) for name, method in STARTED if method.unsupported(SCENES[name]) is None]


@pytest.mark.parametrize(("name", "method"), STARTED)
def test_arrays_are_those_of_the_call_before(name: str, method: cv.Taylor) -> None:
    """Not if the run is prepared again, as in other units."""
    scene = SCENES[name]
    run = method.prepare(scene, grid_of(scene))
    starts = [(R, w * speed(scene)) for R, w in STARTS]
    for _ in range(2):
        calls = [run(*start) for start in starts]
    addresses = {trajectory.R_WB.ctypes.data for trajectory in calls}
    if name == "small":
        assert len(addresses) == len(starts)
    else:
        assert len(addresses) <= 2
    last = method.prepare(scene.rename("last", R_WB0=starts[-1][0], w_WB_B0=starts[-1][1]), grid_of(scene))()
    np.testing.assert_allclose(calls[-1].R_WB, last.R_WB, rtol=0, atol=1e-12)
    assert method.check(calls[-1].scene, grid_of(scene), calls[-1]).ok


def test_a_top_that_comes_near_the_vertical_has_another_model() -> None:
    scene = cv.scenes.lagrange_top()
    grid = grid_of(scene)
    run = cv.Taylor(12).prepare(scene, grid)
    for _ in range(2):
        for R_WB0 in (scene.R_WB0, np.eye(3), scene.R_WB0):
            there = scene.rename("there", R_WB0=R_WB0)
            expected = cv.Taylor(12).prepare(there, grid)()
            np.testing.assert_allclose(run(R_WB0, scene.w_WB_B0).R_WB, expected.R_WB, rtol=0, atol=1e-12)


REFLECTION = np.diag([1.0, 1.0, -1.0])
WRONG: list[tuple[str, Any, Any]] = [
    ("R_WB0", np.eye(2), np.ones(3)),
    ("R_WB0", 2 * np.eye(3), np.ones(3)),
    ("R_WB0", np.eye(3) + 1e-8, np.ones(3)),
    ("R_WB0", REFLECTION, np.ones(3)),
    ("R_WB0", np.full((3, 3), np.nan), np.ones(3)),
    ("R_WB0", "up", np.ones(3)),
    ("R_WB0", None, np.ones(3)),
    ("w_WB_B0", np.eye(3), np.ones(4)),
    ("w_WB_B0", np.eye(3), np.array([1.0, np.inf, 0.0])),
    ("w_WB_B0", np.eye(3), np.array([1e40, 0.0, 0.0])),
    ("w_WB_B0", np.eye(3), None),
]


@pytest.mark.parametrize("method", [cv.Taylor(12), cv.Taylor(tolerance=1e-9), cv.Reduced()])
@pytest.mark.parametrize(("argument", "R_WB0", "w_WB_B0"), WRONG)
def test_a_start_that_is_none_is_refused(method: Any, argument: str, R_WB0: Any, w_WB_B0: Any) -> None:
    run = method.prepare(FREE, cv.Grid(0.1, 5))
    for _ in range(2):
        run(FREE.R_WB0, FREE.w_WB_B0)
        with pytest.raises(cv.BadInput, match=argument):
            run(R_WB0, w_WB_B0)


def test_a_start_can_be_given_as_lists_and_as_integers() -> None:
    run = cv.Taylor(12).prepare(FREE, cv.Grid(0.1, 5))
    expected = run(np.eye(3), np.array([1.0, 2.0, 3.0])).R_WB.copy()
    for R_WB0, w_WB_B0 in (
        (np.eye(3).tolist(), [1, 2, 3]),
        (np.eye(3, dtype=int), np.array([1, 2, 3])),
        (np.eye(3).T, (1, 2, 3)),
    ):
        np.testing.assert_array_equal(run(R_WB0, w_WB_B0).R_WB, expected)


def test_a_body_at_rest_and_much_faster_ones_are_prepared_again() -> None:
    for scene in (FREE, SCENES["gravity"]):
        run = cv.Taylor(12).prepare(scene, cv.Grid(1e-12, 5))
        for size in (1.0, 0.0, 1e10, 1.0):
            there = scene.rename("there", w_WB_B0=size * FREE.w_WB_B0)
            expected = cv.Taylor(12).prepare(there, cv.Grid(1e-12, 5))()
            np.testing.assert_allclose(run(scene.R_WB0, there.w_WB_B0).w_WB_B, expected.w_WB_B, rtol=1e-12)


def test_a_failure_has_the_scene_of_its_start() -> None:
    run = cv.Taylor(12).prepare(FREE, cv.Grid(0.5, 5))
    for factor in (1.0, 1.1, 100.0):
        found = run(FREE.R_WB0, factor * FREE.w_WB_B0)
    assert not found.ok
    np.testing.assert_array_equal(found.scene.w_WB_B0, 100.0 * FREE.w_WB_B0)


@pytest.mark.parametrize("again", [False, True])
def test_a_trajectory_can_be_copied_and_pickled(again: bool) -> None:
    run = cv.Taylor(12).prepare(FREE, cv.Grid(0.1, 5))
    found = run(FREE.R_WB0, 2 * FREE.w_WB_B0)
    found = run(FREE.R_WB0, 2 * FREE.w_WB_B0) if again else run()
    for other in (copy.copy(found), copy.deepcopy(found), pickle.loads(pickle.dumps(found))):
        np.testing.assert_array_equal(other.t, found.t)
        np.testing.assert_array_equal(other.R_WB, found.R_WB)
        assert other.scene.key == found.scene.key
    with pytest.raises(AttributeError, match="speed"):
        found.speed  # noqa: B018
