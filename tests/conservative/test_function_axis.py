"""Functions with a named axis: energy and the momentum about it, both to round-off, whatever the function and the method."""

import math
from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about

from ..sampling import sampled
from .one_body import body_in_axes, drift

B = np.array([0.3, 0.1, 0.4])
QUARTIC = cv.FunctionPotential(
    lambda R: 20 * (R[2] @ B) ** 4, lambda R: np.outer([0, 0, 1], 80 * (R[2] @ B) ** 3 * B), axis_W=(0, 0, 1)
)


def polynomial(seed):
    """Return a scene with a random V of g = R'e, of degree 4 to 6; body, frames and axis are random too."""
    rng = np.random.default_rng(seed)
    e, b, c = (x / np.linalg.norm(x) for x in rng.normal(size=(3, 3)))
    powers, size = rng.integers(2, 4, 2), rng.uniform(2, 6)

    def energy(R):
        g = e @ R
        return size * (0.4 + g @ b) ** powers[0] * (g @ c - 0.3) ** powers[1]

    def gradient(R):
        g = e @ R
        x, y = 0.4 + g @ b, g @ c - 0.3
        m, n = powers
        return np.outer(e, size * (m * x ** (m - 1) * y**n * b + n * x**m * y ** (n - 1) * c))

    moments = np.sum(parts := rng.uniform(0.3, 1.5, 3)) - parts
    turn, start = (rotation_about(rng.normal(size=3), 1.0 + i) for i in range(2))
    field = cv.FunctionPotential(energy, gradient, axis_W=e)
    return cv.Scene(f"polynomial {seed}", body_in_axes(turn, *moments), start, rng.normal(size=3), 1.0, field)


def other_rows(b, degree, size, off):
    """Return the field size (R[2].b)^degree, written with the other rows: matrices that are not rotations have `off` J more."""

    def energy(R):
        return size * (np.cross(R[0], R[1]) @ b) ** degree + off * (R[0] @ R[0] - 1)

    def gradient(R):
        slope = size * degree * (np.cross(R[0], R[1]) @ b) ** (degree - 1)
        return np.array([slope * np.cross(R[1], b) + 2 * off * R[0], slope * np.cross(b, R[0]), np.zeros(3)])

    return cv.FunctionPotential(energy, gradient, axis_W=(0, 0, 1))


def in_field(field, w=(1, 0.6, 2), t_end=1.0):
    return cv.Scene("body", cv.RigidBody((1, 2, 2.5)), np.eye(3), w, t_end, field)


SCENES = {"quartic": in_field(QUARTIC), "other rows": in_field(other_rows(B, 4, 20, 3))} | {
    f"polynomial {seed}": polynomial(seed) for seed in range(3)
}
scenes = pytest.mark.parametrize("name", sampled(SCENES, 1, ["polynomial 1"]))


METHODS = {method.name: method for method in (cv.Reduced(), cv.Reduced(order=4), cv.Convected(tol=1e-13))}


@pytest.mark.parametrize(("name", "method"), sampled(product(SCENES, METHODS), 3, [("polynomial 0", "reduced:order=4")]))
def test_energy_and_momentum_about_the_axis_are_conserved(name, method):
    scene, method = SCENES[name], METHODS[method]
    trajectory = cv.integrate(scene, 0.05, method, t_end=10.0)
    assert len(scene.invariants) == 2
    assert drift(trajectory) < (2e-14 if isinstance(method, cv.Reduced) else 1e-13)  # measured 3e-15, 2.3e-14


@scenes
def test_convected_and_reduced_are_the_same_map(name):
    scene = SCENES[name]
    convected, reduced = (cv.integrate(scene, 0.05, method) for method in (cv.Convected(tol=1e-13), cv.Reduced()))
    assert angle_between(convected.R_WB, reduced.R_WB).max() < 5e-13  # measured 5e-14


@scenes
def test_order_two_and_four_against_a_method_without_finite_derivative(name):
    scene = SCENES[name]
    truth = cv.integrate(scene, 0.005, cv.Projected()).R_WB[-1]
    for order, steps, tolerance in ((2, (160, 320), 0.01), (4, (20, 40), 0.1)):  # measured 3e-4 and 0.037
        coarse, fine = (angle_between(truth, cv.integrate(scene, 1.0 / n, cv.Reduced(order=order)).R_WB[-1]) for n in steps)
        assert abs(math.log2(coarse / fine) - order) < tolerance


@scenes
def test_the_step_is_symmetric(name):
    scene = SCENES[name]
    there = cv.integrate(scene, 0.1, cv.Reduced())
    returning = scene.rename("back", R_WB0=there.R_WB[-1], w_WB_B0=-there.w_WB_B[-1])
    back = cv.integrate(returning, 0.1, cv.Reduced())
    assert angle_between(back.R_WB[-1], scene.R_WB0) < 1e-14  # measured 1.5e-15


@pytest.mark.parametrize("exponent", sampled([*range(1, 17, 2), math.inf], 3, [math.inf]))
def test_a_spin_about_the_axis_with_any_disturbance(exponent):
    # The axis hardly moves in the body, or not at all. The difference of energies is then round-off, here of 100 J, and must
    # not be divided by that motion.
    turn = rotation_about((3, -1, 2), 1.3)
    w, field = turn @ (10.0**-exponent, 0, 9), other_rows(turn[:, 2], 3, 1, 100)
    scene = cv.Scene("sleeping", body_in_axes(turn, 1.0, 1.6, 2.2), turn.T, w, 5.0, field)
    trajectory = cv.integrate(scene, 0.05)
    assert drift(trajectory) < 2e-14  # measured 6e-15
    assert np.abs(trajectory.w_WB_B - turn[:, 2] * 9).max() < 2 * 10.0**-exponent + 1e-13  # measured 1.1 of the first, 3e-14


def test_functions_without_an_axis_keep_their_energy_only():
    free_form = cv.FunctionPotential(QUARTIC.energy, QUARTIC.gradient)
    scene = in_field(free_form)
    assert [invariant.name for invariant in scene.invariants] == ["energy"]
    assert drift(cv.integrate(scene, 0.05)) < 2e-15  # measured 2e-16
