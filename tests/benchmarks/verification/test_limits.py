"""The limits of verdicts, each from both sides: one that is moved by a factor of two fails here.

Recordings start as the scene does, so that no fit hides what was added to the exact motion, and mistakes are not searched for.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.compare import Compared, allow, is_noise
from conservative.benchmarks.verification.recordings import comparison, verdict
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.references.exact.method import free_body

from ...sampling import sampled
from .made import exact

SCENE = cv.Scene("tumbler", cv.RigidBody([2e-3, 6e-3, 7e-3]), np.eye(3), [0.2, 2.0, 0.3], 10.0)
T = np.linspace(0, 10, 501)
R, W = free_body(SCENE.body, SCENE.R_WB0, SCENE.w_WB_B0, T)
SCALE = np.linalg.norm(W, axis=1).max()
AXIS = np.array([0.6, -0.48, 0.64])


pytestmark = pytest.mark.usefixtures("unnamed", "no_moments")


def verify(R_WB=None, w=None, t=T, scene=SCENE, **about):
    return verdict.verify_recording(scene, Recording(t, (R_WB, w), rows=len(t), **about), from_row=False)


def turned(angle, rows=slice(None)):
    """Attitudes that are turned in some rows."""
    out = R.copy()
    out[rows] = out[rows] @ Rotation.from_rotvec(angle * AXIS).as_matrix()
    return out


def moved(size, rows=slice(None)):
    """Rates with an error in some rows, rad/s."""
    out = W.copy()
    out[rows] += size * AXIS
    return out


def noise(size, n=501, seed=5):
    """Noise of rates, relative to the largest, in each axis."""
    return size * SCALE * np.random.default_rng(seed).normal(size=(n, 3))


LARGEST, MEAN = (300, (5.4, 6.6)), (slice(None), (2.3, 2.8))


@pytest.mark.parametrize(
    ("half", "rows", "sizes"), sampled([(half, *where) for half in (1e-4, 3e-4) for where in (LARGEST, MEAN)], 2)
)
def test_half_digits_in_the_largest_error_and_in_the_mean(half, rows, sizes):
    """Six in the largest error, and 1.3 sqrt(3) (1 + 3 / sqrt(n)) = 2.55 in the root of the mean square."""
    for size, expected in zip(sizes, ("right", "wrong"), strict=True):
        assert verify(turned(size * half, rows), digits=(0.0, half, 0.0)).verdict == expected
        assert verify(None, moved(size * half, rows), digits=(0.0, 0.0, half)).verdict == expected
    if rows == 300:
        shapes = [verify(R, unit_errors=np.full(len(T), size * half), digits=(0.0, half, 0.0)).verdict for size in sizes]
        assert shapes == ["right", "wrong"]


def test_round_off_and_the_errors_of_good_solvers():
    """Without digits: right to 1e-9, undecided to 1e-6 in double and to 1e-4 in single precision, wrong beyond."""
    double = [verify(turned(angle)).verdict for angle in (0.7e-9, 1.4e-9, 0.7e-6, 1.4e-6)]
    assert double == ["right", "undecided", "undecided", "wrong"]
    single = [verify(turned(angle), digits=(0.0, 6e-8, 6e-8)).verdict for angle in (1.3e-7, 2e-7, 0.7e-4, 1.4e-4)]
    assert single == ["right", "undecided", "undecided", "wrong"]
    shapes = [verify(R, unit_errors=np.full(len(T), size)).verdict for size in (0.7e-6, 1.4e-6)]
    assert shapes == ["right", "wrong"]


def test_seven_deviations_of_noise_in_the_largest_error():
    verdicts = []
    for size in (6.3, 7.7):
        w = W + noise(1e-3)
        w[300] = moved(size * 1e-3 * SCALE)[300]
        verdicts.append(verify(None, w).verdict)
    assert verdicts == ["right", "wrong"]  # the noise is estimated as 0.99e-3


def test_the_mean_error_of_noise():
    """The root of the mean square is at most 1.3 sqrt(3) (1 + 3 / sqrt(n)) = 2.55 deviations. A constant error adds to it.

    It is no noise, also where it is that small.
    """
    added = [verify(None, moved(size * 1e-3 * SCALE) + noise(1e-3)).verdict for size in (0.0, 1.5, 2.3)]
    assert added == ["right", "undecided", "wrong"]  # 1.73, 2.29 and 2.88 deviations


def test_noise_is_at_most_a_twentieth():
    assert [verify(None, W + noise(size)).verdict for size in (0.04, 0.065)] == ["right", "wrong"]


def test_errors_of_times_lie_along_the_motion():
    """Of noise, a third lies along the slope of the rates. If it is more than 0.8, times are wrong."""
    slope = np.gradient(W, T, axis=0)
    along = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    random, verdicts = noise(1e-3), []
    parallel = (random * along).sum(axis=1, keepdims=True) * along
    for share in (0.7, 0.9):
        mixed = parallel * np.sqrt(3 * share) + (random - parallel) * np.sqrt(1.5 * (1 - share))
        verdicts.append(verify(None, W + mixed).verdict)
    assert verdicts == ["right", "wrong"]


@pytest.mark.parametrize(("rows", "cause"), [(9, "single rows"), (12, "")])
def test_single_rows_are_two_in_a_hundred(rows, cause):
    w = W.copy()
    w[10 :: 500 // rows][:rows] += 0.1 * AXIS
    found = verify(None, w).findings[0]
    assert found.mistake == cause
    assert [(each.numbers["row"], each.numbers["time"]) for each in found.causes] == [(11, T[10])] * bool(cause)


@pytest.mark.parametrize(
    ("turn", "faster", "expected"), [(1.45, 1.0, "right"), (4.0, 1.0, "right"), (1.45, 1.001, "wrong"), (4.0, 1.001, "wrong")]
)
def test_noise_is_what_the_exact_motion_leaves_in_rows_at_any_distance(turn, faster, expected):
    """Differences of rows show noise up to a quarter of a turn a row. Beyond it, what is left has to be white."""
    t = np.arange(401) * turn / SCALE
    w = free_body(SCENE.body, SCENE.R_WB0, SCENE.w_WB_B0, faster * t)[1] + noise(0.01, len(t))
    assert (verify(None, w, t, SCENE.rename("long", t_end=float(t[-1]))).verdict == "right") == (expected == "right")


def smoothed(x, width):
    return np.stack([np.convolve(column, np.ones(width) / width**0.5, "same") for column in x.T], axis=1)


NORMAL = np.random.default_rng(2).normal(size=(300, 3)) * 1e-3
NOT_NOISE = {
    "larger than a twentieth": 60 * NORMAL,
    "of a mean": NORMAL + 5e-4,
    "correlated": smoothed(NORMAL, 3),
    "growing": NORMAL * np.linspace(0.2, 1.8, 300)[:, None],
    "in a plane": NORMAL * [1.0, 1.0, 0.1],
    "with a single row": NORMAL + 0.01 * (np.arange(300) == 99)[:, None],
    "of a few rows": NORMAL[:13],
}


@pytest.mark.parametrize("kind", NOT_NOISE)
def test_noise_is_small_white_of_one_size_and_in_all_directions(kind):
    assert is_noise(NORMAL, W[:300])
    assert not is_noise(NOT_NOISE[kind], W[: len(NOT_NOISE[kind])])


def test_differences_along_a_motion_or_in_its_plane_are_no_noise():
    """The motion turns in all directions, so that differences along it do, too."""
    along = Rotation.from_rotvec(0.3 * np.cumsum(np.random.default_rng(4).normal(size=(300, 3)), axis=0)).apply([1.0, 0.0, 0.0])
    inwards = np.gradient(along, axis=0)
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    in_plane = NORMAL[:, :1] * along + NORMAL[:, 1:2] * inwards
    assert [is_noise(left, along) for left in (NORMAL, NORMAL[:, :1] * along, in_plane)] == [True, False, False]


@pytest.mark.parametrize(("size", "expected"), [(25.0, True), (36.0, False)])
def test_a_start_is_fitted_up_to_thirty_deviations(size, expected):
    allowed = allow(noise=(1e-3, 1e-3))
    w = W[:2].copy()
    w[1] += size * 1e-3 * SCALE * AXIS
    assert comparison._near(Compared(SCENE, T[:2], (None, w), 0.0, SCALE, allowed.errors, allowed.noise)) is expected


def test_what_is_allowed_and_by_what():
    assert allow((1e-5, 1e-12), (1e-6, 1e-3)).errors == pytest.approx([6e-5, 7e-3])
    assert allow((1e-5, 1e-12), (1e-6, 1e-3)).by == ("digits", "noise")
    assert allow().errors == pytest.approx([1e-9, 1e-9])
    assert allow((1e-5, 1e-5), error=1e-4, by="order").errors == pytest.approx([1e-4, 1e-4])
    assert allow((1e-5, 1e-5), error=1e-4, by="order").by == ("order", "order")


@pytest.mark.slow
def test_corners_of_a_recorded_torque_are_no_noise():
    """A torque at 100 Hz has a corner in every row. Up to version 0.3 1.9e-5 rad were allowed by noise on exact rows."""
    t = np.arange(301) * 0.01
    torque = 1e-3 * np.random.default_rng(0).normal(size=(301, 3))
    scene = SCENE.rename("driven", torque=cv.Torque((t, torque)), t_end=3.0)
    made = exact(scene, t)
    found = verify(*made, t, scene)
    assert (found.verdict, found.details.by) == ("right", ("digits", "digits"))
    assert found.details.allowed == pytest.approx((1e-9, 1e-9), rel=0.1)
    w = made[1] + noise(1e-4, len(t))
    found = verify(made[0], w, t, scene)
    assert (found.verdict, found.details.by[1]) == ("right", "noise")
    assert found.details.noise[1] == pytest.approx(1e-4, rel=0.1)  # measured: 1.02e-4
