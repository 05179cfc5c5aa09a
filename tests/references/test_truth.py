from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.grid import Grid
from conservative.references import truth
from conservative.scenes.random_body import FIELDS, random_body

from ..sampling import sampled

R0 = rotation_about((0.3, -1, 0.4), 2.1)


def test_a_closed_form_is_checked_by_integration():
    scene = cv.scenes.brick_flip()
    solution = truth.reference(scene, Grid(0.1, 60, 3))
    assert not solution.approximate
    assert solution.names[0].endswith("/exact")
    assert solution.names[1].startswith("heyoka==")
    assert solution.agreement_rad < 2e-14  # measured 1.2e-15
    assert solution.checked_until == 6
    np.testing.assert_array_equal(solution.trajectory.t, np.arange(0, 61, 3) * 0.1)


def test_only_the_first_hundred_radians_of_a_closed_form_are_checked():
    scene = cv.Scene("long", cv.RigidBody((1, 2, 2.5)), R0, (0.1, 0.2, 20), 1e6)
    solution = truth.reference(scene, Grid(1e5, 10))
    assert solution.checked_until == pytest.approx(truth.CHECKED_RADIANS / 20, rel=1e-2)
    assert solution.trajectory.t[-1] == 1e6


def test_without_a_closed_form_two_integrations_are_compared():
    scene = cv.Scene("heavy", cv.RigidBody((0.5, 0.85, 1)), R0, (0.4, 1.2, 0.4), 3.0, cv.UniformGravity(1, (0, 0.2, 1)))
    solution = truth.reference(scene, Grid(0.5, 6))
    assert [name.split("==")[0] for name in solution.names] == ["heyoka", "scipy"]
    assert not solution.approximate
    assert solution.agreement_rad < 1e-11  # measured 3e-13
    assert solution.checked_until == 3


# A field without expressions
BOWL_FIELD = cv.FunctionPotential(lambda R: R[2, 2] ** 2, lambda R: np.diag((0, 0, 2 * R[2, 2])), scale=1.0, axis_W=(0, 0, 1))


def test_a_user_s_field_has_two_integrations_in_doubles():
    scene = cv.Scene("bowl", cv.RigidBody((0.5, 0.85, 1)), R0, (0.4, 1.2, 0.4), 2.0, BOWL_FIELD)
    solution = truth.reference(scene, Grid(0.5, 4))
    assert [name.split("/")[1].split(",")[0] for name in solution.names] == ["DOP853", "LSODA"]
    assert solution.approximate
    assert solution.agreement_rad < 1e-9  # measured 2e-11


def test_solutions_that_differ_are_refused(monkeypatch):
    # the paper's own map is second order: no truth
    monkeypatch.setattr(truth, "Precise", cv.Reduced)
    scene = cv.scenes.brick_flip()
    with pytest.raises(truth.Disagreement, match=r"scene: got 'brick_flip', for which .*exact and .*reduced differ by .* rad"):
        truth.reference(scene, Grid(0.1, 60))


HEAVY = cv.Scene("heavy", cv.RigidBody((0.5, 0.85, 1)), R0, (0.4, 1.2, 0.4), 1.0, cv.UniformGravity(1, (0, 0.2, 1)))
BOWL = cv.Scene("bowl", cv.RigidBody((0.5, 0.85, 1)), R0, (0.4, 1.2, 0.4), 1.0, BOWL_FIELD)


@pytest.mark.parametrize(("scene", "off"), [(cv.scenes.brick_flip(), 1e-11), (HEAVY, 1e-7), (BOWL, 1e-5)])
def test_differences_of_ten_times_the_errors_are_refused(scene, off, monkeypatch):
    exact = truth.difference
    monkeypatch.setattr(truth, "difference", lambda a, b: exact(a, b) + off)
    with pytest.raises(truth.Disagreement):
        truth.reference(scene, Grid(0.1, 10))


@pytest.mark.parametrize("what", ["R_WB", "w_WB_B"])
def test_attitudes_and_rates_are_compared(what):
    whole = truth.Exact().prepare(cv.scenes.brick_flip(), Grid(0.1, 20))()
    assert truth.difference(whole, replace(whole, **{what: getattr(whole, what)[::-1]})) > 0.1


def test_a_trajectory_that_ended_early_differs():
    scene = cv.scenes.brick_flip()
    whole, half = (truth.Exact().prepare(scene, Grid(0.1, n))() for n in (20, 10))
    assert truth.difference(whole, half) == np.inf
    assert truth.difference(whole, whole) == angle_between(whole.R_WB, whole.R_WB).max() == 0


@pytest.mark.parametrize(("field", "index"), sampled(product(FIELDS, [0, 1]), 5))
def test_two_independent_solutions_of_a_random_body_agree(field, index):
    scene = random_body(field, 7, index)
    solution = truth.confirm(scene, Grid(scene.t_end / 12, 12))
    assert solution.agreement_rad < 1e-13  # measured 0 to 7e-14
    assert solution.names[0].startswith("heyoka==")
    assert "collocation" in solution.names[1]


def test_the_second_solution_does_not_round_the_numbers_of_the_field():
    """This body amplifies round-off: with products in double precision the solutions differ by 2.7e-13 rad."""
    scene = random_body("gradient", 1002, 7)
    assert truth.confirm(scene, Grid(scene.t_end / 12, 12)).agreement_rad < 6e-14  # measured 2.9e-14


@pytest.mark.parametrize(("factor", "samples"), [(1 - 1e-11, 3), pytest.param(1 + 1e-12, 12, marks=pytest.mark.slow)])
def test_a_law_that_is_slightly_wrong_is_no_confirmation(monkeypatch, factor, samples):
    """Planted in the field of the second solution only: measured 3.8e-13 after a quarter of the duration, 2.5e-13 after all."""
    scene = random_body("spring", 7, 0)
    other = scene.rename("other", potential=replace_stiffness(scene.potential, factor))
    real = truth.collocate
    monkeypatch.setattr(truth, "collocate", lambda _, *grid: real(other, *grid))
    with pytest.raises(truth.Disagreement) as caught:
        truth.confirm(scene, Grid(scene.t_end / 12, samples))
    assert caught.value.agreement_rad > caught.value.allowed_rad == truth.CONFIRMED


def replace_stiffness(spring, factor):
    return cv.LinearSpring(spring.stiffness * factor, spring.point_B, spring.anchor_W, spring.rest_length)


def test_collocation_is_of_order_24():
    scene, grid = cv.scenes.brick_flip(), Grid(6.0, 1)
    exact = truth.Exact().solve(scene, grid).R_WB
    errors = [angle_between(truth.collocate(scene, grid, parts).R_WB, exact).max() for parts in (14, 18, 40)]
    order = np.log(errors[0] / errors[1]) / np.log(18 / 14)
    assert order == pytest.approx(24, abs=3)  # measured 23.1
    assert errors[2] < 2e-15  # measured 4e-16
