"""Fields that turn, in engines and in multi-precision: no two of these write the equations the same way.

`Precise` has the field as a function of time in the world's axes, heyoka and SciPy have it in axes that turn, `Projected` has
it at the times of its stages, and is compared with the textbook's equations in tests/conservative/test_turning.py.
"""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.references.engines.heyoka import Heyoka
from conservative.references.engines.scipy import SciPy
from conservative.references.precise import Precise
from conservative.references.truth import reference

from .fields import FIELDS, INERTIA, scene_in

ORBIT = cv.Orbit(0.9, (0.3, -0.5, 0.8))
ACROSS = np.cross(ORBIT.normal_W, (0.2, 1.0, 0.4))
TURNING = {name: cv.Turning(field, ORBIT) for name, field in FIELDS.items()} | {
    "satellite": ORBIT.gravity_gradient(INERTIA, ACROSS)
}


@pytest.mark.parametrize("field", TURNING)
def test_every_formulation_gives_the_same_motion(field):
    scene = scene_in(TURNING[field])
    truth = cv.integrate(scene, 0.1, Precise(128))
    for method, allowed in (
        (Heyoka(1e-16), 1e-13),
        (Heyoka(1e-16, "base_vectors"), 1e-13),
        (Heyoka(1e-16, "lean"), 1e-13),
        (SciPy(rtol=2.3e-14), 1e-12),
        (cv.Projected(), 1e-13),
    ):
        found = cv.integrate(
            scene, 0.1 if method.order is None else 0.01, method, sample_every=1 if method.order is None else 10
        )
        assert angle_between(truth.R_WB, found.R_WB).max() < allowed, method.name
        assert np.abs(truth.w_WB_B - found.w_WB_B).max() < 10 * allowed, method.name


@pytest.mark.parametrize("method", [cv.Taylor(14), cv.Taylor(18)])
def test_taylor_in_the_field_of_a_satellite(method):
    scene = scene_in(TURNING["satellite"])
    truth, found = cv.integrate(scene, 0.1, Precise(128)), cv.integrate(scene, 0.02, method, sample_every=5)
    assert angle_between(truth.R_WB, found.R_WB).max() < 1e-13  # measured up to 1.3e-15
    assert np.abs(truth.w_WB_B - found.w_WB_B).max() < 1e-12


def test_truth_of_a_satellite_is_multi_precision():
    scene = scene_in(TURNING["satellite"])
    assert reference(scene, cv.Grid(0.1, 10)).trajectory.label.startswith("heyoka")


def test_a_function_that_turns_has_scipy_alone_beside_ours():
    gravity = FIELDS["gravity"]
    scene = scene_in(cv.Turning(cv.FunctionPotential(gravity.energy, gravity.gradient), ORBIT))
    assert "FunctionPotential" in Heyoka().unsupported(scene)
    assert "FunctionPotential" in Precise().unsupported(scene)
    found, known = (cv.integrate(each, 0.1, SciPy()) for each in (scene, scene_in(TURNING["gravity"])))
    assert angle_between(found.R_WB, known.R_WB).max() < 1e-10  # measured 1.8e-12
