"""The rules of the automatic choice, one by one, and the whole on methods whose errors are known beforehand."""

import dataclasses
import math
import warnings
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.declarations import Cost
from conservative.errors import AccuracyNotReached
from conservative.methods import automatic, search, trials
from conservative.methods.between import Samples
from conservative.trajectory import Counters

BODY = cv.RigidBody((1.0, 1.0, 1.0))
SCENE = cv.Scene("spin", BODY, np.eye(3), (0, 0, 2.0), 8.0)


@dataclass(frozen=True)
class Known(cv.Method):
    """Turns about the third axis, off by `size` times step to the `power`, rad, times time."""

    size: float = 1.0
    power: int = 2
    step: float = 1.0
    fails_above: float = math.inf

    family: ClassVar[str] = "known"
    role: ClassVar[cv.Role] = cv.Role.OURS
    taken: ClassVar[list] = []

    @property
    def order(self):
        return self.power or None

    @property
    def cost(self):
        return Cost(step=self.step, correction=3.0)

    def prepare(self, scene, grid):
        self.taken.append(grid)
        rate = 2.0 + self.size * grid.dt**self.power
        if grid.dt > self.fails_above:
            raise cv.Unsupported("dt", grid.dt, "shorter steps")
        R = Rotation.from_rotvec(np.outer(rate * grid.t, (0, 0, 1))).as_matrix()
        counters = Counters(grid.n_steps, grid.n_steps, 2 * grid.n_steps)
        return lambda: cv.Trajectory(scene, grid.t, R, np.tile((0, 0, 2.0), (len(R), 1)), self.label, counters)


@pytest.fixture(autouse=True)
def fresh():
    Known.taken.clear()
    trials.recall.cache_clear()


@pytest.mark.parametrize(
    ("dt", "t_end", "spacing", "every", "expected"),
    [
        (0.3, 1.0, None, 1, (0.25, 4, 1)),
        (0.25, 1.0, None, 3, (0.25, 4, 3)),
        (5.0, 1.0, None, 1, (0.5, 2, 1)),
        (0.1, 1.0, 0.5, 1, (0.5 / 6, 12, 6)),
        (0.125, 1.0, 0.5, 2, (0.125, 8, 8)),
        (0.5, 1.2, 0.5, 1, (0.25, 6, 2)),
        (0.1, 2.2, None, 1, (0.1, 22, 1)),  # 2.2 / 0.1 is above 22 by rounding
        (0.1, 2.2, 2.2, 1, (0.1, 22, 22)),
        (0.1, 1.1, 0.1, 1, (0.05, 22, 2)),
    ],
)
def test_grids_have_an_even_number_of_steps(dt, t_end, spacing, every, expected):
    grid = automatic.grid_of(dt, t_end, Samples(spacing, every))
    assert (grid.dt, grid.n_steps, grid.every) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("estimate", "power", "expected"),
    [
        (1e-5, 2, math.sqrt(0.05)),
        (0.6e-6, 2, 0.9),
        (1e-3, 2, 0.1),
        (math.inf, 2, 0.5),
        (1e-4, 0, 0.5),
        (1.6e-5, 4, (0.5 / 16) ** 0.25),
    ],
)
def test_the_next_step_follows_from_the_order(estimate, power, expected):
    assert search.step_factor(estimate, 1e-6, Known(power=power)) == pytest.approx(expected)


def test_factors_by_which_a_finer_run_is_better():
    assert [trials.convergence_factor(Known(power=power)) for power in (0, 2, 4, 6)] == [1.0, 3.0, 15.0, 30.0]


@pytest.mark.parametrize(
    ("errors", "stalls"),
    [
        ([1.0, 0.9], False),
        ([1.0, 0.9, 0.8], True),
        ([1.0, 0.9, 0.69], False),
        ([1.0, 0.69, 0.9], False),
        ([9.0, 1.0, 0.71, 0.71], True),
        ([1.0, 0.7, 0.9], False),
    ],
)
def test_errors_that_stop_falling(errors, stalls):
    assert search.stops_falling(errors) is stalls
    attempts = [(0.1, error) for error in errors]
    assert search.stalls(((0.2, math.inf), *attempts)) is stalls


def test_bounds_and_counts():
    faster = cv.Scene("spin", BODY, np.eye(3), (0, 0, 3.0), 8.0)
    for scene in (SCENE, faster):
        assert search.bound_rate(scene) == pytest.approx(math.sqrt(2 * scene.energy_scale))
    trajectory = Known().prepare(SCENE, cv.Grid(0.5, 4, 1))()
    assert trials.count_work(Known(step=7.0), trajectory) == 3.0 * 8 + 7.0 * 4
    explicit = dataclasses.replace(trajectory, counters=Counters(4, 4, None))
    assert trials.count_work(Known(step=7.0), explicit) == 7.0 * 4
    assert trials.rounding_error(trajectory) == pytest.approx(2.0**-53 * 2.0 * 2.0, rel=1e-9, abs=0)


@pytest.mark.parametrize(("every", "n"), [(1, 8), (2, 8), (3, 8), (1, 6), (3, 10), (4, 10)])
def test_two_runs_are_compared_at_the_times_that_both_have(every, n):
    estimate, fine, _ = trials.run_twice(Known(size=0.01), SCENE, cv.Grid(0.5, n, every))
    difference = 0.01 * (1.0 - 0.25) * 0.5 * n
    assert estimate == pytest.approx(difference / 3 + 2.0**-53 * 2 * 0.5 * n, rel=1e-9)
    assert (fine.t[-1], len(fine)) == (0.5 * n, len(cv.Grid(0.5, n, every).t))
    assert [(grid.dt, grid.n_steps) for grid in Known.taken] == [(0.5, n), (1.0, n // 2)]


def test_errors_that_say_nothing_are_infinite():
    assert trials.run_twice(Known(size=0.2), SCENE, cv.Grid(0.5, 8, 1))[0] == math.inf  # 0.6 rad
    assert trials.run_twice(Known(fails_above=0.6), SCENE, cv.Grid(0.5, 8, 1))[0] == math.inf
    for difference, known in ((0.19, True), (0.21, False)):
        estimate = trials.run_twice(Known(size=difference / 3), SCENE, cv.Grid(0.5, 8, 1))[0]
        assert math.isfinite(estimate) is known


@pytest.fixture
def choose(monkeypatch):
    def among(*methods):
        monkeypatch.setattr(search, "candidates", lambda scene: methods)

    return among


def test_the_step_is_cut_until_the_error_is_reached(choose):
    choose(Known(size=0.1))
    found = automatic.integrate_to_error(SCENE, 1e-5, 8.0, Samples())
    choice = found.choice
    assert choice.reached
    assert choice.estimate <= 1e-5
    exact = 0.1 * choice.dt**2 * 8
    assert choice.estimate == pytest.approx(exact, rel=1e-3)
    assert exact > 1e-6  # and not far below
    assert choice.attempts[-1] == (choice.dt, choice.estimate)
    assert 1 <= len(choice.attempts) <= 3
    assert found.t[-1] == 8.0


def test_the_cheapest_at_its_step_is_taken(choose):
    dear, cheap = Known(size=0.1, step=50.0), Known(size=0.1, step=1.0)
    choose(dear, cheap)
    assert automatic.integrate_to_error(SCENE, 1e-5, 8.0, Samples()).choice.method == cheap
    high = Known(size=0.1, power=4, step=50.0)
    choose(cheap, high)
    assert automatic.integrate_to_error(SCENE, 1e-6, 8.0, Samples()).choice.method == high


def test_spacing_is_kept(choose):
    choose(Known(size=0.1))
    found = automatic.integrate_to_error(SCENE, 1e-4, 8.0, Samples(0.5, 2))
    np.testing.assert_allclose(found.t, np.arange(9.0), atol=1e-12)
    assert (0.5 / found.choice.dt) % 2 == pytest.approx(0, abs=1e-9)


def test_more_steps_than_anybody_waits_for_are_refused_before_they_are_taken(choose):
    choose(Known(size=0.1))
    with pytest.raises(cv.BadInput, match=r"error: got what takes .* steps; allowed: what 1e\+10 steps reach"):
        automatic.integrate_to_error(SCENE, 1e-9, 1e9, Samples(None, 10**12))
    assert max(grid.n_steps for grid in Known.taken) <= search.MOST_PROBED
    candidate = drive(Known(size=1.0), 1e-15, 8.0)
    assert candidate.hopeless
    assert candidate.expected_work(1.0) == math.inf


def test_an_error_that_cannot_be_reached_is_a_warning(choose):
    choose(Known(size=1e-3, power=0))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = cv.integrate(SCENE, error=1e-18)
    assert [(each.category, each.filename) for each in caught] == [(AccuracyNotReached, __file__)]
    assert not found.choice.reached
    assert found.choice.error == 1e-18
    assert 3 <= len(found.choice.attempts) <= automatic.ATTEMPTS


def drive(method, error, t_end):
    """Return a candidate for the scene that is advanced until it is settled or given up."""
    candidate = search.begin(method, SCENE, search.goal_for(SCENE, error, t_end))
    while not (candidate.settled or candidate.hopeless):
        candidate = candidate.advance(trials.Trials(SCENE, {}, lambda method, grid: None))
    return candidate


def test_a_probe_is_short_and_asks_for_its_share():
    candidate = drive(Known(size=0.1), 1e-1, 1e3)
    duration = search.PROBE_RADIANS / search.bound_rate(SCENE)
    assert Known.taken[-2].n_steps * Known.taken[-2].dt == pytest.approx(duration)
    share = 1e-1 * 4 * duration / 1e3
    assert 0.1 * candidate.dt**2 * duration <= 0.5 * share * 1.01
    assert 0.1 * candidate.dt**2 * duration > 0.1 * share
    n = round(duration / candidate.dt)
    assert candidate.work == pytest.approx(3.0 * 2 * n + n, rel=1e-9)
    assert Known.taken[0].dt == pytest.approx(duration / 2)
    Known.taken.clear()
    whole = drive(Known(size=1e-9, power=0), 1e-4, 8.0)
    assert whole.dt == Known.taken[0].dt == 0.5
