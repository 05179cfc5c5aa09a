"""Explicit steps projected onto the invariants, against collocation of high order, in every kind of field."""

from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, orthonormality, rotation_about
from conservative.methods.coefficients.explicit import DORMAND_PRINCE_8, ExplicitTableau

TURN = rotation_about((1, -2, 0.5), 1.1)
BODY = cv.RigidBody(TURN @ np.diag((0.9, 1.7, 1.2)) @ TURN.T)
COM = np.array((0.3, -0.2, 0.4))
FIELDS = {
    "gravity": cv.UniformGravity(4.0, COM),
    "spring": cv.LinearSpring(3.0, COM, (1.0, 0.5, -0.8), 0.4),
    "attraction": cv.PointAttraction(2.0, COM, (1.0, 0.5, -0.8)),
    "gravity gradient": cv.GravityGradient(1.3, BODY.inertia, (0.3, -0.5, 0.8)),
    "two functions": cv.FunctionPotential(
        lambda R: (R[2] @ COM) ** 3,
        lambda R: 3 * (R[2] @ COM) ** 2 * np.outer((0, 0, 1), COM),
        axis_W=np.array((0.0, 0.0, 1.0)),
    ),
    "no axis": cv.FunctionPotential(
        lambda R: (R[0] @ COM) * (R[2] @ COM), lambda R: np.outer((R[2] @ COM, 0, R[0] @ COM), COM)
    ),
}
SLOW = ("two functions", "no axis")
"""Fields that call Python."""


def scene(field: str, t_end: float = 2.0) -> cv.Scene:
    return cv.Scene("generic", BODY, rotation_about((0.3, -0.5, 0.8), 0.7), (1.2, -2.0, 0.7), t_end, FIELDS[field])


def drift(trajectory: cv.Trajectory) -> float:
    """The largest drift of any invariant of the scene, relative to its scale."""
    return max(float(np.abs(trajectory.drift(invariant)).max()) for invariant in trajectory.scene.invariants)


@pytest.mark.parametrize("field", FIELDS)
def test_agrees_with_a_method_that_shares_no_code(field: str) -> None:
    """Reduced at order 8 solves equations of a finite derivative, which has nothing in common with the torque used here."""
    end = 0.2 if field in SLOW else 2.0
    truth = cv.integrate(scene(field, end), 0.01, cv.Reduced(order=8))
    trajectory = cv.integrate(scene(field, end), 0.02, cv.Projected())
    assert angle_between(truth.R_WB[-1], trajectory.R_WB[-1]) < 2e-14  # measured up to 2.1e-15
    assert np.abs(truth.w_WB_B[-1] - trajectory.w_WB_B[-1]).max() < 3e-14  # measured up to 3.4e-15


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("dt", [0.02, 0.3])
def test_keeps_every_invariant_of_the_field(field: str, dt: float) -> None:
    end = 3.0 if field in SLOW else 300.0
    trajectory = cv.integrate(scene(field), dt, cv.Projected(), t_end=end)
    assert drift(trajectory) < 4e-15  # measured up to 1.4e-15
    assert orthonormality(trajectory.R_WB).max() < 1e-14  # measured 1.6e-15


@pytest.mark.parametrize("field", ["gravity", "gravity gradient"])
def test_is_of_order_eight(field: str) -> None:
    truth = cv.integrate(scene(field), 0.005, cv.Projected()).R_WB[-1]
    coarse, fine = (angle_between(truth, cv.integrate(scene(field), 2.0 / n, cv.Projected()).R_WB[-1]) for n in (8, 16))
    assert np.log2(coarse / fine) == pytest.approx(8, abs=0.6)  # measured 7.63 and 8.05


def test_a_steady_precession_whose_invariants_depend_on_each_other() -> None:
    """The paper's top precesses steadily, so that gradients of energy and momentum are parallel; errors leave a square."""
    for dt, allowed in ((0.005, 2e-15), (0.01, 1e-11)):  # measured 4.5e-16 and 3.3e-12
        trajectory = cv.integrate(cv.scenes.lagrange_top(t_end=2.0), dt, cv.Projected())
        assert drift(trajectory) < allowed


def test_a_body_at_rest_in_equilibrium_stays() -> None:
    trajectory = cv.integrate(cv.scenes.hanging_rest(), 0.1, cv.Projected())
    assert angle_between(trajectory.R_WB[0], trajectory.R_WB[-1]) < 1e-15  # measured 0


def test_a_step_that_cannot_be_projected_says_so() -> None:
    trajectory = cv.integrate(scene("gravity"), 2.0, cv.Projected(), on_failure="return")
    assert str(trajectory.outcome).startswith("not converged in step 1")
    assert "too far from the invariants" in str(trajectory.outcome)
    assert len(trajectory) == 1


def test_samples_do_not_change_the_motion() -> None:
    all_of_them, few = (cv.integrate(scene("gravity"), 0.05, cv.Projected(), sample_every=every) for every in (1, 7))
    assert np.array_equal(all_of_them.R_WB[[0, 7, 14, 21, 28, 35, 40]], few.R_WB)


def test_a_free_body_has_a_better_method() -> None:
    with pytest.raises(cv.Unsupported, match="bodies in a field"):
        cv.integrate(cv.scenes.brick_flip(), 0.01, cv.Projected())


@pytest.mark.parametrize("digit", range(12))
def test_a_wrong_digit_in_the_weights_is_noticed(digit: int) -> None:
    b = list(DORMAND_PRINCE_8.b)
    b[digit] += 1e-9
    if DORMAND_PRINCE_8.c[digit] > 0 or digit == 0:
        with pytest.raises(cv.BadInput, match="sum b"):
            replace(DORMAND_PRINCE_8, b=tuple(b))


def test_a_wrong_digit_in_a_stage_is_noticed() -> None:
    rows = [list(row) for row in DORMAND_PRINCE_8.A]
    rows[11][6] += 1e-9
    with pytest.raises(cv.BadInput, match="sum b"):
        replace(DORMAND_PRINCE_8, A=tuple(tuple(row) for row in rows))
    with pytest.raises(cv.BadInput, match="rows of"):
        ExplicitTableau("none", 1, ((), ()), (0.5, 0.5))
