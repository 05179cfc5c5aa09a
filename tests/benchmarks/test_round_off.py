import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.verification import round_off

STEPS = 64 * 4000


def walk(members=8, blocks=64, seed=1):
    steps = np.random.default_rng(seed).normal(size=(members, blocks))
    return np.concatenate([np.zeros((members, 1)), np.cumsum(steps, axis=1)], axis=1)


def test_a_walk_is_not_called_linear():
    found = [round_off.fit_growth(walk(seed=seed), 1000) for seed in range(200)]
    assert not any(grown.linear for grown in found)  # measured: smallest chance 1e-3
    exponents = [grown.exponent for grown in found]
    assert np.mean(exponents) == pytest.approx(0.5, abs=0.02)  # measured 0.501
    assert np.mean([grown.stderr for grown in found]) == pytest.approx(np.std(exponents), rel=0.3)  # measured 0.032 and 0.035


def test_chance_is_what_it_says():
    chances = [round_off.fit_growth(walk(seed=seed), 1000).chance for seed in range(400)]
    for level in (0.1, 0.5, 0.9):
        assert np.mean(np.array(chances) < level) == pytest.approx(level, abs=0.08)  # measured 0.05 off


@pytest.mark.parametrize("signs", [1, -1])
def test_a_line_under_a_walk_is_seen(signs):
    # 64 blocks walk by 8 in all; a line that reaches four times that is seen in every ensemble, whatever its signs.
    line = np.linspace(0, 32, 65) * signs ** np.arange(8)[:, None]
    chances = [round_off.fit_growth(walk(seed=seed) + line, 1000).chance for seed in range(50)]
    assert max(chances) < round_off.LEVEL  # measured 1.5e-10
    assert round_off.fit_growth(1e-3 * walk() + line, 1000).exponent == pytest.approx(1, abs=1e-3)  # measured 4e-6 off


def test_what_stays_bounded_is_no_faster_than_a_walk():
    grown = round_off.fit_growth(np.random.default_rng(2).normal(size=(8, 65)), 1000)
    assert not grown.linear
    assert grown.exponent < 0.1  # measured 0.01


def test_a_method_without_bias():
    found = round_off.measure_growth(cv.MoserVeselov(), cv.scenes.brick_flip(), 0.01, STEPS, 6)
    for name in ("energy", "momentum"):
        assert not found[name].linear, str(found[name])
        assert found[name].rms < 2e-15  # measured 2e-16


def test_a_stopping_test_before_the_update_is_seen():
    # The paper's own: Newton ends where the residual is small, and what is left of it has one sign.
    found = round_off.measure_growth(cv.Convected(tol=1e-6), cv.scenes.brick_flip(), 0.01, 640, 3)
    assert found["energy"].linear, str(found["energy"])
    assert found["energy"].exponent > 0.9  # measured 0.96


def generic():
    """A body, axes, spin and step without any special value; the spin is near the middle axis."""
    turn = rotation_about((3, -1, 2), 1.3)
    body = cv.RigidBody(turn @ np.diag([np.pi, np.e, np.sqrt(3.7)]) @ turn.T)
    return cv.Scene("generic", body, rotation_about((1, 2, -1), 2.4), turn @ [0.3, 1.2, -1.3], 1.0)


def test_the_default_method_walks():
    # After 10^8 steps 8.5e-15 and 4.4e-15, by the command of `round_off` with --steps 1e8 --members 4.
    found = round_off.measure_growth(cv.Reduced(), cv.scenes.brick_flip(), 0.01, 10_000_000, 4)
    for name in ("energy", "momentum"):
        assert not found[name].linear, str(found[name])
        assert found[name].rms < 1e-14  # measured 3.2e-15 and 1.7e-15
        assert abs(found[name].bias) < 1e-21  # measured 1.6e-22; it was 7e-21 when L1 - L0 was formed from a rounded a


@pytest.mark.parametrize("order", [2, 4, 6])
@pytest.mark.parametrize("dt", [0.1, 1 / 37])
def test_no_special_value_makes_it_walk(order, dt):
    found = round_off.measure_growth(cv.Reduced(order), generic(), dt, STEPS if order > 2 else 8 * STEPS, 6)
    for name in ("energy", "momentum"):
        assert not found[name].linear, str(found[name])
        assert found[name].rms < 5e-15  # measured 3e-16 to 1.5e-15


@pytest.mark.parametrize(
    ("options", "argument"),
    [
        (["--steps", "10"], "steps"),
        (["--members", "1"], "members"),
        (["--dt", "-1"], "dt"),
        (["--method", "reducd"], "method"),
        (["--scene", "bric"], "scene"),
    ],
)
def test_bad_input_of_the_command(options, argument):
    ended = CliRunner().invoke(round_off.main, options)
    assert ended.exit_code == 2
    assert f"{argument}: got" in ended.output


def test_the_command_prints_a_line_for_each_invariant():
    ended = CliRunner().invoke(round_off.main, ["--steps", "6400", "--members", "3"])
    assert ended.exit_code == 0
    assert [line.partition(":")[0] for line in ended.output.splitlines()] == ["energy", "momentum"]


def test_too_few_drifts():
    with pytest.raises(cv.BadInput, match="two members"):
        round_off.fit_growth(np.zeros((1, 65)), 100)
