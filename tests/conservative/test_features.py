"""Needs of scenes, the key of a scene, pickling, and steps that end at break points."""

import math
import pickle
import subprocess
import sys
import warnings
from dataclasses import fields

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import rotation_about
from conservative.errors import BadInput
from conservative.features import LOADS, Feature
from conservative.identity import digest, fields_of_motion
from conservative.references.truth import reference

from ..crossing import ROWS
from ..sampling import sampled

R0 = rotation_about((1.0, -2.0, 0.5), 0.9)
TURN = rotation_about((0.3, 1.0, -0.7), 0.6)
TENSOR = TURN @ np.diag((2.3, 1.1, 3.1)) @ TURN.T
ORBIT = cv.Orbit(0.4, (0, 1, 0))
TABLE = ([0.0, 0.5, 0.5, 1.1, 2.0], [[0, 0, 0], [1, 0, 0.2], [0, -2, 0], [0, 0.3, 0.5], [0.1, 0, 0]])
MOTOR = ([0.0, 0.7, 2.0], [[0.3, 0, 0], [0, 0.5, 1.0], [0, 0, 0.2]])


def energy(R, t=0.0):
    return (1 + t) * float(R[2] @ (0.1, 0.2, 0.5))


def gradient(R, t=0.0):
    return (1 + t) * np.outer((0, 0, 1), (0.1, 0.2, 0.5))


def turning_torque(t, R_WB):
    return 0.3 * math.cos(3 * t) * R_WB[2]


class MyField(cv.UniformGravity):
    features = frozenset({Feature.FIELD})


def scene(**parts):
    body = parts.pop("body", cv.RigidBody((TENSOR + TENSOR.T) / 2))
    return cv.Scene("parts", body, R0, (0.7, -0.4, 1.3), 2.0, **parts)


PARTS = {
    Feature.GRAVITY: lambda: scene(potential=cv.UniformGravity(3.0, (0.1, 0.3, 0.2))),
    Feature.SPRING: lambda: scene(potential=cv.LinearSpring(3.0, (0.1, 0.3, 0.2), (0.5, 0, 1), 0.2)),
    Feature.ATTRACTION: lambda: scene(potential=cv.PointAttraction(3.0, (0.1, 0.3, 0.2), (0.5, 0, 1))),
    Feature.GRADIENT: lambda: scene(potential=cv.GravityGradient(0.8, TENSOR, (0, 1, 0))),
    Feature.FIELD: lambda: scene(potential=MyField(3.0, (0.1, 0.3, 0.2))),
    Feature.FUNCTION: lambda: scene(potential=cv.FunctionPotential(energy, gradient)),
    Feature.TURNING: lambda: scene(potential=ORBIT.gravity_gradient((TENSOR + TENSOR.T) / 2, (1, 0, 0))),
    Feature.TIME: lambda: scene(potential=cv.FunctionPotential(energy, gradient, time_dependent=True)),
    Feature.ROTOR: lambda: scene(body=cv.RigidBody(TENSOR, (0.3, -0.5, 0.9))),
    Feature.MOTOR: lambda: scene(body=cv.RigidBody(TENSOR, MOTOR)),
    Feature.TORQUE: lambda: scene(torque=cv.Torque(TABLE)),
    Feature.DAMPING: lambda: scene(damping=cv.Damping(np.diag([0.5, 0.3, 0.7]), ([0.0, 1.0, 1.0, 2.0], [0, 1, 2, 0.5]))),
    Feature.ATTITUDE: lambda: scene(torque=cv.Torque(turning_torque, "world")),
    Feature.FLIGHT: lambda: cv.Scene("flight", cv.shapes.box((1, 2, 0.5), mass=2), R0, (0.7, -0.4, 1.3), 2.0, p_WB0=(0, 0, 1)),
}


def test_every_member_has_a_scene_here():
    assert set(PARTS) == set(Feature)


@pytest.mark.parametrize("feature", Feature, ids=str)
def test_a_scene_declares_each_of_its_parts(feature):
    assert feature in PARTS[feature]().features


METHODS = ("projected", "reduced:order=8", "scipy:rtol=1e-13")
PAIRS = [
    (name, feature)
    for name in METHODS
    for feature in sorted(LOADS | {Feature.ATTITUDE})
    if registry.method(name).unsupported(PARTS[feature]()) is None
]


@pytest.mark.parametrize(("name", "feature"), sampled(PAIRS, 3, [("scipy:rtol=1e-13", Feature.DAMPING)]))
def test_methods_agree_with_the_truth_at_and_between_break_points(name, feature):
    built, method = PARTS[feature](), registry.method(name)
    grid = cv.Grid(0.02, 100, 10)
    truth = reference(built, grid).trajectory
    # Measured: 1e-15 to 4e-14 for projected, 1e-12 to 3e-11 for reduced of order 8, 3e-13 for SciPy.
    assert method.solve(built, grid).error(truth).max() < 2e-10
    times = np.array([0.0, 0.31, 0.5, 0.503, 0.7, 1.003, 1.1001, 1.77])
    between = cv.integrate(built, 0.04, method, t_eval=times)
    fine = reference(built, cv.Grid(0.001, 1771)).trajectory
    for i, t in enumerate(times):
        if abs(t * 1000 - round(t * 1000)) < 1e-9:
            j = round(t * 1000)
            assert np.abs(between.R_WB[i] - fine.R_WB[j]).max() < 1e-9


def test_a_run_of_long_steps_keeps_a_pulse():
    pulse = ([0, 50, 50, 50.02, 50.02, 100], np.outer([0, 0, 1, 1, 0, 0], (0, 0, 5.0)))
    built = cv.Scene("pulse", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0, 0, 0.01), 100.0, torque=cv.Torque(pulse))
    for method, steps in (("reduced", (1.0, 0.05, 0.013)), ("projected", (1.0, 0.013)), ("scipy", (1.0,))):
        for dt in steps:
            assert cv.integrate(built, dt, method).w_WB_B[-1, 2] == pytest.approx(0.05, rel=1e-12)


def test_jumps_of_a_function_are_found_and_smooth_pulses_reported():
    def jump(t):
        return (0, 0, 5.0 if 5 <= t < 5.02 else 0.0)

    def smooth(t):
        return (0, 0, 5 * math.exp(-(((t - 5) / 0.02) ** 2)))

    built = cv.Scene("pulse", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0, 0, 0.01), 10.0, torque=cv.Torque(jump))
    assert built.breaks == pytest.approx([5, 5.02], abs=1e-13)
    assert cv.integrate(built, 1.0).w_WB_B[-1, 2] == pytest.approx(0.05, rel=1e-12)
    narrow = built.rename("smooth", torque=cv.Torque(smooth))
    with pytest.warns(cv.LoadNotResolved, match="5") as said:
        cv.integrate(narrow, 1.0)
    (warning,) = said
    assert warning.message.step < 0.02
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        right = 0.01 + 5 * 0.02 * math.sqrt(math.pi) / 2.5
        assert cv.integrate(narrow, warning.message.step).w_WB_B[-1, 2] == pytest.approx(right, rel=1e-9)
        assert cv.integrate(narrow, error=1e-6).w_WB_B[-1, 2] == pytest.approx(right, rel=1e-6)
        assert cv.integrate(narrow, 1.0, "scipy").w_WB_B[-1, 2] == pytest.approx(right, rel=1e-9)


@pytest.mark.parametrize("size", [1.0, 1e-12, 1e12])
def test_break_points_are_those_of_own_units(size):
    clock = 1e4 if size > 1 else 1e-4 if size < 1 else 1.0
    times, values = np.array(TABLE[0]) * clock, np.array(TABLE[1]) * size / clock**2
    base = PARTS[Feature.TORQUE]()
    built = cv.Scene("sized", cv.RigidBody(base.body.inertia * size), R0, base.w_WB_B0 / clock, 2 * clock,
                     torque=cv.Torque((times, values)))  # fmt: skip
    found, right = cv.integrate(built, 0.04 * clock, "projected"), cv.integrate(base, 0.04, "projected")
    assert np.abs(found.R_WB - right.R_WB).max() < 1e-13  # measured: 4e-15


def test_jumps_after_the_end_of_the_scene_and_beside_declared_points_are_found():
    step = cv.Torque(lambda t: (0, 0, float(t >= 0.5) + 2.0 * (1.5 <= t < 3)), breaks=(0.5,))
    built = cv.Scene("longer", cv.RigidBody((1, 2, 2.5)), np.eye(3), (0, 0, 0.01), 2.0, torque=step)
    found = cv.integrate(built, 0.8, "projected", t_end=4.0)
    assert found.w_WB_B[-1, 2] == pytest.approx(0.01 + (3.5 + 2 * 1.5) / 2.5, rel=1e-12)


def test_a_change_of_any_field_changes_the_key():
    for build in PARTS.values():
        built = build()
        assert built.key == build().key
        assert built.rename("other", group="x", source="y", dt=0.3).key == built.key
    base = PARTS[Feature.TORQUE]()
    keys = {base.key}
    changed = (
        base.rename("s", w_WB_B0=np.nextafter(base.w_WB_B0, 9)),
        base.rename("s", R_WB0=base.R_WB0 * (1 + 2.0**-52)),
        base.rename("s", t_end=math.nextafter(2.0, 0)),
        base.rename("s", body=cv.RigidBody(base.body.inertia * (1 + 2.0**-52))),
        base.rename("s", body=cv.RigidBody(base.body.inertia, (0, 0, 1e-30))),
        base.rename("s", body=cv.RigidBody(base.body.inertia, ([0.0, 2.0], np.zeros((2, 3))))),
        base.rename("s", potential=cv.UniformGravity(1e-30, (0, 0, 1))),
        base.rename("s", torque=None),
        base.rename("s", torque=cv.Torque((TABLE[0], np.nextafter(TABLE[1], 9)))),
        base.rename("s", torque=cv.Torque(TABLE, "world")),
        base.rename("s", damping=cv.Damping(1e-30 * np.eye(3))),
        base.rename("s", extra_invariants=(cv.Invariant("x", "J", 1.0, lambda R, w: w[:, 0]),)),
    )
    names = {field.name for field in fields(cv.Scene)} - set(fields_of_motion(cv.Scene))
    assert names == {"name", "dt", "group", "source"}
    for each in changed:
        assert each.key not in keys
        keys.add(each.key)


def test_functions_are_the_same_if_all_that_they_use_is():
    def build(size, helper):
        return lambda t: helper(size * t)

    def model(size):
        class Model:
            gain = size

            def __call__(self, t):
                return self.gain * t

        return Model()

    assert digest(model(1.0)) == digest(model(1.0))
    assert digest(model(1.0)) != digest(model(2.0))
    assert digest(build(2.0, math.sin)) == digest(build(2.0, math.sin))
    assert digest(build(2.0, math.sin)) != digest(build(3.0, math.sin))
    assert digest(build(2.0, math.sin)) != digest(build(2.0, math.cos))


def test_digests_of_functions_are_the_same_in_another_process():
    """The Kovalevskaya integral has an ellipsis, which was represented by its address."""
    code = "import conservative as cv; print(cv.scenes.kovalevskaya_top().key)"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.split() == [cv.scenes.kovalevskaya_top().key]


def test_estimates_are_those_of_the_scene():
    def spun(size):
        return cv.Scene("spun", cv.RigidBody((1, 2, 2.5)), R0, (0.1, 0.2, 1.0), 5.0, torque=cv.Torque((0, size, 0)))

    for size in (1.0, 30.0):
        found = cv.integrate(spun(size), error=1e-8)
        truth = reference(spun(size), cv.Grid(found.t[-1] / 8, 8)).trajectory
        assert np.abs(found.R_WB[-1] - truth.R_WB[-1]).max() < 1e-8


@pytest.mark.parametrize("feature", Feature, ids=str)
def test_scenes_and_trajectories_can_be_pickled(feature):
    built = PARTS[feature]()
    _ = built.invariants  # cached functions of the scene
    method = next(each for each in ("projected", "taylor") if registry.method(each).unsupported(built) is None)
    found = cv.integrate(built, 0.1, method)
    if found.scene.torque is not None and callable(found.scene.torque.value):
        assert found.scene.breaks.size == 0
    again = pickle.loads(pickle.dumps(found))
    assert again.scene.key == built.key
    assert np.array_equal(cv.integrate(pickle.loads(pickle.dumps(built)), 0.1, method).w_WB_B, found.w_WB_B)
    assert not again.scene.R_WB0.flags.writeable


CALLS = iter(range(1000))


def drifting(_t):
    return (0.0, 0.0, float(next(CALLS)))


@pytest.mark.parametrize(
    ("build", "argument"),
    [
        (lambda: cv.Torque(lambda t: (0, 0, t), breaks=(2, 1)), "breaks"),
        (lambda: cv.Torque(lambda t: (0, 0, t), breaks=(np.nan,)), "breaks"),
        (lambda: cv.Torque((0, 0, 1), breaks=(1,)), "breaks"),
        (lambda: scene(torque=cv.Torque(lambda t: (0, 0, t), breaks=(1, 3))), "breaks"),
        (lambda: scene(torque=cv.Torque(lambda t: (0, 0, t), breaks=(-1,))), "breaks"),
        (lambda: cv.Torque(([0, 1, 1, 1, 2], np.zeros((5, 3)))), "times"),
        (lambda: cv.Torque(([0, 1, 0.5], np.zeros((3, 3)))), "times"),
        (lambda: cv.Torque(drifting), "torque"),
        (lambda: cv.Damping(lambda t, R: -np.eye(3)), "matrix"),
        (lambda: cv.Damping(lambda t: np.eye(2)), "matrix"),
        (lambda: cv.Damping(lambda t: np.eye(3), lambda t: 1.0), "factor"),
        (lambda: cv.RigidBody((1, 2, 3), ([0, 1, 1, 2], [[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 0]])), "rotor_momentum"),
        (lambda: cv.RigidBody((1, 2, 3), lambda t: (0, 0)), "rotor_momentum"),
        (lambda: scene(body=cv.RigidBody((1, 2, 3), lambda t: (0, 0, float(t > 1)))).breaks, "rotor_momentum"),
        (lambda: cv.integrate(PARTS[Feature.TORQUE](), 0.1, t_end=3.0), "torque"),
        (lambda: cv.integrate(PARTS[Feature.TORQUE](), error=1e-3, t_end=3.0), "torque"),
    ],
)
def test_bad_loads_are_refused_by_name(build, argument):
    with pytest.raises(BadInput) as refusal:
        build()
    assert refusal.value.argument == argument


def test_the_last_step_may_end_after_a_table():
    built = PARTS[Feature.TORQUE]()
    found = cv.integrate(built, 0.013)
    assert found.t[-1] > 2.0
    assert found.ok


NUMBERS = ("symmetric", "for bodies in a field", "right angles")
"""Words of the reasons of `unsupported` that depend on numbers, or on another part, and not on a part alone."""


@pytest.mark.parametrize("name", [n for n, family in registry.list_families().items() if family.role != cv.Role.ENGINE])
def test_a_method_takes_every_part_that_it_declares(name):
    """Pages show what is declared. `projected` and `splitting` declared free flight, and refused it."""
    method = registry.method(name)
    for feature in method.supports:
        reason = method.unsupported(ROWS[feature].scene())
        assert reason is None or any(words in reason for words in NUMBERS), (feature, reason)
        assert (feature, reason) != (cv.Feature.FLIGHT, "it is for bodies in a field")
    assert method.supports == method.method_info.supports
