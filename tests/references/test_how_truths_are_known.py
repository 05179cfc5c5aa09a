"""Which truths are known to round-off, and which no better than two of their kind agree."""

import numpy as np
import pytest

import conservative as cv
from conservative.method import Grid
from conservative.references.truth import reference

BODY, START, RATES = cv.RigidBody((1.0, 1.7, 2.3)), np.eye(3), (0.4, -0.6, 0.9)
HOOK = np.array((0.1, 0.2, 0.4))
FIELDS = {
    "closed form": (None, False),
    "multi-precision": (cv.UniformGravity(2.0, (0.3, 0.1, 0.2)), False),
    "two integrators": (cv.FunctionPotential(lambda R: float(R[2] @ HOOK), lambda R: np.outer((0, 0, 1), HOOK)), True),
}


@pytest.mark.parametrize("kind", FIELDS)
def test_a_truth_is_approximate_where_it_is_neither_a_closed_form_nor_multi_precision(kind):
    potential, approximate = FIELDS[kind]
    found = reference(cv.Scene(kind, BODY, START, RATES, 1.0, potential), Grid(0.05, 4))
    assert found.approximate is approximate
