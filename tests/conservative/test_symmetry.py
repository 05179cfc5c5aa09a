"""Symmetries that need no truth: each changes nothing beyond round-off, whatever the body, for every method of ours."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import conservative as cv
from conservative import deferred_imports
from conservative.attitude import angle_between, rotation_about
from conservative.invariants import axial_direction
from conservative.method import Role
from conservative.scenes.transforms import in_body_frame

STEPS, DT = 40, 0.04
# Measured 2e-14 nearly always; 1.4e-12 where a run of Taylor(order=8) is split: corrections are weighed by scales of the start.
ROUND_OFF = 1e-11

KINDS = ("free", "asymmetric top", "symmetric top")
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Case:
    """A scene and the numbers that its symmetry needs."""

    scene: cv.Scene
    axis: tuple[float, float, float]
    angle: float
    factor: float
    mass: float


def between(low, high):
    return st.floats(low, high)


@st.composite
def cases(draw, kind):
    """A random body, start and field; rates of 0.2 to 1.5 rad/s about each axis, so that |w| dt stays below 0.11."""
    parts = np.array([draw(between(0.3, 2)) for _ in range(3)])
    if kind == "symmetric top":
        parts[1] = parts[0]
    moments = parts.sum() - parts
    # The axis of a nearly spherical top is not known to round-off in other axes: it may not be taken for symmetric there.
    assume(kind != "symmetric top" or abs(parts[2] - parts[0]) >= 0.01 * moments.max())
    signs = [draw(st.sampled_from((-1, 1))) for _ in range(3)]
    rates = [sign * draw(between(0.2, 1.5)) for sign in signs]
    com = {"asymmetric top": (0.3, -0.2, 0.4), "symmetric top": (0, 0, 0.4)}.get(kind)
    field = None if com is None else cv.UniformGravity(draw(between(0.5, 3)), com)
    start = rotation_about((0.3, -0.5, 0.8), draw(between(0.3, 2.5)))
    scene = cv.Scene("random", cv.RigidBody(moments), start, rates, STEPS * DT, field)
    axis = (draw(between(0.1, 1)), draw(between(-1, 1)), draw(between(0.1, 1)))
    return Case(scene, axis, draw(between(0.2, 3)), draw(between(0.3, 3)), draw(between(0.1, 10)))


def run(method, scene, dt=DT, steps=STEPS):
    return cv.integrate(scene, dt, method, t_end=dt * steps)


def states(trajectory):
    return trajectory.R_WB, trajectory.w_WB_B


def turned_world(method, case):
    """The world turned, about the vertical where there is gravity."""
    W = rotation_about(case.axis if case.scene.free else UP, case.angle)
    R, w = states(run(method, case.scene.rename("turned", R_WB0=W @ case.scene.R_WB0)))
    return states(run(method, case.scene)), (W.T @ R, w)


def in_frame(method, case, F):
    R, w = states(run(method, in_body_frame(case.scene, F, "turned")))
    return states(run(method, case.scene)), (R @ F, w @ F)


def turned_body(method, case):
    """The same body in another frame: off-diagonal inertia."""
    return in_frame(method, case, rotation_about(case.axis, case.angle))


def permuted_axes(method, case):
    """The body's axes renamed, 1 to 2 to 3 to 1."""
    return in_frame(method, case, np.roll(np.eye(3), 1, axis=0))


def reversed_time(method, case):
    """Forth, and back with the rates turned over."""
    forth = run(method, case.scene)
    back = run(method, case.scene.rename("back", R_WB0=forth.R_WB[-1], w_WB_B0=-forth.w_WB_B[-1]))
    return states(forth), (back.R_WB[::-1], -back.w_WB_B[::-1])


def scaled_time(method, case):
    """Everything `factor` times as fast, gravity its square as strong, the step as much shorter."""
    f, field = case.factor, case.scene.potential
    faster = case.scene.rename(
        "faster",
        w_WB_B0=f * case.scene.w_WB_B0,
        t_end=case.scene.t_end / f,
        potential=field and cv.UniformGravity(f * f * field.weight, field.com_B),
    )
    R, w = states(run(method, faster, DT / f))
    return states(run(method, case.scene)), (R, w / f)


def scaled_mass(method, case):
    """Everything `mass` times as heavy."""
    m, field = case.mass, case.scene.potential
    heavier = case.scene.rename(
        "heavier",
        body=cv.RigidBody(m * case.scene.body.inertia),
        potential=field and cv.UniformGravity(m * field.weight, field.com_B),
    )
    return states(run(method, case.scene)), states(run(method, heavier))


def split_run(method, case):
    """Two runs, the second from where the first ended."""
    whole, n = run(method, case.scene), STEPS // 2
    first = run(method, case.scene, steps=n)
    second = run(method, case.scene.rename("rest", R_WB0=first.R_WB[-1], w_WB_B0=first.w_WB_B[-1]), steps=n)
    R = np.concatenate([first.R_WB, second.R_WB[1:]])
    return states(whole), (R, np.concatenate([first.w_WB_B, second.w_WB_B[1:]]))


SYMMETRIES = (turned_world, turned_body, permuted_axes, reversed_time, scaled_time, scaled_mass, split_run)


def ours():
    """Every setting of every registered method of ours; `Convected` with its Newton iteration carried to round-off."""
    found = []
    for entry in deferred_imports.list_entries(deferred_imports.METHODS).values():
        if not entry.value.startswith("conservative."):
            continue
        for method in entry.load().settings_for("variants"):
            if method.role == Role.OURS:
                found.append(replace(method, tol=1e-13) if isinstance(method, cv.Convected) else method)
    return found


def supported(method, kind):
    field = {"asymmetric top": cv.UniformGravity(1, (0.3, -0.2, 0.4)), "symmetric top": cv.UniformGravity(1, (0, 0, 0.4))}
    moments = (2, 2, 1) if kind == "symmetric top" else (1, 1.5, 2)
    scene = cv.Scene("probe", cv.RigidBody(moments), np.eye(3), (1, 1, 1), 1, field.get(kind))
    return method.unsupported(scene) is None


PAIRS = [(method, kind) for method in ours() for kind in KINDS if supported(method, kind)]


def differences(pair):
    (R_a, w_a), (R_b, w_b) = pair
    return angle_between(R_a, R_b).max(), np.abs(w_a - w_b).max()


@pytest.mark.parametrize("symmetry", SYMMETRIES, ids=lambda symmetry: symmetry.__name__)
@pytest.mark.parametrize(("method", "kind"), PAIRS, ids=lambda value: getattr(value, "name", value))
@settings(max_examples=5, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_symmetry_holds(symmetry, method, kind, data):
    angle, rate = differences(symmetry(method, data.draw(cases(kind))))
    assert angle < ROUND_OFF
    assert rate < ROUND_OFF


def test_a_top_is_symmetric_in_any_axes() -> None:
    # The axes of a tensor are less certain the closer its moments are; with a fixed tolerance 13 % of these were refused.
    draw = np.random.default_rng(3)
    for _ in range(200):
        J3 = draw.uniform(0.3, 3)
        J1 = J3 * (1 + 10 ** draw.uniform(-2, -0.3))
        F = rotation_about(draw.normal(size=3), draw.uniform(0.2, 3))
        tensor = F @ np.diag((J1, J1, J3)) @ F.T
        body = cv.RigidBody((tensor + tensor.T) / 2)
        assert axial_direction(body, cv.UniformGravity(1, F @ (0, 0, 0.4))) is not None
        assert axial_direction(body, cv.UniformGravity(1, F @ (4e-10, 0, 0.4))) is None
