"""Random initial states have the requested distribution. With 20,000 bodies a standard deviation is known to 0.5 %."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest, truncnorm

import conservative as cv
from conservative.attitude import orthonormality, rotation_about
from conservative.integration.spread import list_parameters, spread

from ..bodies import impossible_body
from .one_body import BODY, TURN

N = 20_000
START = {"R_WB0": rotation_about((1, 0.2, -1), 0.7), "w_WB_B0": (0.3, -2.0, 1.0), "t_end": 2.0}
TOP = cv.Scene("top", BODY, **START, potential=cv.UniformGravity(-3.0, (0.1, 0.2, -0.4)))
LEAST = 1e-3
"""Significance below which a sample does not have the distribution; the seed is fixed."""


def is_normal(values, deviation):
    """Return whether all columns (n, k) are normal about 0 with a standard deviation, and independent."""
    each = [kstest(column, "norm", (0, deviation)).pvalue for column in values.T]
    off = np.corrcoef(values.T) - np.eye(values.shape[1])
    return min(each) > LEAST and np.abs(off).max() < 4 / math.sqrt(len(values))


@pytest.mark.parametrize(("given", "sigma"), [(0.1, 0.1), ("5deg", math.radians(5)), ("0.02 rad", 0.02), (" 3e-9 ", 3e-9)])
def test_attitudes_are_turned_by_normal_rotation_vectors_in_body_axes(given, sigma):
    R = spread(TOP, N, attitude=given)["R_WB0"]
    assert orthonormality(R).max() < 1e-15  # measured 7e-16
    turned = Rotation.from_matrix(TOP.R_WB0.T @ R).as_rotvec()
    assert is_normal(turned, sigma)
    assert turned.std(axis=0) == pytest.approx(sigma, rel=0.03)  # measured 0.8 %
    assert not is_normal(turned, 1.05 * sigma)


def test_turns_are_about_body_axes():
    (R,) = spread(TOP, 1, attitude=0.3)["R_WB0"]
    at_one = cv.Scene("one", BODY, np.eye(3), (0, 0, 1), 1.0)
    (turn,) = spread(at_one, 1, attitude=0.3)["R_WB0"]
    assert np.abs(R - TOP.R_WB0 @ turn).max() < 1e-15  # measured 1e-16
    assert np.abs(R - turn @ TOP.R_WB0).max() > 0.01


def test_any_attitude_is_evenly_distributed():
    R = spread(TOP, N, attitude="any")["R_WB0"]
    assert orthonormality(R).max() < 2e-15  # measured 9e-16
    angles = Rotation.from_matrix(R).magnitude()
    assert kstest(angles, lambda a: (a - np.sin(a)) / math.pi).pvalue > LEAST
    assert all(kstest(R[:, i, j], "uniform", (-1, 2)).pvalue > LEAST for i in range(3) for j in range(3))
    assert kstest(Rotation.from_matrix(spread(TOP, N, attitude=1.5)["R_WB0"]).magnitude(), lambda a: a / math.pi).pvalue < LEAST


@pytest.mark.parametrize(("given", "sigma"), [(0.1, 0.1), ("2deg/s", math.radians(2)), ("10%", 0.1 * math.sqrt(5.09))])
def test_rates_are_normal_about_the_scenes(given, sigma):
    w = spread(TOP, N, rate=given)["w_WB_B0"] - TOP.w_WB_B0
    assert is_normal(w, sigma)
    assert not is_normal(w, 1.05 * sigma)


def test_rates_of_any_direction_keep_their_size():
    w = spread(TOP, N, rate="any")["w_WB_B0"]
    size = np.linalg.norm(TOP.w_WB_B0)
    assert np.linalg.norm(w, axis=1) == pytest.approx(size, rel=1e-14)  # measured 3e-16
    assert all(kstest(column / size, "uniform", (-1, 2)).pvalue > LEAST for column in w.T)


@pytest.mark.parametrize("share", [0.01, 0.6])
def test_inertia_is_that_of_a_body_whose_second_moments_of_mass_vary(share):
    J = spread(TOP, N, inertia=f"{100 * share}%")["inertia"]
    moments = np.diagonal(TURN.T @ J @ TURN, axis1=1, axis2=2)
    assert np.abs(J - np.swapaxes(J, 1, 2)).max() < 1e-14  # measured 9e-16
    assert np.abs(TURN.T @ J @ TURN - moments[:, :, None] * np.eye(3)).max() < 1e-14 * moments.max()  # measured 3e-16
    planes = moments.sum(axis=1, keepdims=True) / 2 - moments
    assert planes.min() > 0  # so that no moment is larger than the sum of the others
    shares, expected = planes / (1.2, 0.8, 0.2), truncnorm(-1 / share, math.inf, 1, share)
    assert all(kstest(column, expected.cdf).pvalue > LEAST for column in shares.T)
    assert not all(kstest(column, "norm", (1, 1.05 * share)).pvalue > LEAST for column in shares.T)


def test_a_plate_remains_a_plate():
    plate = cv.Scene("plate", cv.RigidBody((1.0, 2.0, 3.0)), np.eye(3), (0, 0, 1), 1.0)
    J = spread(plate, 1000, inertia="5%")["inertia"]
    assert J[:, 0] + J[:, 1] == pytest.approx(J[:, 2], rel=1e-15)


def test_parameters_of_the_potential():
    found = spread(TOP, N, parameters={"weight": "2%", "com_B": 0.01})["parameters"]
    assert is_normal(found["weight"][:, None] + 3.0, 0.06)
    assert is_normal(found["com_B"] - TOP.potential.com_B, 0.01)
    assert (spread(TOP, 1000, parameters={"weight": "80%"})["parameters"]["weight"] < 0).all()
    assert list_parameters(TOP) == ["weight", "com_B"]
    assert list_parameters(cv.scenes.brick_flip()) == []


def test_directions_stay_unit_vectors_and_gravity_gradients_have_the_inertia_of_the_body():
    field = cv.GravityGradient(0.3, BODY.inertia, (1, 2, -2))
    scene = cv.Scene("satellite", BODY, **START, potential=field)
    found = spread(scene, 1000, inertia="3%", parameters={"direction_W": 0.02, "rate": "1%"})
    u = found["parameters"]["direction_W"]
    assert np.linalg.norm(u, axis=1) == pytest.approx(1, abs=1e-15)
    assert np.arccos(u @ field.direction_W).max() < 0.1
    np.testing.assert_array_equal(found["parameters"]["inertia"], found["inertia"])
    assert list_parameters(scene) == ["rate", "direction_W"]


ALL = {"attitude": "5deg", "rate": 0.1, "inertia": "60%", "parameters": {"weight": "60%", "com_B": "1%"}}


def flat(starts):
    return {**{k: v for k, v in starts.items() if k != "parameters"}, **starts["parameters"]}


def test_the_first_of_many_are_those_of_few_and_seeds_differ(monkeypatch):
    few, many, other = (flat(spread(TOP, n, **ALL, seed=seed)) for n, seed in ((50, 7), (300, 7), (50, 8)))
    monkeypatch.setattr("conservative.integration.spread._PIECE", 64)
    in_pieces = flat(spread(TOP, 300, **ALL, seed=7))
    for name, values in few.items():
        np.testing.assert_array_equal(values, many[name][:50])
        np.testing.assert_array_equal(many[name], in_pieces[name])
        assert (values != other[name]).all(), name


def test_the_spread_of_one_quantity_changes_no_other():
    alone, together = spread(TOP, 50, rate=0.1), spread(TOP, 50, **ALL)
    np.testing.assert_array_equal(alone["w_WB_B0"], together["w_WB_B0"])
    assert set(alone) == {"R_WB0", "w_WB_B0"}
    assert (alone["R_WB0"] == TOP.R_WB0).all()


REST = cv.Scene("rest", BODY, np.eye(3), (0, 0, 0), 1.0)
ORBIT = REST.rename("orbit", potential=cv.Orbit(0.1, (0, 0, 1)).gravity_gradient(BODY.inertia, (1, 0, 0)))
ODD = cv.Scene("odd", impossible_body((1.0, 1.0, 3.0)), np.eye(3), (0, 0, 1), 1.0)


@pytest.mark.parametrize(
    ("scene", "given", "argument", "got", "allowed"),
    [
        (TOP, {"attitude": "5dge"}, "attitude", "'5dge'", "5deg, or any"),
        (TOP, {"attitude": math.nan}, "attitude", "nan", "above 0"),
        (TOP, {"rate": -0.1}, "rate", "-0.1", "10% (of its size)"),
        (REST, {"rate": "10%"}, "rate", "'10%' of 0", "in rad/s"),
        (REST, {"rate": "any"}, "rate", "'any' of 0", "in rad/s"),
        (TOP, {"inertia": "101%"}, "inertia", "'101%'", "up to 100%"),
        (ODD, {"inertia": "1%"}, "inertia", "[1.0, 1.0, 3.0]", "none is larger than the sum"),
        (ORBIT, {"inertia": "1%"}, "inertia", "a turning field", "none"),
        (TOP, {"parameters": {"wieght": "1%"}}, "parameters", "'wieght'", "'weight' (nearest)"),
        (TOP, {"parameters": {"weight": "1kg"}}, "potential.weight", "'1kg'", "its own SI unit"),
        (TOP, {"seed": -1}, "seed", "-1", "0 or more"),
        (TOP, {"n": 10**12}, "n", "1000000000000", "fit in memory"),
    ],
)
def test_mistakes(scene, given, argument, got, allowed):
    with pytest.raises(cv.BadInput) as caught:
        spread(scene, **({"n": 3} | given))
    assert caught.value.argument == argument
    assert got in str(caught.value.got)
    assert allowed in caught.value.allowed
