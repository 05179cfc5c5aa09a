"""heyoka and SciPy in every field whose equations we have, against the fields' own gradients and multi-precision truth."""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, rotation_about
from conservative.method import Grid
from conservative.potentials.potential import torque_W
from conservative.references.engines.heyoka import Heyoka
from conservative.references.engines.scipy import SciPy
from conservative.references.heyoka_equations import formulations, torques
from conservative.references.heyoka_equations.accelerations import READERS, express_field
from conservative.references.precise import Precise
from conservative.scenes.random_body import random_body

from .fields import FIELDS, make_fields, scene_in

GRID = Grid(0.05, 40)
ATTITUDES = from_quaternion(np.random.default_rng(3).normal(size=(5, 4)))
ATTITUDES /= np.cbrt(np.linalg.det(ATTITUDES))[:, None, None]


def accelerations(scene, parameters=None):
    """Return angular accelerations (n, 3), body axes, at five attitudes from the expressions, without Euler's terms."""
    field = express_field(scene)
    rows = [(field.R_WD.T @ R @ field.axes.R_BF)[2].tolist() for R in ATTITUDES]
    return np.array([field.acceleration(parameters or field.parameters, g) for g in rows]) @ field.axes.R_BF.T


def from_gradient(scene):
    """Return the same from the potential's gradient."""
    torque_B = np.einsum("nij,ni->nj", ATTITUDES, torque_W(scene.potential, ATTITUDES))
    return torque_B @ np.linalg.inv(scene.body.inertia)


@pytest.mark.parametrize("name", FIELDS)
def test_expressions_are_the_gradients(name):
    scene = scene_in(FIELDS[name])
    expected = from_gradient(scene)
    np.testing.assert_allclose(accelerations(scene), expected, rtol=0, atol=2e-15 * max(np.abs(expected).max(), 1))  # 7e-16


@pytest.mark.parametrize("name", FIELDS)
def test_every_parameter_matters(name):
    """So that the agreement above cannot be by chance: each number changed by a thousandth is seen."""
    scene = scene_in(FIELDS[name])
    right, parameters = accelerations(scene), express_field(scene).parameters
    assert any(parameters) == (name not in ("spring at the pivot", "repulsion of the pivot"))
    for i, value in enumerate(parameters):
        wrong = [*parameters[:i], value * 1.001, *parameters[i + 1 :]]
        assert value == 0 or np.abs(accelerations(scene, wrong) - right).max() > 1e-7 * np.abs(right).max()


def test_truth_and_engines_know_the_same_fields():
    assert READERS.keys() == torques.FIELDS.keys() == {type(field) for field in FIELDS.values()}


INTEGRATED = ["gravity", "spring", "attraction", "gradient on another inertia"]


@pytest.mark.parametrize("frame", ["body", "base_vectors"])
@pytest.mark.parametrize("name", INTEGRATED)
def test_heyoka_agrees_with_truth(name, frame):
    """Errors near the tolerance, measured over both frames."""
    scene = scene_in(FIELDS[name])
    truth = Precise(128).prepare(scene, GRID)()
    for tol, bound in ((1e-9, 1e-10), (1e-15, 4e-14)):  # measured 1e-11, 4e-15
        found = Heyoka(tol, frame).prepare(scene, GRID)()
        assert found.ok
        assert angle_between(truth.R_WB, found.R_WB).max() < bound
        assert np.abs(truth.w_WB_B - found.w_WB_B).max() < bound


@pytest.mark.parametrize("name", INTEGRATED)
def test_a_slightly_wrong_field_would_be_seen(name):
    """The bounds above are far below what a millionth of the field changes."""
    stronger = scene_in(make_fields(1 + 1e-6)[name])
    right, wrong = (Precise(128).prepare(scene, GRID)() for scene in (scene_in(FIELDS[name]), stronger))
    assert angle_between(right.R_WB, wrong.R_WB).max() > 1e-7


@pytest.mark.parametrize("name", FIELDS)
def test_scipy_agrees_with_truth(name):
    scene = scene_in(FIELDS[name])
    truth, found = (method.prepare(scene, GRID)() for method in (Precise(128), SciPy(rtol=3e-14)))
    assert angle_between(truth.R_WB, found.R_WB).max() < 2e-12  # measured 4e-13
    assert np.abs(truth.w_WB_B - found.w_WB_B).max() < 5e-12


def test_scipy_takes_functions_through_their_gradient():
    field = FIELDS["spring"]
    functions = cv.FunctionPotential(field.energy, field.gradient)
    written_out, called = (SciPy(rtol=1e-12).prepare(scene_in(each), GRID)() for each in (field, functions))
    assert angle_between(written_out.R_WB, called.R_WB).max() < 1e-9  # measured 3e-11, as steps differ


@pytest.mark.parametrize("field", ["spring", "attraction"])
def test_scipy_takes_fields_at_loose_tolerances(field):
    """Within a step the quaternion is longer than one; a distance made of it as it is would be a root of a negative number."""
    scene = random_body(field, seed=7, index=1)
    outcome = SciPy(rtol=0.1).run(scene, scene.t_end / 12).outcome
    assert outcome.kind is cv.OutcomeKind.NOT_CONSERVED, outcome  # and not an exception from within its steps


def test_both_take_every_scene_of_the_catalogue():
    for name in registry.list_scenes():
        for method in (Heyoka(), Heyoka(frame="lean"), Heyoka(frame="base_vectors"), SciPy()):
            assert method.unsupported(registry.scene(name)) is None


def test_heyoka_names_a_field_without_expressions_and_where_they_belong():
    gravity = FIELDS["gravity"]
    reason = Heyoka().unsupported(scene_in(cv.FunctionPotential(gravity.energy, gravity.gradient)))
    assert reason == f"no heyoka expressions for FunctionPotential; add them to {express_field.__module__}.READERS"


def test_base_vectors_are_not_tidied_up():
    """The rows of a loose run are off a rotation by about its tolerance, and nothing hides that."""
    found = Heyoka(1e-4, "base_vectors").prepare(scene_in(FIELDS["gravity"]), GRID)()
    off = cv.attitude.orthonormality(found.R_WB).max()
    assert 1e-9 < off < 1e-3  # measured 4e-6
    np.testing.assert_allclose(found.R_WB[:, 1], np.cross(found.R_WB[:, 2], found.R_WB[:, 0]), atol=1e-15)


@pytest.mark.parametrize("moments", [(1, 2, 2.5), (2, 1, 2.5), (2, 2.5, 1), (2.5, 2, 1), (1, 2.5, 2), (2.5, 1, 2)])
@pytest.mark.parametrize("slow", [False, True])
def test_a_free_bodys_third_axis_is_one_about_which_its_momentum_circulates(moments, slow):
    """Its component stays above 0 about that axis, as it does about no other one."""
    axes = np.argsort(moments)
    w = np.zeros(3)
    w[axes] = (-3, 0.4, 0.1) if slow else (0.1, 0.4, -3)  # about the smallest moment, or about the largest
    scene = cv.Scene("free", cv.RigidBody(moments), rotation_about((1, -1, 0.3), 1.1), w, 10.0)
    problem = formulations.lean(scene)
    rates = Heyoka(1e-12, "lean").run(scene, 0.05).w_WB_B @ problem.axes.R_BF
    assert rates[:, 2].min() > 2.5  # measured 2.9
    assert (rates[:, :2].min(axis=0) < 0).all()
    assert (rates[:, :2].max(axis=0) > 0).all()
    assert problem.axes.J[2] == moments[axes[0 if slow else 2]]
