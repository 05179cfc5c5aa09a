"""Masked arrays with masked entries are refused: NumPy's functions would use the numbers below the mask."""

import inspect

import numpy as np
import pytest

import conservative as cv
from conservative import errors
from conservative.check import has_masked, real_array
from conservative.references.exact.method import free_body

EYE = np.eye(3)
BODY = cv.RigidBody((1.0, 2.0, 2.5))
BRICK, TOP = cv.scenes.brick_flip(), cv.scenes.lagrange_top()
ORBIT = cv.Orbit(1.0, (0, 1, 0))
TIMES, TORQUES = np.array([0.0, 0.5, 6.0]), np.zeros((3, 3))
MOTOR = cv.RigidBody((1.0, 2.0, 2.5), (TIMES, TORQUES))
BOX = cv.shapes.box((1, 2, 3), mass=1)


def scene(**changes):
    return cv.Scene(**{"name": "s", "body": BODY, "R_WB0": EYE, "w_WB_B0": (0, 0, 1), "t_end": 1.0} | changes)


def many(**changes):
    return cv.integrate_many(TOP, dt=0.01, t_end=0.1, **changes)


# fmt: off
CALLS = {
    "RigidBody.inertia": (cv.RigidBody, (1.0, 2.0, 2.5)),
    "RigidBody.rotor_momentum": (lambda h: cv.RigidBody((1, 2, 2.5), h), (0.1, 0.2, 0.3)),
    "RigidBody.breaks": (lambda t: cv.RigidBody((1, 2, 2.5), lambda t: (t, 0, 0), breaks=t), (0.1, 0.2, 0.3)),
    "RigidBody.momentum.w_WB_B": (BODY.momentum, (1.0, 2.0, 2.5)),
    "RigidBody.momentum.t": (lambda t: MOTOR.momentum(np.ones((3, 3)), t), (0.1, 0.2, 0.3)),
    "Scene.R_WB0": (lambda R: scene(R_WB0=R), EYE),
    "Scene.w_WB_B0": (lambda w: scene(w_WB_B0=w), (0.1, 0.2, 0.3)),
    "Scene.p_WB0": (lambda p: scene(body=BOX, p_WB0=p), (0.1, 0.2, 0.3)),
    "Scene.v_WB0": (lambda v: scene(body=BOX, v_WB0=v), (0.1, 0.2, 0.3)),
    "UniformGravity.com_B": (lambda c: cv.UniformGravity(1.0, c), (0.1, 0.2, 0.3)),
    "LinearSpring.point_B": (lambda p: cv.LinearSpring(1.0, p, (0, 0, 1)), (0.1, 0.2, 0.3)),
    "LinearSpring.anchor_W": (lambda p: cv.LinearSpring(1.0, (0, 0, 1), p), (0.1, 0.2, 0.3)),
    "PointAttraction.point_B": (lambda p: cv.PointAttraction(1.0, p, (0, 0, 1)), (0.1, 0.2, 0.3)),
    "PointAttraction.anchor_W": (lambda p: cv.PointAttraction(1.0, (0, 0, 1), p), (0.1, 0.2, 0.3)),
    "GravityGradient.inertia": (lambda J: cv.GravityGradient(1.0, J), (1.0, 2.0, 2.5)),
    "GravityGradient.direction_W": (lambda d: cv.GravityGradient(1.0, (1, 2, 2.5), d), (0.1, 0.2, 0.3)),
    "FunctionPotential.axis_W": (
        lambda a: cv.FunctionPotential(lambda R: R[2, 2], lambda R: np.outer((0, 0, 1), (0, 0, 1)), axis_W=a), (0.0, 0.0, 1.0)
    ),
    "Orbit.normal_W": (lambda n: cv.Orbit(1.0, n), (0.1, 0.2, 0.3)),
    "Orbit.R_WO.t": (ORBIT.R_WO, (0.1, 0.2, 0.3)),
    "Orbit.gravity_gradient.inertia": (lambda J: ORBIT.gravity_gradient(J, (1, 0, 0)), (1.0, 2.0, 2.5)),
    "Orbit.gravity_gradient.direction_W": (lambda d: ORBIT.gravity_gradient((1, 2, 2.5), d), (1.0, 0.0, 0.0)),
    "Torque.value": (cv.Torque, (0.1, 0.2, 0.3)),
    "Torque.value of times": (lambda t: cv.Torque((t, TORQUES)), TIMES),
    "Torque.value of values": (lambda values: cv.Torque((TIMES, values)), TORQUES),
    "Torque.breaks": (lambda t: cv.Torque(lambda t: (t, 0, 0), breaks=t), (0.1, 0.2, 0.3)),
    "Damping.matrix": (cv.Damping, EYE),
    "Damping.factor of values": (lambda values: cv.Damping(EYE, (TIMES, values)), (0.1, 0.2, 0.3)),
    "Damping.breaks": (lambda t: cv.Damping(EYE, lambda t: 1.0, breaks=t), (0.1, 0.2, 0.3)),
    "integrate.t_eval": (lambda t: cv.integrate(BRICK, 0.01, t_eval=t), (0.1, 0.2, 0.3)),
    "integrate_many.R_WB0": (lambda R: many(R_WB0=R), [EYE, EYE, EYE]),
    "integrate_many.w_WB_B0": (lambda w: many(w_WB_B0=w), np.ones((3, 3))),
    "integrate_many.inertia": (lambda J: many(inertia=J), [(1, 2, 2.5), (1, 2, 2.5), (1, 2, 2)]),
    "integrate_many.parameters": (lambda weight: many(parameters={"weight": weight}), (1.0, 2.0, 2.5)),
    "Ensemble.plot.axis_B": (lambda axis: many(w_WB_B0=np.ones((2, 3))).plot(axis), (0.0, 0.0, 1.0)),
    "shapes.box.size": (lambda size: cv.shapes.box(size, mass=1), (1.0, 2.0, 2.5)),
    "shapes.ellipsoid.semi_axes": (lambda size: cv.shapes.ellipsoid(size, mass=1), (1.0, 2.0, 2.5)),
    "shapes.MassDistribution.com_B": (lambda c: cv.shapes.MassDistribution(1.0, c, (1, 2, 2.5)), (0.1, 0.2, 0.3)),
    "shapes.MassDistribution.inertia_com": (lambda J: cv.shapes.MassDistribution(1.0, (0, 0, 1), J), (1.0, 2.0, 2.5)),
    "shapes.MassDistribution.about.com_B": (BOX.about, (0.1, 0.2, 0.3)),
    "shapes.MassDistribution.rotate.R_BS": (BOX.rotate, EYE),
    "exact.free_body.t": (lambda t: free_body(BODY, EYE, (0, 0, 1), t), (0.1, 0.2, 0.3)),
}
# fmt: on


def public_arrays():
    """Return the names of the public parameters that take arrays, by their annotations."""
    packages = {"": {name: getattr(cv, name) for name in cv.__all__}, "shapes.": vars(cv.shapes)}
    for room, members in packages.items():
        own = {
            name: each for name, each in members.items() if not room or getattr(each, "__module__", "") == cv.shapes.__name__
        }
        for name, member in own.items():
            if name.startswith("_") or not callable(member) or name in vars(errors):
                continue
            inside = [*vars(member).items()] if isinstance(member, type) else []
            methods = {f"{name}.{key}": each for key, each in inside if not key.startswith("_") and inspect.isfunction(each)}
            for label, function in {name: member, **methods}.items():
                for parameter in inspect.signature(function).parameters.values():
                    if "ArrayLike" in str(parameter.annotation) or "Given" in str(parameter.annotation):
                        yield f"{room}{label}.{parameter.name}"


def test_every_public_parameter_has_a_call():
    missing = {name for name in public_arrays() if not any(call.startswith(name) for call in CALLS)}
    assert not missing


@pytest.mark.parametrize("name", CALLS)
def test_masked_entries_are_refused_and_masks_without_entries_are_not(name):
    call, usual = CALLS[name]
    if name == "Ensemble.plot.axis_B":
        pytest.importorskip("altair")
    call(np.ma.array(usual, dtype=float))
    masked = np.ma.array(usual, dtype=float)
    masked[(*(0 for _ in range(masked.ndim - 1)), 1)] = np.ma.masked
    with pytest.raises(cv.BadInput, match="masked") as caught:
        call(masked)
    assert caught.value.argument in (name.split(" of ")[-1], "parameters['weight']") or caught.value.argument in name
    if masked.ndim > 1:
        with pytest.raises(cv.BadInput, match="masked"):
            call([*masked])


def test_what_functions_and_methods_return():
    masked = np.ma.array((0.1, 0.2, 0.3), mask=(0, 1, 0))
    with pytest.raises((cv.BadInput, cv.TorqueFailed), match="masked"):
        scene(torque=cv.Torque(lambda t: masked))

    class Masked(cv.Reduced):
        def prepare(self, scene, grid):
            run = super().prepare(scene, grid)

            def solve():
                made = run()
                vars(made)["w_WB_B"] = np.ma.array(made.w_WB_B, mask=made.w_WB_B == made.w_WB_B[1])
                return made

            return solve

    with pytest.raises(cv.InvalidResult, match="w_WB_B as a MaskedArray with masked entries"):
        cv.integrate(BRICK, 0.01, Masked())


def test_no_list_is_too_deep_and_other_arrays_with_masks_count():
    class Other(np.ndarray):  # as of packages with masked arrays of their own
        mask = np.array([False, True])

    assert real_array(np.zeros(2).view(Other)) is None
    assert not has_masked([[1.0, 2], (3.0, np.zeros(2))])
    endless = []
    endless.append(endless)
    assert real_array(endless) is None
    with pytest.raises(cv.BadInput):
        cv.RigidBody(endless)
