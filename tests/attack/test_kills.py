"""Commands and engines killed at random moments: no partial file, no running process, no lost result.

Python itself handles Ctrl-C in the first moments of a process, with a traceback. Such tries only have to end.
"""

import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time

import psutil
import pytest

from conservative import registry
from conservative.benchmarks.studies.case import Case, attempt
from conservative.grid import grid_for
from conservative.outcome import Outcome
from conservative.references.environments.environment import worker_of

from ..environments import ROOT, programs, variables
from ..references.conftest import trial_cache, trial_home, trial_registered  # noqa: F401
from ..references.trial_engine import Trial
from .effort import SEED, count

pytestmark = pytest.mark.attack
HANG, PATIENCE = 1800, 1800  # s after which a command hangs for sure, without and after a signal
REPORT = ["report", "--quick", "--scenes", "brick_flip", "--methods", "moser_veselov:order=2"]
TIMES = ("s", "s/s")  # units of rows whose values differ from one run to the next
SAME = ("study", "scene", "method", "label", "role", "dt", "quantity", "measure", "unit", "outcome")
ENDLESS = {
    "compiled code": ["run", "brick_flip", "--dt", "6e-9", "--t-end", "60", "--csv", "samples.csv"],
    "many bodies": ["sweep", "brick_flip", "--spread", "rate=1%", "--starts", "1e5", "--t-end", "600", "--out", "s.zarr"],
    "a report": REPORT,
}


def end_at(moment, number, arguments, folder):
    """Run a command in a folder; send it a signal at a moment, s, if it has not ended; return its exit code and stderr."""
    with programs() as popen:
        environment = variables(PYTHONPATH=str(ROOT))
        command = [sys.executable, "-m", "conservative", *arguments]
        process = popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        children = []
        try:
            _, err = process.communicate(timeout=moment)
        except subprocess.TimeoutExpired:
            children = psutil.Process(process.pid).children(recursive=True)
            process.send_signal(number)
            _, err = process.communicate(timeout=PATIENCE)
        finally:
            going_on = psutil.wait_procs(children, timeout=PATIENCE)[1]
            for child in going_on:
                child.kill()
        assert not going_on
        return process.returncode, err


def temporaries(folder):
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("command", ENDLESS)
def test_ctrl_c_at_any_moment(command, tmp_path):
    draw = random.Random(SEED)
    for number in range(count(4)):
        folder, moment = tmp_path / str(number), draw.uniform(0, 2 if number % 2 == 0 else 10)
        folder.mkdir()
        code, err = end_at(moment, signal.SIGINT, ENDLESS[command], folder)
        assert temporaries(folder) == [], moment
        if code == 0 and command == "a report":
            continue  # it ended before
        if code == -signal.SIGINT and "in launch" not in err:
            continue  # Python was starting
        said = [line for line in err.splitlines() if line.startswith("Interrupted")]
        assert (code, len(said), "Traceback" in err) == (130, 1, False), (moment, err)


def rows(folder):
    """Return the rows of a report without what a time changes."""
    with (folder / "report" / "measurements.csv").open(encoding="utf-8", newline="") as stream:
        found = list(csv.DictReader(stream))
    return [{name: row[name] for name in (SAME if row["unit"] in TIMES else row)} for row in found]


def check_whole(folder, expected):
    assert rows(folder) == expected
    assert [path.name for path in folder.iterdir()] == ["report"]
    listed = json.loads((folder / "report" / "measurements.json").read_text(encoding="utf-8"))["files"]
    assert sorted(path.name for path in (folder / "report").iterdir()) == sorted(listed)


def run_alone(report, folder):
    """Return the rows of a report that is left alone, and the time that it takes, s, with all code compiled."""
    for _ in range(2):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        start = time.monotonic()
        code, err = end_at(HANG, signal.SIGKILL, report, folder)
        assert code == 0, err
    return rows(folder), time.monotonic() - start


def test_a_report_killed_at_random_moments_is_resumed_to_the_same_rows(tmp_path):
    draw, killed, folder = random.Random(SEED), 0, tmp_path / "killed"
    expected, span = run_alone(REPORT, tmp_path / "alone")
    check_whole(tmp_path / "alone", expected)
    folder.mkdir()
    while True:
        partial = folder / "report.partial.json"
        number = draw.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP))
        moment = HANG if killed == count(6) else draw.uniform(0, 1.2 * span)
        code, err = end_at(moment, number, [*REPORT, *(["--resume"] if partial.exists() else [])], folder)
        if code == 0:
            check_whole(folder, expected)
            if killed == count(6):
                return
            shutil.rmtree(folder / "report")
            continue
        killed += 1
        assert code in (-number, 128 + number), err
        assert number == signal.SIGKILL or temporaries(folder) == []
        if partial.exists():
            json.loads(partial.read_text(encoding="utf-8"))


def run_all(cases, after=1e6, kill=lambda: None):
    """Return the results of all cases, while something happens after a time, s."""
    timer = threading.Timer(after, kill)
    timer.start()
    try:
        return [attempt(case) for case in cases]
    finally:
        timer.cancel()
        timer.join()


@pytest.mark.usefixtures("trial_cache", "trial_registered")
def test_a_worker_killed_at_random_moments_costs_one_run():
    method, draw = registry.method("trial@1.0"), random.Random(SEED)
    scenes = [registry.scene(name) for name in ("brick_flip", "turned_brick", "separatrix", "stable_spin")]
    cases = [Case("kills", scene, method, grid_for(scene, 0.01, min(scene.t_end, 20.0))) for scene in scenes]
    run_all(cases)
    start = time.monotonic()
    expected = run_all(cases)
    span = time.monotonic() - start
    process = worker_of(method.environment)
    for _ in range(count(20)):
        found = run_all(cases, draw.uniform(0, span), lambda: process.pid and os.kill(process.pid, signal.SIGKILL))
        assert len(check_results(expected, found)) <= 1


def check_results(expected, found):
    """Return the crashes; every other result is the expected one, bit for bit."""
    assert len(found) == len(expected)
    crashes = [each for each in found if isinstance(each, Outcome)]
    assert all(crash.reason.startswith("signal 9") for crash in crashes)
    for before, after in zip(expected, found, strict=True):
        assert isinstance(after, Outcome) or (after.trajectory.R_WB == before.trajectory.R_WB).all()
    return crashes


@pytest.mark.usefixtures("trial_cache", "trial_registered")
def test_another_result_is_found():
    scenes = [registry.scene(name) for name in ("brick_flip", "turned_brick")]
    one, other = (attempt(Case("kills", scene, Trial(), grid_for(scene, 0.01, 0.5))) for scene in scenes)
    assert check_results([one], [one]) == []
    with pytest.raises(AssertionError):
        check_results([one], [other])
