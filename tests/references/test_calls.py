"""Functions with a time limit: after the limit their process is ended, and no process remains."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest

import conservative as cv
from conservative.pickling import NotTransferable, dump, load
from conservative.references.worker import client
from conservative.references.worker.calls import run_within
from conservative.references.worker.client import EngineCrashed, EngineTimeout, close_workers
from conservative.references.worker.program import MAGIC, PREFIX

from ..environments import PATIENCE, run_python, wait_until
from ..sampling import sampled


def hang():
    while True:
        pass


@pytest.fixture
def no_process_before():
    close_workers()


@pytest.fixture(scope="module", autouse=True)
def no_process_of_other_tests():
    close_workers()
    yield
    close_workers()


def children():
    return psutil.Process().children(recursive=True)


@pytest.mark.usefixtures("no_process_before")
@pytest.mark.parametrize("work", [hang, lambda: ctypes.PyDLL(None).sleep(600)])  # PyDLL does not release the interpreter
def test_work_beyond_its_limit_is_ended_and_no_process_remains(work):
    before = threading.enumerate()
    with pytest.raises(EngineTimeout, match=r"did not answer within 0\.2 s"):
        run_within(0.2, work)
    assert threading.enumerate() == before
    assert children() == []


ENDS = [
    (lambda: ctypes.string_at(0), "signal 11 (SIGSEGV)"),
    pytest.param(os.abort, "signal 6 (SIGABRT)", marks=pytest.mark.slow),
    pytest.param(lambda: os.kill(os.getpid(), signal.SIGKILL), "signal 9 (SIGKILL)", marks=pytest.mark.slow),  # no memory left
    (lambda: os._exit(3), "exit code 3"),
]


@pytest.mark.usefixtures("no_process_before")
@pytest.mark.parametrize(("work", "description"), ENDS)
def test_the_end_of_its_process_is_described(work, description):
    with pytest.raises(EngineCrashed) as caught:
        run_within(PATIENCE, work)
    assert caught.value.reason == description
    assert children() == []
    assert run_within(PATIENCE, lambda: 3) == 3


def close_all():
    os.closerange(3, 256)
    time.sleep(600)


def answer_by_half():
    """Write the prefix of an answer, and less than it announces."""
    for descriptor in range(3, 256):
        with contextlib.suppress(OSError):
            os.write(descriptor, PREFIX.pack(MAGIC, 100, 0) + b"half")
    os._exit(4)


@pytest.mark.usefixtures("no_process_before")
@pytest.mark.parametrize(
    ("work", "patience", "description"), [(close_all, 0.2, "signal 9"), (answer_by_half, PATIENCE, "exit code 4")]
)
def test_a_process_with_an_incomplete_answer_is_ended(work, patience, description, monkeypatch):
    monkeypatch.setattr(client, "_PATIENCE", patience)
    with pytest.raises(EngineCrashed, match=description):
        run_within(PATIENCE, work)
    assert children() == []


def test_a_limit_may_be_any_number():
    assert run_within(1e100, int) == 0


def test_results_and_exceptions_are_returned():
    local = {"factor": 7}
    assert run_within(PATIENCE, lambda: 6 * local["factor"]) == 42
    with pytest.raises(ZeroDivisionError):
        run_within(PATIENCE, lambda: 1 // 0)

    def refuse():
        raise cv.BadInput("dt", 0, "above 0")

    with pytest.raises(cv.BadInput) as caught:
        run_within(PATIENCE, refuse)
    assert (caught.value.argument, caught.value.got, caught.value.allowed) == ("dt", 0, "above 0")


@pytest.mark.usefixtures("no_process_before")
def test_one_process_does_one_piece_of_work_after_the_other():
    assert run_within(PATIENCE, os.getpid) == run_within(PATIENCE, os.getpid) != os.getpid()
    (process,) = children()
    close_workers()
    assert not process.is_running()


def test_it_runs_in_the_current_working_directory(tmp_path, monkeypatch):
    run_within(PATIENCE, int)
    monkeypatch.chdir(tmp_path)
    assert run_within(PATIENCE, os.getcwd) == str(tmp_path)
    tmp_path.rmdir()
    assert run_within(PATIENCE, int) == 0


def test_threads_have_processes_of_their_own():
    results = []
    threads = [
        threading.Thread(target=lambda k=k: results.append(run_within(PATIENCE, lambda: (time.sleep(0.2), k)[1])))
        for k in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(results) == [0, 1, 2]


@pytest.mark.usefixtures("no_process_before")
def test_an_interrupt_ends_the_work(tmp_path):
    begun = tmp_path / "begun"

    def interrupt():
        wait_until(begun.exists)
        os.kill(os.getpid(), signal.SIGINT)

    sender = threading.Thread(target=interrupt)
    sender.start()
    with pytest.raises(KeyboardInterrupt):
        run_within(PATIENCE, lambda: (begun.touch(), hang()))
    sender.join()
    assert children() == []


def test_objects_that_cannot_be_sent_are_refused():
    lock = threading.Lock()
    with pytest.raises(NotTransferable, match="lock"):
        run_within(PATIENCE, lambda: lock)
    with pytest.raises(NotTransferable, match="lock"):
        run_within(PATIENCE, lambda: __import__("threading").Lock())
    assert run_within(PATIENCE, lambda: 3) == 3


def test_shared_objects_keep_their_identity():
    scene = cv.scenes.brick_flip()
    again, renamed = run_within(PATIENCE, lambda: (scene, scene.rename("other")), (scene,))
    assert again is scene
    assert renamed.body is not scene.body
    assert np.array_equal(renamed.body.inertia, scene.body.inertia)


def test_frozen_values_stay_frozen_and_are_sent_without_caches():
    scene = cv.scenes.brick_flip()
    assert scene.energy_scale
    scene.derive(lambda scene: threading.Lock())
    copy = load(dump(scene))
    assert "_derivations" not in vars(copy)
    assert not copy.R_WB0.flags.writeable
    assert copy.R_WB0.flags.c_contiguous == scene.R_WB0.flags.c_contiguous
    assert copy.energy_scale == scene.energy_scale


def test_a_module_that_the_process_cannot_import_is_sent(tmp_path, monkeypatch):
    (tmp_path / "beside_the_script.py").write_text(
        "import math\n\ndef double(x):\n    return _twice(x) + math.floor(0.5)\n\ndef _twice(x):\n    return 2 * x\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import beside_the_script

    double = beside_the_script.double
    monkeypatch.undo()
    assert run_within(PATIENCE, lambda: double(21)) == 42
    del sys.modules["beside_the_script"]


SCRIPT = """
import threading
from conservative.references.worker.calls import run_within
from conservative.references.worker.client import EngineTimeout

print("main module")

class Local:
    def answer(self):
        return 42

print(run_within(1800, lambda: Local().answer()))
try:
    run_within(0.2, lambda: [None for _ in iter(int, 1)])
except EngineTimeout as late:
    print(late.outcome)
"""


def test_a_script_needs_no_guard_of_its_main_module(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    code, out, error = run_python(
        "import runpy, sys; runpy.run_path(sys.argv[1], run_name='__main__')", str(tmp_path / "script.py")
    )
    assert (code, error) == (0, "")
    assert out.splitlines() == ["main module", "42", "timeout (after 0.2 s)"]


ORPHAN = """
import sys, threading, time
from conservative.references.worker.calls import _idle, run_within
run_within(1800, int)
number = _idle[0].pid
if sys.argv[1] == "busy":
    run_within(1800, lambda: (print(number, flush=True), [None for _ in iter(int, 1)]))
print(number, flush=True)
time.sleep(1800)
"""


@pytest.mark.parametrize("how", sampled(["busy", "idle"], 1))
def test_the_process_does_not_outlive_a_parent_that_is_killed(how, start):
    parent = start([sys.executable, "-c", ORPHAN, how], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    process = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    gone, _ = psutil.wait_procs([process], timeout=PATIENCE)
    assert gone == [process]
