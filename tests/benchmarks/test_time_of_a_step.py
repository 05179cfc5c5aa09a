"""The yardstick on a clock of its own: how long samples are, when they end, and what the ratio is of."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from conservative.benchmarks.gate import yardstick


@pytest.fixture
def clock(monkeypatch):
    """A clock that only runs tell: each returns its time, s."""
    monkeypatch.setattr(yardstick, "wall_time", lambda run, calls=1: calls * run())


def test_the_yardstick_turns_a_free_body():
    """The start of 5 turns: Euler's equations of moments 1, 2, 3 in the body's frame, and an attitude of length one."""

    def rates(_, y):
        x, y_, z, a, b, c, d = y
        turn = (-b * x - c * y_ - d * z, a * x + c * z - d * y_, a * y_ + d * x - b * z, a * z + b * y_ - c * x)
        return [-y_ * z, z * x, -x * y_ / 3, *(0.5 * part for part in turn)]

    start, h, n = [0.3, 1.1, -0.7, 1, 0, 0, 0], 1e-3, 3000
    exact = solve_ivp(rates, (0, n * h), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    assert yardstick.step_reference_body(n, h) == pytest.approx(exact[3] + exact[0], abs=3e-6)  # order 2
    assert yardstick.step_reference_body(0, h) == 1.3


def test_samples_end_after_three_quiet_batches(clock):
    taken = []

    def run():
        taken.append(1)
        return 1.0

    assert yardstick.measure_minimums(run) == (1.0,)
    assert len(taken) == 4 * yardstick.ROUNDS  # the first one is not quiet
    falling = iter(2.0**-k for k in range(1000))
    assert yardstick.measure_minimums(lambda: next(falling)) == (2.0 ** -(yardstick.MOST_ROUNDS - 1),)


@pytest.mark.parametrize(("fall", "batches"), [(0.999, 4), (0.997, 7)])
def test_a_minimum_that_falls_by_less_than_the_tolerance_is_quiet(clock, fall, batches):
    """One fall, in the fourth batch, by more or by less than 0.2 %."""
    taken = []

    def run():
        taken.append(1)
        return 1.0 if len(taken) <= 3 * yardstick.ROUNDS else fall

    assert yardstick.measure_minimums(run, lambda: 2.0) == (fall, 2.0)
    assert len(taken) == batches * yardstick.ROUNDS


def test_both_lasts_a_sample(clock):
    prepared = []

    def prepare(n):
        prepared.append(n)
        return lambda: calls.append(n) or n * 1e-6

    calls = []
    steps, run = yardstick.last_a_sample(prepare)
    assert prepared == [16, 128, 401]  # at most eight times as many at once
    assert calls == [16] * 6 + [128] * 6 + [401] * 6  # a first call and the fastest of five
    assert (steps, run()) == (401, 401e-6)
    assert yardstick.last_a_sample(lambda n: lambda: n * 2.4e-5)[0] == 16
    assert yardstick.last_a_sample(lambda n: lambda: 0.0)[0] == 2**22  # 16 times a power of 8: the first not below 2^20
    assert yardstick.last_a_sample(lambda n: lambda: 0.9 * yardstick.SAMPLE)[0] == 16
    assert yardstick.last_a_sample(lambda n: lambda: n * 2e-5)[0] == 20


def test_the_ratio_is_of_a_step_to_a_turn(clock, monkeypatch):
    monkeypatch.setattr(yardstick, "compile_reference", lambda: lambda n, h: n * 2e-8 * (1.0 if h == 1e-3 else 9.0))
    made = []

    def prepare(scene, grid):
        assert grid.n_steps == grid.every
        assert grid.dt == 0.5
        made.append(grid.n_steps)
        slower = 1.0 if made.count(made[-1]) == 3 else 1.1  # one place in memory is better than the others
        return lambda: grid.n_steps * 1e-7 * slower

    ratio = yardstick.time_ratio(SimpleNamespace(prepare=prepare), None, 0.5)
    assert made.count(made[-1]) == yardstick.PREPARATIONS
    assert ratio == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("ratio", "limit", "repeats", "expected", "left"),
    [
        (2.0, 2.0, [], 2.0, 0),
        (3.0, 2.0, [2.5, 2.4, 2.6], 2.4, 0),
        (3.0, 2.0, [2.0, 1.0], 2.0, 1),
        (3.0, 2.0, [5.0, 4.0, 9.0, 1.0], 3.0, 1),
    ],
)
def test_what_is_too_slow_is_measured_three_times_more(monkeypatch, ratio, limit, repeats, expected, left):
    rests, rest = [], iter(repeats)
    monkeypatch.setattr(yardstick, "sleep", rests.append)
    assert yardstick.confirm(ratio, limit, lambda: next(rest)) == expected
    assert len(list(rest)) == left
    assert rests == [0.5] * (len(repeats) - left)


def test_the_definition_holds_every_constant(monkeypatch):
    before = yardstick.definition()
    assert before.startswith("def turn(n_steps")
    for name in ("SAMPLE", "ROUNDS", "MINIMUM_TOLERANCE", "STABLE_BATCHES", "PREPARATIONS"):
        with monkeypatch.context() as patch:
            patch.setattr(yardstick, name, 17)
            assert yardstick.definition() != before
    assert np.isfinite(yardstick.step_reference_body(10**3, 1e-2))
    assert math.isclose(eval(before[before.rindex("(") :])[0], 0.0004)


def test_another_process_is_asked_by_name(monkeypatch):
    asked = []

    def run(command, **options):
        asked.append((command[1:], options))
        return SimpleNamespace(stdout="1.5\n")

    monkeypatch.setattr(yardstick.subprocess, "run", run)
    assert yardstick.time_ratio_elsewhere("brick_flip", "reduced") == 1.5
    ((command, options),) = asked
    assert command == ["-m", "conservative.benchmarks.gate.yardstick", "brick_flip", "reduced"]
    assert options["text"] is options["check"] is True


def test_the_yardstick_is_compiled_once():
    assert yardstick.compile_reference.cache_parameters()["maxsize"] == 1


def test_the_constants_are_those_that_baselines_were_measured_with():
    assert yardstick.definition().endswith("(0.0004, 30, 0.002, 3, 4)")
    assert (yardstick.MOST_ROUNDS, yardstick.MOST_STEPS, yardstick.RETRIES, yardstick.PAUSE) == (300, 2**20, 3, 0.5)
