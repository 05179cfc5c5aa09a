"""Samples at any times are as accurate as the steps, compared with an independent reference solution in all fields."""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, rotation_about
from conservative.methods import between
from conservative.references.precise import Precise

from ..sampling import sampled

INERTIA = np.array([[1.0, 0.1, 0.05], [0.1, 1.6, -0.2], [0.05, -0.2, 2.1]])
FIELDS = {
    "free": None,
    "gravity": cv.UniformGravity(3.0, (0.3, 0.2, 0.4)),
    "spring": cv.LinearSpring(20.0, (0.3, 0.2, 0.1), (0.5, 1.0, 1.0), 0.2),
    "attraction": cv.PointAttraction(5.0, (0.3, 0.2, 0.1), (0.5, 1.0, 1.0)),
    "gradient": cv.GravityGradient(1.5, INERTIA, (1, 2, 3)),
}
TIMES = (0.0, 0.0123, 0.3, 0.777, 1.0, 1.9, 2.6543, 3.0)


def scene_in(field):
    return cv.Scene(field, cv.RigidBody(INERTIA), rotation_about((1, 2, 0.5), 0.9), (1.0, -2.0, 3.0), 3.0, FIELDS[field])


def truth_at(scene, times):
    """Return attitudes and rates at any times, from one run per time."""
    runs = [Precise(128).solve(scene, cv.Grid(t, 1)) for t in times if t > 0]
    start = [(scene.R_WB0, scene.w_WB_B0)] if times[0] == 0 else []
    return [np.array(values) for values in zip(*start, *((run.R_WB[-1], run.w_WB_B[-1]) for run in runs), strict=True)]


@pytest.fixture(scope="module", params=sampled(FIELDS, 2, keep=["free", "spring"]))
def case(request):
    scene = scene_in(request.param)
    return scene, *truth_at(scene, TIMES)


def errors(trajectory, R_WB, w_WB_B):
    return angle_between(trajectory.R_WB, R_WB).max(), np.abs(trajectory.w_WB_B - w_WB_B).max()


@pytest.mark.parametrize(
    ("name", "dt", "bound"),
    [
        ("reduced", 0.01, 1e-2),  # measured up to 2.3e-3
        ("reduced:order=4", 0.05, 3e-4),  # up to 4.8e-5
        ("taylor:order=18", 0.1, 1e-11),  # up to 8e-12, by the spring
        ("projected", 0.02, 1e-11),  # up to 1e-12
        ("moser_veselov", 1.0, 1e-13),  # 3e-15
    ],
)
def test_a_sample_is_as_accurate_as_the_steps(case, name, dt, bound):
    scene, R_WB, w_WB_B = case
    method = registry.method(name)
    if method.unsupported(scene):
        pytest.skip("not for this field")
    trajectory = cv.integrate(scene, dt, method, t_eval=TIMES)
    assert trajectory.t.tolist() == list(TIMES)
    grid = cv.Grid(dt, round(3 / dt))
    steps, exact = method.solve(scene, grid), Precise(128).solve(scene, grid)
    largest = errors(steps, exact.R_WB, exact.w_WB_B)
    for off, of_steps in zip(errors(trajectory, R_WB, w_WB_B), largest, strict=True):
        assert off <= 1.5 * of_steps + 1e-14
        assert off < 5 * bound
    for invariant in scene.invariants:
        if invariant.name in method.conserves:
            assert np.abs(trajectory.drift(invariant)).max() < 3e-15  # measured up to 1e-15


@pytest.mark.parametrize("error", [1e-4, 1e-9])
def test_a_sample_reaches_the_target_error(case, error):
    scene, R_WB, w_WB_B = case
    trajectory = cv.integrate(scene, error=error, t_eval=TIMES)
    assert trajectory.choice.reached
    assert errors(trajectory, R_WB, w_WB_B)[0] <= 3 * error


def test_samples_of_the_exact_motion_are_exact_to_round_off(case):
    """Errors of the tests above are therefore not errors of samples."""
    scene, R_WB, w_WB_B = case
    trajectory = cv.integrate(scene, 0.5, Precise(128), t_eval=TIMES)
    off = errors(trajectory, R_WB, w_WB_B)
    assert off[0] < 5e-15  # measured up to 1e-15
    assert off[1] < 1e-14  # up to 3e-15


def test_constant_rates_between_steps_are_detected(case, monkeypatch):
    """The negative control: between steps the body turns at the rates of the step."""
    scene, R_WB, w_WB_B = case

    def turn_on(scene, t, gaps, R_WB, w_WB_B, supplied):
        turns = [rotation_about(w, np.linalg.norm(w) * gap) if gap else np.eye(3) for w, gap in zip(w_WB_B, gaps, strict=True)]
        return R_WB @ np.array(turns), w_WB_B, len(t)

    monkeypatch.setattr(between, "move", turn_on)
    monkeypatch.setattr(between, "cut_at_failure", lambda trajectory, *_: trajectory)
    trajectory = cv.integrate(scene, 0.1, "taylor:order=18", t_eval=TIMES)
    assert errors(trajectory, R_WB, w_WB_B)[0] > 1e-5


def test_the_exact_step_of_a_top_may_be_long():
    scene = cv.scenes.lagrange_top(t_end=3.0)
    truth = truth_at(scene, TIMES)
    for dt in (0.1, 3.0):
        off = errors(cv.integrate(scene, dt, cv.Lame(), t_eval=TIMES), *truth)
        assert off[0] < 1e-11, dt  # measured below
        assert off[1] < 1e-10, dt


def test_samples_in_a_field_that_turns():
    field = cv.Orbit(0.7, (1, 2, 2)).gravity_gradient(INERTIA, (0, 1, -1))
    scene = scene_in("free").rename("satellite", potential=field)
    trajectory = cv.integrate(scene, 0.02, cv.Projected(), t_eval=TIMES)
    fine = cv.Projected().solve(scene, cv.Grid(1e-4, 30000))
    index = np.rint(np.array(TIMES) / 1e-4).astype(int)
    off = errors(trajectory, fine.R_WB[index], fine.w_WB_B[index])
    assert off[0] < 1e-11  # measured below
    assert off[1] < 1e-11
