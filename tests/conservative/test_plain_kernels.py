"""Short runs of kernels whose figures are known, cheap enough for kernels as plain Python as well."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import orthonormality, rotation_about

TURN = rotation_about((1, -2, 0.5), 1.1)
START = rotation_about((0.3, -0.5, 0.8), 0.7)
SYMMETRIC = cv.Scene(
    "top",
    cv.RigidBody(TURN @ np.diag((1.1, 1.1, 0.6)) @ TURN.T),
    START,
    (1, -2, 3),
    2.0,
    cv.UniformGravity(4, 0.5 * TURN[:, 2]),
)
HEAVY = cv.Scene(
    "heavy",
    cv.RigidBody(TURN @ np.diag((0.9, 1.7, 1.2)) @ TURN.T),
    START,
    (1.2, -2, 0.7),
    2.0,
    cv.UniformGravity(4, (0.3, -0.2, 0.4)),
)


def drift(trajectory):
    """The largest drift of any invariant of the scene, relative to its scale."""
    return max(float(np.abs(trajectory.drift(invariant)).max()) for invariant in trajectory.scene.invariants)


def test_a_top_is_kept_on_its_invariants():
    found = cv.integrate(SYMMETRIC, 0.1, cv.Lame(), t_end=200.0)
    assert drift(found) < 1e-14  # measured 2e-15
    assert orthonormality(found.R_WB).max() < 1e-14


def test_a_projected_step_is_on_its_invariants():
    found = cv.integrate(HEAVY, 0.2, cv.Projected(), t_end=20.0)
    assert drift(found) < 4e-15  # measured 1.4e-15


@pytest.mark.parametrize("dt", np.linspace(0.4, 2.0, 17))
def test_a_step_that_cannot_be_projected_is_a_failure(dt):
    found = cv.integrate(HEAVY, float(dt), cv.Projected(), t_end=40.0, on_failure="return")
    assert drift(found) < 1e-5
    assert found.ok or "too far from the invariants" in str(found.outcome)
