"""The errors of the automatic choice against an independent reference solution, over random bodies and initial states."""

import warnings

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import angle_between
from conservative.methods import trials
from conservative.references.exact.method import Exact
from conservative.references.precise import Precise

from .exact_trials import random_rotation

SCENES = 100
KINDS = ("free", "top", "heavy body", "heavy body, tilted axes")


def random_scene(rng, kind):
    """Return a physical body in turned axes with a generic start; rates 1 to 40 rad/s, durations 0.5 to 5 s."""
    halves = rng.uniform(0.2, 1, 3)
    moments = (halves.sum() - halves) * rng.uniform(0.1, 3)
    R_BP = random_rotation(rng) if kind != "heavy body" else np.eye(3)
    potential = None
    if kind == "top":
        moments[1] = moments[0]
    if kind != "free":
        com = rng.normal(size=3) * 0.3 * ([0, 0, 1] if kind == "top" else [1, 1, 1])
        potential = cv.UniformGravity(rng.uniform(1, 10), R_BP @ com)
    body = cv.RigidBody(R_BP @ np.diag(moments) @ R_BP.T)
    rates = rng.normal(size=3) * rng.uniform(0.5, 20)
    return cv.Scene(kind, body, random_rotation(rng), rates, rng.uniform(0.5, 5), potential)


def true_error(trajectory):
    truth = Exact()
    if truth.unsupported(trajectory.scene):
        truth = Precise(128)
    grid = cv.Grid(trajectory.choice.dt, len(trajectory) - 1)
    return angle_between(truth.prepare(trajectory.scene, grid)().R_WB, trajectory.R_WB).max()


def test_true_errors_are_at_most_ten_times_the_target():
    rng = np.random.default_rng(20)
    worse = []
    for number in range(SCENES):
        scene = random_scene(rng, KINDS[number % len(KINDS)])
        error = 10 ** rng.uniform(-11, -2)
        trajectory = cv.integrate(scene, error=error)
        measured = true_error(trajectory)
        if measured > 10 * error:
            worse.append((scene.name, error, measured, trajectory.choice))
    assert len(worse) <= 0.02 * SCENES, worse  # measured 0 of 200, and no true error above 3 times the target


def test_estimates_that_are_too_small_are_detected(monkeypatch):
    """The negative control of the test above: estimates that are far too small."""

    monkeypatch.setattr(trials, "convergence_factor", lambda method: 1e9)
    rng = np.random.default_rng(3)
    errors = [true_error(cv.integrate(random_scene(rng, "heavy body"), error=1e-8)) for _ in range(3)]
    assert max(errors) > 1e-7  # measured 2e-4


@pytest.mark.parametrize("every", [1, 2, 3, 10])
def test_samples_fall_on_multiples_of_dt(every):
    trajectory = cv.integrate(cv.scenes.lagrange_top(), dt=0.01, error=1e-9, sample_every=every, t_end=0.3)
    np.testing.assert_allclose(trajectory.t, np.arange(0, 31, every) * 0.01, atol=1e-14)


def test_other_fields_get_the_explicit_method():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = cv.scenes.brick_flip()
        held = cv.Scene("held", scene.body, scene.R_WB0, scene.w_WB_B0, 0.5, cv.LinearSpring(50.0, (0.3, 0.1, 0), (1, 1, 0)))
        assert cv.integrate(held, error=1e-6).choice.method.family == "taylor"
