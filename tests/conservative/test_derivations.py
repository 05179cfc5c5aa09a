"""What methods derive from a scene is kept with it, within bounds, and nowhere else."""

from __future__ import annotations

import copy
import gc
import pickle
import threading
import weakref

import numpy as np
import pytest

import conservative as cv
from conservative.derivations import MOST, Derivations
from conservative.methods import reduced


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
    scene = cv.scenes.brick_flip()
    for number in range(3 * MOST):
        scene.derive(lambda _, number: number, number)
    assert len(scene._derivations.entries) == MOST


def test_each_thread_derives_for_itself() -> None:
    scene, found = cv.scenes.lagrange_top(), []
    for _ in range(2):
        thread = threading.Thread(target=lambda: found.append(scene.derive(reduced.convert, cv.Reduced())))
        thread.start()
        thread.join()
    assert found[0] is not found[1]
    assert found[0] is not scene.derive(reduced.convert, cv.Reduced())


def test_copies_do_not_carry_what_was_derived() -> None:
    store = Derivations()
    store.add(("key",), 1)
    assert pickle.loads(pickle.dumps(store)).entries == {}
    assert copy.deepcopy(store).entries == {}


@pytest.mark.parametrize("method", [cv.Reduced(), cv.Reduced(4, frame="auto"), cv.Gauss(2), cv.Lame(), cv.Projected()])
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
