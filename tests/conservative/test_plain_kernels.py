"""Short runs of kernels whose figures are known, cheap enough for kernels as plain Python as well."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import orthonormality, rotation_about
from conservative.kernels import projected
from conservative.methods.coefficients.explicit import DORMAND_PRINCE_8
from conservative.methods.projected import convert

from ..environments import run_python

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


@pytest.mark.parametrize(("defect", "done"), [(1e-16, 3), (1e-7, 3), (1e-5, 0), (1e-2, 0), (1.0, 0), (np.nan, 0)])
def test_a_step_that_is_left_off_its_invariants_is_a_failure(defect, done, monkeypatch):
    """The loop in Python, with a made-up projection: a real one ends on the invariants or far from them."""
    monkeypatch.setattr(projected, "take_step", lambda *given: given[-3:-1])
    monkeypatch.setattr(projected, "project", lambda *given: (*given[-2:], 8, defect))
    coefficients = projected.Coefficients(*DORMAND_PRINCE_8.packed, np.array(DORMAND_PRINCE_8.c), 0.1)
    march = getattr(projected.march, "py_func", projected.march)
    found = march(convert(HEAVY, cv.Projected())[2], coefficients, (3, 1, 0, np.empty((4, 4)), np.empty((4, 3))))
    assert found.done == done
    assert found.size == pytest.approx(defect, nan_ok=True)


@pytest.mark.slow
def test_without_a_folder_for_compiled_code_a_run_works_and_warns():
    code = (
        "import warnings, conservative as cv\n"
        "with warnings.catch_warnings(record=True) as told:\n    warnings.simplefilter('always')\n"
        "    print(cv.integrate(cv.scenes.brick_flip(t_end=0.1), 0.01, 'reduced').ok)\n"
        "print(['NUMBA_CACHE_DIR' in str(each.message) for each in told])"
    )
    nowhere = {"NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator", "NUMBA_CACHE_DIR": "/dev/null/nowhere"}
    status, out, error = run_python(code, **nowhere)
    assert (status, out) == (0, "True\n[True]\n"), error
