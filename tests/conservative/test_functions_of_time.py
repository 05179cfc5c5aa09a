"""Potentials as functions of attitude and time: against the textbook's equations, and what nobody may take them for."""

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.references.engines.scipy import SciPy

from .test_turning import INERTIA, R_WB0, RATES, textbook

MOMENT = np.array((0.3, -0.5, 1.2))


def _strength(t):
    return 1 + 0.5 * np.sin(2 * t)


def _energy(R, t):
    return _strength(t) * (R[2] @ MOMENT)


def _gradient(R, t):
    return _strength(t) * np.outer((0, 0, 1), MOMENT)


def _static_energy(R):
    return R[2] @ MOMENT


def _static_gradient(R):
    return np.outer((0, 0, 1), MOMENT)


FIELD = cv.FunctionPotential(_energy, _gradient, axis_W=(0, 0, 1), time_dependent=True)


def scene(potential=FIELD, t_end=2.0):
    return cv.Scene("shaken", cv.RigidBody(INERTIA), R_WB0, RATES, t_end, potential)


def test_projected_and_scipy_follow_the_textbook():
    t = np.linspace(0, 2, 5)
    R, w = textbook(lambda t, R: _strength(t) * np.cross(R[2], MOMENT), t)
    found = cv.integrate(scene(), 0.025, cv.Projected(), sample_every=20)
    assert angle_between(R, found.R_WB).max() < 1e-12  # measured 1.3e-14
    assert np.abs(w - found.w_WB_B).max() < 1e-12
    assert angle_between(R, cv.integrate(scene(), 0.5, SciPy()).R_WB).max() < 1e-10  # measured 1.1e-12
    still = cv.integrate(scene(cv.UniformGravity(1.0, MOMENT)), 0.025, cv.Projected())
    assert angle_between(R[-1], still.R_WB[-1]) > 0.01  # measured 0.3


def test_nothing_is_conserved_but_the_momentum_about_its_axis():
    found = cv.integrate(scene(), 0.05, cv.Projected())
    (momentum,) = found.scene.invariants
    assert momentum.name == "momentum along the field's axis"
    assert np.abs(found.drift(momentum)).max() < 4e-15  # measured 1.0e-15
    assert np.ptp(found.energy) > 0.1
    by_hand = np.sum((found.w_WB_B @ INERTIA) * found.w_WB_B, axis=1) / 2
    by_hand += [_energy(R, t) for R, t in zip(found.R_WB, found.t, strict=True)]
    np.testing.assert_allclose(found.energy, by_hand, rtol=1e-14)


def test_without_an_axis_nothing_is_put_back():
    free_of_axis = scene(cv.FunctionPotential(_energy, _gradient, time_dependent=True), 0.5)
    assert free_of_axis.invariants == ()
    found = cv.integrate(free_of_axis, 0.05, cv.Projected())
    assert found.counters.iterations == 0
    assert "drift" not in found._repr_html_()


def test_a_slow_motion_is_done_in_units_of_our_own():
    unit = 2.0**40
    slow = cv.FunctionPotential(
        lambda R, t: _energy(R, t / unit) / unit**2, lambda R, t: _gradient(R, t / unit) / unit**2, time_dependent=True
    )
    there = cv.Scene("slow", cv.RigidBody(INERTIA), R_WB0, RATES / unit, unit, slow)
    found, known = (cv.integrate(each, 0.05 * each.t_end, cv.Projected()) for each in (there, scene(FIELD, 1.0)))
    assert angle_between(found.R_WB, known.R_WB).max() < 1e-13


@pytest.mark.parametrize("name", ["reduced", "convected", "gauss", "lame", "heyoka", "precise"])
def test_other_methods_refuse(name):
    with pytest.raises(cv.Unsupported):
        cv.integrate(scene(), 0.1, name)


def test_there_is_no_value_without_a_time():
    for function in (FIELD.energy, FIELD.gradient):
        with pytest.raises(cv.PotentialFailed, match="attitude and time"):
            function(R_WB0)
    defaulted = cv.FunctionPotential(lambda R, t=0.0: _energy(R, t), lambda R, t=0.0: _gradient(R, t), time_dependent=True)
    with pytest.raises(cv.PotentialFailed, match="attitude and time"):
        defaulted.energy(R_WB0)
    static = cv.FunctionPotential(_static_energy, _static_gradient)
    with pytest.raises(cv.PotentialFailed, match="attitude alone"):
        static.energy(R_WB0, 1.0)


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: cv.FunctionPotential(_energy, _gradient), "gradient"),
        (lambda: cv.FunctionPotential(_static_energy, _gradient, time_dependent=True), "energy"),
        (lambda: cv.FunctionPotential(_energy, _static_gradient, time_dependent=True), "gradient"),
        (lambda: cv.FunctionPotential(_energy, lambda R, t: _gradient(R, 0.0), time_dependent=True), "gradient"),
        (lambda: cv.FunctionPotential(_energy, _gradient, axis_W=(1, 0, 0), time_dependent=True), "axis_W"),
        (lambda: cv.FunctionPotential(_energy, _gradient, time_dependent=1), "time_dependent"),
        (lambda: cv.Turning(FIELD, cv.Orbit(1, (0, 0, 1))), "potential"),
    ],
)
def test_what_is_no_function_of_attitude_and_time_is_refused(make, argument):
    with pytest.raises(cv.BadInput) as caught:
        make()
    assert caught.value.argument == argument
