"""A share of the attack on the public API; and the attack sees what it is there to see."""

import time
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.verification import hostile_values
from conservative.benchmarks.verification.hostile_arguments import Try
from conservative.benchmarks.verification.hostile_bodies import Comparison, Search
from conservative.benchmarks.verification.hostile_calls import warm_up
from conservative.benchmarks.verification.hostile_scales import Pair
from conservative.errors import NotConserved
from conservative.method import Grid

BRICK = cv.integrate(cv.scenes.brick_flip(), 0.01, t_end=0.1)
TURNED = replace(BRICK, R_WB=np.roll(BRICK.R_WB, 1, axis=0))
FASTER = replace(BRICK, w_WB_B=(1 + 1e-12) * BRICK.w_WB_B)
ALARM = replace(BRICK, failure=NotConserved(0.1, "energy", 1.0, 0.1))


def search(found, turn=0.1):
    return Search(found, cv.Reduced(), Grid(0.01, 10), turn)


def test_a_hundred_hostile_calls_leak_nothing(tmp_path):
    warm_up()
    leaks = hostile_values.find_leaks(hostile_values.draw_tries(100, 1, tmp_path, part="arguments"))
    assert not leaks


def test_sixty_random_bodies_leak_nothing(tmp_path):
    assert not hostile_values.find_leaks(hostile_values.draw_tries(60, 1, tmp_path, part="bodies"))


def test_a_lack_of_conservation_is_an_answer_where_steps_are_long():
    assert hostile_values.find_fault(search(ALARM, turn=30.0)) == ""
    assert hostile_values.find_fault(search(BRICK)) == hostile_values.find_fault(Comparison(BRICK, BRICK, 1e-9)) == ""


def test_tries_are_those_of_their_seed(tmp_path):
    first, again, other = (
        [attempt.words for attempt in hostile_values.draw_tries(50, seed, tmp_path, part="arguments")] for seed in (1, 1, 2)
    )
    assert [words.partition(" at 0x")[0] for words in first] == [words.partition(" at 0x")[0] for words in again]
    assert first != other


FAULTS = {
    "RuntimeError": lambda: (_ for _ in ()).throw(RuntimeError("raw")),
    "RuntimeWarning": lambda: np.array([1e308]) * 10,
    "not finite": lambda: replace(BRICK, w_WB_B=np.full_like(BRICK.w_WB_B, np.nan)),
    "not orthonormal": lambda: replace(BRICK, R_WB=1.001 * BRICK.R_WB),
    "loses energy": lambda: replace(BRICK, w_WB_B=np.linspace(1, 1.1, len(BRICK))[:, None] * BRICK.w_WB_B),
    "times": lambda: replace(BRICK, t=BRICK.t[::-1]),
    "depends on units": lambda: Pair(BRICK, TURNED),
    "is not the motion": lambda: Comparison(BRICK, TURNED, 1e-3),
    "wrong ok: reduced and energy": lambda: search(FASTER),
    "reduced is not orthonormal": lambda: search(replace(BRICK, R_WB=(1 + 1e-12) * BRICK.R_WB)),
    "false alarm: reduced and energy": lambda: search(ALARM),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_seen(fault):
    assert fault in hostile_values.judge(Try("call", "", FAULTS[fault]))


def test_a_hang_is_seen(monkeypatch):
    monkeypatch.setattr(hostile_values, "SECONDS", 0.1)
    assert "hangs" in hostile_values.judge(Try("call", "", lambda: time.sleep(60)))


@pytest.mark.parametrize("error", [cv.BadInput("a", "b", "c"), cv.NotConverged(1, 0.0, 1.0)])
def test_what_is_documented_is_no_leak(error):
    def fail():
        raise error

    assert hostile_values.judge(Try("call", "", fail)) == ""
    assert hostile_values.judge(Try("call", "", lambda: BRICK)) == ""
