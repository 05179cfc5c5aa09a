"""What cannot be used is said before any work: which argument, which body, what was got and what is allowed."""

import numpy as np
import pytest

import conservative as cv
from conservative.integration.inputs import read_bodies

from .many_bodies import BODY, fields, scene, starts, tensors

N = 1000
GRAVITY = cv.UniformGravity(3.0, (0.1, 0.2, 0.3))


def changed(values, i, value):
    """A copy with another value in place i."""
    found = np.array(values, dtype=float)
    found[i] = value
    return found


R, W, J = *starts(N), tensors(N)
SHAPES = {
    "n differs": (
        {"R_WB0": R, "w_WB_B0": W[:7]},
        r"^w_WB_B0: got shape \(7, 3\); allowed: .* \(1000, 3\): 1000 bodies, as R_WB0 has",
    ),
    "n of a number": (
        {"w_WB_B0": W, "parameters": {"weight": [1.0, 2.0]}},
        r"^parameters\['weight'\]: got shape \(2,\); allowed: numbers of shape \(1000,\): 1000 bodies",
    ),
    "one start": ({"w_WB_B0": W[0]}, r"^w_WB_B0: got shape \(3,\); allowed: numbers of shape \(n, 3\)"),
    "no body": ({"w_WB_B0": np.empty((0, 3))}, r"^w_WB_B0: got shape \(0, 3\)"),
    "a text": ({"w_WB_B0": "fast"}, r"^w_WB_B0: got 'fast'"),
    "unknown number": ({"parameters": {"wieght": [1.0]}}, r"^parameters: got 'wieght'; allowed: 'weight' \(nearest\)"),
    "no mapping": ({"parameters": [1.0]}, r"^parameters: got \[1.0\]; allowed: a mapping"),
}


@pytest.mark.parametrize("what", SHAPES)
def test_shapes_that_do_not_match(what):
    given, message = SHAPES[what]
    with pytest.raises(cv.BadInput, match=message):
        cv.integrate_many(scene(GRAVITY), **given)


ONE_BAD = {
    "nan": ({"w_WB_B0": changed(W, 7, np.nan)}, r"^w_WB_B0\[7\]: got \[nan, nan, nan\], not finite"),
    "too fast": ({"w_WB_B0": changed(W, 5, (0, 1e101, 0))}, r"^w_WB_B0\[5\]: got .*1e\+101.* the largest 0 or of magnitude"),
    "too slow": ({"w_WB_B0": changed(W, 5, (0, 1e-101, 0))}, r"^w_WB_B0\[5\]: got .*1e-101.* the largest 0 or of magnitude"),
    "no rotation": ({"R_WB0": changed(R, 500, np.diag([1, 1, 1.1]))}, r"^R_WB0\[500\]: got a matrix with \|R'R - 1\| = 0.21"),
    "a reflection": ({"R_WB0": changed(R, 0, -np.eye(3))}, r"^R_WB0\[0\]: got a reflection"),
    "not positive": (
        {"inertia": changed(J, 4, np.diag([1.0, -1, 1]))},
        r"^inertia\[4\]: got principal moments .* not all positive",
    ),
    "not symmetric": (
        {"inertia": changed(J, 4, J[4] + [[0, 1e-3, 0]] * 3)},
        r"^inertia\[4\]: got a matrix that is not symmetric",
    ),
    "far apart": (
        {"inertia": changed(J, 4, BODY.R_BP @ np.diag([1e-14, 1, 1]) @ BODY.R_BP.T)},
        r"^inertia\[4\]: got principal moments .*(ratio up to 1e\+13|not all positive)",
    ),
    "nan weight": ({"parameters": {"weight": changed(np.ones(N), 8, np.nan)}}, r"^parameters\['weight'\]\[8\]: got nan"),
    "huge lever": ({"parameters": {"com_B": changed(W, 8, 1e101)}}, r"^parameters\['com_B'\]\[8\]: got \[1e\+101"),
}


@pytest.mark.parametrize("what", ONE_BAD)
def test_one_bad_body_is_named(what, monkeypatch):
    monkeypatch.setattr(cv.Gauss, "prepare", None)  # no work
    given, message = ONE_BAD[what]
    with pytest.raises(cv.BadInput, match=message):
        cv.integrate_many(scene(GRAVITY), **given, method=cv.Gauss())


FIELDS = {
    "stiffness": ("spring", "stiffness", 0.0, r"^parameters\['stiffness'\]\[2\]: got 0.0"),
    "rate": ("gradient", "rate", -1.0, r"^parameters\['rate'\]\[2\]: got -1.0"),
    "inertia of a field": ("gradient", "inertia", -np.eye(3), r"^parameters\['inertia'\]\[2\]: got principal moments"),
    "direction": ("gradient", "direction_W", 0.0, r"^parameters\['direction_W'\]\[2\]: got \[0.0, 0.0, 0.0\]"),
    "inertia in an orbit": ("orbit", "inertia", -np.eye(3), r"^parameters\['inertia'\]\[2\]: got principal moments"),
}


@pytest.mark.parametrize("what", FIELDS)
def test_what_one_potential_refuses_is_refused_of_many(what):
    field, name, value, message = FIELDS[what]
    potential, parameters = fields(5)[field]
    parameters = parameters | {name: changed(parameters[name], 2, value)}
    with pytest.raises(cv.BadInput, match=message):
        cv.integrate_many(scene(potential), parameters=parameters)


def test_numbers_of_a_field_are_those_that_it_makes_of_them():
    potential, parameters = fields(5)["gradient"]
    found = read_bodies(scene(potential), None, None, None, parameters)
    np.testing.assert_allclose(np.linalg.norm(found.parameters["direction_W"], axis=1), 1, rtol=1e-15)


OTHERS = {
    "threads": ({"threads": 0}, r"^threads: got 0"),
    "progress": ({"progress": 3}, r"^progress: got 3"),
    "error": ({"error": 0.0}, r"^error: got 0"),
    "no numbers": (
        {"scene": scene(), "parameters": {"weight": [1.0]}},
        r"^parameters: got 'weight'; allowed: none: .* no potential",
    ),
    "memory": ({"dt": 1e-6, "w_WB_B0": W}, r"^sample_every: got 1, for 2000001000 samples of 1000 bodies"),
    "two inertias": (
        {"scene": scene(cv.GravityGradient(0.7, BODY.inertia)), "inertia": J},
        r"^parameters: got None; allowed: .* an inertia of its own",
    ),
    "cannot do": ({"method": cv.Projected(), "scene": scene(), "w_WB_B0": W}, r"^method: got projected"),
}


@pytest.mark.parametrize("what", OTHERS)
def test_other_arguments(what):
    given, message = OTHERS[what]
    with pytest.raises(cv.BadInput, match=message):
        cv.integrate_many(**{"scene": scene(GRAVITY), "threads": 1} | given)


def test_a_step_that_is_too_long_for_the_fastest_is_refused_before_any_work():
    with pytest.raises(cv.BadInput, match=r"^dt: got 0.05.*\(body 321\)"):
        cv.integrate_many(scene(), w_WB_B0=changed(W, 321, (300.0, 20, 10)), method="moser_veselov", dt=0.05, t_end=1.0)
