"""The compiled conversion of engines' states against products of NumPy, and the run of an engine without it."""

from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import from_quaternion
from conservative.grid import Grid
from conservative.potentials.turning import Orbit
from conservative.references.heyoka_equations import formulations
from conservative.references.samples import MATRIX, QUATERNION, ROW_AND_ANGLE, ROWS, States, bind_conversion, to_body_axes
from conservative.references.solvers.heyoka import FRAMES, Heyoka
from conservative.trajectory import Trajectory

BODIES, SAMPLES = 3, 5
DRAW = np.random.default_rng(4)
T = np.linspace(0, 2, SAMPLES)


def draw(*shape):
    """Return quaternions of norms 0.9 to 1.1, as engines return them."""
    q = DRAW.normal(size=(*shape, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True) * DRAW.uniform(0.9, 1.1, (*shape, 1))


R_BF, R_WD = from_quaternion(draw(BODIES)), from_quaternion(draw(BODIES))
q, w = draw(BODIES, SAMPLES), DRAW.normal(size=(BODIES, SAMPLES, 3))
R_DF = from_quaternion(q)
UNIT = from_quaternion(q / np.linalg.norm(q, axis=-1, keepdims=True))
FORMS = [
    (QUATERNION, q, R_DF),
    (MATRIX, R_DF.reshape(BODIES, SAMPLES, 9), R_DF),
    (ROWS, np.concatenate([UNIT[..., 2, :], UNIT[..., 0, :]], axis=-1), UNIT),
    (
        ROW_AND_ANGLE,
        np.apply_along_axis(lambda R: formulations._row_and_angle(R.reshape(3, 3)), -1, UNIT.reshape(3, 5, 9)),
        UNIT,
    ),
]


@pytest.mark.parametrize(("kind", "attitudes", "R"), FORMS, ids=["quaternion", "matrix", "rows", "row and angle"])
@pytest.mark.parametrize("in_world", [False, True])
def test_each_form_is_the_product_of_its_rotations(kind, attitudes, R, in_world):
    orbit = Orbit(0.7, (0.6, 0, 0.8))
    constants = np.array([[0.0] * 4, [orbit.rate, *orbit.normal_W], [0.0] * 4])  # the axes of the second body turn
    states = States(kind, np.concatenate([attitudes, w], axis=-1), R_WD, constants, in_world)
    R_WB, w_WB_B, finite = to_body_axes(T, states, R_BF)
    expected = R_WD[:, None] @ R @ R_BF[:, None].swapaxes(-1, -2)
    if kind != ROW_AND_ANGLE:  # whose field does not turn
        expected[1] = orbit.R_WO(T) @ expected[1]
    in_F = (w[..., None, :] @ R)[..., 0, :] if in_world else w
    np.testing.assert_allclose(R_WB, expected, atol=3e-15)  # measured 7e-16
    np.testing.assert_allclose(w_WB_B, in_F @ R_BF.swapaxes(-1, -2), atol=5e-15)
    assert finite.tolist() == [SAMPLES] * BODIES
    one = States(kind, np.empty((1, 0, 0)), R_WD[1:2], constants[1:2], in_world)
    final = bind_conversion(T[-1], one, R_BF[1])(states.values[1, -1].copy())
    assert [np.array_equal(a, b) for a, b in zip(final, (R_WB[1, -1], w_WB_B[1, -1]), strict=True)] == [True, True]


@pytest.mark.parametrize("column", [0, 6])
def test_samples_count_up_to_the_first_that_is_not_finite(column):
    values = np.concatenate([q, w], axis=-1)
    values[1, 2, column] = np.nan
    values[2, 0, column] = np.inf
    assert to_body_axes(T, States(QUATERNION, values), R_BF)[2].tolist() == [SAMPLES, 2, 0]


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("n", [1, 4, 50])
def test_the_own_loop_of_heyoka_is_its_run_without_the_conversion(frame, n):
    """The loop of a user, which is timed, has the states of the run with limits, each time from the initial state."""
    scene = cv.scenes.lagrange_top(t_end=0.5)
    method = Heyoka(1e-12, frame)
    run = method.prepare(scene, Grid(0.5 / n, n))
    trajectory = run()
    problem = getattr(formulations, frame)(scene)
    for _ in range(2):
        states = np.array(run.own_loop(), ndmin=2)
        found = formulations.gather([problem])(states[None])
        R_WB, w_WB_B, _ = to_body_axes(trajectory.t[-len(states) :], found, problem.axes.R_BF[None])
        assert len(states) == (1 if n == 1 else n + 1)
        assert np.array_equal(R_WB[0], trajectory.R_WB[-len(states) :])
        assert np.array_equal(w_WB_B[0], trajectory.w_WB_B[-len(states) :])
        final = run.final_call()
        if n == 1:  # with more samples, the steps are others
            assert np.array_equal(final[0], trajectory.R_WB[-1])
            assert np.array_equal(final[1], trajectory.w_WB_B[-1])
        np.testing.assert_allclose(final[0], trajectory.R_WB[-1], atol=1e-10)  # measured: 4e-12, at a tolerance of 1e-12
    assert np.array_equal(run().R_WB, trajectory.R_WB)


def test_a_loop_in_other_units_is_timed_without_the_conversion_to_si():
    scene = cv.scenes.lagrange_top(t_end=0.5)
    tiny = replace(scene, body=cv.RigidBody(scene.body.inertia * 1e-12), potential=None)
    for method in (cv.Gauss(), Heyoka(1e-9)):
        run = method.prepare(tiny, Grid(0.01, 50, 50))
        assert not isinstance(run.own_loop(), Trajectory)
