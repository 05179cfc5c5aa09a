"""Recordings near a separatrix: the motion multiplies the digits or the noise of the first row to an error of any size."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.recordings import verdict
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.references.exact.method import free_body

AXES = Rotation.from_rotvec([0.5, -0.8, 0.4]).as_matrix()
T = np.linspace(0, 20, 401)


def scene(middle=10.0):
    """A body that turns about nearly its middle axis; the axes are not principal."""
    body = cv.RigidBody(AXES @ np.diag([13.0, 5.0, middle]) @ AXES.T)
    return cv.Scene("near", body, Rotation.from_rotvec([0.3, 0.2, -0.6]), AXES @ [0.0, 1e-6, 10.0], 20.0)


def rounded(R, w, step):
    q = Rotation.from_quat(np.round(Rotation.from_matrix(R).as_quat() / step) * step).as_matrix()
    return Recording(T, (q, np.round(w / step) * step), rows=len(T), digits=(0.0, 2 * step, step / 2))


def noisy(R, w, size):
    random = np.random.default_rng(4)
    turned = R @ Rotation.from_rotvec(size * random.normal(size=(len(T), 3))).as_matrix()
    return Recording(T, (turned, w + 10 * size * random.normal(size=w.shape)), rows=len(T))


@pytest.mark.slow  # the search for the start; `test_verdicts.py` has a shorter one by default
@pytest.mark.parametrize(("make", "size"), [(rounded, 1e-3), (rounded, 1e-4), (noisy, 1e-3)], ids=["3", "4", "noise"])
def test_few_digits_and_noise_are_not_wrong(make, size, unnamed):
    """The first row alone is off by 3.1 rad. Right with 3 digits and with noise; no start is found with 4 digits."""
    near = scene()
    found = verdict.verify_recording(near, make(*free_body(near.body, near.R_WB0, near.w_WB_B0, T), size))
    assert found.verdict in ("right", "undecided"), found.sentence
    assert found.details.first_row[0] > 5 * found.details.allowed[0]


@pytest.mark.slow
def test_another_body_stays_wrong(unnamed):
    near, other = scene(), scene(9.0)
    found = verdict.verify_recording(near, rounded(*free_body(other.body, near.R_WB0, near.w_WB_B0, T), 1e-4))
    assert found.verdict == "wrong", found.sentence
