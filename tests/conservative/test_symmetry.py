"""Symmetries of the equations hold to round-off for every method of ours and random bodies; no reference solution is needed."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, rotation_about
from conservative.invariants import axial_direction
from conservative.method import Role
from conservative.scenes.transforms import in_body_frame

from ..sampling import sampled

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
    """Draw a body, an initial state and a field; rates of 0.2 to 1.5 rad/s about each axis, so that |w| dt stays below 0.11."""
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


def turned_world(method, case, _):
    """Turn the world, about the vertical if there is gravity."""
    W = rotation_about(case.axis if case.scene.free else UP, case.angle)
    turned = run(method, case.scene.rename("turned", R_WB0=W @ case.scene.R_WB0))
    return W.T @ turned.R_WB, turned.w_WB_B


def in_frame(method, case, F):
    turned = run(method, in_body_frame(case.scene, F, "turned"))
    return turned.R_WB @ F, turned.w_WB_B @ F


def turned_body(method, case, _):
    """Describe the same body in another frame: off-diagonal inertia."""
    return in_frame(method, case, rotation_about(case.axis, case.angle))


def permuted_axes(method, case, _):
    """Rename the axes of the body, 1 to 2 to 3 to 1."""
    return in_frame(method, case, np.roll(np.eye(3), 1, axis=0))


def reversed_time(method, case, forth):
    """Start at the final state with reversed rates."""
    back = run(method, case.scene.rename("back", R_WB0=forth.R_WB[-1], w_WB_B0=-forth.w_WB_B[-1]))
    return back.R_WB[::-1], -back.w_WB_B[::-1]


def scaled_time(method, case, _):
    """Make everything `factor` times as fast, with the square of that in gravity, and the step as much shorter."""
    f, field = case.factor, case.scene.potential
    faster = case.scene.rename(
        "faster",
        w_WB_B0=f * case.scene.w_WB_B0,
        t_end=case.scene.t_end / f,
        potential=field and cv.UniformGravity(f * f * field.weight, field.com_B),
    )
    fast = run(method, faster, DT / f)
    return fast.R_WB, fast.w_WB_B / f


def scaled_mass(method, case, _):
    """Make everything `mass` times as heavy."""
    m, field = case.mass, case.scene.potential
    heavier = case.scene.rename(
        "heavier",
        body=cv.RigidBody(m * case.scene.body.inertia),
        potential=field and cv.UniformGravity(m * field.weight, field.com_B),
    )
    heavy = run(method, heavier)
    return heavy.R_WB, heavy.w_WB_B


def split_run(method, case, _):
    """Run in two parts, the second from the final state of the first."""
    first = run(method, case.scene, steps=STEPS // 2)
    rest = case.scene.rename("rest", R_WB0=first.R_WB[-1], w_WB_B0=first.w_WB_B[-1])
    second = run(method, rest, steps=STEPS // 2)
    return np.concatenate([first.R_WB, second.R_WB[1:]]), np.concatenate([first.w_WB_B, second.w_WB_B[1:]])


SYMMETRIES = (turned_world, turned_body, permuted_axes, reversed_time, scaled_time, scaled_mass, split_run)
"""Functions of method, case and the plain run of the case that return attitudes and rates equal to those of that run."""


def ours():
    """Return every setting of our methods; `Convected` with its Newton iteration converged to round-off."""
    families = [family for family in registry.list_families().values() if family.role == Role.OURS]
    methods = [method for family in families for method in family.settings_for("variants")]
    return [replace(method, tol=1e-13) if isinstance(method, cv.Convected) else method for method in methods]


def supported(method, kind):
    field = {"asymmetric top": cv.UniformGravity(1, (0.3, -0.2, 0.4)), "symmetric top": cv.UniformGravity(1, (0, 0, 0.4))}
    moments = (2, 2, 1) if kind == "symmetric top" else (1, 1.5, 2)
    scene = cv.Scene("probe", cv.RigidBody(moments), np.eye(3), (1, 1, 1), 1, field.get(kind))
    return method.unsupported(scene) is None


PAIRS = [(method, kind) for method in ours() for kind in KINDS if supported(method, kind)]


@pytest.mark.parametrize(("method", "kind"), sampled(PAIRS, 24), ids=lambda value: getattr(value, "name", value))
@settings(max_examples=5, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_symmetries_hold(method, kind, data):
    case = data.draw(cases(kind))
    plain = run(method, case.scene)
    # `Taylor` is not symmetric in time: back and forth leave twice its truncation error, measured 2e-11 at order 8. The steps
    # that a tolerance chooses depend on the direction and the start: measured 8e-12 in 150 cases of 1e-9.
    bound = 1e-10 if isinstance(method, cv.Taylor) else ROUND_OFF
    for symmetry in SYMMETRIES:
        if isinstance(method, cv.NoSquish) and symmetry in (turned_body, permuted_axes):
            continue  # equal moments have no axes of their own, and its error depends on the axes
        structure = method.method_info.structure(method)
        if symmetry is reversed_time and not (structure and structure.symmetric) and (method.order or 8) < 8:
            continue  # twice its truncation error remains
        R, w = symmetry(method, case, plain)
        assert angle_between(plain.R_WB, R).max() < bound, symmetry.__name__
        assert np.abs(plain.w_WB_B - w).max() < bound, symmetry.__name__


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
