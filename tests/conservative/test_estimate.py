"""The automatic choice on methods whose errors and costs are known beforehand."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative import check
from conservative.attitude import rotation_about
from conservative.declarations import Cost
from conservative.method import Grid, Method, Role
from conservative.methods import automatic, search, trials
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
        return self._turn(scene, grid, 4.0 * grid.t + self.noise * (1 if grid.n_steps % 4 == 0 else -1))

    def _turn(self, scene, grid, angles):
        R_WB = np.array([rotation_about((0, 0, 1), angle) for angle in angles])
        w_WB_B = np.broadcast_to(scene.w_WB_B0, (grid.n_samples, 3))
        return lambda: Trajectory(scene, grid.t, R_WB, w_WB_B, self.label, Counters(grid.n_steps))


@dataclass(frozen=True)
class Slow(Spun):
    """Of order 1: too fast by 0.01 rad/s at a step of 1 s."""

    family: ClassVar[str] = "slow"

    @property
    def order(self):
        return 1

    def prepare(self, scene, grid):
        return self._turn(scene, grid, (4.0 + 1e-2 * grid.dt) * grid.t)


def test_an_estimate_is_never_below_what_rounding_the_scene_turns_the_body_by():
    estimate, *_ = trials.run_twice(Spun(), SCENE, GRID)
    assert estimate >= np.finfo(float).eps / 2 * 4.0 * 5.0


def test_an_estimate_does_not_trust_noise_to_shrink_with_the_step():
    estimate, *_ = trials.run_twice(Spun(1e-6), SCENE, Grid(5.0 / 52, 52))  # off by 1e-6 one way, with 26 steps the other
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


def needle(condition):
    """A thin body whose tensor is full, so that its least moment is known to an ulp of the largest only."""
    R = rotation_about((1, 2, 3), 0.7)
    tensor = R @ np.diag((1.0, 1.1, 1 / condition)) @ R.T
    field = cv.UniformGravity(1.0, (0.1, 0.2, 0.3))
    return cv.Scene("needle", cv.RigidBody((tensor + tensor.T) / 2), np.eye(3), R @ (0.3, 0.2, 5.0), 10.0, field)


def test_an_estimate_has_what_rounding_the_inertia_causes():
    """At condition 1e5 the run for 1e-8 rad is 3.9e-8 rad off by `Precise(192)`; the estimate without rounding was 7e-9."""
    with pytest.warns(cv.AccuracyNotReached) as caught:
        found = cv.integrate(needle(1e5), error=1e-8)
    assert 3.9e-8 <= found.choice.estimate <= 5e-6  # measured 1e-6
    assert caught[0].message.estimate == found.choice.estimate
    assert cv.integrate(needle(1e3), error=1e-8).choice.estimate <= 1e-8


def test_what_rounding_causes_is_no_reason_to_take_a_coarse_step():
    with pytest.warns(cv.AccuracyNotReached):
        choice = cv.integrate(needle(1e5), error=1e-7).choice
    assert choice.estimate < 5e-6  # measured 6e-7; the first step tried was off by 1e-3


def test_a_spin_about_a_principal_axis_is_not_moved_off_it_by_rounding():
    near = trials.nearby_scene(cv.Scene("spin", cv.RigidBody((1, 2, 3)), np.eye(3), (0, 2.0, 0), 1.0))
    assert near.w_WB_B0.tolist()[::2] == [0, 0]
    assert np.count_nonzero(near.body.inertia) == 3
    assert 0 < abs(near.w_WB_B0[1] / 2 - 1) < 5e-16


CHAOTIC = cv.Scene(
    "chaotic",
    cv.RigidBody(
        [
            [0.8561473151436181, -0.1399209844619009, 0.2596232291707036],
            [-0.1399209844619009, 0.8639032569163886, 0.2525273535979581],
            [0.2596232291707036, 0.2525273535979581, 0.531435779649731],
        ]
    ),
    [
        [-0.36137691973756003, -0.46339656708943133, 0.8091170147084557],
        [0.748683825368686, -0.661436587819048, -0.04443163203851147],
        [0.5557690631119225, 0.5897162554178279, 0.5859654312190021],
    ],
    [0.34078729040002304, -1.5690401418883404, -1.021436630924228],
    208.07820450168416,
    cv.PointAttraction(
        0.5198954949249285,
        [0.13668659642970388, -0.0930140741058145, -0.6886305645960864],
        [-0.5202606179382248, -0.5662843993318173, 0.15283415904335093],
    ),
)
"""A body near an attracting point that amplifies the rounding of its start to a half turn within 208 s."""


def test_a_motion_that_rounding_decides_is_given_up_at_once():
    taken = []
    with pytest.warns(cv.AccuracyNotReached):
        found = cv.integrate(CHAOTIC, error=1e-8, progress=taken.append)
    assert found.ok
    assert found.choice.estimate > 0.2
    assert len(found.choice.attempts) == 1
    assert found.choice.dt > 1e-3  # before, steps were halved down to 3e-6 s, and then there was no memory for the samples


def test_where_no_more_samples_fit_in_memory_the_best_run_so_far_is_returned(monkeypatch):
    monkeypatch.setattr(automatic, "find_cheapest", lambda trials, error, t_end: (Slow(), 0.1))
    monkeypatch.setattr(check, "most_samples", lambda: 10_000)
    with pytest.warns(cv.AccuracyNotReached):
        found = cv.integrate(SCENE, error=1e-7)
    assert found.choice.estimate == min(estimate for _, estimate in found.choice.attempts)
    assert 1000 < len(found) <= 10_000
    monkeypatch.setattr(check, "most_samples", lambda: 2)
    with pytest.raises(cv.BadInput) as raised:
        cv.integrate(SCENE, error=1e-7)
    assert raised.value.argument == "sample_every"


def test_trial_runs_of_a_python_function_warn_of_nothing():
    """Too long a step overflows in the callback; pytest makes errors of warnings."""
    hook = np.array([0.0, 0.1, 0.4])
    field = cv.FunctionPotential(
        lambda R: 5 * (R[2] @ hook) ** 4,
        lambda R: np.outer([0, 0, 1], 20 * (R[2] @ hook) ** 3 * hook),
    )
    scene = cv.Scene("function", cv.RigidBody((1.0, 2.0, 2.5)), np.eye(3), (0.3, 1.0, 20.0), 3.0, field)
    assert cv.integrate(scene, error=1e-9).choice.reached
