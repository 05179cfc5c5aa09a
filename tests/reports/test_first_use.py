"""The first report with an empty cache compiles its kernels in other processes, and finds them there."""

import pytest

from ..environments import run_python

TWICE = """
import conservative as cv
from conservative.kernels import moser_veselov, is_first_use
from conservative.reports.run.measure import compile_kernels
from conservative.reports.run.plan import plan_report
plan = plan_report(["brick_flip"], ["moser_veselov:order=2", "mujoco"], quick=True)
for _ in range(2):
    steps = []
    compile_kernels(plan, lambda share, what: steps.append(what))
    print(steps, is_first_use())
cv.integrate(cv.scenes.brick_flip(), 0.01, method=plan.methods[0])
print(sum(moser_veselov.enter.stats.cache_hits.values()), sum(moser_veselov.enter.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_kernels_are_compiled_once_before_the_studies(tmp_path):
    code, out, err = run_python(TWICE, NUMBA_CACHE_DIR=str(tmp_path))
    assert code == 0, err
    assert out.splitlines() == ["['compilation of kernels, for the first time: 1 of 1'] False", "[] False", "1 0"]
    assert err == "compilation of kernels, for the first time\n"


ELSEWHERE = """
import os, signal, time
from dataclasses import replace
from pathlib import Path
from threading import Thread
from conservative.methods.gauss import Gauss
from conservative.methods.moser_veselov import MoserVeselov
from conservative.reports.run.measure import compile_kernels
from conservative.reports.run.plan import plan_report
here, BEGUN = os.getpid(), Path(os.environ["NUMBA_CACHE_DIR"], "begun")
class Ends(MoserVeselov):
    def prepare(self, scene, grid):
        return os._exit(3) if os.getpid() != here else super().prepare(scene, grid)
class Sleeps(Gauss):
    def prepare(self, scene, grid):
        if os.getpid() == here: return super().prepare(scene, grid)
        BEGUN.touch()
        time.sleep(1e6)
def plan(*methods):
    made = plan_report(["brick_flip"], ["moser_veselov:order=2"], quick=True)
    return replace(made, studies=tuple(replace(study, methods=methods) for study in made.studies))
"""


ENDED = "compile_kernels(plan(Ends(order=2)), print)\n"
DURING_A_COMPILATION = """
def interrupt():
    while not BEGUN.exists(): time.sleep(0.01)
    os.kill(here, signal.SIGINT)
try: Thread(target=interrupt).start(), compile_kernels(plan(Sleeps()), print)
except KeyboardInterrupt: print("interrupted")
"""
BETWEEN_TWO = """
os.cpu_count = lambda: 1
def interrupted(share, what): raise KeyboardInterrupt
try: compile_kernels(plan(Ends(order=2), Sleeps()), interrupted)
except KeyboardInterrupt: print("interrupted")
"""


@pytest.mark.parametrize(
    ("code", "shown"),
    [
        (ENDED + DURING_A_COMPILATION, "0.0 compilation of kernels, for the first time: 1 of 1\ninterrupted\n"),
        pytest.param(BETWEEN_TWO, "interrupted\n", marks=pytest.mark.slow),
    ],
)
def test_a_process_that_ends_leaves_its_compilation_to_the_studies_and_an_interrupt_does_not_wait(code, shown, tmp_path):
    """Otherwise the process waits for the sleeping one until the time limit of this test."""
    status, out, err = run_python(ELSEWHERE + code, NUMBA_CACHE_DIR=str(tmp_path))
    assert (status, out) == (0, shown), err
