"""Programs that a test starts end with it and can be interrupted."""

import shlex
import signal
import subprocess
import sys

import psutil
import pytest

from .environments import PATIENCE, ROOT, programs, variables

SLEEP = "import time; print('ready', flush=True); time.sleep(600)"
PARENT = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print(child.pid, flush=True)
child.wait()
"""


@pytest.mark.parametrize("parent_ends", [pytest.param(False, marks=pytest.mark.slow), True])
def test_children_of_a_program_end_with_the_test(parent_ends):
    with programs() as start:
        code = PARENT.replace("child.wait()", "") if parent_ends else PARENT
        parent = start([sys.executable, "-c", code], stdout=subprocess.PIPE)
        child = psutil.Process(int(parent.stdout.readline()))
        assert not parent_ends or parent.wait(PATIENCE) == 0
        assert child.is_running()
    assert parent.returncode == (0 if parent_ends else -signal.SIGKILL)
    child.wait(PATIENCE)  # raises if it is still running


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_program_can_be_interrupted(start, number):
    process = start([sys.executable, "-c", SLEEP], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdout.readline() == b"ready\n"
    process.send_signal(number)
    assert process.wait(PATIENCE) == -number


@pytest.mark.slow
def test_a_program_can_be_interrupted_where_a_shell_ignores_signals(start):
    # A script starts background jobs with SIGINT ignored, and nohup programs with SIGHUP ignored. Children inherit both.
    inner = f"{sys.executable} -m pytest -n0 -q -k test_a_program_can_be_interrupted[ {shlex.quote(__file__)}"
    process = start(
        ["sh", "-c", f"trap '' INT HUP; exec {inner}"], cwd=ROOT, env=variables(), stdout=subprocess.PIPE, text=True
    )
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, out
    assert "2 passed" in out
