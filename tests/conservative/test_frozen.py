"""Values are frozen: `dataclasses.replace` works, arrays are read-only, and derived values are stored with their scene."""

import gc
import weakref
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

import conservative as cv
from conservative import registry, shapes
from conservative.scene import MOST_DERIVATIONS

from ..sampling import sampled

DIRECTION = (0.3, -0.2, 1.7)


def quartic_energy(R):
    return (R[2] @ np.array([0.0, 0.1, 0.4])) ** 4


def quartic_gradient(R):
    hook = np.array([0.0, 0.1, 0.4])
    return np.outer([0, 0, 1], 4 * (R[2] @ hook) ** 3 * hook)


def shaken_energy(R, t):
    return (1 + t) * quartic_energy(R)


def shaken_gradient(R, t):
    return (1 + t) * quartic_gradient(R)


BODY = cv.RigidBody([[1.0, 0.1, 0.0], [0.1, 2.0, 0.2], [0.0, 0.2, 2.5]])
VALUES = {
    "moments": cv.RigidBody((1.0, 2.0, 2.5)),
    "tensor": BODY,
    "mass": shapes.cone(0.05, 0.1, density=2700).about((0, 0, 0.075)),
    "uniform gravity": cv.UniformGravity(3.0, (0.1, 0.2, 0.3)),
    "gravity gradient": cv.GravityGradient(0.5, (1.0, 2.0, 2.5), DIRECTION),
    "spring": cv.LinearSpring(2.0, (0.1, 0, 0), (0, 0, 1), 0.3),
    "attraction": cv.PointAttraction(2, (0.1, 0, 0), (0, 0, 1)),
    "functions": cv.FunctionPotential(quartic_energy, quartic_gradient, axis_W=(0, 0, 1)),
    "functions of time": cv.FunctionPotential(shaken_energy, shaken_gradient, time_dependent=True),
    "orbit": cv.Orbit(0.3, DIRECTION),
    "satellite": cv.Orbit(0.3, (0, 0, 1)).gravity_gradient((1.0, 2.0, 2.5), (3, 4, 0)),
    "scene": cv.Scene("own", BODY, np.eye(3), (0, 1, 2), 3, cv.UniformGravity(1, (0, 0, 1)), source="here"),
    "trajectory": cv.Trajectory(cv.scenes.brick_flip(), np.zeros(1), np.eye(3)[None], np.zeros((1, 3)), "nobody"),
    "grid": cv.Grid(0.01, 10),
    **{method.name: method for name in registry.list_methods() for method in registry.method(name).settings_for("variants")},
}


def same(a, b):
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.tobytes() == b.tobytes()
    return a is b or a == b


@pytest.mark.parametrize("name", VALUES)
def test_replacing_nothing_changes_nothing(name):
    value = VALUES[name]
    other = replace(value)
    assert type(other) is type(value)
    assert repr(other) == repr(value)
    assert all(same(getattr(value, field.name), getattr(other, field.name)) for field in fields(value))


@pytest.mark.parametrize("name", VALUES)
def test_nothing_is_assigned_to_a_value(name):
    value = VALUES[name]
    for attribute in (fields(value)[0].name if fields(value) else "label", "something_new"):
        with pytest.raises(FrozenInstanceError):
            setattr(value, attribute, 3)


@pytest.mark.parametrize("name", sorted(set(VALUES) - {"trajectory"}))
def test_arrays_that_a_value_made_are_read_only(name):
    value = VALUES[name]
    arrays = [getattr(value, field.name) for field in fields(value)]
    assert not any(array.flags.writeable for array in arrays if isinstance(array, np.ndarray))


def test_a_value_copies_arrays_of_the_caller():
    rates = np.array([0.0, 1.0, 2.0])
    scene = cv.Scene("own", BODY, np.eye(3), rates, 3.0)
    rates[0] = 7.0
    assert scene.w_WB_B0[0] == 0
    assert rates.flags.writeable


def test_replaced_fields_are_checked_and_converted():
    assert replace(VALUES["spring"], point_B=[1, 2, 3]).point_B.tolist() == [1.0, 2.0, 3.0]
    assert replace(VALUES["scene"], t_end=7).t_end == 7.0
    with pytest.raises(cv.BadInput, match="t_end"):
        replace(VALUES["scene"], t_end=-1)
    with pytest.raises(cv.BadInput, match="inertia"):
        replace(BODY, inertia=(1, 2))


def test_the_exact_step_of_moser_and_veselov_by_all_its_names():
    names = [
        cv.MoserVeselov(),
        cv.MoserVeselov("exact"),
        registry.method("moser_veselov:order=exact"),
        replace(cv.MoserVeselov()),
    ]
    assert {(method.name, method.order) for method in names} == {("moser_veselov", None)}
    assert len(set(names)) == 1
    assert replace(cv.MoserVeselov(), order=4).name == "moser_veselov:order=4"


def test_a_value_is_derived_once_for_each_setting_until_it_is_forgotten() -> None:
    scene, calls = cv.scenes.brick_flip(), []

    def double(scene: cv.Scene, number: int) -> int:
        calls.append((scene, number))
        return 2 * number

    assert [scene.derive(double, number) for number in (3, 3, 4, 3)] == [6, 6, 8, 6]
    assert calls == [(scene, 3), (scene, 4)]
    scene.forget()
    assert scene.derive(double, 3) == 6
    assert len(calls) == 3


def test_the_store_is_bounded() -> None:
    scene = cv.scenes.lagrange_top()
    for number in range(3 * MOST_DERIVATIONS + 5):
        cv.Projected().prepare(scene, cv.Grid(0.01, 1))
        assert scene.derive(lambda _, number: number, number) == number
        assert len(scene._derivations) <= MOST_DERIVATIONS


@pytest.mark.parametrize(
    "method", sampled([cv.Reduced(), cv.Reduced(4, frame="auto"), cv.Gauss(2), cv.Lame(), cv.Projected(), cv.Taylor()], 2)
)
def test_a_scene_is_freed_after_its_last_use(method: cv.Method) -> None:
    top = cv.scenes.lagrange_top()
    cv.integrate(top, method=method, t_end=0.05)
    gone = weakref.ref(top)
    del top
    gc.collect()
    assert gone() is None


def test_a_run_after_forgetting_is_the_same() -> None:
    scene = cv.scenes.lagrange_top()
    before = cv.Reduced().run(scene, 0.01, 0.1)
    scene.forget()
    assert np.array_equal(cv.Reduced().run(scene, 0.01, 0.1).R_WB, before.R_WB)
