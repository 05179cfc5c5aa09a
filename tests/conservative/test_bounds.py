"""What a run of ours may be off by before it is no longer ok, in numbers; and the compiled code that asks for it."""

import sys

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.kernels import drifts
from conservative.kernels.signals import end_of_block
from conservative.method import Grid
from conservative.methods.bounds import bounds_of

EPS = sys.float_info.epsilon
BODY = cv.RigidBody((3.0, 4.0, 6.0))
RNG = np.random.default_rng(4)
J = (lambda A: A @ A.T)(RNG.normal(size=(3, 3)))
ALLOWED = 1e-9


def scene(moments=(3.0, 4.0, 6.0)):
    return cv.Scene("free", cv.RigidBody(moments), np.eye(3), (1, 2, 3), 1.0)


def test_rounding_and_tolerances_add_up_over_the_steps():
    assert bounds_of(scene(), Grid(0.1, 90)).drift == pytest.approx(4 * EPS * 100 * 2, rel=1e-12, abs=0)
    assert bounds_of(scene((1.0, 7.0, 7.5)), Grid(0.1, 90)).drift == pytest.approx(4 * EPS * 100 * 7.5, rel=1e-12, abs=0)
    assert bounds_of(scene(), Grid(0.1, 90), tol=1e-9).drift == pytest.approx(10 * 90 * 1e-9, rel=1e-6, abs=0)
    assert bounds_of(scene(), Grid(0.1, 90), tol=1.0).drift == 1e-3


def test_attitudes_from_quaternions_are_orthonormal_and_others_as_good_as_the_rest():
    assert bounds_of(scene(), Grid(0.1, 90)).orthonormality == 1e-13
    loose = bounds_of(scene(), Grid(0.1, 90), 1e-9, None)
    assert loose.orthonormality == loose.drift > 1e-7


@pytest.mark.parametrize(
    "method", [cv.Gauss(), cv.Lame(), cv.MoserVeselov(), cv.Projected(), cv.Taylor()], ids=lambda each: each.name
)
def test_without_a_tolerance_bounds_are_those_of_rounding(method):
    assert method.bounds(scene(), Grid(0.1, 90)) == bounds_of(scene(), Grid(0.1, 90))


def test_bounds_of_methods_with_a_tolerance():
    grid = Grid(0.1, 90)
    assert cv.Reduced(tol=1e-9).bounds(scene(), grid) == bounds_of(scene(), grid, 1e-9)
    assert cv.Convected(1e-7).bounds(scene(), grid) == bounds_of(scene(), grid, 1e-7, None)


def test_bounds_of_parts_are_those_of_all_parts():
    grid = Grid(0.1, 90)
    assert cv.Substepped(most=8).bounds(scene(), grid) == cv.Reduced().bounds(scene(), Grid(0.0125, 720))


def test_the_departure_is_that_of_energy_and_momenta():
    R, w, V = RNG.normal(size=(3, 3)), RNG.normal(size=3), 0.7
    constants = RNG.normal(size=(5, 4))
    energy = 0.5 * w @ J @ w + V
    expected = abs((energy - constants[0, 3]) * constants[0, 0])
    expected += sum(abs(row[:3] @ R @ J @ w - row[3]) for row in constants[1:4])
    expected += abs(constants[4, :3] @ J @ w - constants[4, 3])
    assert drifts.departure(R, w, V, J, constants) == pytest.approx(expected, rel=1e-13)
    for row in range(5):
        alone = np.zeros((5, 4))
        alone[row] = constants[row]
        parts = abs((energy - alone[0, 3]) * alone[0, 0]) if row == 0 else None
        arm = R @ J @ w if row < 4 else J @ w
        parts = abs(alone[row, :3] @ arm - alone[row, 3]) if parts is None else parts
        assert drifts.departure(R, w, V, J, alone) == pytest.approx(parts, rel=1e-12)


def test_the_skewness_is_that_of_all_columns():
    R = RNG.normal(size=(3, 3))
    off = R.T @ R - np.eye(3)
    assert drifts.skewness(R) == pytest.approx(np.abs(off[np.triu_indices(3)]).sum(), rel=1e-13)
    assert drifts.skewness(rotation_about((1, 2, 3), 0.8)) < 1e-15


def samples(n_steps=7, every=3):
    """Samples of a body that turns steadily, at their times, with what is kept of it."""
    grid, w = Grid(0.1, n_steps, every), np.array([0.3, -0.2, 0.4])
    R = np.array([rotation_about(w, np.linalg.norm(w) * t) for t in grid.t])
    constants = np.zeros((5, 4))
    constants[0] = 1.0, 0.0, 0.0, 0.5 * w @ w + 2.0
    constants[1, :3], constants[1, 3] = w, w @ w
    return [0.1, every, n_steps, grid.t.copy(), R, np.tile(w, (len(R), 1)), np.full(len(R), 2.0), np.eye(3), constants]


def is_kept(*given):
    return drifts.are_kept(*given, ALLOWED, ALLOWED)


@pytest.mark.parametrize("n_steps", [1, 6, 7])
def test_good_samples_are_kept(n_steps):
    assert is_kept(*samples(n_steps))


@pytest.mark.parametrize("sample", [0, 1, 2, 3])
@pytest.mark.parametrize("array", [3, 4, 5, 6])
@pytest.mark.parametrize("value", [1.1, np.nan])
def test_one_number_that_is_off_is_noticed(sample, array, value):
    given = samples()
    given[array][sample] = given[array][sample] * value + 1e-3
    assert not is_kept(*given)


@pytest.mark.parametrize(("share", "kept"), [(0.98, True), (1.02, False)])
def test_the_bounds_are_where_they_are_said_to_be(share, kept):
    given = samples()
    given[6][2] += share * ALLOWED
    assert is_kept(*given) is kept
    given = samples()
    given[7] = np.zeros((3, 3))  # without any momentum attitudes count for their skewness alone
    given[8][:] = 0.0
    given[4][1] *= np.sqrt(1 + share * ALLOWED / 3)
    assert is_kept(*given) is kept


def test_blocks_of_steps_end_with_the_run():
    assert [end_of_block(done, 10, 4) for done in (0, 4, 8)] == [4, 8, 10]
    assert [end_of_block(3, 10, block) for block in (0, -1, 1)] == [10, 10, 4]
