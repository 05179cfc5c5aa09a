"""The automatic choice on methods whose errors and costs are known beforehand."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.declarations import Cost
from conservative.method import Grid, Method, Role
from conservative.methods import search, trials
from conservative.trajectory import Counters, Trajectory

SCENE = cv.Scene("spun", cv.RigidBody((1, 2, 3)), np.eye(3), (0, 0, 4.0), 5.0)
GRID = Grid(0.1, 50)


@dataclass(frozen=True)
class Spun(Method):
    """The exact motion of `SCENE`, but every run is off by `noise` rad, this way and that, whatever its step."""

    noise: float = 0.0
    price: float = 1.0

    family: ClassVar[str] = "spun"
    role: ClassVar[Role] = Role.OURS

    @property
    def order(self):
        return 12

    @property
    def cost(self):
        return Cost(step=self.price)

    def prepare(self, scene, grid):
        off = self.noise * (1 if grid.n_steps % 4 == 0 else -1)
        R_WB = np.array([rotation_about((0, 0, 1), 4.0 * t + off) for t in grid.t])
        w_WB_B = np.broadcast_to(scene.w_WB_B0, (grid.n_samples, 3))
        return lambda: Trajectory(scene, grid.t, R_WB, w_WB_B, self.label, Counters(grid.n_steps))


def test_an_estimate_is_never_below_what_rounding_the_scene_turns_the_body_by():
    estimate, _ = trials.run_twice(Spun(), SCENE, GRID)
    assert estimate >= np.finfo(float).eps / 2 * 4.0 * 5.0


def test_an_estimate_does_not_trust_noise_to_shrink_with_the_step():
    estimate, _ = trials.run_twice(Spun(1e-6), SCENE, Grid(5.0 / 52, 52))  # off by 1e-6 one way, with 26 steps the other
    assert estimate > 2e-6 / 100  # and not 2e-6 / 4095, as order 12 would have it


@pytest.mark.parametrize("prices", [(1.0, 100.0), (100.0, 1.0)])
def test_the_cheapest_candidate_is_chosen(prices, monkeypatch):
    monkeypatch.setattr(search, "candidates", lambda scene: tuple(Spun(price=price) for price in prices))
    assert cv.integrate(SCENE, error=1e-3).choice.method.price == 1.0


@pytest.mark.parametrize(
    ("errors", "stopped"),
    [([1.0, 0.9, 0.8], True), ([1.0, 0.9, 0.1], False), ([1.0, 0.1, 0.9], False), ([1.0, 2.0], False), ([9, 1, 1, 1], True)],
)
def test_only_two_steps_in_a_row_that_do_not_help_are_round_off(errors, stopped):
    assert search.stops_falling(errors) is stopped
