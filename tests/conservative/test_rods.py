"""Rods: bodies with one small moment, such as (1, 1, which the energy allows to rotate fast about their axis."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about

from ..independent import Case, angle_between, motion

START, END = rotation_about((0.3, 0.4, -0.8), 0.9), 2.0


def rod(ratio: float, spin: float = 0.0, gravity: bool = True, axis: int = 2) -> Case:
    """Return a rod that swings, or is free, and turns about its axis at a rate `spin`, rad/s."""
    J, w, com = ((np.roll(each, axis + 1)) for each in ((ratio, 1.0, 1.0), (spin, 0.7, -0.4), (0.8, 0.0, 0.0)))
    return Case(J, START, w, END, ("gravity", 2.0, com) if gravity else None)


def truth(case: Case) -> Any:
    """Return the attitudes at 0, 0.5, ... s."""
    return motion(case, np.linspace(0.0, END, 5))[0]


def run(case: Case, method: str, dt: float) -> tuple[float, bool]:
    """Return the largest error, rad, nan for a run that is not ok, and whether the user is warned."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = cv.integrate(case.scene(), dt, method, sample_every=round(0.5 / dt), on_failure="return")
    warned = any(isinstance(each.message, cv.RotationNotResolved) for each in caught)
    return (float(angle_between(found.R_WB, truth(case)).max()) if found.ok else np.nan), warned


@pytest.mark.parametrize(
    ("method", "case", "dt"),
    [
        ("reduced", rod(1e-3, 3.0), 0.1),
        ("convected", rod(1e-3, 3.0), 0.1),
        ("no_squish", rod(1e-3, 0.0), 0.1),
        ("no_squish", rod(1e-3, 0.0, gravity=False), 0.1),
        ("lie_variational", rod(1e-3, 3.0), 0.1),
    ],
)
def test_a_wrong_run_of_a_rod_has_a_warning(method: str, case: Case, dt: float) -> None:
    error, warned = run(case, method, dt)
    assert error > 0.1  # measured 0.14 to 3.1
    assert warned


RIGHT = [(name, True) for name in ("taylor", "gauss", "splitting", "lame")]
RIGHT += [(name, False) for name in ("moser_veselov", "taylor", "gauss", "reduced:order=6")]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("method", "gravity"), RIGHT)
def test_other_runs_of_a_rod_have_none(method: str, gravity: bool, axis: int) -> None:
    error, warned = run(rod(1e-4, 0.0, gravity, axis), method, 0.02)
    assert error < 1e-12  # measured up to 7e-14
    assert not warned


@pytest.mark.parametrize("method", ["reduced", "no_squish"])
def test_the_error_on_a_rod_is_the_square_of_the_step_over_the_ratio_of_moments(method: str) -> None:
    errors = [
        run(rod(ratio, 3.0 if method == "reduced" else 0.0), method, dt)[0]
        for ratio, dt in ((1e-3, 0.002), (1e-3, 0.001), (1e-2, 0.002))
    ]
    assert 3.5 < errors[0] / errors[1] < 4.5  # measured 4.0
    assert 8 < errors[0] / errors[2] < 12  # measured 9.4 and 10.1


def test_many_rods_have_the_warning() -> None:
    with pytest.warns(cv.RotationNotResolved):
        cv.integrate_many(rod(1e-3).scene(), **cv.spread(rod(1e-3).scene(), 2, rate="1%", seed=1), dt=0.1, method="no_squish")


def test_a_rod_among_other_bodies_has_the_warning() -> None:
    ball = cv.Scene("ball", cv.RigidBody((1, 1, 1)), np.eye(3), (0.3, 0.2, 0), 1.0, cv.UniformGravity(1.0, (0.3, 0.1, 0)))
    starts = [ball.w_WB_B0, ball.w_WB_B0]
    with pytest.warns(cv.RotationNotResolved):
        cv.integrate_many(ball, w_WB_B0=starts, inertia=[(1, 1, 1), (1e-6, 1, 1)], dt=0.01, method="reduced", threads=1)
    cv.integrate_many(ball, w_WB_B0=starts, inertia=[(1, 1, 1), (1, 1, 1.1)], dt=0.01, method="reduced", threads=1)


@pytest.mark.filterwarnings("ignore::conservative.AccuracyNotReached")
@pytest.mark.parametrize("gravity", [True, False])
@pytest.mark.parametrize("axis", [0, 2])
def test_the_recipe_for_a_rod_reaches_the_error(gravity: bool, axis: int) -> None:
    case = rod(1e-9, 0.0, gravity, axis)  # without a spin, the motion does not depend on the small moment
    found = cv.integrate(case.scene(), error=1e-6, t_eval=5)
    assert angle_between(found.R_WB, truth(rod(1e-3, 0.0, gravity, axis))).max() < 1e-6  # measured 1.9e-13
