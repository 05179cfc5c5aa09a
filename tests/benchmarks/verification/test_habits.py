"""Limits, sleep, dead bands and cut-offs of small bodies: the exact motions name them, without the comparison of pairs."""

import math
import shlex
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from conservative.benchmarks.verification import programs
from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.motions.files import read
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.programs import Answers, Ran, turn_finding
from conservative.benchmarks.verification.verify import verify
from conservative.references.worker.client import close_workers
from conservative.registry import method

from ...sampling import sampled
from . import right_programs, wrong_programs

HABITS = wrong_programs.habits()
FEW = (
    "slow", "very_slow", "slow_turn", "golden_0", "huge", "fast", "fast_turn", "tiny", "tiny_turned", "half_turn",
    "orbit", "orbit_flat",
)  # fmt: skip
"""Motions at 1e-5 to 0.3 and at 150 to 1000 rad/s, of 1e-12 to 1e9 kg m^2, and one at 1 rad/s."""


@pytest.fixture(autouse=True)
def few_motions(monkeypatch, request, tmp_path):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    if not request.node.get_closest_marker("slow"):
        few = [motion for motion in load() if motion.name in FEW]
        monkeypatch.setattr(programs, "load", lambda: few)
    yield
    close_workers()


def verified(name):
    (found,) = verify([shlex.join([sys.executable, wrong_programs.__file__, name])], only=["motions"])
    return found


EACH = ("limit 500 rk2", "turn euler", "turn of the attitude rk2", "sleep 0.8 rk2", "sleep 0.001 euler", "band 1e-05 rk2")


@pytest.mark.parametrize("name", sampled(HABITS, len(EACH) + 1, keep=(*EACH, "small inertia rk2")))
def test_a_habit_is_named_by_the_motions_alone(name):
    found = verified(name)
    named = {cause.key for finding in found.findings for cause in finding.causes}
    assert found.verdict is Verdict.WRONG
    assert HABITS[name].key in named, found.reason


def answers(solve, motion):
    """Return answers with the steady turn alone, whose samples do not matter."""
    ran = Ran(motion, None, np.zeros(2), np.ones(2), 1.0)
    return Answers(solve, [ran], {}, 2, False)


def samples(R, w):
    return SimpleNamespace(t=np.arange(2.0), R_WB=R, w_WB_B=w)


def in_process(program):
    motion = read(programs.TURN)

    def solve(scene, grid):
        (q, w), *_ = program.simulate(motion, grid.dt, 1, 1)
        return samples(np.array([motion["R_WB0"], right_programs.matrix(q)]), np.array([motion["w_WB_B0"], w]))

    return solve


@pytest.fixture
def steady():
    (motion,) = (motion for motion in load() if motion.name == programs.TURN)
    return motion


@pytest.mark.parametrize("name", right_programs.right_programs())
def test_no_right_program_limits_the_turn_in_a_step(name, steady):
    """Steps of 2 and 2.5 rad: the turns of each method differ, by 0.06 rad or more."""
    assert turn_finding("a", answers(in_process(right_programs.right_programs()[name]), steady)) is None


@pytest.mark.parametrize("name", ["taylor", "reduced", "splitting", "no_squish", "gauss"])
def test_no_method_limits_the_turn_in_a_step(name, steady):
    made = method(name)
    assert turn_finding("a", answers(programs.solver(made), steady)) is None


@pytest.mark.parametrize(("name", "k"), [("turn rk2", 1), ("turn euler", 1), ("turn of the attitude euler", 0)])
def test_the_limit_is_in_the_sentence_and_the_number(name, k, steady):
    found = turn_finding("a", answers(in_process(HABITS[name]), steady))
    assert (found.verdict, found.unit) == (Verdict.WRONG, ("rad", "of the largest rate")[k])
    assert found.causes[0].numbers["turn"] == pytest.approx(math.pi / 4, rel=1e-9)
    assert "45 degrees" in found.causes[0].sentence
    assert found.error == pytest.approx((2 - math.pi / 4, 1 - math.pi / 8)[k], rel=1e-6)


def test_a_limit_of_the_rate_is_no_limit_of_the_turn(steady):
    assert turn_finding("a", answers(in_process(HABITS["limit 100 rk2"]), steady)) is None


def test_a_body_that_stands_still_has_no_limit(steady):
    def still(scene, grid):
        return samples(np.repeat(scene.R_WB0[None], 2, axis=0), np.zeros((2, 3)))

    assert turn_finding("a", answers(still, steady)) is None
