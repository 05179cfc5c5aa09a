"""Round-off over long runs: drifts of energy and momentum grow with the square root of the number of steps, not linearly.

The drift of each body of an ensemble with slightly different rates is read at equally spaced times. Short runs are part of all
test runs. `ATTACK_EFFORT=100 pytest --attack` takes 10^8 steps.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import conservative as cv
from conservative.attitude import rotation_about
from conservative.grid import Grid

from ..conservative.one_body import TURN, body_in_axes
from ..sampling import sampled
from .effort import count

BLOCKS = 64  # equal parts of a run between which drifts are read
SPREAD = 1e-3  # of the members' rates at the start, relative
LEVEL = 1e-6  # drifts are linear if a random walk looks like them with a smaller probability than this
STEPS = BLOCKS * 4000


@dataclass(frozen=True)
class Growth:
    """Growth of drifts.

    `rms` after all steps; `exponent` p of rms ~ N^p, fitted to changes over 1, 2, 4, ... blocks, and its standard error from
    leaving out each member in turn; `bias`, the mean drift per step; `chance`, the probability that a walk, with steps of mean
    zero in every member, looks as much like a line as this.
    """

    rms: float
    exponent: float
    stderr: float
    bias: float
    chance: float

    @property
    def linear(self):
        return self.chance < LEVEL


def fit_growth(drift, steps):
    """Return the growth of drifts (members, blocks + 1), zero at first, over a number of steps.

    The changes over blocks of a walk are independent and of mean zero, so that the t value of each member, as a normal deviate,
    squared and summed over members, has a chi-square distribution. Members may drift in different directions.
    """
    # Sixteen blocks are enough for t, and long enough that periodic motion is not taken for dependence.
    coarse = np.diff(drift[:, :: (drift.shape[1] - 1) // 16], axis=1)
    scatter = np.maximum(coarse.std(axis=1, ddof=1), np.finfo(float).tiny)
    t = np.abs(coarse.mean(axis=1)) / scatter * math.sqrt(coarse.shape[1])
    deviates = stats.norm.isf(np.clip(stats.t.sf(t, coarse.shape[1] - 1), 1e-300, 0.5))
    slopes = np.array([fit_exponent(np.delete(drift, k, axis=0)) for k in range(len(drift))])
    return Growth(
        rms=float(np.sqrt(np.mean(drift[:, -1] ** 2))),
        exponent=fit_exponent(drift),
        stderr=float(np.sqrt((len(slopes) - 1) * np.mean((slopes - slopes.mean()) ** 2))),
        bias=float(drift[:, -1].mean() / steps),
        chance=float(stats.chi2.sf(np.sum(deviates**2), len(drift))),
    )


def fit_exponent(drift):
    """Return the slope of log(rms change) over log(blocks passed), over an eighth of the run at most."""
    lags = 2 ** np.arange(int(math.log2((drift.shape[1] - 1) // 8)) + 1)
    rms = [np.sqrt(np.mean((drift[:, lag:] - drift[:, :-lag]) ** 2)) for lag in lags]
    return float(stats.linregress(np.log(lags), np.log(np.maximum(rms, np.finfo(float).tiny))).slope)


def measure_growth(method, scene, dt, steps, members):
    """Return the growth of each invariant's drift; of a vector, of its component along itself."""
    steps -= steps % BLOCKS
    draw, found = np.random.default_rng(0), {}
    for _ in range(members):
        member = scene.rename(scene.name, w_WB_B0=scene.w_WB_B0 * (1 + SPREAD * draw.normal(size=3)))
        trajectory = method.solve(member, Grid(dt, steps, steps // BLOCKS))
        assert trajectory.ok, trajectory.failure
        for invariant in member.invariants:
            drift = trajectory.drift(invariant)
            start = invariant.evaluate(member.R_WB0[None], member.w_WB_B0[None])[0]
            along = drift if drift.ndim == 1 else drift @ (start / np.linalg.norm(start))
            found.setdefault(invariant.name, []).append(along - along[0])
    return {name: fit_growth(np.array(drifts), steps) for name, drifts in found.items()}


def walk(members=8, seed=1):
    steps = np.random.default_rng(seed).normal(size=(members, BLOCKS))
    return np.concatenate([np.zeros((members, 1)), np.cumsum(steps, axis=1)], axis=1)


def test_a_walk_is_not_called_linear():
    found = [fit_growth(walk(seed=seed), 1000) for seed in range(100)]
    assert not any(grown.linear for grown in found)  # measured: smallest chance 1e-3
    exponents = [grown.exponent for grown in found]
    assert np.mean(exponents) == pytest.approx(0.5, abs=0.02)  # measured 0.501
    assert np.mean([grown.stderr for grown in found]) == pytest.approx(np.std(exponents), rel=0.3)  # measured 0.032 and 0.035
    for level in (0.1, 0.5, 0.9):
        assert np.mean([grown.chance < level for grown in found]) == pytest.approx(level, abs=0.1)


@pytest.mark.parametrize("signs", [1, -1])
def test_a_line_under_a_walk_is_seen(signs):
    # 64 blocks walk by 8 in all; a line that reaches four times that is seen in every ensemble, whatever its signs.
    line = np.linspace(0, 32, BLOCKS + 1) * signs ** np.arange(8)[:, None]
    assert all(fit_growth(walk(seed=seed) + line, 1000).linear for seed in range(50))  # measured: chances up to 1.5e-10
    assert fit_growth(1e-3 * walk() + line, 1000).exponent == pytest.approx(1, abs=1e-3)  # measured 4e-6 off


def test_bounded_drifts_are_no_faster_than_a_walk():
    grown = fit_growth(np.random.default_rng(2).normal(size=(8, BLOCKS + 1)), 1000)
    assert not grown.linear
    assert grown.exponent < 0.1  # measured 0.01


@pytest.mark.slow
def test_a_stopping_test_before_the_update_is_seen():
    # The paper's test: Newton ends when the residual is small, and the rest of the residual has one sign.
    grown = measure_growth(cv.Convected(tol=1e-6), cv.scenes.brick_flip(), 0.01, 640, 3)["energy"]
    assert grown.linear, str(grown)
    assert grown.exponent > 0.9  # measured 0.96


def test_a_method_without_bias():
    for grown in measure_growth(cv.MoserVeselov(), cv.scenes.brick_flip(), 0.01, STEPS, 6).values():
        assert not grown.linear, str(grown)
        assert grown.rms < 2e-15  # measured 2e-16


def test_the_default_method_walks():
    # After 10^8 steps energy has 8.5e-15 and momentum 4.4e-15.
    for grown in measure_growth(cv.Reduced(), cv.scenes.brick_flip(), 0.01, 4_000_000, 4).values():
        assert not grown.linear, str(grown)
        assert grown.rms < 6e-15  # measured 1.5e-15 and 8e-16
        assert abs(grown.bias) < 1e-21  # measured 8e-23; it was 7e-21 when L1 - L0 was formed from a rounded a


def generic():
    """Return a body, axes and spin without any special value; the spin is near the middle axis."""
    body = body_in_axes(TURN, np.pi, np.e, np.sqrt(3.7))
    return cv.Scene("generic", body, rotation_about((1, 2, -1), 2.4), TURN @ [0.3, 1.2, -1.3], 1.0)


@pytest.mark.parametrize(("order", "dt"), sampled([(2, 0.1), (2, 1 / 37), (4, 0.1), (6, 1 / 37)], 2))
def test_no_special_value_makes_it_walk(order, dt):
    for grown in measure_growth(cv.Reduced(order), generic(), dt, STEPS if order > 2 else 8 * STEPS, 6).values():
        assert not grown.linear, str(grown)
        assert grown.rms < 5e-15  # measured 4e-16 to 2.7e-15


@pytest.mark.parametrize(
    ("scene", "method", "dt", "invariant", "steps", "drift"),
    [
        (cv.scenes.nutating_top(), cv.Reduced(), 0.005, "vertical momentum", 1_000_000, 8e-14),
        pytest.param(
            cv.scenes.lagrange_top(), cv.Splitting(order=4), 0.002, "vertical momentum", 100_000, 4e-13, marks=pytest.mark.slow
        ),
        pytest.param(cv.scenes.symmetric_body(), cv.Lame(), 0.05, "momentum", 100_000, 1.1e-13, marks=pytest.mark.slow),
    ],
    ids=["nutating_top", "lagrange_top", "symmetric_body"],
)
def test_symmetric_bodies_drift_linearly_as_published(scene, method, dt, invariant, steps, drift):
    """The rows of DERIVATION.md, section 12."""
    found = method.solve(scene, Grid(dt, steps, steps // 2))
    assert found.ok, found.failure
    half, end = np.linalg.norm(np.reshape(found.drift(invariant), (3, -1)), axis=1)[1:]
    assert end == pytest.approx(drift, rel=0.5)  # measured 6.7e-14, 4.2e-13 and 1.07e-13
    assert f"{drift:g}" in (Path(cv.__file__).parent / "methods" / "DERIVATION.md").read_text(encoding="utf-8")
    assert end / half == pytest.approx(2, abs=0.5)  # measured 1.8 to 2.0


def random_body_in(field, index):
    scene = cv.scenes.random_body(field, 31, index)
    return scene, 0.05 / float(np.linalg.norm(scene.w_WB_B0))


FIELDS = [("gravity", 26), ("spring", 14), ("attraction", 2), ("fixed_gradient", 1)]


@pytest.mark.parametrize(
    ("field", "index", "order"),
    sampled([(*field, order) for field in FIELDS for order in (2, 6)], 1, keep=[("gravity", 26, 2)]),
)
def test_fields_walk(field, index, order):
    """The energy of these drifted by 7e-20 to 6e-19 a step, with chances of 1e-148 to 1e-30 of a walk."""
    scene, dt = random_body_in(field, index)
    for name, grown in measure_growth(cv.Reduced(order), scene, dt, 800_000 if order == 2 else 100_000, 5).items():
        assert not grown.linear, f"{name}: {grown}"  # measured: chances from 7e-3 on


@pytest.mark.attack
@pytest.mark.parametrize("field", ["gravity", "spring", "attraction", "fixed_gradient"])
def test_fields_walk_for_long(field):
    """With a chance of 1e-3 each, 39 of 40 random bodies have to walk."""
    found = []
    for index in range(40):
        scene, dt = random_body_in(field, index)
        found.append(measure_growth(cv.Reduced(), scene, dt, count(500_000), 2)["energy"].chance)
    assert np.sum(np.array(found) < 1e-3) <= 1, found


@pytest.mark.attack
@pytest.mark.parametrize("method", [cv.Reduced(), cv.Reduced(4), cv.MoserVeselov(), cv.Gauss(2)], ids=lambda each: each.name)
@pytest.mark.parametrize("scene", [cv.scenes.brick_flip(), generic()], ids=lambda each: each.name)
def test_long_runs_walk(method, scene):
    for grown in measure_growth(method, scene, 0.01, count(1_000_000), 6).values():
        assert not grown.linear, str(grown)
