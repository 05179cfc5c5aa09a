"""Engines that take a field through its gradient, on a body whose principal axes are not its own."""

import numpy as np

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.method import Grid
from conservative.references.engines.scipy import SciPy

TURN = rotation_about((1, -2, 0.5), 1.1)
SCENE = cv.Scene(
    "sprung",
    cv.RigidBody(TURN @ np.diag((0.9, 1.7, 1.2)) @ TURN.T),
    rotation_about((0.3, -0.5, 0.8), 0.7),
    (1.2, -2, 0.7),
    1.0,
    cv.LinearSpring(3.0, (0.3, -0.2, 0.4), (1.0, 0.5, 2.0), 0.4),
)


def test_scipy_turns_the_torque_into_principal_axes():
    grid = Grid(0.01, 100)
    found, other = (method.solve(SCENE, grid) for method in (SciPy(rtol=1e-12), cv.Reduced(8)))
    assert angle_between(found.R_WB, other.R_WB).max() < 1e-9
