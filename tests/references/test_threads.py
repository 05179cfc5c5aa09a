"""Runs of engines and reference solutions in several threads are equal bit for bit to runs in one."""

from concurrent.futures import ThreadPoolExecutor

import mpmath
import numpy as np
import pytest

import conservative as cv
from conservative.references.environments.catalogue import MuJoCo
from conservative.references.exact.method import Exact
from conservative.references.heyoka_equations import forms, formulations
from conservative.references.precise import Precise
from conservative.references.solvers.heyoka import Heyoka

from .exact_trials import states_in_digits

pytestmark = pytest.mark.slow

THREADS = 4


def states(trajectory):
    assert trajectory.ok
    return trajectory.R_WB.tobytes() + trajectory.w_WB_B.tobytes()


def in_threads(calls):
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(lambda call: call(), calls))


def test_overlapping_runs_of_mujoco_restore_its_handler_of_warnings():
    mj = pytest.importorskip("mujoco")

    def handler(message):
        raise AssertionError(message)

    mj.set_mju_user_warning(handler)
    try:
        runs = [MuJoCo().prepare(cv.scenes.brick_flip(), cv.Grid(0.01, 300)) for _ in range(4 * THREADS)]
        assert len({states(trajectory) for trajectory in in_threads(runs)}) == 1
        assert mj.get_mju_user_warning() is handler
    finally:
        mj.set_mju_user_warning(None)


def test_preparing_in_threads_and_precisions():
    """Preparation computes in many digits too, and does not change the precision of the user."""
    body, grid = cv.RigidBody([[1.0, 0.1, 0.0], [0.1, 2.0, 0.2], [0.0, 0.2, 2.5]]), cv.Grid(0.5, 4)
    scenes = [cv.Scene("own", body, np.eye(3), (0.1, k, 1.0), 2.0) for k in range(1, 1 + THREADS)]
    pairs = [(method, scene) for scene in scenes for method in (Exact(), Precise(80), Precise(300))]
    before = mpmath.mp.prec
    alone = [states(method.prepare(scene, grid)()) for method, scene in pairs]
    results = in_threads([lambda pair=pair: states(pair[0].prepare(pair[1], grid)()) for pair in pairs * 3])
    assert results == alone * 3
    assert mpmath.mp.prec == before


def test_states_in_threads_have_all_their_digits():
    def rows(bits):
        q, w = states_in_digits((1, 2, "2.5"), (1, 0, 0, 0), ("0.1", "0.2", "1.7"), ["0.5", "1.5"], bits=bits)
        return [mpmath.nstr(x, 40) for row in (*q, *w) for x in row]

    wanted = [80, 150, 300, 200] * 3
    assert in_threads([lambda bits=bits: rows(bits) for bits in wanted]) == [rows(bits) for bits in wanted]


def test_a_second_borrower_gets_another_integrator():
    run = Heyoka(1e-9).prepare(cv.scenes.brick_flip(), cv.Grid(0.1, 20))
    first = states(run())
    integrators = forms.compile_double(formulations.body(cv.scenes.brick_flip()).form, 1e-9)
    with integrators.borrow() as one, integrators.borrow() as two:
        assert one is not two
        assert one.state is not two.state
        assert states(run()) == first
