"""Labels, bad settings, formulations and degenerate scenes."""

from dataclasses import fields
from importlib.metadata import version

import numpy as np
import pytest

import conservative as cv
from conservative.grid import Grid
from conservative.references.environments import catalogue
from conservative.references.environments.catalogue import MuJoCo, Pinocchio
from conservative.references.heyoka_equations import formulations
from conservative.references.heyoka_equations.accelerations import express_field
from conservative.references.precise import Precise
from conservative.references.solvers.heyoka import FRAMES, Heyoka
from conservative.references.solvers.scipy import SciPy
from conservative.scenes.random_body import random_body

from ..sampling import sampled


@pytest.mark.parametrize(
    ("method", "package", "setting"),
    [
        (MuJoCo("implicitfast"), "mujoco", "implicitfast"),
        (Pinocchio("Euler"), "pin", "aba+Euler"),
        (Heyoka(1e-9), "heyoka", "tol=1e-09,body"),
        (Heyoka(1e-9, "lean"), "heyoka", "tol=1e-09,lean"),
        (Heyoka(1e-12, "base_vectors"), "heyoka", "tol=1e-12,base_vectors"),
        (Heyoka(1e-9, "angle", fast_math="off"), "heyoka", "tol=1e-09,angle,fast_math=off"),
        (SciPy("RK45", 1e-6), "scipy", "RK45,rtol=1e-06"),
        (SciPy(rtol=1e-15, loop="compiled"), "scipy", "DOP853,rtol=1e-15,compiled"),
        (Precise(128), "heyoka", "128 bits"),
    ],
)
def test_labels_have_version_and_setting(method, package, setting):
    assert method.label == f"{package}=={version(package)}/{setting}"


@pytest.mark.parametrize("family", [MuJoCo, Pinocchio])
def test_the_settings_of_a_class_are_those_in_the_file_of_the_engine(family):
    """Editors and mypy read the class, an environment of the same engine the file."""
    assert {field.name: (field.type, field.default) for field in fields(family)} == {
        name: (type(value).__name__, value) for name, value in family.adapter.ENGINE["settings"].items()
    }
    apart = getattr(catalogue, family.family)
    assert (family.data, family.method_info, family().precision) == (apart.data, apart.method_info, apart.precision)


BAD = [
    (MuJoCo, {"integrator": "rk4"}, r"integrator: got 'rk4'; expected one of 'Euler', 'RK4'"),
    (Pinocchio, {"scheme": "leapfrog"}, r"scheme: got 'leapfrog'; expected one of 'Euler', 'RK4'"),
    (Heyoka, {"tol": 0}, r"tol: got 0; expected a number above 0, from 1e-20, and below 1"),
    (Heyoka, {"tol": -1e-9}, r"tol: got -1e-09; expected"),
    (Heyoka, {"tol": 1.0}, r"tol: got 1.0; expected"),
    (Heyoka, {"tol": float("nan")}, r"tol: got nan; expected"),
    (Heyoka, {"frame": "slow"}, r"frame: got 'slow'; expected one of 'body', 'non_spinning', 'lean', 'base_vectors', 'angle'"),
    (Heyoka, {"fast_math": True}, r"fast_math: got True; expected one of 'auto', 'on', 'off'"),
    (SciPy, {"integrator": "dop853"}, r"integrator: got 'dop853'; expected one of 'DOP853'"),
    (SciPy, {"rtol": 0.0}, r"rtol: got 0.0; expected a number from 2.3e-14"),
    (SciPy, {"rtol": 1e-15}, r"rtol: got 1e-15; expected"),
    (SciPy, {"rtol": 1e-16, "loop": "compiled"}, r"rtol: got 1e-16; expected a number from 1e-15"),
    (SciPy, {"rtol": 1e-14, "loop": "compiled", "integrator": "LSODA"}, r"rtol: got 1e-14; expected a number from 2.3e-14"),
    (SciPy, {"rtol": "tight"}, r"rtol: got 'tight'; expected"),
]


@pytest.mark.parametrize(("method", "settings", "message"), BAD)
def test_bad_settings(method, settings, message):
    with pytest.raises(cv.BadInput, match=message):
        method(**settings)


@pytest.mark.parametrize("name", ["colour", "variants", "suite", "rank", "candidates"])
def test_an_entry_of_method_info_is_refused_as_a_class_attribute(name):
    with pytest.raises(TypeError, match=rf"Mine\.{name} has no effect\. Write: method_info = MethodInfo\({name}="):
        type("Mine", (cv.Method,), {name: ()})


@pytest.mark.parametrize(("former", "name"), [("Need", "Feature"), ("Card", "MethodInfo"), ("needs", "features")])
def test_a_former_public_name_is_an_error_with_the_new_one(former, name):
    message = rf"{former} has another name now: conservative\.{name}$"
    with pytest.raises(ImportError, match=message):
        getattr(cv, former)
    with pytest.raises(ImportError, match=message):
        exec(f"from conservative import {former}")


@pytest.mark.parametrize(("former", "name"), [("card", "method_info"), ("takes", "supports")])
def test_a_former_class_attribute_is_an_error_with_the_new_one(former, name):
    with pytest.raises(TypeError, match=rf"Mine\.{former} has another name now\. Write: {name}"):
        type("Mine", (cv.Method,), {former: ()})


def test_a_non_spinning_frame_needs_symmetry(free, heavy, top):
    method = Heyoka(frame="non_spinning")
    assert method.unsupported(top) is None
    for scene in (free, heavy):
        with pytest.raises(cv.Unsupported, match="symmetric about an axis"):
            cv.integrate(scene, 0.1, method)


def test_lean_takes_the_form_with_the_fewest_products(free, heavy, top, spun):
    def chosen(scene):
        equations = formulations.lean(scene).form.equations
        return getattr(equations, "attitude", equations).__name__

    assert chosen(free) == "free_rates_and_angle"
    assert chosen(heavy) == "base_vectors"
    assert chosen(cv.scenes.sprung_body()) == "base_vectors"
    assert chosen(spun) == "non_spinning"
    assert chosen(cv.scenes.lagrange_top()) == "axis_and_angle"
    hanging = top.rename("hanging", potential=cv.UniformGravity(-30.0, top.potential.com_B))
    assert chosen(hanging) == "axis_and_angle"
    assert chosen(top) == "non_spinning"  # it comes within 0.52 of both poles
    over_both_poles = cv.Scene("swing", cv.RigidBody((2, 2, 1)), np.eye(3), (5, 0, 0), 1.0, cv.UniformGravity(3, (0, 0, 1)))
    assert chosen(over_both_poles) == "non_spinning"
    at_rest = free.rename("rest", w_WB_B0=(0, 0, 0))
    assert chosen(at_rest) == "quaternion"


@pytest.mark.parametrize("field", ["gravity", "attraction"])
def test_the_axis_of_the_angle_is_the_farthest_from_its_pole(field):
    """Looked at in samples of a precise run, for each of the six axes that it could have."""
    for index in range(3):
        scene = random_body(field, 6002, index)
        run = Precise(96).prepare(scene, Grid(scene.t_end / 500, 500))()
        R_WD, _, (axes, *_) = express_field(scene, scene.derive(formulations._axes_away_from_pole))
        g = R_WD[:, 2] @ run.R_WB
        distances = {sign * k: float((1 + sign * g @ scene.body.R_BP[:, k - 1]).min()) for k in (1, 2, 3) for sign in (1, -1)}
        chosen = float((1 + g @ axes.R_BF[:, 2]).min())
        assert chosen == pytest.approx(max(distances.values()), abs=1e-3)  # measured 2e-6
        assert formulations.angle(scene).start[2] > -1 + chosen - 1e-3


def test_an_angle_about_the_axis_of_a_turning_field_is_refused():
    method = Heyoka(frame="angle")
    turning, fixed = (random_body(field, 6002, 0) for field in ("gradient", "fixed_gradient"))
    assert method.unsupported(fixed) is None
    with pytest.raises(cv.Unsupported, match="needs a field that does not turn"):
        cv.integrate(turning, 0.1, method)


def test_fast_math_makes_another_program(heavy):
    auto, on, off = (Heyoka(fast_math=value) for value in ("auto", "on", "off"))
    assert auto.program(heavy) == off.program(heavy) != on.program(heavy)
    lean_on, base_vectors = Heyoka(frame="lean", fast_math="on"), Heyoka(frame="base_vectors")
    assert lean_on.program(heavy) == base_vectors.program(heavy) != Heyoka(frame="lean", fast_math="off").program(heavy)


def test_one_compiled_integrator_serves_all_scenes_of_a_form(free):
    other = cv.Scene("other", cv.RigidBody((1, 2, 2.7)), np.eye(3), (0.1, 0.2, 2.0), 1.0)
    assert formulations.body(free).form == formulations.body(other).form
    assert formulations.lean(free).form == formulations.lean(other).form
    sprung = (cv.scenes.sprung_body(stiffness) for stiffness in (8, 9))
    assert len({formulations.base_vectors(scene).form for scene in sprung}) == 1
    assert formulations.base_vectors(free).form != formulations.body(free).form


EDGES = [
    ((1, 2, 2.5), (0, 0, 0), None),
    ((1, 2, 2.5), (0, 2, 0), None),
    ((1, 2, 2.5), (0, 0, -2), None),
    ((2, 2, 2), (1, 2, 3), None),
    ((2, 2, 2), (1, 2, 3), (0.3, 0.6, 0.9)),
    ((2, 2, 1), (0, 0, 0), (0, 0, -3)),
    ((2, 2, 1), (0, 0, 0), (0, 0, 3)),
    ((2, 2, 1), (3, 0, 0), (0, 0, 3)),
    ((2, 1.5, 1), (0, 0, 0), (0, 0, 3)),
    ((1, 2, 2.5), (1, 2, 3), (0, 0, 0)),
    ((1.1, 2.2, 3.3000000000000003), (1, 2, 3), None),
]


@pytest.mark.parametrize(("inertia", "w", "moment"), sampled(EDGES, 3))
def test_degenerate_scenes(inertia, w, moment):
    field = None if moment is None else cv.UniformGravity(1, moment)
    scene = cv.Scene("edge", cv.RigidBody(inertia), np.eye(3), w, 1.0, field)
    truth = Precise(80).run(scene, 0.25)
    for method in (*(Heyoka(frame=frame) for frame in FRAMES), SciPy(), MuJoCo(), Pinocchio()):
        if method.unsupported(scene):
            continue
        trajectory = method.run(scene, 0.25) if method.order is None else method.run(scene, 0.005, sample_every=50)
        assert trajectory.ok
        bound = 1e-8 if method.order else 1e-10  # measured 1.2e-9 and 1.6e-11
        assert cv.attitude.angle_between(truth.R_WB, trajectory.R_WB).max() < bound
