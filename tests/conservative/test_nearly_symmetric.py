"""Free bodies with two moments that are nearly equal: what is not symmetric has no momentum about an axis to lose."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv

TURN = Rotation.from_rotvec((0.3, -0.5, 0.8)).as_matrix()


@pytest.mark.parametrize("apart", [1e-15, 3e-14, 1e-13, -9e-13, 1e-11, -1e-8])
def test_exact_steps_of_a_nearly_symmetric_body_are_ok(apart):
    body = cv.RigidBody(TURN @ np.diag((1.7, 1.7 * (1 + apart), 1.6)) @ TURN.T)
    scene = cv.Scene("nearly symmetric", body, TURN.T, (3, 4, 0.5), 10.0)
    assert cv.integrate(scene, 0.1, cv.MoserVeselov()).outcome.ok  # momentum about the axis is off by up to 1e-11
