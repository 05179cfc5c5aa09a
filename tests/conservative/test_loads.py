"""Torques and damping: balances of energy and momentum, order, bad input, and which methods take them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.errors import BadInput, TorqueFailed, Unsupported
from conservative.invariants import sizes

from ..bodies import impossible_body
from ..sampling import sampled

BODY = cv.RigidBody([[13, 0.5, 0.2], [0.5, 5, 0.3], [0.2, 0.3, 10]])
R_WB0 = rotation_about((1.0, -2.0, 0.5), 0.9)
DAMPING = cv.Damping([[0.5, 0.1, 0], [-0.1, 0.3, 0], [0, 0, 0.7]])
GRAVITY = cv.UniformGravity(3.0, (0.1, 0.2, 0.3))

SPRING = cv.LinearSpring(3.0, (0.1, 0.2, 0.3), (1.0, 0.0, 0.5), 0.3)
ORBIT = cv.Orbit(0.3, (0, 1, 0)).gravity_gradient(BODY.inertia, (1, 0, 0))


def loaded(torque=None, damping=DAMPING, potential=None, t_end=5.0, **others) -> cv.Scene:
    return cv.Scene("loaded", BODY, R_WB0, (0.1, 1.5, 2.0), t_end, potential, torque=torque, damping=damping, **others)


SINE = cv.Torque(lambda t: (3 * np.sin(t), -1.0, 2.0), "world")
TABLE = cv.Torque(([0.0, 1.3, 4.5, 6.0], [[0, 0, 1], [1, 0, 1], [1, 2, 3], [0, 0, 0]]))
GROWING = cv.Damping(DAMPING.matrix, lambda t: 1 + np.sin(t))
STEPPED = cv.Damping(DAMPING.matrix, ([0.0, 1.3, 4.5, 6.0], [0, 2, 1, 1]))
SCENES = {
    "constant, body": loaded(cv.Torque((3.0, -1.0, 2.0))),
    "damping alone, gravity": loaded(None, potential=GRAVITY),
    "function, world, gravity": loaded(SINE, potential=GRAVITY),
    "table": loaded(TABLE, damping=None),
    "damping with a factor": loaded(None, GROWING),
    "torque, damping with a table, gravity": loaded(SINE, STEPPED, GRAVITY),
}


@pytest.mark.parametrize(("name", "order"), sampled(product(SCENES, (2, 6)), 6))
def test_reduced_keeps_the_balances_to_round_off(name, order):
    scene = SCENES[name]
    trajectory = cv.integrate(scene, 0.05, cv.Reduced(order=order))
    assert [invariant.name.split()[-1] for invariant in scene.invariants] == ["balance"] * 2
    for balance in scene.invariants:
        assert sizes(trajectory.drift(balance)).max() < 2e-14  # measured: at most 2.6e-15
        without = balance.evaluate(trajectory.R_WB, trajectory.w_WB_B) - balance.evaluate(
            scene.R_WB0[None], scene.w_WB_B0[None]
        )
        assert sizes(without).max() > 0.01 * balance.scale  # the quantity itself is not conserved


FIELDS = {"gravity": GRAVITY, "spring": SPRING, "orbit": ORBIT}
DAMPINGS = {"constant": DAMPING, "factor": GROWING}


@pytest.mark.parametrize(("field", "damping"), sampled(product(FIELDS, DAMPINGS), 2, [("orbit", "factor")]))
def test_projected_keeps_the_balances_also_between_its_steps(field, damping):
    scene = loaded(SINE, DAMPINGS[damping], FIELDS[field])
    trajectory = cv.integrate(scene, 0.05, "projected")
    between = cv.integrate(scene, 0.05, "projected", t_eval=[0.0, 0.333, 4.9, 5.0])
    for balance in scene.invariants:
        assert sizes(trajectory.drift(balance)).max() < 2e-14  # measured: at most 2e-15
        assert sizes(between.drift(balance)).max() < 2e-14  # measured: at most 2e-15
    assert np.abs(between.supplied[-1] - trajectory.supplied[-1]).max() < 1e-13


def test_a_work_that_is_wrong_by_a_millionth_shows():
    scene = SCENES["constant, body"]
    trajectory = cv.integrate(scene, 0.05)
    trajectory.supplied[-1] *= 1 + 1e-6
    assert all(sizes(trajectory.drift(balance))[-1] > 1e-8 for balance in scene.invariants)


def test_a_constant_torque_about_a_principal_axis():
    body = impossible_body((1.0, 2.0, 4.0))
    scene = cv.Scene(
        "spin up", body, R_WB0, (0, 0, 0.5), 3.0, torque=cv.Torque((0, 0, 2.0)), damping=cv.Damping(np.diag([0, 0, 1.0]))
    )
    found, rate = cv.integrate(scene, 0.001), 0.25  # damping / moment, 1/s
    exact = 2.0 + (0.5 - 2.0) * np.exp(-rate * found.t)
    angle = 2.0 * found.t + (0.5 - 2.0) * (1 - np.exp(-rate * found.t)) / rate
    turned = np.array([R_WB0 @ rotation_about((0, 0, 1), each) for each in angle])
    assert np.abs(found.w_WB_B[:, 2] - exact).max() < 1e-8  # measured: 2e-9
    assert angle_between(found.R_WB, turned).max() < 1e-5  # measured: 1.4e-6


def test_a_damping_that_grows_with_time_about_a_principal_axis():
    damping = cv.Damping(np.diag([0, 0, 1.0]), lambda t: t)
    scene = cv.Scene("spin down", impossible_body((1.0, 2.0, 4.0)), R_WB0, (0, 0, 0.5), 3.0, damping=damping)
    found = cv.integrate(scene, 0.001)
    assert np.abs(found.w_WB_B[:, 2] - 0.5 * np.exp(-(found.t**2) / 8)).max() < 1e-8  # measured: 4.3e-9


def test_a_factor_of_one_changes_no_bit():
    one = cv.Damping(DAMPING.matrix, lambda t: 1.0)
    for method, potential in (("reduced", None), ("reduced", GRAVITY), ("projected", SPRING), ("scipy", GRAVITY)):
        found, constant = (cv.integrate(loaded(SINE, each, potential), 0.05, method) for each in (one, DAMPING))
        assert np.array_equal(found.w_WB_B, constant.w_WB_B)
        assert np.array_equal(found.R_WB, constant.R_WB)


def test_very_small_scenes_are_integrated_in_their_own_units():
    small, unit = 2.0**-60, 2.0**20  # kg m^2, s
    torque = cv.Torque(lambda t: np.array((3 * np.sin(t / unit), -1.0, 2.0)) * small / unit**2, "world")
    scene = cv.Scene(
        "small", cv.RigidBody(BODY.inertia * small), R_WB0, np.array((0.1, 1.5, 2.0)) / unit, 5.0 * unit,
        torque=torque, damping=cv.Damping(DAMPING.matrix * small / unit, lambda t: 1 + np.sin(t / unit)),
    )  # fmt: skip
    found, same = cv.integrate(scene, 0.05 * unit), cv.integrate(loaded(SINE, GROWING), 0.05)
    assert np.abs(found.w_WB_B * unit - same.w_WB_B).max() < 1e-12
    assert np.abs(found.supplied[:, 0] / (small / unit**2) - same.supplied[:, 0]).max() < 1e-12 * np.abs(same.supplied).max()


@pytest.mark.parametrize(
    ("build", "argument", "said"),
    [
        (lambda: cv.Torque((1, 2)), "value", "shape (2,)"),
        (lambda: cv.Torque("up"), "value", "'up'"),
        (lambda: cv.Torque((1, np.nan, 0)), "value", "not finite"),
        (lambda: cv.Torque((1, 2, 3), "orbit"), "frame", "'orbit'"),
        (lambda: cv.Torque(([0, 1, 1, 1], np.zeros((4, 3)))), "times", "1 after 1, at index 3"),
        (lambda: cv.Torque(([0, 1], np.zeros((3, 3)))), "values", "shape (3, 3)"),
        (lambda: cv.Torque(lambda t: (1, 2)), "torque", "returns (1, 2)"),
        (lambda: cv.Torque(lambda t: (1, 2, np.nan)), "torque", "nan"),
        (lambda: cv.Torque(lambda t: 1 / t), "torque", "ZeroDivisionError"),
        (lambda: loaded(cv.Torque(([0, 1], np.zeros((2, 3))))), "torque", "a table from 0 to 1 s"),
        (lambda: loaded((1, 2, 3)), "torque", "(1, 2, 3)"),
        (lambda: loaded(damping=0.1), "damping", "0.1"),
        (lambda: cv.Damping([1, 2, 3]), "matrix", "shape (3,)"),
        (lambda: cv.Damping(np.diag([1, -0.5, 1])), "matrix", "eigenvalue -0.5"),
        (lambda: cv.Damping(np.eye(3), (1, 2)), "factor", "shape (2,)"),
        (lambda: cv.Damping(np.eye(3), lambda t: (1, 2)), "factor", "returns (1, 2)"),
        (lambda: cv.Damping(np.eye(3), lambda t: np.nan), "factor", "nan"),
        (lambda: cv.Damping(np.eye(3), ([0, 1], [1, -2])), "values", "-2"),
        (lambda: cv.Damping(np.eye(3), ([0, 1], [1, 2, 3])), "values", "shape (3,)"),
        (lambda: cv.Damping(np.eye(3), ([1, 0], [1, 2])), "times", "0 after 1"),
        (lambda: cv.Damping(np.eye(3), lambda t: 1.0, breaks=[np.inf]), "breaks", "inf"),
        (lambda: loaded(damping=cv.Damping(np.eye(3), ([0, 1], [1, 2]))), "factor", "a table from 0 to 1 s"),
        (lambda: loaded(damping=cv.Damping(np.eye(3), lambda t: 2 - t)), "factor", "returns -0.0312"),
    ],
)
def test_bad_input_names_the_argument_and_its_value(build, argument, said):
    with pytest.raises(BadInput) as failure:
        build()
    assert failure.value.argument == argument
    assert said in failure.value.got


def test_a_torque_that_fails_during_the_run_ends_it_with_its_time():
    def after_two(t):
        if t > 4.9 and t < 4.99:
            raise ValueError("no torque")
        return 0.0, 0.0, 1.0

    with pytest.raises(TorqueFailed, match="no torque") as failure:
        cv.integrate(loaded(cv.Torque(after_two)), 0.01)
    assert failure.value.time == pytest.approx(4.905)
    assert isinstance(failure.value.__cause__, ValueError)
    with pytest.raises(TorqueFailed, match=r"factor: got a function that returns -1\.0") as failure:
        cv.integrate(loaded(damping=cv.Damping(np.eye(3), lambda t: -1.0 if 4.9 < t < 4.99 else 1.0)), 0.01)
    assert 4.9 < failure.value.time < 4.91


@pytest.mark.parametrize(
    "method", ["taylor", "gauss", "splitting", "convected", "moser_veselov", "mujoco", "exact", "textbook"]
)
def test_other_methods_refuse_and_name_those_that_take_loads(method):
    with pytest.raises(Unsupported, match="damping") as refusal:
        cv.integrate(SCENES["damping alone, gravity"], 0.01, method)
    advised = str(refusal.value).rpartition(": ")[2]
    assert {"projected", "reduced", "scipy"} <= {each.strip(" )") for each in advised.replace(" and ", ",").split(",")}
