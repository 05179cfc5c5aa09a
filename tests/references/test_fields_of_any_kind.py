"""heyoka, SciPy, multi-precision and engines in every kind of field, also in fields that turn.

Axes are turned, inertias are not diagonal and sizes are not 1, so that a wrong convention shows. The programs write the
equations of fields that turn in different ways: `Precise`, SciPy and engines have the field as a function of time in the
world's axes, heyoka has it in axes that turn, and `Projected` has it at the times of its stages (compared with the textbook in
`test_turning.py`).
"""

import ctypes
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, rotation_about, to_quaternion
from conservative.body import RigidBody
from conservative.grid import Grid
from conservative.potentials.potential import torque_W
from conservative.references import precise
from conservative.references.engine import principal_axes
from conservative.references.engines import pinocchio
from conservative.references.environments.plain_numbers import describe
from conservative.references.heyoka_equations import formulations
from conservative.references.heyoka_equations.accelerations import READERS, express_field, order_axes
from conservative.references.precise import Precise
from conservative.references.solvers.heyoka import Heyoka
from conservative.references.solvers.scipy import SciPy
from conservative.references.truth import reference
from conservative.scenes.random_body import random_body

from ..sampling import sampled

TURN = rotation_about((1, -2, 0.5), 1.1)
R_WB0 = rotation_about((0.3, -0.5, 0.8), 0.7)
INERTIA = TURN @ np.diag((0.9, 1.7, 1.2)) @ TURN.T
OTHER = rotation_about((-1, 0.3, 0.7), 0.6)
POINT, ANCHOR, CENTRE = (0.3, -0.2, 0.4), (1.0, 0.5, 2.0), (0.2, -0.3, -1.0)


def make_fields(strength=1.0):
    """Return fields by name, with energies multiplied by `strength`."""
    rate = 1.7 * strength**0.5
    return {
        "gravity": cv.UniformGravity(3.1 * strength, POINT),
        "spring": cv.LinearSpring(3.0 * strength, POINT, ANCHOR, 0.4),
        "spring about its length": cv.LinearSpring(3.0 * strength, POINT, ANCHOR, 2.3),  # 1.75 to 2.83 m long
        "spring of no length": cv.LinearSpring(3.0 * strength, POINT, ANCHOR),
        "spring on an axis": cv.LinearSpring(3.0 * strength, TURN[:, 0] * 0.5, ANCHOR, 0.4),
        "spring at the pivot": cv.LinearSpring(3.0 * strength, POINT, (0, 0, 0), 0.4),
        "attraction": cv.PointAttraction(2.3 * strength, POINT, ANCHOR),
        "repulsion of the pivot": cv.PointAttraction(-2.3 * strength, (0, 0, 0), ANCHOR),
        "gradient": cv.GravityGradient(rate, INERTIA, CENTRE),
        "gradient on another inertia": cv.GravityGradient(rate, OTHER @ np.diag((0.7, 1.1, 1.3)) @ OTHER.T, CENTRE),
    }


FIELDS = make_fields()


def scene_in(field, name="in a field"):
    """Return the body in a field."""
    return cv.Scene(name, cv.RigidBody(INERTIA), R_WB0, (1.2, -2, 0.7), 1.0, field)


GRID = Grid(0.05, 40)
ATTITUDES = from_quaternion(np.random.default_rng(3).normal(size=(5, 4)))
ATTITUDES /= np.cbrt(np.linalg.det(ATTITUDES))[:, None, None]


def accelerations(scene, parameters=None, kept=None):
    """Return angular accelerations (n, 3), body axes, at five attitudes from the expressions, without Euler's terms.

    The expressions keep the principal axes `kept`.
    """
    R_WD, _, (axes, acceleration, values) = express_field(scene, kept)
    assert kept in (None, axes)
    rows = [(R_WD.T @ R @ axes.R_BF)[2].tolist() for R in ATTITUDES]
    return np.array([acceleration(parameters or values, g) for g in rows]) @ axes.R_BF.T


def from_gradient(scene):
    """Return the same from the potential's gradient."""
    torque_B = np.einsum("nij,ni->nj", ATTITUDES, torque_W(scene.potential, ATTITUDES))
    return torque_B @ np.linalg.inv(scene.body.inertia)


@pytest.mark.parametrize("name", FIELDS)
def test_expressions_are_the_gradients(name):
    scene = scene_in(FIELDS[name])
    expected = from_gradient(scene)
    np.testing.assert_allclose(accelerations(scene), expected, rtol=0, atol=2e-15 * max(np.abs(expected).max(), 1))  # 7e-16


@pytest.mark.parametrize("third", range(3))
@pytest.mark.parametrize("name", FIELDS)
def test_expressions_in_axes_of_any_order_are_the_gradients(name, third):
    """As the frame of the angle needs them: the third axis is the one that stays away from the pole, in either direction."""
    scene = scene_in(FIELDS[name])
    axes, expected = order_axes(principal_axes(scene), third), from_gradient(scene)
    for kept in (axes, replace(axes, R_BF=axes.R_BF @ np.diag([1.0, -1.0, -1.0]))):
        size = max(np.abs(expected).max(), 1)
        np.testing.assert_allclose(accelerations(scene, kept=kept), expected, rtol=0, atol=3e-15 * size)  # measured 9e-16


@pytest.mark.parametrize("name", FIELDS)
def test_every_parameter_matters(name):
    """A change of any parameter by a thousandth is detected, so the agreement above is not by chance."""
    scene = scene_in(FIELDS[name])
    right, (*_, parameters) = accelerations(scene), express_field(scene)[2]
    assert any(parameters) == (name not in ("spring at the pivot", "repulsion of the pivot"))
    for i, value in enumerate(parameters):
        wrong = [*parameters[:i], value * 1.001, *parameters[i + 1 :]]
        assert value == 0 or np.abs(accelerations(scene, wrong) - right).max() > 1e-7 * np.abs(right).max()


def test_precise_and_engines_support_the_same_fields():
    assert READERS.keys() == precise.FIELDS.keys() == {type(field) for field in FIELDS.values()}


INTEGRATED = ["gravity", "spring", "attraction", "gradient on another inertia"]


FRAMES = [("gradient on another inertia", "base_vectors"), ("spring", "body"), ("attraction", "angle")]


@pytest.mark.parametrize(("name", "frame"), sampled(product(INTEGRATED, ["body", "base_vectors", "angle"]), 3, keep=FRAMES))
def test_heyoka_agrees_with_truth(name, frame):
    """Check errors near the tolerance, measured over both frames."""
    scene = scene_in(FIELDS[name])
    truth = Precise(128).prepare(scene, GRID)()
    for tol, bound in ((1e-9, 1e-10), (1e-15, 4e-14)):  # measured 1e-11, 4e-15
        trajectory = Heyoka(tol, frame).prepare(scene, GRID)()
        assert trajectory.ok
        assert angle_between(truth.R_WB, trajectory.R_WB).max() < bound
        assert np.abs(truth.w_WB_B - trajectory.w_WB_B).max() < bound


@pytest.mark.parametrize("name", INTEGRATED)
def test_a_slightly_wrong_field_is_detected(name):
    """The bounds above are far below what a millionth of the field changes."""
    stronger = scene_in(make_fields(1 + 1e-6)[name])
    right, wrong = (Precise(128).prepare(scene, GRID)() for scene in (scene_in(FIELDS[name]), stronger))
    assert angle_between(right.R_WB, wrong.R_WB).max() > 1e-7


@pytest.mark.parametrize("name", FIELDS)
def test_scipy_agrees_with_truth(name):
    scene = scene_in(FIELDS[name])
    truth, trajectory = (method.prepare(scene, GRID)() for method in (Precise(128), SciPy(rtol=3e-14)))
    assert angle_between(truth.R_WB, trajectory.R_WB).max() < 2e-12  # measured 4e-13
    assert np.abs(truth.w_WB_B - trajectory.w_WB_B).max() < 5e-12


@pytest.mark.parametrize("field", ["spring", "attraction"])
def test_scipy_supports_loose_tolerances(field):
    """Within a step the quaternion is longer than one: without normalisation a distance is the root of a negative number."""
    scene = random_body(field, seed=7, index=1)
    outcome = SciPy(rtol=0.1).run(scene, scene.t_end / 12).outcome
    assert outcome.kind is cv.OutcomeKind.NOT_CONSERVED, outcome  # and not an exception from within its steps


def test_heyoka_and_scipy_support_every_registered_scene():
    for name in registry.list_scenes():
        for method in (Heyoka(), Heyoka(frame="lean"), Heyoka(frame="base_vectors"), SciPy()):
            scene = registry.scene(name)
            assert (method.unsupported(scene) is None) == (scene.flight is None), name


class OwnGravity(cv.UniformGravity):
    """A field of a user, which no table has."""


def test_the_reason_of_an_unsupported_field_names_the_table_of_expressions():
    reason = Heyoka().unsupported(scene_in(OwnGravity(1.0, (0, 0, 1))))
    assert reason == f"no heyoka expressions for OwnGravity; add them to {express_field.__module__}.READERS"


def test_base_vectors_are_not_orthonormalised():
    """At a loose tolerance, the rows differ from a rotation by about the tolerance."""
    trajectory = Heyoka(1e-4, "base_vectors").prepare(scene_in(FIELDS["gravity"]), GRID)()
    off = cv.attitude.orthonormality(trajectory.R_WB).max()
    assert 1e-9 < off < 1e-3  # measured 4e-6
    np.testing.assert_allclose(trajectory.R_WB[:, 1], np.cross(trajectory.R_WB[:, 2], trajectory.R_WB[:, 0]), atol=1e-15)


@pytest.mark.parametrize("moments", [(1, 2, 2.5), (2, 1, 2.5), (2, 2.5, 1), (2.5, 2, 1), (1, 2.5, 2), (2.5, 1, 2)])
@pytest.mark.parametrize("slow", [False, True])
def test_a_free_bodys_third_axis_is_one_about_which_its_momentum_circulates(moments, slow):
    """Its component along that axis stays above 0, and no other component does."""
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


ORBIT = cv.Orbit(0.9, (0.3, -0.5, 0.8))
ACROSS = np.cross(ORBIT.normal_W, (0.2, 1.0, 0.4))
TURNING = {name: cv.Turning(field, ORBIT) for name, field in FIELDS.items()} | {
    "satellite": ORBIT.gravity_gradient(INERTIA, ACROSS)
}


@pytest.mark.parametrize("field", sampled(TURNING, 3, keep=["gradient on another inertia", "spring on an axis", "satellite"]))
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
        trajectory = cv.integrate(
            scene, 0.1 if method.order is None else 0.01, method, sample_every=1 if method.order is None else 10
        )
        assert angle_between(truth.R_WB, trajectory.R_WB).max() < allowed, method.name
        assert np.abs(truth.w_WB_B - trajectory.w_WB_B).max() < 10 * allowed, method.name


@pytest.mark.parametrize("method", [cv.Taylor(14), cv.Taylor(18)])
def test_taylor_in_the_field_of_a_satellite(method):
    scene = scene_in(TURNING["satellite"])
    truth, trajectory = cv.integrate(scene, 0.1, Precise(128)), cv.integrate(scene, 0.02, method, sample_every=5)
    assert angle_between(truth.R_WB, trajectory.R_WB).max() < 1e-13  # measured up to 1.3e-15
    assert np.abs(truth.w_WB_B - trajectory.w_WB_B).max() < 1e-12


def test_truth_of_a_satellite_is_multi_precision():
    scene = scene_in(TURNING["satellite"])
    assert reference(scene, cv.Grid(0.1, 10)).trajectory.label.startswith("heyoka")


def test_only_scipy_supports_a_function_that_turns():
    gravity = FIELDS["gravity"]
    scene = scene_in(cv.Turning(cv.FunctionPotential(gravity.energy, gravity.gradient), ORBIT))
    assert "a potential of Python functions" in Heyoka().unsupported(scene)
    assert "a potential of Python functions" in Precise().unsupported(scene)
    trajectory, known = (cv.integrate(each, 0.1, SciPy()) for each in (scene, scene_in(TURNING["gravity"])))
    assert angle_between(trajectory.R_WB, known.R_WB).max() < 1e-10  # measured 1.8e-12


IN_ENGINES = {name: FIELDS[name] for name in FIELDS} | {
    f"turning {name}": TURNING[name] for name in (*INTEGRATED[1:], "satellite")
}
"""Fields that engines integrate. They do not have uniform gravity that turns."""


LARGEST_ERRORS = {1: 0.015, 2: 3e-4, 3: 2e-5, 4: 6e-9, 5: 3e-9, 6: 2e-11}
"""By order, rad; measured at most 0.013, 1.9e-4, 1.7e-5, 4.7e-9, 1.8e-9 and 1.1e-11."""


def check_order(method, name, right=None, above=0.1):
    """Check that an engine in a field converges to the truth, and its order; `right` is the field of the truth."""
    scene = scene_in(IN_ENGINES[name])
    truth = Precise(128).run(scene if right is None else scene_in(right), 1.0).R_WB[-1]
    steps = (25, 50) if method.order == 6 else (50, 100)  # round-off is nearer
    coarse, fine = (angle_between(method.prepare(scene, Grid(1 / n, n, n))().R_WB[-1], truth) for n in steps)
    assert -0.25 < np.log2(coarse / fine) - method.order < above  # measured -0.19 to 0.071
    assert fine < LARGEST_ERRORS[method.order]


SETTINGS = ["mujoco:RK4", "mujoco:Euler", "mujoco:implicit", "pinocchio:RK4", "pinocchio:Euler"]


@pytest.mark.parametrize(("engine", "name"), sampled(product(SETTINGS, IN_ENGINES), len(IN_ENGINES)))
def test_engines_converge_to_the_truth_in_every_field(engine, name):
    check_order(registry.method(engine), name)


@pytest.mark.parametrize("engine", ["mujoco:RK4", "pinocchio:RK4"])
@pytest.mark.parametrize("name", ["spring", "attraction", "gradient", "turning satellite"])
def test_an_engine_in_a_wrong_field_is_detected(engine, name):
    """A ten-thousandth of the field, a rest length, or the direction of turning."""
    wrong = {
        "spring": cv.LinearSpring(3.0, POINT, ANCHOR, 0.40001),
        "attraction": cv.PointAttraction(2.30001, POINT, ANCHOR),
        "gradient": cv.GravityGradient(1.70001, INERTIA, CENTRE),
        "turning satellite": cv.Orbit(0.9, -ORBIT.normal_W).gravity_gradient(INERTIA, ACROSS),
    }
    with pytest.raises(AssertionError):
        check_order(registry.method(engine), name, wrong[name])


def test_a_torque_that_is_evaluated_once_in_a_step_is_detected(monkeypatch):
    torque, calls = pinocchio.compile_torque(), []

    def held(*state):
        calls.append(torque(*state) if len(calls) % 4 == 0 else calls[-1])
        return calls[-1]

    monkeypatch.setattr(pinocchio, "compile_torque", lambda: held)
    with pytest.raises(AssertionError):
        check_order(registry.method("pinocchio:RK4"), "attraction")


@pytest.mark.parametrize("engine", ["mujoco:RK4", "pinocchio:RK4"])
@pytest.mark.parametrize("name", ["spring", "attraction", "gradient", "turning satellite"])
def test_forces_act_about_the_fixed_point_and_not_the_centre_of_mass(engine, name):
    """Without gravity, any centre of mass with the same inertia about the fixed point gives the same motion."""
    method, axes = registry.method(engine), principal_axes(scene_in(IN_ENGINES[name]))
    numbers = {**method.settings, **describe(axes, Grid(0.01, 100, 100))}
    com = np.array((0.2, -0.1, 0.3))
    inertia = RigidBody(np.diag(axes.J) - com @ com * np.eye(3) + np.outer(com, com))
    moved = {"com": com, "inertia_com": inertia.inertia, "moments_com": inertia.moments, "q_com": to_quaternion(inertia.R_BP)}
    here, there = (method.adapter.prepare(SimpleNamespace(**{**numbers, **each}))()["q"][-1] for each in ({}, moved))
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-14)  # measured 4e-16


def test_mujoco_restores_the_users_passive_force():
    own = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda model, data: None)
    mujoco.set_mjcb_passive(own)
    try:
        assert registry.method("mujoco:RK4").run(scene_in(FIELDS["attraction"]), 0.1).ok
        assert mujoco.get_mjcb_passive() is own
    finally:
        mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize("custom", ["", "<custom><numeric name='field' data='1 2 3'/></custom>"])
def test_mujocos_passive_force_leaves_other_models_alone(custom):
    """The callback is the process's, and other threads may have models of their own."""
    body = "<worldbody><body><joint type='ball'/><geom size='1'/></body></worldbody>"
    method = registry.method("mujoco:RK4")
    numbers = {**method.settings, **describe(principal_axes(scene_in(FIELDS["attraction"])), GRID)}
    ours, other = (
        method.adapter._model(mujoco, SimpleNamespace(**numbers)),
        mujoco.MjModel.from_xml_string(f"<mujoco>{custom}{body}</mujoco>"),
    )
    forces = []
    mujoco.set_mjcb_passive(method.adapter._find_callback(mujoco, ours, mujoco.MjData(ours)))
    try:
        for model in (ours, other):
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            forces.append(data.qfrc_passive.any())
    finally:
        mujoco.set_mjcb_passive(None)
    assert forces == [True, False]


def test_what_the_adapter_of_an_engine_lacks_is_named():
    function = cv.FunctionPotential(FIELDS["gravity"].energy, FIELDS["gravity"].gradient)
    method = registry.method("mujoco")
    assert method.unsupported(scene_in(function)).startswith("it does not support a potential of Python functions; ")
    assert method.unsupported(scene_in(TURNING["gravity"])) == "not supported by our adapter: Turning of UniformGravity"
