"""What methods derive from a scene is kept with it, within bounds, and nowhere else."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

import conservative as cv
from conservative.scene import MOST_DERIVATIONS


def test_a_value_is_derived_once_for_each_setting_until_it_is_forgotten() -> None:
    scene, calls = cv.scenes.brick_flip(), []

    def double(scene: cv.Scene, number: int) -> int:
        calls.append((scene, number))
        return 2 * number

    assert [scene.derive(double, number) for number in (3, 3, 4, 3)] == [6, 6, 8, 6]
    assert calls == [(scene, 3), (scene, 4)]
    scene.forget()
    assert scene.derive(double, 3) == 6
    assert len(calls) == 3


def test_the_store_is_bounded() -> None:
    scene = cv.scenes.lagrange_top()
    for number in range(3 * MOST_DERIVATIONS + 5):
        cv.Projected().prepare(scene, cv.Grid(0.01, 1))
        assert scene.derive(lambda _, number: number, number) == number
        assert len(scene._derivations) <= MOST_DERIVATIONS


@pytest.mark.parametrize(
    "method", [cv.Reduced(), cv.Reduced(4, frame="auto"), cv.Gauss(2), cv.Lame(), cv.Projected(), cv.Taylor()]
)
def test_nothing_keeps_a_scene_alive(method: cv.Method) -> None:
    top = cv.scenes.lagrange_top()
    cv.integrate(top, method=method, t_end=0.05)
    gone = weakref.ref(top)
    del top
    gc.collect()
    assert gone() is None


def test_a_run_after_forgetting_is_the_same() -> None:
    scene = cv.scenes.lagrange_top()
    before = cv.Reduced().run(scene, 0.01, 0.1)
    scene.forget()
    assert np.array_equal(cv.Reduced().run(scene, 0.01, 0.1).R_WB, before.R_WB)
