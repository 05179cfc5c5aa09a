"""Series steps projected onto the invariants, against 256 bits in every field with a recurrence."""

import math
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.arithmetic import cross, dot, vertical
from conservative.attitude import angle_between, orthonormality, rotation_about
from conservative.methods.taylor_model import find_model
from conservative.potentials.uniform_gravity import UniformField
from conservative.references.precise import Precise
from conservative.scenes.random_body import FIELDS as RANDOM_FIELDS
from conservative.scenes.random_body import random_body

from ..sampling import sampled
from .one_body import body_in_axes, drift

TURN = rotation_about((1, -2, 0.5), 1.1)
BODY = body_in_axes(TURN, 0.9, 1.7, 1.2)
SYMMETRIC = body_in_axes(TURN, 0.9, 0.9, 1.2)
OTHER_INERTIA = body_in_axes(rotation_about((1, 0.4, -0.5), 0.8), 1.0, 2.0, 1.5).inertia
COM, ANCHOR = np.array((0.3, -0.2, 0.4)), np.array((1.0, 0.5, -0.8))
FIELDS = {
    "gravity": cv.UniformGravity(4.0, COM),
    "gravity upwards": cv.UniformGravity(-4.0, COM),
    "spring": cv.LinearSpring(3.0, COM, ANCHOR, 0.4),
    "spring without length": cv.LinearSpring(3.0, COM, ANCHOR),
    "attraction": cv.PointAttraction(2.0, COM, ANCHOR),
    "repulsion": cv.PointAttraction(-2.0, COM, ANCHOR),
    "attraction of the pivot": cv.PointAttraction(2.0, (0, 0, 0), ANCHOR),
    "attraction to the pivot": cv.PointAttraction(2.0, COM, (0, 0, 0)),
    "gravity gradient": cv.GravityGradient(1.3, BODY.inertia, (0.3, -0.5, 0.8)),
    "gravity gradient in other axes": cv.GravityGradient(1.3, OTHER_INERTIA, (0.3, -0.5, 0.8)),
    "free": None,
}
ORDERS = {4: 0.8, 7: 1.5, 10: 2.5, 15: 3.5}
"""Orders, and the tolerance of the observed order in powers of two."""


@cache
def scene(field: str, t_end: float = 2.0) -> cv.Scene:
    return cv.Scene("generic", BODY, rotation_about((0.3, -0.5, 0.8), 0.7), (1.2, -2.0, 0.7), t_end, FIELDS[field])


@cache
def truth(field: str, t: float) -> np.ndarray:
    """Return the attitude at a time. A field without torque gives the motion of a free body."""
    held = scene("free" if field.endswith(" pivot") else field)
    return Precise(256).prepare(held, cv.Grid(t, 1))().R_WB[-1]


def error(field: str, order: int, steps: int, t: float = 2.0) -> float:
    found = cv.Taylor(order).prepare(scene(field), cv.Grid(t / steps, steps, steps))()
    return float(angle_between(truth(field, t), found.R_WB[-1]))


@pytest.mark.parametrize("field", sampled(FIELDS, 3, ["gravity gradient in other axes", "spring", "free"]))
def test_agrees_with_the_truth(field: str) -> None:
    assert error(field, 18, 40) < 5e-15  # measured up to 1.7e-15
    assert error(field, 14, 60) < 5e-15
    assert error(field, 14, 16) > 1e-16  # it is not the reference solution itself


@pytest.mark.parametrize("field", ["gravity", "spring", "attraction", "gravity gradient in other axes", "free"])
@pytest.mark.parametrize("order", ORDERS)
def test_a_step_has_the_error_of_its_order(field: str, order: int) -> None:
    """The error of one step is h^(p+1), or smaller if projection removes the leading term."""
    t = {4: 0.05, 7: 0.1, 10: 0.15, 15: 0.2}[order]
    coarse, fine = error(field, order, 1, t), error(field, order, 1, t / 2)
    assert fine < coarse * 2.0 ** -(order + 1 - ORDERS[order]) + 1e-15


@pytest.mark.parametrize(
    ("field", "order", "dt"), sampled([(f, *o) for f in FIELDS for o in ((6, 0.05), (14, 0.05), (18, 0.1))], 6)
)
def test_conserves_every_invariant(field: str, order: int, dt: float) -> None:
    trajectory = cv.integrate(scene(field), dt, cv.Taylor(order), t_end=500.0, sample_every=7)
    assert drift(trajectory) < 5e-15  # measured up to 2e-15
    assert orthonormality(trajectory.R_WB).max() < 1e-14  # measured 2e-15


@pytest.mark.parametrize("field", FIELDS)
def test_samples_are_corrected_to_round_off_and_do_not_change_the_motion(field: str) -> None:
    each = cv.Taylor(4).solve(scene(field), cv.Grid(0.1, 60))
    last = cv.Taylor(4).solve(scene(field), cv.Grid(0.1, 60, 60))
    np.testing.assert_array_equal(each.R_WB[-1], last.R_WB[-1])
    np.testing.assert_array_equal(each.w_WB_B[-1], last.w_WB_B[-1])
    assert each.counters.iterations > last.counters.iterations + 40  # measured 120 to 128, and 61 to 64
    assert drift(last) < 5e-15


def test_rounding_does_not_add_up() -> None:
    trajectory = cv.integrate(scene("gravity"), 0.05, cv.Taylor(12), t_end=5e4, sample_every=1000)
    energy, _ = (np.abs(trajectory.drift(invariant)) for invariant in trajectory.scene.invariants)
    assert drift(trajectory) < 1e-14
    assert energy[500:].mean() < 3 * energy[:500].mean() + 1e-16


@pytest.mark.parametrize("potential", [cv.UniformGravity(4.0, 0.3 * TURN[:, 2]), None])
def test_conserves_the_momentum_about_an_axis_of_symmetry(potential: cv.Potential | None) -> None:
    held = cv.Scene("top", SYMMETRIC, rotation_about((0.3, -0.5, 0.8), 0.7), (1.2, -2.0, 0.7), 2.0, potential)
    for order, dt in ((5, 0.05), (14, 0.1)):
        trajectory = cv.integrate(held, dt, cv.Taylor(order), t_end=500.0)
        assert "axial momentum" in [invariant.name for invariant in held.invariants]
        assert drift(trajectory) < 2e-14  # measured 6e-15


STARTS = {
    "long axis": (2.0, 0.3, 0.4),
    "long axis, backwards": (-2.0, 0.3, 0.4),
    "short axis": (0.3, 2.0, -0.4),
    "short axis, backwards": (0.3, -2.0, 0.4),
    "tumbling": (1e-3, 1e-3, 2.0),
    "steady": (0.0, -2.0, 0.0),
    "unstable": (0.0, 0.0, 2.0),
    "nearly steady": (1e-9, 2.0, 1e-9),
    "separatrix": (1.2, 1.2 * math.sqrt(0.27 / 0.85), 0.0),
}


@pytest.mark.parametrize("start", STARTS)
def test_free_bodies_circulate_about_any_axis(start: str) -> None:
    """Moments are 0.9, 1.7 and 1.2: the momentum circulates about the first or the second axis."""
    held = cv.Scene(start, BODY, rotation_about((0.3, -0.5, 0.8), 0.7), TURN @ STARTS[start], 2.0)
    exact = Precise(256).prepare(held, cv.Grid(2.0, 1))()
    for order, steps in ((18, 20), (8, 80)):
        found = cv.Taylor(order).prepare(held, cv.Grid(2.0 / steps, steps, 1))()
        assert angle_between(exact.R_WB[-1], found.R_WB[-1]) < 1e-14  # measured up to 4e-15
        assert np.abs(exact.w_WB_B[-1] - found.w_WB_B[-1]).max() < 1e-14  # measured up to 2.1e-15
        assert drift(found) < 5e-15  # measured up to 1.8e-15


TOPS = {
    "sleeping": (0.01, (0.0, 0.01, 9.0), False),
    "over the top": (1.2, (4.0, 0.0, 0.1), False),
    "nutating": (1.2, (0.5, -0.4, 6.0), True),
    "nutating down": (1.9, (0.5, -0.4, -6.0), True),
    "steady": (1.0, None, True),
}


@pytest.mark.parametrize("top", TOPS)
def test_tops_away_from_the_vertical_are_reduced_to_their_nutation(top: str) -> None:
    """Up to a height of 0.8 the angles are as accurate as the series. Otherwise rows and rates are integrated."""
    angle, w, reduced = TOPS[top]
    if w is None:  # Lagrange's steady precession at a rate p: J3 w3 p = M + (J1 p^2) cos
        p, cos, sin = 1.5, math.cos(angle), math.sin(angle)
        w = (0.0, p * sin, p * cos + (1.2 + 0.9 * p * p * cos - 1.2 * p * p * cos) / (1.2 * p))
    R, body = rotation_about((1, 0, 0), angle), cv.RigidBody((0.9, 0.9, 1.2))
    held = cv.Scene(top, body, R, w, 2.0, cv.UniformGravity(1.0, (0, 0, 1.2)))
    exact = Precise(256).prepare(held, cv.Grid(2.0, 1))()
    field = find_model(held, True)[1].field
    assert (type(field).__name__ == "Nutation") is reduced
    for order, steps, allowed in ((18, 40, 2e-14), (8, 80, 2e-8)):  # measured up to 6e-15 and 4e-9
        found = cv.Taylor(order).prepare(held, cv.Grid(2.0 / steps, steps, 1))()
        assert angle_between(exact.R_WB[-1], found.R_WB[-1]) < allowed
        assert np.abs(exact.w_WB_B[-1] - found.w_WB_B[-1]).max() < allowed
        assert drift(found) < 5e-15
    if reduced and top != "steady":
        assert "too far from the invariants" in str(cv.integrate(held, 2.0, cv.Taylor(5), on_failure="return").outcome)


def test_a_ball_with_its_weight_anywhere_is_symmetric() -> None:
    ball = cv.Scene("ball", cv.RigidBody((1, 1, 1)), rotation_about((1, 2, 3), 1.0), (1, -1, 2), 2.0, cv.UniformGravity(3, COM))
    assert drift(cv.integrate(ball, 0.1, cv.Taylor(), t_end=100.0)) < 1e-14


@pytest.mark.parametrize("field", ["gravity", "free"])
def test_bodies_at_rest_stay(field: str) -> None:
    hanging = cv.UniformGravity(4.0, (0, 0, -0.3)) if field == "gravity" else None
    still = cv.Scene("still", cv.RigidBody((1, 1.4, 2)), np.eye(3), (0, 0, 0), 10.0, hanging)
    found = cv.integrate(still, 0.1, cv.Taylor())
    assert angle_between(found.R_WB[0], found.R_WB[-1]) < 1e-15
    assert np.abs(found.w_WB_B).max() == 0


def test_slow_swings_are_not_lost_in_projection() -> None:
    """The gradient of energy is 1e-5 of its usual size: steps that followed its round-off would have errors of 1e-11."""
    slow = cv.Scene("slow", BODY, np.eye(3), (1e-5, 2e-5, 0), 3.0, cv.UniformGravity(4.0, (0, 0, -0.3)))
    exact = Precise(256).prepare(slow, cv.Grid(3.0, 1))()
    found = cv.integrate(slow, 0.05, cv.Taylor())
    assert angle_between(exact.R_WB[-1], found.R_WB[-1]) < 3e-15  # measured 3.3e-16
    assert np.abs(exact.w_WB_B[-1] - found.w_WB_B[-1]).max() < 3e-15


@pytest.mark.parametrize("field", ["gravity", "spring", "attraction", "gravity gradient", "free"])
def test_a_step_that_cannot_be_projected_is_reported(field: str) -> None:
    found = cv.integrate(scene(field), 2.0, cv.Taylor(5), on_failure="return")
    assert str(found.outcome).startswith("not converged in step 1")
    assert "too far from the invariants" in str(found.outcome)
    assert (len(found), found.counters.steps, found.counters.stages, found.counters.evaluations) == (1, 0, 0, 5)


def test_a_step_that_overflows_is_a_failure() -> None:
    found = cv.integrate(scene("gravity", 1e30), 1e30, cv.Taylor(18), on_failure="return")
    assert found.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    assert not found.outcome.residual < 1e-6  # not a number, too
    assert len(found) == 1


PASSING = cv.Scene(
    "close passage",
    BODY,
    rotation_about((0.3, -0.5, 0.8), 0.7),
    (0.3, -0.2, 0.1),
    4.0,
    cv.PointAttraction(2.0, COM, 1.02 * np.linalg.norm(COM) / np.linalg.norm(ANCHOR) * ANCHOR),
)
"""The points approach each other to a fortieth of their largest distance."""


@pytest.mark.parametrize(
    ("order", "tolerance", "allowed"), sampled([(16, 1e-12, 7e-14), (12, 1e-6, 4e-7), (14, 1e-9, 2e-10), (16, 1e-14, 3e-14)], 1)
)
def test_a_tolerance_divides_steps_in_a_close_passage(order: int, tolerance: float, allowed: float) -> None:
    exact = Precise(256).prepare(PASSING, cv.Grid(4.0, 1))().R_WB[-1]
    assert not cv.Taylor().run(PASSING, 0.005).ok
    method = cv.Taylor(tolerance=tolerance)
    found = method.run(PASSING, 4.0)
    assert method.terms == order
    assert found.ok
    assert angle_between(exact, found.R_WB[-1]) < allowed  # measured a third of it
    assert drift(found) < 2e-14  # measured 5e-15
    parts, computed = found.counters.stages // order, found.counters.evaluations // order
    assert found.counters.steps == 1 < 50 < parts < 200  # measured 58 to 145; 4,000 steps of 0.001 leave 1e-8
    assert parts == computed


@pytest.mark.slow
def test_a_first_guess_that_is_far_too_long_or_too_short_does_not_matter() -> None:
    """A rotor forces a nutation of 1e6 rad/s on one body. The other one turns at 1e-9 of the rate that all energy allows."""
    rotor = cv.RigidBody((0.9, 1.7, 1.2), rotor_momentum=(0.3e6, -0.5e6, 0.8e6))
    fast = cv.Scene("fast", rotor, np.eye(3), (1.2, -2.0, 0.7), 1e-4, FIELDS["gravity"])
    slow = cv.Scene("slow", BODY, np.eye(3), (1e-9, -2e-9, 1e-9), 3e9, FIELDS["attraction of the pivot"])
    for held, steps in ((fast, 100), (slow, 100)):
        method = cv.Taylor(tolerance=1e-14)
        grid = cv.Grid(held.t_end, 1)
        found, equal = method.prepare(held, grid)(), cv.Taylor(18).prepare(held, cv.Grid(held.t_end / steps, steps))()
        assert angle_between(equal.R_WB[-1], found.R_WB[-1]) < 1e-14  # measured 1e-16 and 2e-15
        assert found.counters.evaluations == found.counters.stages < 500 * method.terms  # measured 369 and 27 steps


MEDIANS = {1e-3: 0.1, 1e-6: 0.06, 1e-9: 0.05, 1e-12: 0.15}


@pytest.mark.parametrize(
    ("field", "tolerance"),
    sampled(product(RANDOM_FIELDS, MEDIANS), 4, [("spring", 1e-12)], [("fixed_gradient", tolerance) for tolerance in MEDIANS]),
)
def test_errors_are_below_the_tolerance(field: str, tolerance: float) -> None:
    """After 12 rad, in tolerances. One in 50 random bodies is less stable than these, and can have a larger error."""
    method, found = cv.Taylor(tolerance=tolerance), []
    for index in range(3):
        held = random_body(field, 7, index)
        grid = cv.Grid(held.t_end / 12, 12)
        found.append(angle_between(truths(field, index), method.prepare(held, grid)().R_WB).max() / tolerance)
    assert np.median(found) < MEDIANS[tolerance]  # measured up to 0.036, 0.023, 0.026, 0.059
    assert max(found) < 1  # measured up to 0.35
    assert max(found) > 1e-3  # measured 0.007: steps are not much shorter than the tolerance allows


@cache
def truths(field: str, index: int) -> np.ndarray:
    """Return the attitudes of a random body."""
    held = random_body(field, 7, index)
    return Precise(96).prepare(held, cv.Grid(held.t_end / 12, 12))().R_WB


def test_a_tolerance_samples_at_the_times_of_the_grid() -> None:
    grid = cv.Grid(0.25, 16, 1)
    fine = cv.Taylor(tolerance=1e-13).solve(PASSING, grid)
    exact = Precise(256).prepare(PASSING, grid)()
    np.testing.assert_array_equal(fine.t, grid.t)
    assert angle_between(exact.R_WB, fine.R_WB).max() < 1e-12
    assert fine.counters.steps == 16


SAMPLED = {field: scene(field) for field in FIELDS} | {
    "symmetric top": cv.Scene("top", SYMMETRIC, TURN, (1.2, -2.0, 0.7), 2.0, cv.UniformGravity(4.0, 0.3 * TURN[:, 2])),
    "lagrange_top": registry.scene("lagrange_top"),
    "brick_flip": registry.scene("brick_flip"),
    "satellite": registry.scene("librating_satellite"),
}


@pytest.mark.parametrize(
    ("name", "every"), sampled(product(SAMPLED, (1, 7)), 4, [("satellite", 7), ("brick_flip", 1), ("symmetric top", 7)])
)
def test_steps_span_samples_that_are_as_accurate_as_steps(name: str, every: int) -> None:
    """If every 7th is stored, the last interval is shorter. Samples do not change the steps."""
    held, method = SAMPLED[name], cv.Taylor(tolerance=1e-11)
    grid = cv.Grid(held.t_end / 200 / every, 200 * every - every // 2, every)
    found, end = method.solve(held, grid), method.solve(held, cv.Grid(grid.dt * grid.n_steps, 1))
    exact = Precise(256).prepare(held, grid)()
    assert found.ok
    assert angle_between(exact.R_WB, found.R_WB).max() < 2e-11  # measured 8e-12 on the brick, 1.3e-13 on others
    assert np.abs(exact.w_WB_B - found.w_WB_B).max() < 2e-11 * np.abs(exact.w_WB_B).max()
    assert drift(found) < 1e-14  # measured 2e-15
    assert orthonormality(found.R_WB).max() < 1e-14  # measured 1.2e-15
    assert angle_between(end.R_WB[-1], found.R_WB[-1]) < 1e-11  # measured 1.5e-12
    assert found.counters.steps == grid.n_steps
    assert found.counters.stages / method.terms < 150  # steps; measured 15 to 142 for 200 samples


@pytest.mark.parametrize("method", [cv.Taylor(), cv.Taylor(tolerance=1e-11)])
def test_the_loop_of_a_run_can_be_timed_alone(method: cv.Taylor) -> None:
    for name in ("lagrange_top", "librating_satellite"):  # the samples of the latter are turned afterwards
        run: Any = method.prepare(registry.scene(name), cv.Grid(0.01, 5))
        assert run.own_loop()[0] == run().counters.steps == 5


def test_samples_before_a_step_that_cannot_be_projected_are_kept() -> None:
    found = cv.Taylor(tolerance=0.4).solve(PASSING, cv.Grid(1e-3, 4000))
    exact = Precise(256).prepare(PASSING, cv.Grid(1e-3, 4000))()
    assert found.outcome.kind is cv.OutcomeKind.NOT_CONVERGED
    assert 1 < len(found) == found.outcome.step < 4000
    assert drift(found) < 1e-13
    assert angle_between(exact.R_WB[: len(found)], found.R_WB).max() < 0.5


@pytest.mark.parametrize("tolerance", [0.0, -1e-9, np.nan, np.inf, "fine", True])
def test_a_tolerance_is_a_number_above_0(tolerance: object) -> None:
    with pytest.raises(cv.BadInput) as raised:
        cv.Taylor(tolerance=tolerance)
    assert raised.value.argument == "tolerance"


def test_an_order_and_a_tolerance_exclude_each_other() -> None:
    with pytest.raises(cv.BadInput, match="which chooses the order"):
        cv.Taylor(14, 1e-9)
    assert (cv.Taylor().order, cv.Taylor(tolerance=1e-9).order) == (14, None)
    assert cv.Taylor(tolerance=1e-30).terms == 18


PARALLEL = [("lagrange_top", 8, 0.04), ("lagrange_top", 6, 0.01), ("simo_wong_top", 6, 0.16)]


@pytest.mark.parametrize(("name", "order", "dt"), PARALLEL)
def test_steps_near_steady_precessions_are_corrected_to_round_off(name: str, order: int, dt: float) -> None:
    """Gradients are nearly parallel, so that one correction leaves a part of the defect: 1e-13 or more."""
    found = cv.Taylor(order).solve(registry.scene(name), cv.Grid(dt, 60))
    assert found.ok
    assert drift(found) < 2e-14  # measured 5e-15


class Upwards(UniformField):
    """The opposite field with the same numbers."""

    __slots__ = ()

    def body_torque(self, q):
        return cross(self, vertical(q))

    def find_constants(self, J_inverse):
        return tuple(tuple(-x for x in row) for row in super().find_constants(J_inverse))

    def slope(self, constants, g):
        return -dot(g, self), tuple(-x for x in self)

    def energies(self, R_WB):
        return -super().energies(R_WB)


class Lift(cv.UniformGravity):
    @property
    def moment_B(self):
        return -super().moment_B

    @staticmethod
    def build_field(R_BP, weight, com_B):
        return Upwards(*cv.UniformGravity.build_field(R_BP, weight, com_B))


@pytest.mark.parametrize("method", sampled([cv.Taylor(), cv.Taylor(tolerance=1e-12)], 1), ids=lambda method: method.name)
def test_two_fields_with_equal_numbers_have_code_of_their_own(method):
    """Named tuples of different types with equal numbers are equal: a cache that compares them runs the other field's code."""
    start = BODY, np.eye(3), [0.7, -1.1, 1.6], 2.0
    for field, same in ((cv.UniformGravity(4.0, COM), 4.0), (Lift(4.0, COM), -4.0)):
        found = method.solve(cv.Scene("a", *start, field), cv.Grid(0.02, 100))
        known = method.solve(cv.Scene("b", *start, cv.UniformGravity(same, COM)), cv.Grid(0.02, 100))
        assert angle_between(known.R_WB, found.R_WB).max() < 1e-11  # measured: 0; with one code for both 2.6
