"""Potentials: gradients against differences, the identity of the finite derivative, energy and momentum in motion."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import conservative as cv
from conservative.attitude import angle_between, cayley, from_quaternion, rotation_about
from conservative.potentials.potential import torque_W

TURNED = rotation_about((1, 2, 3), 0.7)
INERTIA = TURNED @ np.diag([1.3, 0.9, 0.7]) @ TURNED.T
POINT, ANCHOR = (0.4, -0.2, 0.3), (0.5, 0.6, -0.7)
HOOK = np.array([0.2, -0.1, 0.4])


def quartic_energy(R):
    return 20 * (R[2] @ HOOK) ** 4 + np.sin(R[0] @ HOOK)


def quartic_gradient(R):
    return np.outer([0, 0, 80 * (R[2] @ HOOK) ** 3], HOOK) + np.outer([np.cos(R[0] @ HOOK), 0, 0], HOOK)


POTENTIALS = {
    "gravity": cv.UniformGravity(2.3, (0.1, 0.3, -0.2)),
    "spring": cv.LinearSpring(3.1, POINT, ANCHOR),
    "spring with rest length": cv.LinearSpring(3.1, POINT, ANCHOR, 0.3),
    "attraction": cv.PointAttraction(1.7, POINT, ANCHOR),
    "repulsion": cv.PointAttraction(-1.7, POINT, ANCHOR),
    "gravity gradient": cv.GravityGradient(1.2, INERTIA, (1, 2, -0.5)),
    "functions": cv.FunctionPotential(quartic_energy, quartic_gradient),
}
potentials = pytest.mark.parametrize("potential", POTENTIALS.values(), ids=POTENTIALS)
attitudes = st.builds(rotation_about, st.tuples(*[st.floats(0.1, 1)] * 3), st.floats(-math.pi, math.pi))
matrices = st.builds(lambda *values: np.reshape(values, (3, 3)) / 8 + np.eye(3), *[st.floats(-1, 1)] * 9)


def scene_in(potential, t_end=5.0):
    return cv.Scene("body", cv.RigidBody(INERTIA), rotation_about((3, -1, 2), 1.2), (0.5, 1.1, -0.8), t_end, potential)


@potentials
@settings(max_examples=30)
@given(R=matrices)
def test_gradient_is_that_of_the_energy(potential, R):
    step, gradient = 1e-5, potential.gradient(R)
    for index in np.ndindex(3, 3):
        aside = np.zeros((3, 3))
        aside[index] = step
        difference = (potential.energy(R + aside) - potential.energy(R - aside)) / (2 * step)
        assert abs(difference - gradient[index]) < 1e-8 * potential.scale()  # measured 1e-10


@potentials
@settings(max_examples=60)
@given(R_0=matrices, R_1=matrices)
def test_finite_derivative_gives_the_difference_of_energy(potential, R_0, R_1):
    gained = np.sum(potential.finite_derivative(R_0, R_1) * (R_1 - R_0))
    assert abs(gained - (potential.energy(R_1) - potential.energy(R_0))) < 1e-14 * potential.scale()  # measured up to 2e-15


@potentials
@settings(max_examples=30)
@given(R=attitudes, exponent=st.floats(-18, -3))
@example(R=rotation_about((0.1875, 0.40625, 1.0), 3.125), exponent=-11.0)  # a small energy, by cancellation
def test_finite_derivative_of_a_tiny_step_is_the_gradient(potential, R, exponent):
    step = 10.0**exponent
    there = R @ cayley(step * np.array([0.6, -0.7, 0.4]))
    off = potential.finite_derivative(R, there) - potential.gradient(R)
    assert np.abs(off).max() < (10 * step + 1e-9) * potential.scale()  # measured 0.7 step


@potentials
def test_torque_works_against_the_energy(potential):
    R = rotation_about((1, -2, 0.5), 0.9)
    for axis in np.eye(3):
        gained = potential.energy(rotation_about(axis, 1e-5) @ R) - potential.energy(rotation_about(axis, -1e-5) @ R)
        assert abs(gained / 2e-5 + torque_W(potential, R) @ axis) < 1e-9 * potential.scale()  # measured 6e-11


@potentials
def test_energy_of_many_attitudes_is_that_of_each(potential):
    R = np.array([rotation_about((1, 2, 3), angle) for angle in (0.1, 0.5, 2.0)])
    for one, energy, gradient in zip(R, potential.energy(R), potential.gradient(R), strict=True):
        np.testing.assert_array_almost_equal_nulp(potential.energy(one), energy, 8)
        np.testing.assert_allclose(potential.gradient(one), gradient, rtol=1e-14, atol=1e-15)


@potentials
def test_reduced_conserves_energy_and_momentum_along_the_axis(potential):
    trajectory = cv.integrate(scene_in(potential), 0.02)
    assert len(trajectory.scene.invariants) == (1 if potential.axis_W is None else 2)
    for invariant in trajectory.scene.invariants:
        assert invariant.name in cv.Reduced().conserves & cv.Convected().conserves
        value = invariant.evaluate(trajectory.R_WB, trajectory.w_WB_B)
        assert np.abs(value - value[0]).max() < 1e-14 * invariant.scale  # measured 1e-15


@potentials
def test_convected_and_reduced_are_the_same_map(potential):
    scene = scene_in(potential, t_end=1.0)
    convected, reduced = (cv.integrate(scene, 0.02, method) for method in (cv.Convected(tol=1e-13), cv.Reduced()))
    assert angle_between(convected.R_WB, reduced.R_WB).max() < 1e-12  # measured 1e-15
    drift = np.abs(convected.energy - convected.energy[0]).max()
    assert drift < 1e-13 * scene.energy_scale  # measured 9e-16


@potentials
def test_newton_has_the_tangent_of_the_field(potential):
    # With a wrong tangent it converges slowly: more than six corrections a step.
    counters = cv.integrate(scene_in(potential), 0.25, cv.Convected(tol=1e-13)).counters
    assert counters.iterations <= 5 * counters.steps  # measured 4.0 to 4.4 a step


@potentials
def test_motion_is_of_order_two(potential):
    scene = scene_in(potential, t_end=1.0)
    last = [cv.integrate(scene, dt).R_WB[-1] for dt in (0.01, 0.005, 0.0025)]
    ratio = angle_between(last[0], last[1]) / angle_between(last[1], last[2])
    assert abs(math.log2(ratio) - 2) < 0.01  # measured 2e-4


def test_a_body_at_rest_falls_in_every_field():
    for potential in POTENTIALS.values():
        scene = scene_in(potential).rename("at rest", w_WB_B0=(0, 0, 0))
        trajectory = cv.integrate(scene, 0.01, t_end=0.3)
        assert np.abs(trajectory.energy - trajectory.energy[0]).max() < 1e-14 * scene.energy_scale  # measured 1e-15
        assert np.linalg.norm(trajectory.w_WB_B[-1]) > 0.01


def test_functions_of_a_spring_move_as_the_compiled_spring():
    spring = POTENTIALS["spring"]
    functions = cv.FunctionPotential(spring.energy, spring.gradient)
    compiled, called = (cv.integrate(scene_in(potential), 0.02) for potential in (spring, functions))
    assert angle_between(compiled.R_WB, called.R_WB).max() < 1e-12  # measured 3e-15: both are exact for a quadratic


def test_an_exception_of_a_function_is_reported():
    calls = []

    def energy(R):
        calls.append(R)
        if len(calls) > 100:
            raise ZeroDivisionError("the hundredth")
        return 0.0

    potential = cv.FunctionPotential(energy, lambda R: np.zeros((3, 3)), scale=1.0)
    for method in (cv.Reduced(), cv.Convected()):
        calls.clear()
        with pytest.raises(cv.PotentialFailed, match="the hundredth") as caught:
            cv.integrate(scene_in(potential), 0.02, method)
        assert isinstance(caught.value.__cause__, ZeroDivisionError)


@pytest.mark.parametrize("name", ["gravity", "spring", "gravity gradient"])
def test_the_scale_of_a_field_is_its_largest_energy(name):
    potential, q = POTENTIALS[name], np.random.default_rng(4).normal(size=(4000, 4))
    largest = np.abs(potential.energy(from_quaternion(q / np.linalg.norm(q, axis=1)[:, None]))).max()
    assert 0.95 * potential.scale() < largest <= potential.scale() * (1 + 1e-12)


def test_the_scale_of_an_attraction_is_its_energy_at_right_angles():
    potential = cv.PointAttraction(-1.7, (3, 0, 0), (0, 0, 4))
    assert potential.scale() == pytest.approx(1.7 / 5, rel=1e-14) == potential.energy(np.eye(3))


def test_the_scale_of_a_long_spring_is_that_of_its_rest_length():
    spring = cv.LinearSpring(3.0, (0, 0, 1), (0, 2, 0), 1e6)
    assert spring.scale() == pytest.approx(1.5e12)
    assert spring.scale() == pytest.approx(spring.energy(np.eye(3)), rel=1e-5)
    assert cv.integrate(cv.Scene("pushed", cv.RigidBody(INERTIA), np.eye(3), (0, 0, 1), 0.1, spring), 1e-4).ok


def scales(w_WB_B0):
    scene = cv.Scene("body", cv.RigidBody((0.7, 1.3, 0.9)), np.eye(3), w_WB_B0, 1.0, cv.UniformGravity(3.0, (0, 0.3, 0.4)))
    return {invariant.name: invariant.scale for invariant in scene.invariants}


def test_energy_is_relative_to_motion_and_field_and_momentum_to_its_initial_value():
    assert scales((0, 2.0, 0)) == pytest.approx({"energy": 1.3 * 4 / 2 + 3.0 * 0.5, "vertical momentum": 1.3 * 2})


def test_at_rest_momentum_is_relative_to_the_momentum_that_the_field_can_make():
    assert scales((0, 0, 0)) == pytest.approx({"energy": 3.0 * 0.5, "vertical momentum": np.sqrt(1.3 * 1.5)})


def test_the_gravity_gradient_is_the_second_order_of_newtons_law_for_point_masses():
    points = np.concatenate([arms := np.diag([1.0, 0.7, 0.4]) @ rotation_about((1, 2, 3), 0.8), -arms])  # 1 kg each, m
    inertia = sum(point @ point * np.eye(3) - np.outer(point, point) for point in points)
    distance, direction_W, G_M = 100.0, np.array([0.6, 0.0, 0.8]), 5.0
    field = cv.GravityGradient(np.sqrt(G_M / distance**3), inertia, direction_W)

    def newton(R):
        gaps = distance * direction_W - points @ R.T
        sizes = np.linalg.norm(gaps, axis=1)
        forces = G_M * gaps / sizes[:, None] ** 3
        return -(G_M / sizes).sum(), np.cross(points, forces @ R).sum(axis=0)

    turned, level = rotation_about((3, -1, 2), 1.3), np.eye(3)
    difference, torque_B = field.energy(turned) - field.energy(level), turned.T @ torque_W(field, turned)
    # the next order is (size/distance)^2 = 1e-4
    assert newton(turned)[0] - newton(level)[0] == pytest.approx(difference, rel=3e-4)  # measured 1.6e-4
    assert np.linalg.norm(newton(turned)[1] - torque_B) < 3e-4 * np.linalg.norm(torque_B)  # measured 1.8e-4


def test_a_fixed_gravity_gradient_has_the_integral_of_de_brun():
    scene = cv.scenes.gravity_gradient_body()
    J, field = scene.body.inertia, scene.potential

    def spread(dt):
        run = cv.integrate(scene, dt, cv.Taylor(16))
        L, u = run.w_WB_B @ J, field.direction_W @ run.R_WB
        whole = (L**2).sum(axis=1) - field.factor * np.linalg.det(J) * np.einsum("ni,ij,nj->n", u, np.linalg.inv(J), u)
        return np.ptp(whole) / np.ptp((L**2).sum(axis=1))

    assert spread(0.02) < 1e-13  # measured 4e-15
    assert spread(0.4) > 1e-12  # measured 2e-8: the motion conserves it, the method does not
