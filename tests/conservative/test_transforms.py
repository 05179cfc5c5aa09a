"""Scenes in another body frame and with time stretched: every part of a scene is carried along, and the motion is the same."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.features import FIELDS, IN_TIME, Feature
from conservative.invariants import Invariant, momentum_W, sizes
from conservative.scenes.transforms import in_body_frame, slow_motion

from ..sampling import sampled

BODY = cv.RigidBody([[13, 0.5, 0.2], [0.5, 5, 0.3], [0.2, 0.3, 10]])
GRAVITY = cv.UniformGravity(20.0, (0.1, 0.2, 0.3))
MATRIX = [[5, 1.0, 0], [-1.0, 3, 0], [0, 0, 7]]
TIMES, VALUES = [0.0, 0.7, 1.0, 2.0], [[0, 9, 1], [1, 0, 1], [1, 20, 3], [5, 5, 5]]
FLIGHT = cv.shapes.box((0.1, 0.2, 0.3), mass=2).about((0.1, 0, 0))


def pulse(t):
    return (20.0, 0.0, -5.0) if 0.4 < t < 0.83 else (0.0, np.sin(t), 0.0)


def magnetic(t, R_WB):
    """Return a torque m x B of a body whose dipole m and whose field B are fixed, but for its growth."""
    return np.cross((30.0, 0.0, 10.0), R_WB.T @ (0.0, 2.0 + t, 1.0))


def eddy(t, R_WB):
    field_B = R_WB.T @ (0.0, 2.0 + t, 1.0)
    return field_B @ field_B * np.eye(3) - np.outer(field_B, field_B)


def plain(**parts):
    scene = cv.Scene("plain", BODY, rotation_about((1, -2, 0.5), 0.9), (0.1, 1.5, 2.0), 1.5)
    return scene.rename("parts", **parts)


PARTS = {
    "gravity": ({"potential": GRAVITY}, "potential"),
    "rotor": ({"body": cv.RigidBody(BODY.inertia, (3.0, -4.0, 20.0))}, "rotor"),
    "torque": ({"torque": cv.Torque((9.0, -1.0, 20.0))}, "torque"),
    "torque, world": ({"torque": cv.Torque((9.0, -1.0, 20.0), "world")}, "torque"),
    "torque, table": ({"torque": cv.Torque((TIMES, VALUES))}, "torque"),
    "torque, function": ({"torque": cv.Torque(pulse, breaks=(0.4, 0.83))}, "torque"),
    "torque, function, world": ({"torque": cv.Torque(pulse, "world", (0.4, 0.83))}, "torque"),
    "damping": ({"damping": cv.Damping(MATRIX)}, "damping"),
    "damping, table": ({"damping": cv.Damping(MATRIX, (TIMES, [0, 2, 1, 1]))}, "damping"),
    "damping, function": ({"damping": cv.Damping(MATRIX, lambda t: float(t > 0.5), breaks=[0.5])}, "damping"),
    "torque, jump": ({"torque": cv.Torque(([0, 0.5, 0.5, 2], [VALUES[1], VALUES[1], VALUES[2], VALUES[3]]))}, "torque"),
    "torque, attitude": ({"torque": cv.Torque(magnetic)}, "torque"),
    "torque, attitude, world": ({"torque": cv.Torque(lambda t, R: 20 * R[:, 0] + t, "world")}, "torque"),
    "damping, matrices": ({"damping": cv.Damping((TIMES, np.multiply.outer([0, 2, 1, 1], MATRIX)))}, "damping"),
    "damping, attitude": ({"damping": cv.Damping(eddy)}, "damping"),
    "damping, factor of attitude": ({"damping": cv.Damping(MATRIX, lambda t, R: 1 + R[0, 1])}, "damping"),
    "motor": ({"body": cv.RigidBody(BODY.inertia, (TIMES, VALUES))}, "rotor"),
    "motor, function": ({"body": cv.RigidBody(BODY.inertia, lambda t: (30 * t, 0.0, 20 * np.cos(t)))}, "rotor"),
    "all": ({"potential": GRAVITY, "torque": cv.Torque((TIMES, VALUES)), "damping": cv.Damping(MATRIX)}, "torque"),
}
REFUSED = FIELDS - {Feature.GRAVITY} | IN_TIME
F = rotation_about((1, 2, 3), 0.7)


def run(scene, steps=60):
    return cv.integrate(scene, scene.t_end / steps, "projected" if Feature.ATTITUDE in scene.features else "reduced:order=4")


def without(scene, part):
    changes = {"body": cv.RigidBody(scene.body.inertia)} if part == "rotor" else {part: None}
    return scene.rename("without", **changes)


def test_each_part_that_a_scene_can_need_is_carried_along_or_refused():
    needed = frozenset().union(*(plain(**parts).features for parts, _ in PARTS.values()))
    assert needed | {Feature.FLIGHT} | REFUSED == set(Feature)
    orbit = cv.Orbit(0.3, (0, 1, 0)).gravity_gradient(BODY.inertia, (1, 0, 0))
    function = cv.FunctionPotential(lambda R: R[2, 0], lambda R: np.outer([0, 0, 1], [1, 0, 0]), 1.0)
    for field in (orbit, function, cv.LinearSpring(3.0, (0.1, 0.2, 0.3), (1.0, 0.0, 0.5), 0.3)):
        for transform in (lambda scene: in_body_frame(scene, F, "turned"), slow_motion):
            with pytest.raises(cv.BadInput) as refused:
                transform(plain(potential=field))
            assert (refused.value.argument, refused.value.got) == ("scene", f"a scene with {field!r}")


SAMPLE = ["rotor", "torque, world", "torque, table", "damping, factor of attitude", "all"]


@pytest.mark.parametrize("name", sampled(PARTS, len(SAMPLE), SAMPLE))
def test_in_another_body_frame_the_motion_is_the_same(name):
    scene, part = plain(**PARTS[name][0]), PARTS[name][1]
    turned = in_body_frame(scene, F, "turned")
    one, other = run(scene), run(turned)
    assert angle_between(other.R_WB @ F, one.R_WB).max() < 1e-12  # measured 3e-15
    assert np.abs(other.w_WB_B @ F - one.w_WB_B).max() < 1e-12  # measured 1e-14
    for invariant in turned.invariants:
        assert sizes(other.drift(invariant)).max() < 1e-13  # measured 3e-15
    assert angle_between(run(without(turned, part)).R_WB @ F, one.R_WB).max() > 0.01  # the part matters
    if scene.loaded:
        np.testing.assert_allclose(other.supplied, one.supplied, rtol=0, atol=1e-10)


SLOWER = [("torque, function", 3.0), *((name, slow) for name, slow in zip(SAMPLE, [4.0, 3.0] * 4, strict=False))]


@pytest.mark.parametrize(("name", "slow"), sampled(product(PARTS, (4.0, 3.0)), len(SLOWER), SLOWER))
def test_slower_the_motion_is_the_same(name, slow):
    scene, part = plain(**PARTS[name][0]), PARTS[name][1]
    slower = slow_motion(scene, slow)
    one, other = run(scene), run(slower)
    close = 0 if slow == 4.0 else 1e-12  # powers of two do not round; measured 2e-15
    np.testing.assert_allclose(other.R_WB, one.R_WB, rtol=0, atol=close)
    np.testing.assert_allclose(slow * other.w_WB_B, one.w_WB_B, rtol=0, atol=10 * close)
    assert angle_between(run(without(slower, part)).R_WB, one.R_WB).max() > 0.01  # the part matters
    if scene.loaded:
        units = slow ** np.array([2, 1, 1, 1])
        np.testing.assert_allclose(other.supplied * units, one.supplied, rtol=0, atol=100 * close)


@pytest.mark.parametrize("name", ["motor", "motor, function"])
def test_the_momentum_of_a_motor_is_carried_along(name):
    scene = plain(**PARTS[name][0])
    turned, slower, w = in_body_frame(scene, F, "turned"), slow_motion(scene, 3.0), np.array((0.3, -0.4, 0.5))
    for t in (0.0, 0.4, 0.9, 1.4):
        momentum = scene.body.momentum(w, t)
        np.testing.assert_allclose(turned.body.momentum(F @ w, t), F @ momentum, rtol=1e-13)
        np.testing.assert_allclose(3.0 * slower.body.momentum(w / 3.0, 3.0 * t), momentum, rtol=1e-13)


def test_breaks_are_carried_along():
    torque, damping = cv.Torque(pulse, breaks=(0.4, 0.83)), cv.Damping(MATRIX, lambda t: 1.0, breaks=[0.5])
    scene = plain(torque=torque, damping=damping)
    turned, slower = in_body_frame(scene, F, "turned"), slow_motion(scene, 4)
    assert turned.torque.breaks.tolist() == [0.4, 0.83]
    assert slower.torque.breaks.tolist() == [1.6, 3.32]
    assert (turned.damping.factor.breaks, slower.damping.factor.breaks) == ([0.5], [2.0])


def test_extra_invariants_are_those_of_the_motion_in_the_other_frame():
    extra = Invariant("first momentum", "kg m^2/s", 2.0, lambda R, w: momentum_W(BODY, R, w)[..., 0])
    rate = Invariant("a rate", "rad/s", 2.0, lambda R, w: w[..., 0])  # not conserved, but the same in both
    scene = plain(extra_invariants=(extra, rate))
    turned = in_body_frame(scene, F, "turned")
    assert sizes(run(turned).drift("first momentum")).max() < 1e-13  # measured 5e-15
    np.testing.assert_allclose(run(turned).drift("a rate"), run(scene).drift("a rate"), atol=1e-12)


def test_a_flight_is_carried_along():
    scene = cv.Scene("box", FLIGHT, np.eye(3), (1, 2, 3), 1.0, FLIGHT.gravity(9.81), p_WB0=(1, 2, 3), v_WB0=(0, 1, 5))
    one, turned, slower = run(scene), run(in_body_frame(scene, F, "turned")), run(slow_motion(scene, 4))
    np.testing.assert_allclose(turned.p_WB, one.p_WB, rtol=0, atol=1e-13)  # measured 1e-15
    np.testing.assert_allclose(slower.p_WB, one.p_WB, rtol=0, atol=1e-13)
    np.testing.assert_allclose(4 * slower.v_WB, one.v_WB, rtol=0, atol=1e-13)
    off = run(scene.rename("off", flight=replace(scene.flight, com_B=-scene.flight.com_B)))
    assert np.abs(off.p_WB - one.p_WB).max() > 0.01
