"""Reference solutions of scenes with a torque or damping."""

from __future__ import annotations

import numpy as np
import pytest

import conservative as cv
from conservative.grid import Grid
from conservative.references.truth import difference, reference
from tests.conservative.test_loads import SCENES


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_reduced_converges_to_the_reference_at_its_order(scene):
    truth = reference(scene, Grid(0.5, 10))
    assert truth.agreement_rad < 1e-10  # measured: 1.7e-13, at the bends of the table 1.6e-12
    errors = [
        difference(truth.trajectory, cv.integrate(scene, dt, cv.Reduced(order=4), sample_every=round(0.5 / dt)))
        for dt in (0.05, 0.025)
    ]
    assert 14 < errors[0] / errors[1] < 18
    assert errors[1] < 1e-6
    scipy = cv.integrate(scene, 0.5, "scipy")
    assert difference(truth.trajectory, scipy) < 1e-8
    assert np.isnan(scipy.drift("energy balance")).all()
