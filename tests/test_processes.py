"""Nothing that a test starts outlives it, and what it starts can be interrupted."""

import shlex
import signal
import subprocess
import sys

import psutil
import pytest

from .environments import ROOT, programs, variables

SLEEP = "import time; print('ready', flush=True); time.sleep(600)"
PARENT = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print(child.pid, flush=True)
child.wait()
"""


def test_children_of_a_program_end_with_it():
    with programs() as start:
        parent = start([sys.executable, "-c", PARENT], stdout=subprocess.PIPE)
        child = psutil.Process(int(parent.stdout.readline()))
        assert child.is_running()
    assert parent.returncode == -signal.SIGKILL
    child.wait(60)  # raises if it is still running


def test_a_child_that_outlives_its_parent_ends_with_the_test():
    with programs() as start:
        parent = start([sys.executable, "-c", PARENT.replace("child.wait()", "")], stdout=subprocess.PIPE)
        child = psutil.Process(int(parent.stdout.readline()))
        assert parent.wait(60) == 0
        assert child.is_running()
    child.wait(60)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_program_can_be_interrupted(start, number):
    process = start([sys.executable, "-c", SLEEP], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdout.readline() == b"ready\n"
    process.send_signal(number)
    assert process.wait(60) == -number


@pytest.mark.slow
def test_a_program_can_be_interrupted_where_a_shell_ignores_signals(start):
    # A script starts background jobs with SIGINT ignored, nohup with SIGHUP ignored; both are inherited.
    inner = f"{sys.executable} -m pytest -n0 -q -k test_a_program_can_be_interrupted[ {shlex.quote(__file__)}"
    process = start(
        ["sh", "-c", f"trap '' INT HUP; exec {inner}"], cwd=ROOT, env=variables(), stdout=subprocess.PIPE, text=True
    )
    out, _ = process.communicate(timeout=300)
    assert process.returncode == 0, out
    assert "2 passed" in out
