"""Samples at given times: values that `t_eval` accepts and refuses, and the samples returned."""

import numpy as np
import pytest

import conservative as cv
from conservative.methods import between, trials

BRICK = cv.scenes.brick_flip()
TOP = cv.scenes.asymmetric_top(t_end=2.0)


def test_an_integer_is_the_number_of_samples():
    found = cv.integrate(BRICK, 0.01, t_eval=7)
    np.testing.assert_array_equal(found.t, np.linspace(0, 6, 7))
    np.testing.assert_array_equal(cv.integrate(BRICK, 0.01, t_eval=np.int64(3), t_end=1.0).t, [0, 0.5, 1])
    assert len(cv.integrate(BRICK, error=1e-6, t_eval=5)) == 5


def test_samples_on_steps_are_the_steps_bit_for_bit():
    steps = cv.integrate(BRICK, 0.01)
    found = cv.integrate(BRICK, 0.01, t_eval=steps.t[::7])
    np.testing.assert_array_equal(found.R_WB, steps.R_WB[::7])
    np.testing.assert_array_equal(found.w_WB_B, steps.w_WB_B[::7])
    assert found.label == steps.label


@pytest.mark.parametrize("times", [[0.0], [0.003], [0.25, 0.2500001], [1.9999], (2.0,), np.array([1, 2])])
def test_few_samples_anywhere(times):
    found = cv.integrate(TOP, 0.01, cv.Projected(), t_eval=times)
    np.testing.assert_array_equal(found.t, np.array(times, dtype=float))
    assert found.counters.steps == max(1, int(times[-1] * 100 * (1 + 1e-9)))
    whole = cv.integrate(TOP, 0.0001, cv.Projected())
    index = np.rint(found.t / 0.0001).astype(int)
    np.testing.assert_allclose(found.R_WB, whole.R_WB[index], atol=3e-6)  # times are rounded to 1e-4 s, at 0.1 rad/s or so
    assert cv.integrate(TOP, error=1e-6, t_eval=times).ok


@pytest.mark.parametrize(
    ("times", "got"),
    [
        ([], "none"),
        (1, "1"),
        (0, "none"),
        (-3, "-3"),
        (True, "True"),
        ("abc", "'abc'"),
        ([[0.0, 1.0]], r"\[\[0"),
        ([0.0, float("nan")], "nan at index 1"),
        ([0.0, float("inf")], "inf at index 1"),
        ([0.0, 0.5, 0.4], "0.4.* after 0.5, at index 2"),
        ([0.0, 0.5, 0.5], "0.5 after 0.5, at index 2"),
        ([-0.1, 0.5], "times from -0.1"),
        ([0.0, 2.1], "times from 0 to 2.1"),
        (10**15, "1000000000000000 samples"),
    ],
)
def test_unusable_times_are_refused(times, got):
    with pytest.raises(cv.BadInput, match=f"t_eval: got {got}.*; expected times .* from 0 to t_end = 2") as caught:
        cv.integrate(TOP, 0.01, t_eval=times)
    assert caught.value.argument == "t_eval"


@pytest.mark.parametrize(
    ("arguments", "argument"),
    [
        ({"sample_every": 2}, "sample_every"),
        ({"error": 1e-6, "dt": 0.1}, "dt"),
        ({"error": 1e-6, "method": cv.Reduced()}, "method"),
        ({"progress": 3}, "progress"),
        ({"dt": 5.0}, "dt"),
    ],
)
def test_arguments_that_contradict_times_are_refused(arguments, argument):
    with pytest.raises(cv.BadInput) as caught:
        cv.integrate(TOP, **{"t_eval": [0.0, 1.0], **arguments})
    assert caught.value.argument == argument


def test_a_run_that_fails_has_the_samples_before():
    scene = cv.scenes.lagrange_top()
    whole = cv.integrate(scene, dt=0.6, on_failure="return")
    times = np.linspace(0, scene.t_end, 50)
    found = cv.integrate(scene, dt=0.6, on_failure="return", t_eval=times)
    assert str(found.outcome) == str(whole.outcome)
    assert not found.ok
    np.testing.assert_array_equal(found.t, times[times <= whole.t[-1]])
    with pytest.raises(cv.NotConverged):
        cv.integrate(scene, dt=0.6, t_eval=times)


def test_samples_between_steps_are_checked(monkeypatch):
    move = between.move

    def spoil(*arguments):
        R, w, n = move(*arguments)
        return R, w * (1 + 1e-6 * (arguments[2] > 0))[:, None], n

    monkeypatch.setattr(between, "move", spoil)
    with pytest.raises(cv.NotConserved):
        cv.integrate(TOP, 0.01, cv.Projected(), t_eval=[0.0, 0.5, 0.505, 1.0])


def test_a_gap_that_needs_too_many_steps_is_a_failure(monkeypatch):
    monkeypatch.setattr(between, "RADIANS", 1e-7)  # more steps than a gap may take
    found = cv.integrate(TOP, 0.5, cv.Projected(), t_eval=[0.0, 0.5, 0.9, 1.0], on_failure="return")
    assert found.outcome.kind is cv.OutcomeKind.DIVERGED
    np.testing.assert_array_equal(found.t, [0.0, 0.5])


def test_some_of_many_steps_are_stored(monkeypatch):
    times = [0.0, 0.123, 0.77, 1.5]
    all_of_them = cv.integrate(TOP, 0.001, cv.Projected(), t_eval=times)
    monkeypatch.setattr(between, "MOST_KEPT", 20)
    few = cv.integrate(TOP, 0.001, cv.Projected(), t_eval=times)
    np.testing.assert_allclose(few.R_WB, all_of_them.R_WB, atol=1e-13)
    assert few.counters.steps == all_of_them.counters.steps
    np.testing.assert_allclose(cv.integrate(TOP, error=1e-10, t_eval=times).R_WB, all_of_them.R_WB, atol=1e-9)


@pytest.mark.parametrize("size", [1e-24, 1e24])
def test_scenes_of_any_size(size):
    scene = cv.Scene("big", cv.RigidBody(np.array((1, 2, 2.5)) * size), np.eye(3), (1, 2, 3), 2.0)
    small = cv.Scene("small", cv.RigidBody((1, 2, 2.5)), np.eye(3), (1, 2, 3), 2.0)
    found, expected = (cv.integrate(each, 0.01, t_eval=[0.0, 0.333, 1.234]) for each in (scene, small))
    np.testing.assert_allclose(found.R_WB, expected.R_WB, atol=1e-14)
    np.testing.assert_allclose(found.w_WB_B, expected.w_WB_B, atol=1e-14)


def test_a_potential_of_python_functions():
    field = cv.FunctionPotential(lambda R: 9.0 * R[2, 2], lambda R: np.diag((0.0, 0.0, 9.0)), scale=9.0, axis_W=(0, 0, 1))
    scene = cv.Scene("own", TOP.body, TOP.R_WB0, TOP.w_WB_B0, 0.3, field)
    same = scene.rename("weight", potential=cv.UniformGravity(9.0, (0, 0, 1)))
    found, expected = (cv.integrate(each, 0.05, cv.Projected(), t_eval=[0.01, 0.27]) for each in (scene, same))
    np.testing.assert_allclose(found.R_WB, expected.R_WB, atol=1e-13)


def test_progress_of_trial_runs(monkeypatch, capsys):
    monkeypatch.setattr(trials, "QUIET", 0.0)
    monkeypatch.setattr(trials, "PAUSE", 0.0)
    trials.recall.cache_clear()
    told, scene = [], cv.scenes.random_body("attraction", 777, 9)
    cv.integrate(scene, error=1e-6, progress=told.append)
    assert len(told) > 1
    assert [each.runs for each in told] == list(range(0, 2 * len(told), 2))
    told.clear()
    cv.integrate(scene, error=1e-6, progress=told.append)
    assert not told  # the trial runs are remembered
    cv.integrate(scene, error=1e-5)
    assert capsys.readouterr() == ("", "")


def test_samples_in_a_field_that_turns_are_the_same_in_units_of_our_own():
    """A motion that is 2^30 times as slow is computed in units of 2^16 s and more."""
    w, inertia = np.array((0.3, -0.4, 0.5)), (1.0, 1.4, 2.0)

    def sample(slower):
        field = cv.Orbit(0.5 / slower, (0, 0, 1)).gravity_gradient(inertia, (1, 0, 0))
        scene = cv.Scene("satellite", cv.RigidBody(inertia), np.eye(3), w / slower, 6.0 * slower, field)
        return cv.integrate(scene, 0.05 * slower, cv.Taylor(), t_eval=np.array((0.513, 3.021, 5.987)) * slower)

    np.testing.assert_allclose(sample(2.0**30).R_WB, sample(1.0).R_WB, atol=1e-14)
