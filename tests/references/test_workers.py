"""An engine in another process: its results, and its failures, which become outcomes."""

import multiprocessing
import pickle
import sys
import threading
import time
from contextlib import nullcontext
from itertools import product

import numpy as np
import psutil
import pytest

import conservative as cv
from conservative import registry
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.measures.timing import time_interleaved
from conservative.benchmarks.studies import studies, study
from conservative.benchmarks.studies.case import Case
from conservative.benchmarks.studies.study import Study
from conservative.benchmarks.studies.time_limit import attempt_here, attempt_within
from conservative.errors import MissingEngine, Unsupported
from conservative.grid import grid_for
from conservative.outcome import OutcomeKind
from conservative.references.environments import environment, folders
from conservative.references.environments.environment import worker_of
from conservative.references.worker import client
from conservative.references.worker.client import EngineCrashed, Worker, time_limit

from ..declared import NAMED
from ..environments import PATIENCE, run_python, wait_until
from ..sampling import sampled
from . import trial
from .trial_engine import Trial

SCENE = cv.scenes.brick_flip(t_end=0.5)
DT = 0.01


@pytest.fixture(autouse=True)
def folder(trial_cache):
    """Return the folder of all environments."""
    return trial_cache


def run(do, at="run", limit=PATIENCE):
    with time_limit(limit):
        return cv.integrate(SCENE, DT, method=Trial(do, at), on_failure="return")


def test_a_trajectory_is_in_body_axes():
    truth = cv.integrate(SCENE, DT, method=registry.method("exact"))
    trajectory = run("integrate")
    assert trajectory.ok
    assert trajectory.label == "trial==1.0/integrate"
    assert np.abs(trajectory.R_WB - truth.R_WB).max() < 1e-6
    assert np.abs(trajectory.w_WB_B - truth.w_WB_B).max() < 1e-5
    assert (trajectory.counters.steps, trajectory.counters.evaluations) == (50, 200)


def test_samples_are_those_of_the_grid():
    every = cv.integrate(SCENE, DT, method=Trial(), sample_every=7)
    assert np.array_equal(every.R_WB, run("integrate").R_WB[[0, 7, 14, 21, 28, 35, 42, 49, 50]])


CRASHES = {
    "segfault": "signal 11 (SIGSEGV)",
    "abort": "signal 6 (SIGABRT)",
    "exit": "exit code 3",
    "sys_exit": "SystemExit",
    "raise": "KeyError: 'no such key'",
    "babble": "an answer that cannot be read",
    "import": "signal 11 (SIGSEGV)",
    "shape": "it returned attitudes (50, 4)",
}


AT = {do: ("run",) if do == "shape" else ("prepare", "run") for do in CRASHES}


@pytest.mark.parametrize(("do", "at"), sampled([(do, at) for do in CRASHES for at in AT[do]], len(CRASHES)))
def test_a_crash_is_an_outcome_and_the_next_run_succeeds(do, at):
    before = run("integrate")
    trajectory = run(do, at)
    assert trajectory.outcome.kind is OutcomeKind.CRASHED
    assert trajectory.outcome.reason.startswith(CRASHES[do])
    assert len(trajectory) == 0
    assert np.array_equal(run("integrate").R_WB, before.R_WB)


@pytest.mark.parametrize("do", sampled(["spin", "hang", "lock"], 1))
def test_an_engine_that_hangs_is_ended_after_its_limit(do):
    trajectory = run(do, limit=0.2)
    assert str(trajectory.outcome) == "timeout (after 0.2 s)"
    assert run("integrate").ok


def test_output_of_an_engine_is_discarded(capfd):
    assert run("print").ok
    assert run("print", "prepare").ok
    assert capfd.readouterr() == ("", "")


def test_a_flood_of_output_ends_at_a_limit(folder):
    run("flood")
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink()]
    assert max(sizes) <= client.LARGEST_FILE


def test_the_memory_of_an_engine_is_limited(folder):
    place = environment.read_environment(folder / "trial" / "1.0")
    small = place.start_worker(memory=1 << 29)
    given = {"adapter": trial.__file__, "settings": {"at": "prepare", "do": "allocate"}}
    with pytest.raises(EngineCrashed, match=r"MemoryError|signal 9"):
        small.ask("prepare", **given)
    small.close()


def test_files_of_an_engine_are_removed(folder):
    before = {*folders.temporary_folder().iterdir()}  # of processes that other tests ended
    assert run("leave").ok
    client.close_workers()
    assert not list(folder.rglob("left_behind"))
    assert {*folders.temporary_folder().iterdir()} <= before


def test_a_run_survives_the_crash_of_another():
    grid = grid_for(SCENE, DT)
    whole = Trial().prepare(SCENE, grid)
    before = whole()
    assert not Trial("segfault").prepare(SCENE, grid)().ok
    assert np.array_equal(whole().R_WB, before.R_WB)  # prepared before the crash, and prepared again without being asked


def test_a_refusal_is_unsupported():
    with pytest.raises(Unsupported, match="this version turns no bodies"):
        Trial("refuse", "prepare").prepare(SCENE, grid_for(SCENE, DT))


def test_a_process_that_is_killed_while_it_runs_is_a_crash():
    run("integrate")
    assert str(run("kill").outcome) == "crashed (signal 9 (SIGKILL))"
    assert run("integrate").ok


def test_wall_time_grows_with_the_number_of_calls():
    timed = Trial("rest").prepare(SCENE, grid_for(SCENE, DT))  # for 0.05 s in each call
    assert timed.wall_time(1) >= 0.05
    assert timed.wall_time(4) >= 0.2


def test_renewing_a_run_is_not_measured():
    renewed = Trial("renew").prepare(SCENE, grid_for(SCENE, SCENE.t_end))
    start = time.perf_counter()
    measured = renewed.wall_time(2)
    assert time.perf_counter() - start - measured >= 0.4  # twice 0.2 s


def test_the_loop_is_measured_instead_of_the_run():
    slow = Trial("loop").prepare(SCENE, grid_for(SCENE, SCENE.t_end))
    assert slow.own_loop.wall_time(2) >= 0.2  # of its loop; the run itself takes a millisecond
    assert slow().ok


def test_runs_in_threads_do_not_mix():
    scenes = [cv.scenes.brick_flip(t_end=end) for end in (0.1, 0.2, 0.3, 0.4)]
    lengths = {}
    jobs = [threading.Thread(target=lambda s=s: lengths.update({s.t_end: len(Trial().run(s, DT))})) for s in scenes]
    for job in jobs:
        job.start()
    for job in jobs:
        job.join()
    assert lengths == {0.1: 11, 0.2: 21, 0.3: 31, 0.4: 41}


def _in_child(queue):
    queue.put((worker_of(Trial().environment).pid, len(run("integrate"))))


def test_a_forked_process_has_a_worker_of_its_own():
    run("integrate")
    mine = worker_of(Trial().environment)
    starts = mine.starts
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_in_child, args=(queue,))
    child.start()
    assert queue.get(timeout=PATIENCE) == (None, 51)
    child.join(PATIENCE)
    assert run("integrate").ok
    assert mine.starts == starts


def test_a_worker_ends_with_its_parent(folder):
    code = (
        "import os, sys, threading, time\n"
        "from conservative.references.environments.environment import find_environment\n"
        "worker = find_environment('trial').start_worker()\n"
        f"given = dict(adapter={trial.__file__!r}, settings=dict(at='prepare', do='spin'))\n"
        "worker.ask('check', module='os')\n"
        "threading.Thread(target=worker.ask, args=('prepare',), kwargs=given, daemon=True).start()\n"
        "time.sleep(0.5); print(worker.pid, flush=True); os._exit(0)\n"
    )
    status, out, errors = run_python(code)
    assert status == 0 or not errors, errors
    wait_for_end(int(out))


def wait_for_end(process):
    """Wait until a process of another parent has ended."""

    def ended():
        try:
            return psutil.Process(process).status() == psutil.STATUS_ZOMBIE
        except psutil.NoSuchProcess:
            return True

    wait_until(ended)


@pytest.fixture
def first_preparation_is_lost(monkeypatch):
    """Let the first preparation fail as if the process were killed."""
    lost, ask = [], Worker.ask

    def ask_once_in_vain(self, do, **values):
        if do == "prepare" and not lost:
            lost.append(do)
            raise EngineCrashed("signal 9 (SIGKILL)")
        return ask(self, do, **values)

    monkeypatch.setattr(Worker, "ask", ask_once_in_vain)


def test_a_kill_in_a_preparation_is_an_outcome(trial_cache, first_preparation_is_lost):
    killed = cv.integrate(SCENE, 0.01, Trial(), on_failure="return")
    assert (killed.outcome.kind, killed.outcome.reason) == (OutcomeKind.CRASHED, "signal 9 (SIGKILL)")
    assert cv.integrate(SCENE, 0.01, Trial()).ok


TIMED = tuple(name for name in NAMED if studies.STUDIES[name].timed)
ENDS = {
    "segfault": OutcomeKind.CRASHED,
    "hang": OutcomeKind.TIMEOUT,
    "shape": OutcomeKind.CRASHED,
    "diverge": OutcomeKind.DIVERGED,
}


@pytest.fixture
def short_limits(monkeypatch):
    """Limits that only the engine that hangs can reach: the others have all the time that a busy machine needs."""
    monkeypatch.setattr(study, "HANG_LIMIT", 2.0)
    monkeypatch.setattr(study, "ENGINE_LIMIT", 2.0)
    prepared, ask = {}, Worker.ask

    def ask_within(self, do, **values):
        prepared[self] = values["settings"] if do == "prepare" else prepared.get(self, {})
        with nullcontext() if prepared[self].get("do") == "hang" else time_limit(PATIENCE):
            return ask(self, do, **values)

    monkeypatch.setattr(Worker, "ask", ask_within)


def rows(name, *methods):
    return list(studies.rows(Study(name, (SCENE.rename(SCENE.name),), methods, quick=True, time_limit=0.05)))


@pytest.mark.usefixtures("short_limits")
@pytest.mark.parametrize(("name", "do"), sampled(product(TIMED, ENDS), 2))
def test_a_crash_or_a_hang_is_a_row(name, do):
    table = rows(name, Trial(do), registry.method("pinocchio"), Trial())
    measured = [row for row in table if row.measure in (Measure.ATTITUDE_MAX, Measure.TIME)]
    wrong = [row for row in measured if row.method == Trial(do).name]
    assert wrong[0].outcome.kind is ENDS[do]
    assert not any(row.outcome.ok for row in wrong)
    for method in ("pinocchio", Trial().name):
        assert any(row.measure is Measure.TIME and row.outcome.ok and row.value > 0 for row in measured if row.method == method)


def test_an_engine_in_its_environment_has_time_to_compile():
    planned = Study("speed", (SCENE,), (Trial(),))
    assert [planned.limit_of(method) for method in (Trial(), registry.method("pinocchio"))] == [180.0, 60.0]


def test_a_run_that_crashes_while_it_is_timed_is_marked():
    runs = {do: Trial(do).prepare(SCENE, grid_for(SCENE, 0.01)) for do in ("integrate", "abort")}
    timings = time_interleaved(runs, rounds=3, min_time=1e-3)
    assert timings["integrate"].outcome.ok
    assert timings["integrate"].minimum > 0
    assert timings["abort"].outcome.kind is OutcomeKind.CRASHED
    assert timings["abort"].minimum != timings["abort"].minimum


@pytest.mark.usefixtures("trial_registered")
@pytest.mark.parametrize("within", [attempt_here, attempt_within])
def test_the_limit_of_a_study_ends_an_engine_that_hangs(within):
    case = Case("test", SCENE.rename(SCENE.name), Trial("hang"), grid_for(SCENE, 0.01))
    assert str(within(0.2, case)) == "timeout (after 0.2 s)"
    assert within(0.2, case).reason == "a run of 50 steps was ended after 0.2 s"  # not tried again


@pytest.mark.usefixtures("trial_registered")
def test_a_name_with_a_version_is_read_back():
    for text in ("trial", "trial:segfault", "trial@1.0", "trial@1.0:do=print,at=prepare"):
        method = registry.method(text)
        assert registry.method(method.name) == method
        assert pickle.loads(pickle.dumps(method)) == method
    assert registry.method("trial@1.0").label == "trial==1.0/integrate"


@pytest.mark.usefixtures("trial_registered")
def test_a_version_that_is_not_installed_is_missing():
    with pytest.raises(
        MissingEngine, match=r"^trial@2.0 is not installed \(installed: 1.0.*\. Run: conservative engines install trial@2.0"
    ):
        registry.method("trial@2.0")


@pytest.mark.usefixtures("trial_registered")
def test_an_unknown_name_names_the_nearest():
    with pytest.raises(cv.BadInput, match="'trial' \\(nearest\\)"):
        registry.method("trail:segfault")
    with pytest.raises(cv.BadInput, match=r"got 'reduced@1\.0'; expected 'reduced' without a version, or an engine: "):
        registry.method("reduced@1.0")


@pytest.mark.parametrize("how", sampled(["close", "crash", "kill"], leave=["crash"]))
def test_what_a_program_has_forked_ends_with_it(how, tmp_path):
    code = """
import json, os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(300)"])
for line in sys.stdin:
    if json.loads(line)["do"] == "crash": sys.exit(3)
    print(json.dumps(dict(protocol=1, program="p", version="1", framing="lines", child=child.pid)), flush=True)
"""
    worker = Worker([sys.executable, "-c", code])
    child = worker.greet()["child"]
    if how == "close":
        worker.close()
    elif how == "crash":
        with pytest.raises(EngineCrashed, match="exit code 3"):
            worker.ask("crash")
    else:
        client.kill_workers()
    wait_for_end(child)
    worker.close()


@pytest.mark.skipif(sys.platform != "linux", reason="no other system has a life line")
def test_what_an_engine_has_forked_ends_when_the_client_is_killed(tmp_path):
    (tmp_path / "adapter.py").write_text("""
import subprocess, sys
def fork(): return {"child": subprocess.Popen([sys.executable, "-c", "import time; time.sleep(300)"], close_fds=False).pid}
def spin():
    while True: pass
""")
    code = f"""
import os, sys, threading, time
from conservative.references.worker import program
from conservative.references.worker.client import Worker
worker, adapter = Worker([sys.executable, program.__file__]), {str(tmp_path / "adapter.py")!r}
print(worker.ask("call", adapter=adapter, function="fork")["child"], flush=True)
threading.Thread(target=worker.ask, args=("call",), kwargs=dict(adapter=adapter, function="spin"), daemon=True).start()
time.sleep(0.5); os._exit(0)
"""
    status, out, errors = run_python(code)
    assert status == 0, errors
    wait_for_end(int(out))
