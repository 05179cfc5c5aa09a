from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import conservative as cv
from conservative.attitude import angle_between, orthonormality, rotation_about

from ..sampling import sampled
from .one_body import body_in_axes, drift


def top(
    seed: int,
    side: float = 1.0,
    w_WB_B0: np.ndarray | None = None,
    tilt: float | None = None,
    J: tuple[float, float] = (1.1, 0.6),
) -> cv.Scene:
    """Return a top with a full tensor and its centre of mass on either side; `tilt` is the angle of its axis to e_z."""
    random = np.random.default_rng(seed)
    turn = rotation_about(random.normal(size=3), random.uniform(0.5, 3))
    R_WB0 = rotation_about(random.normal(size=3), random.uniform(0.5, 3))
    if tilt is not None:
        R_WB0 = rotation_about((0, 0, 1), 0.7) @ rotation_about((1, 0, 0), tilt) @ turn.T
    w = 3 * random.normal(size=3) if w_WB_B0 is None else turn @ w_WB_B0
    body = body_in_axes(turn, J[0], J[0], J[1])
    return cv.Scene("top", body, R_WB0, w, 2.0, cv.UniformGravity(4.0, 0.5 * side * turn[:, 2]))


STEADY = cv.scenes.lagrange_top(t_end=2.0)
SCENES = {
    "steady": STEADY,
    "nutating": STEADY.rename("nutating", w_WB_B0=STEADY.w_WB_B0 + STEADY.body.inverse @ (0.003, 0.001, 0)),
    "generic": top(0),
    "generic, com below": top(1, -1.0),
    "flat body": top(2, J=(0.7, 1.3)),
    "spherical body": top(3, J=(0.9, 0.9)),
    "no spin": top(4, w_WB_B0=np.array([1.0, -2.0, 0.0])),
    "released at rest": top(5, w_WB_B0=np.zeros(3), tilt=2.0),
    "almost asleep": top(6, w_WB_B0=np.array([1e-7, 0.0, 2.5]), tilt=1e-7),
    "asleep": top(7, w_WB_B0=np.array([1e-3, 0.0, 50.0]), tilt=1e-3, J=(5.0, 1.0)),
    "past the upper pole": top(8, w_WB_B0=np.array([-2.0, 1e-7, 1e-7]), tilt=0.4),
    "past the lower pole": top(9, w_WB_B0=np.array([2.0, 1e-7, 1e-7]), tilt=2.9),
}


@pytest.mark.parametrize("name", SCENES)
def test_agrees_with_collocation_of_order_twenty_at_any_step(name: str) -> None:
    scene = SCENES[name]
    truth = cv.integrate(scene, 0.01, cv.Gauss(10))
    for dt in (0.02, 0.1, 0.5, 2.0):
        trajectory = cv.integrate(scene, dt, cv.Lame())
        assert angle_between(truth.R_WB[-1], trajectory.R_WB[-1]) < 1e-13  # measured up to 2e-14
        assert np.abs(truth.w_WB_B[-1] - trajectory.w_WB_B[-1]).max() < 1e-13 * np.abs(truth.w_WB_B).max()  # 2e-14


@pytest.mark.parametrize(("spin", "side", "upright"), sampled(product((0.0, 0.3, 1.0, 3.0), (1.0, -1.0), (1.0, -1.0)), 4))
def test_starts_at_any_distance_from_the_double_roots(spin: float, side: float, upright: float) -> None:
    """Tops that fall and stand up again, on either side of the pivot: the axis starts 1e-12 to 0.1 rad from the vertical.

    `spin` is relative to the critical one; `upright` is -1 for tops that hang.
    """
    for distance in 10.0 ** np.arange(-12, 0):
        tilt = np.pi * (upright * side < 0) + distance
        w = np.array([0.3 * distance, -distance, spin * 2 * np.sqrt(2.0 * 1.1) / 0.6])
        turned, field = top(20, side, w, tilt), cv.UniformGravity(4.0, (0, 0, 0.5 * side))
        aligned = cv.Scene("top", cv.RigidBody((1.1, 1.1, 0.6)), rotation_about((1, 0, 0), tilt), w, 2.0, field)
        # The initial tilt of a turned body is rounded to 1e-16 rad. Measured: up to 1.1e-13, and 2.4e-16 / distance more.
        for scene, bound in ((aligned, 1e-12), (turned, 1e-12 + 2e-15 / distance)):
            truth = cv.registry.method("exact").prepare(scene, cv.Grid(0.6, 40))()
            found = cv.integrate(scene, 0.6, cv.Lame(), t_end=24.0)
            assert angle_between(truth.R_WB, found.R_WB).max() < bound, distance


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("dt", [0.013, 0.1, 1.7])
def test_conserves_every_invariant(name: str, dt: float) -> None:
    trajectory = cv.integrate(SCENES[name], dt, cv.Lame(), t_end=1e5 * dt, sample_every=100)
    assert drift(trajectory) < 1e-14  # measured up to 3e-15
    assert orthonormality(trajectory.R_WB).max() < 1e-14  # measured 5e-15, of the axes that eigh gives the body


@settings(max_examples=100)
@given(st.integers(0, 10**6), st.sampled_from([-1.0, 1.0]), st.floats(0.01, 20.0))
def test_one_step_is_two_half_steps(seed: int, side: float, dt: float) -> None:
    scene = top(seed, side)
    whole = cv.integrate(scene, dt, cv.Lame(), t_end=dt)
    halves = cv.integrate(scene, dt / 2, cv.Lame(), t_end=dt)
    # Rounding the initial state alone changes the final attitude in proportion to the angle turned.
    turned = 1 + dt * np.abs(whole.w_WB_B).max()
    assert angle_between(whole.R_WB[-1], halves.R_WB[-1]) < 1e-12 * turned  # measured up to 4e-14


def test_long_steps_are_taken_in_parts() -> None:
    scene = SCENES["generic"]
    truth = cv.integrate(scene, 0.01, cv.Gauss(10), t_end=8.0)
    parts = []
    for n in (1, 2, 3, 7, 8, 20, 40):
        trajectory = cv.integrate(scene, 8.0 / n, cv.Lame(), t_end=8.0)
        parts.append((trajectory.counters.stages or 0) // trajectory.counters.steps)
        assert angle_between(truth.R_WB[-1], trajectory.R_WB[-1]) < 1e-12  # measured up to 2e-13
    assert parts[0] > parts[1] > parts[-1] == 1


@pytest.mark.parametrize("tilt", [0.0, np.pi])
def test_rest_stays_rest(tilt: float) -> None:
    field, R_WB0 = cv.UniformGravity(3.0, (0, 0, 0.2)), rotation_about((1, 0, 0), tilt)
    trajectory = cv.integrate(cv.Scene("rest", cv.RigidBody((1, 1, 2)), R_WB0, (0, 0, 0), 3.0, field), 0.5, cv.Lame())
    # Upright it falls from a rounding error like exp(0.8 t).
    assert angle_between(trajectory.R_WB[0], trajectory.R_WB).max() < 1e-12
