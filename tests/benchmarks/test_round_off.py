import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from benchmarks import round_off

STEPS = 64 * 4000


def walk(members=8, blocks=64, seed=1):
    steps = np.random.default_rng(seed).normal(size=(members, blocks))
    return np.concatenate([np.zeros((members, 1)), np.cumsum(steps, axis=1)], axis=1)


def test_a_walk_is_not_called_linear():
    found = [round_off.growth(walk(seed=seed), 1000) for seed in range(200)]
    assert not any(grown.linear for grown in found)  # measured: smallest chance 1e-3
    exponents = [grown.exponent for grown in found]
    assert np.mean(exponents) == pytest.approx(0.5, abs=0.02)  # measured 0.501
    assert np.mean([grown.stderr for grown in found]) == pytest.approx(np.std(exponents), rel=0.3)  # measured 0.032 and 0.035


def test_chance_is_what_it_says():
    chances = [round_off.growth(walk(seed=seed), 1000).chance for seed in range(400)]
    for level in (0.1, 0.5, 0.9):
        assert np.mean(np.array(chances) < level) == pytest.approx(level, abs=0.08)  # measured 0.05 off


@pytest.mark.parametrize("signs", [1, -1])
def test_a_line_under_a_walk_is_seen(signs):
    # 64 blocks walk by 8 in all; a line that reaches four times that is seen in every ensemble, whatever its signs.
    line = np.linspace(0, 32, 65) * signs ** np.arange(8)[:, None]
    chances = [round_off.growth(walk(seed=seed) + line, 1000).chance for seed in range(50)]
    assert max(chances) < round_off.LEVEL  # measured 1.5e-10
    assert round_off.growth(1e-3 * walk() + line, 1000).exponent == pytest.approx(1, abs=1e-3)  # measured 4e-6 off


def test_what_stays_bounded_is_no_faster_than_a_walk():
    grown = round_off.growth(np.random.default_rng(2).normal(size=(8, 65)), 1000)
    assert not grown.linear
    assert grown.exponent < 0.1  # measured 0.01


def test_a_method_without_bias():
    found = round_off.measure(cv.MoserVeselov(), cv.scenes.brick_flip(), 0.01, STEPS, 6)
    for name in ("energy", "momentum"):
        assert not found[name].linear, str(found[name])
        assert found[name].rms < 2e-15  # measured 2e-16


def test_a_stopping_test_before_the_update_is_seen():
    # The paper's own: Newton ends where the residual is small, and what is left of it has one sign.
    found = round_off.measure(cv.Convected(tol=1e-6), cv.scenes.brick_flip(), 0.01, 640, 3)
    assert found["energy"].linear, str(found["energy"])
    assert found["energy"].exponent > 0.9  # measured 0.96


def test_the_default_method_has_a_bias_far_below_a_rounding_unit():
    found = round_off.measure(cv.Reduced(), cv.scenes.brick_flip(), 0.01, STEPS, 6)
    assert abs(found["energy"].bias) < 1e-19  # measured 8e-21: seen after 10^6 steps, 7e-13 after 10^8
    assert found["energy"].rms < 2e-14  # measured 3e-15


@pytest.mark.xfail(strict=True, reason="extrapolated first guesses leave -7e-21 of the energy a step, always the same way")
def test_the_default_method_walks():
    found = round_off.measure(cv.Reduced(), cv.scenes.brick_flip(), 0.01, 64 * 40_000, 8)
    assert not found["energy"].linear  # measured: chance 5e-17


def test_compositions_walk():
    # They take the explicit guess in every stage.
    found = round_off.measure(cv.Reduced(6), cv.scenes.brick_flip(), 0.01, STEPS, 6)
    assert not any(grown.linear for grown in found.values())  # measured: chance 1


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
        round_off.growth(np.zeros((1, 65)), 100)
