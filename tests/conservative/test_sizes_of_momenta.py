"""What drifts are relative to: all the momentum that the energy can make of a body, near rest too."""

import math

import numpy as np
import pytest

import conservative as cv
from conservative.invariants import kept_sizes


def test_momentum_is_relative_to_what_all_the_energy_makes_with_the_largest_moment():
    scene = cv.Scene("near rest", cv.RigidBody((1, 4, 25)), np.eye(3), (1e-3, 0, 0), 1.0, cv.UniformGravity(2, (0, 0, 3)))
    (found,) = kept_sizes(scene, frozenset({"vertical momentum"})).values()
    assert found == pytest.approx(math.sqrt(2 * scene.energy_scale * 25), rel=1e-12)
    (own,) = kept_sizes(scene, frozenset({"energy"})).values()
    assert own == scene.energy_scale
