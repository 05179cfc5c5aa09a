"""The closed forms of many random free bodies and tops against multi-precision integration, and against Orekit's.

Measured, largest of 1,000 each: free bodies 1.4e-15 rad (1.2e-15 near the separatrix), tops 1.2e-13 rad (2.2e-14 past a pole).

Orekit's `TorqueFree` has Jacobi's elliptic functions in Java (`conservative engines install orekit`). For 300 bodies with
Orekit 13.1.9, attitudes away from the separatrix differ by up to 1.3e-11 rad and rates by 1.0e-12. Near it, Orekit is within
1e-10 for a quarter of them. For the others its error is up to 3 rad, or it fails, while multi-precision integration and our
solution agree.
"""

from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between
from conservative.grid import Grid
from conservative.references.exact.method import Exact
from conservative.references.precise import Precise

from ..references.exact_trials import FREE_BOUND, TOP_BOUND, draw_free, draw_top, log_uniform
from .effort import SEED, count

pytestmark = pytest.mark.attack
PARTS = 10  # so that workers share the bodies
KINDS = [(draw_free, 200, 5, FREE_BOUND), (draw_top, 100, 10, TOP_BOUND)]
OREKIT_BOUND = 1e-10  # attitudes, rad, and rates relative to the largest one


def generators(usual, part=0, parts=1):
    return [(number, np.random.default_rng([SEED, number])) for number in range(part, count(usual), parts)]


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize(("draw", "usual", "special", "bound"), KINDS)
def test_closed_forms_against_multi_precision(draw, usual, special, bound, part):
    for number, rng in generators(usual, part, PARTS):
        trial = draw(rng, log_uniform(rng, 1e-12, 1e-6) if number // PARTS % special == 0 else None)
        assert max(trial.errors()) <= bound, number


def test_bodies_near_the_separatrix_and_tops_past_a_pole_are_near():
    for _, rng in generators(5):
        trial = draw_top(rng, 1e-6)
        assert trial.pole_distance(trial.t[-1]) < 1e-5
        trial = draw_free(rng, 1e-6)
        L = trial.body.momentum(trial.w_WB_B0)
        assert L @ L / (trial.w_WB_B0 @ L) / np.sort(trial.body.moments)[1] == pytest.approx(1, abs=2e-6)


def difference(scene, method, other=None):
    """Return the largest difference of the closed form from another method, run on another scene if there is one."""
    grid = Grid(scene.t_end / 24, 24)
    ours = Exact().solve(scene, grid)
    try:
        found = method.solve(other or scene, grid)
    except cv.IntegrationFailed:
        return np.inf
    if found.failure is not None:
        return np.inf
    rates = np.abs(ours.w_WB_B - found.w_WB_B).max() / np.abs(ours.w_WB_B).max()
    return max(angle_between(ours.R_WB, found.R_WB).max(), rates)


def draw_scene(rng, near):
    trial = draw_free(rng, log_uniform(rng, 1e-12, 1e-2) if near else None, physical=True)
    return cv.Scene("drawn", trial.body, trial.R_WB0, trial.w_WB_B0, (60 if near else 20) / np.linalg.norm(trial.w_WB_B0))


def with_wrong_moment(scene):
    """Return the scene with its largest moment off by 1e-9 of itself, in the same axes."""
    R, moments = scene.body.R_BP, np.array(scene.body.moments)
    moments[np.argmax(moments)] *= 1 + 1e-9
    tensor = R @ np.diag(moments) @ R.T
    return replace(scene, body=cv.RigidBody((tensor + tensor.T) / 2))


@pytest.mark.engine("orekit")
def test_free_bodies_against_orekit():
    orekit = registry.method("orekit")
    for number, rng in generators(100):
        near = number % 5 == 0
        scene = draw_scene(rng, near)
        apart = difference(scene, orekit)
        if near and apart > OREKIT_BOUND:
            apart = difference(scene, Precise())  # decides who is right
        assert apart <= OREKIT_BOUND, number
        if not near:
            assert difference(scene, orekit, with_wrong_moment(scene)) > OREKIT_BOUND, number
