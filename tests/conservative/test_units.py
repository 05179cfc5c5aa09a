"""Motions do not depend on the units of a scene, and ordinary scenes are computed in their own units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between, rotation_about
from conservative.errors import NotConverged
from conservative.grid import Grid
from conservative.invariants import sizes
from conservative.method import Method
from conservative.methods.units import SI, bound_rate, find_units
from conservative.registry import list_scenes, method
from conservative.registry import scene as registered

from .one_body import TURN, body_in_axes

HOOK = np.array([0.3, 0.1, 0.4])
UNITS = [(1e24, 1.0, 1.0), (1e-24, 1.0, 1.0), (1.0, 1e12, 1.0), (1e-24, 1e-2, 1e-8), (1e24, 1e9, 1e12), (1e-6, 1e-2, 1e-2)]
"""Units of moments, kg m^2, times, s, and lengths, m."""


def field(kind: str, J: np.ndarray, energy: float, time: float, length: float) -> Any:
    arm = np.array([0.3, -0.4, 0.9]) * length
    anchor = np.array([2.0, -0.4, 0.2]) * length
    return {
        "free": lambda: None,
        "top": lambda: cv.UniformGravity(2 * energy / length, TURN @ np.array([0, 0, 0.9]) * length),
        "heavy": lambda: cv.UniformGravity(2 * energy / length, arm),
        "spring": lambda: cv.LinearSpring(2 * energy / length / length, arm, anchor, 0.3 * length),
        "attraction": lambda: cv.PointAttraction(2 * energy * length, arm, anchor),
        "gradient": lambda: cv.GravityGradient(1.2 / time, J, (1, 2, 3)),
        "function": lambda: cv.FunctionPotential(
            lambda R: energy * (R[2] @ HOOK) ** 4, lambda R: energy * np.outer([0, 0, 1], 4 * (R[2] @ HOOK) ** 3 * HOOK), energy
        ),
    }[kind]()


def scene(kind: str, moment: float = 1.0, time: float = 1.0, length: float = 1.0) -> cv.Scene:
    """Return a generic motion of a body with a full tensor."""
    body = body_in_axes(TURN, *moment * np.array((1.3, 1.3, 0.6) if kind == "top" else (1.3, 0.7, 1.9)))
    potential = field(kind, body.inertia, moment / time / time, time, length)
    w = np.array([0.8, -0.5, 1.1]) / time
    return cv.Scene(kind, body, rotation_about((1, 2, 3), 0.7), w, 3 * time, potential, dt=0.05 * time)


RUNS = [
    *(("reduced", kind) for kind in ("free", "top", "heavy", "spring", "attraction", "gradient", "function")),
    *(("convected:tol=1e-9", kind) for kind in ("free", "heavy")),
    *(
        ("gauss", "heavy"),
        ("lame", "top"),
        ("moser_veselov", "free"),
        ("projected", "heavy"),
        ("exact", "free"),
        ("exact", "top"),
    ),
]


@pytest.mark.parametrize(("name", "kind"), RUNS)
def test_a_motion_is_the_same_in_units_of_any_size(name: str, kind: str) -> None:
    integrate = method(name)
    steps = 4 if kind == "function" else 30  # a function calls Python
    expected = integrate.solve(scene(kind), Grid(0.05, steps))
    assert expected.ok
    for moment, time, length in UNITS:
        other = scene(kind, moment, time, length)
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            found = integrate.solve(other, Grid(0.05 * time, steps))
        assert found.ok, (moment, time, length, found.outcome)
        assert found.scene is other
        bound = 1e-12 if name != "convected:tol=1e-9" else 1e-6
        assert angle_between(expected.R_WB, found.R_WB).max() <= bound
        assert np.abs(found.w_WB_B * time - expected.w_WB_B).max() <= bound
        for invariant in other.invariants:
            assert sizes(found.drift(invariant)).max() <= bound * 1e3 or invariant.name not in integrate.conserves


def test_registered_scenes_are_not_converted() -> None:
    for name in set(list_scenes()) - {"tiny_body"}:
        assert find_units(registered(name), registered(name).dt) == SI, name


def test_units_are_powers_of_two_to_the_sixteenth() -> None:
    for unit in UNITS:
        units = find_units(scene("heavy", *unit), 0.05 * unit[1])
        for value, size in ((units.moment, unit[0]), (units.time, unit[1])):
            mantissa, exponent = math.frexp(value)
            assert (mantissa, (exponent - 1) % 16) == (0.5, 0)
            assert 2**-17 < size / value < 2**17


def test_a_potential_without_units_is_not_rescaled() -> None:
    class Foreign:
        def __init__(self, inner: Any) -> None:
            self.inner = inner

        def __getattr__(self, name: str) -> Any:
            if name in ("in_units", "inner"):
                raise AttributeError(name)
            return getattr(self.inner, name)

    heavy = scene("heavy", 1e8, 1e-3)
    theirs = heavy.rename("theirs", potential=Foreign(heavy.potential))
    assert find_units(heavy, heavy.dt) != SI == find_units(theirs, heavy.dt)
    assert cv.Reduced().solve(theirs, Grid(heavy.dt, 10)).ok


def test_failures_have_their_time_in_seconds() -> None:
    ordinary, tiny = (
        cv.Convected(1e-9).solve(scene("heavy", time * time, time), Grid(1.4 * time, 8)).failure for time in (1.0, 2.0**-40)
    )
    assert isinstance(ordinary, NotConverged)
    assert ordinary.time == pytest.approx(4 * 1.4)
    assert (tiny.step, type(tiny), tiny.time * 2.0**40) == (ordinary.step, type(ordinary), ordinary.time)


def test_limits_of_steps_and_rates_are_in_seconds() -> None:
    ordinary, tiny = scene("free"), scene("free", 1e24, 2.0**-80)
    assert cv.MoserVeselov().longest_step(tiny) == pytest.approx(cv.MoserVeselov().longest_step(ordinary) * 2.0**-80)
    assert bound_rate(tiny) == pytest.approx(bound_rate(ordinary) * 2.0**80)
    with pytest.raises(cv.BadInput, match=r"dt: got 1e-22"):
        cv.integrate(tiny, 1e-22, cv.MoserVeselov(), t_end=1e-21)
    with pytest.raises(cv.BadInput, match="dt: got 1e"):  # a million turns in a step
        cv.integrate(scene("top"), 1e30, cv.Lame(), t_end=1e30)


@pytest.mark.parametrize("integrate", [cv.Reduced(), cv.Lame(), cv.Gauss()])
def test_tiny_motions_in_a_step_do_not_divide_by_zero(integrate: Method) -> None:
    for unit in ((1e20, 1e24, 1.0), (1e-10, 1e5, 1e-10), (1e24, 1e20, 1e10)):
        slow = scene("top", *unit)
        found = integrate.solve(slow, Grid(1e-30, 5))
        assert found.ok, found.outcome
        np.testing.assert_allclose(found.w_WB_B, np.tile(slow.w_WB_B0, (len(found), 1)), rtol=1e-12)


def test_scales_of_invariants_neither_overflow_nor_vanish() -> None:
    for size in (1e30, 1e-30):
        body = cv.RigidBody(np.array([1.0, 0.7, 0.9]) * size)
        for w in ((size, 0.5 * size, 0), (0, 0, 0)):
            falling = cv.Scene("extreme", body, np.eye(3), w, 1.0, cv.UniformGravity(size, (size, 0, 0)))
            assert all(0 < invariant.scale < math.inf for invariant in falling.invariants)


FREE = [cv.Convected(), cv.Reduced(), cv.Gauss(), cv.MoserVeselov(), cv.Taylor(), cv.Textbook(), cv.NoSquish(), cv.Rattle()]


@pytest.mark.parametrize("method", FREE, ids=repr)
def test_a_free_body_of_any_size_has_the_motion_of_its_ratios(method: Method) -> None:
    """Molecules, 1e-47 kg m^2, and planets, 1e38, by powers of 2. Measured: no bit differs, and up to 1e-15 from 1e70 on."""
    tensor = np.array([[1.3, 0.1, -0.05], [0.1, 1.9, 0.2], [-0.05, 0.2, 2.4]])
    one, *others = [
        cv.integrate(cv.Scene("s", cv.RigidBody(tensor * 2.0**k), np.eye(3), (0.3, 2.0, 0.4), 1.0), 0.01, method)
        for k in (0, -156, 126)
    ]
    for other in others:
        np.testing.assert_allclose(other.R_WB, one.R_WB, atol=1e-14)
        np.testing.assert_allclose(other.w_WB_B, one.w_WB_B, atol=1e-14)
        np.testing.assert_allclose(other.drift("energy"), one.drift("energy"), atol=1e-14)


def test_the_free_nutation_of_the_earth() -> None:
    """Euler: w1 + i w2 turns at w3 (C - A)/A. With the Earth's moments that is one turn in 305 days of the Earth, by hand."""
    A, C, w3 = 8.0101e37, 8.0365e37, 7.292e-5
    earth = cv.Scene("earth", cv.RigidBody((A, A, C)), np.eye(3), (1e-10, 0, w3), 2.6e7)
    rate = w3 * (C - A) / A
    assert w3 / rate == pytest.approx(303.4, abs=0.1)
    found = cv.integrate(earth, 2.6e3, "exact")
    turn = np.unwrap(np.arctan2(found.w_WB_B[:, 1], found.w_WB_B[:, 0]))
    np.testing.assert_allclose(turn, rate * found.t, atol=1e-6)


def test_a_rod_is_written_with_a_small_moment() -> None:
    """As the message for a moment of 0 says: without a rate about its axis, the rod turns evenly about a fixed direction."""
    with pytest.raises(cv.BadInput, match=r"1e-9 I, I, I"):
        cv.RigidBody((0.0, 3e-46, 3e-46))
    rod = cv.Scene("rod", cv.RigidBody((3e-55, 3e-46, 3e-46)), np.eye(3), (0.0, 1.0, 0.5), 10.0)
    for each in (cv.Reduced(), cv.Taylor(), cv.MoserVeselov()):
        found = cv.integrate(rod, 0.01, each)
        np.testing.assert_allclose(found.w_WB_B, np.tile([0.0, 1.0, 0.5], (len(found), 1)), atol=1e-12)


def test_the_size_of_a_body_in_a_field_is_limited() -> None:
    small, ordinary = np.array([1.0, 2.0, 2.5]) * 1e-47, cv.scenes.lagrange_top()
    with pytest.raises(cv.BadInput, match="beside a field or a load"):
        cv.integrate_many(ordinary, inertia=[small], dt=0.01)
    free = cv.integrate_many(cv.Scene("s", cv.RigidBody((1, 2, 2.5)), np.eye(3), (1, 2, 3), 0.1), inertia=[small], dt=0.01)
    assert np.isfinite(free.R_WB).all()
