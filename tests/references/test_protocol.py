"""PROTOCOL.md: programs in other languages are engines, and their wrong answers are outcomes."""

import json
import math
import re
import shutil
import sys
from itertools import count
from pathlib import Path

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between
from conservative.grid import grid_for
from conservative.outcome import OutcomeKind
from conservative.references.engine import principal_axes
from conservative.references.environments import engine_method
from conservative.references.environments.engine_method import WorkerRun
from conservative.references.environments.plain_numbers import describe, describe_many, read_many, read_one
from conservative.references.worker import program
from conservative.references.worker.calls import python_worker
from conservative.references.worker.client import EngineCrashed, EngineTimeout, Worker

PROGRAMS = Path(__file__).parent / "programs"
NO_NODE = pytest.mark.skipif(not shutil.which("node"), reason="needs node")
COMMANDS = [
    pytest.param((sys.executable, "-I", PROGRAMS / "engine.py"), id="python"),
    pytest.param(("node", PROGRAMS / "engine.js"), id="javascript", marks=NO_NODE),
]
BRICK = cv.scenes.brick_flip(t_end=1.0)


@pytest.fixture
def start():
    """Yield a function that starts a worker from a command line. The worker ends with the test."""
    workers = []

    def start_worker(*command, **options):
        workers.append(Worker(command, **options))
        return workers[-1]

    yield start_worker
    for worker in workers:
        worker.close()


def run_of(worker, dt, scene=BRICK, **settings):
    grid, axes = grid_for(scene, dt), principal_axes(scene)
    return WorkerRun(worker, {"adapter": "", "settings": settings, **describe(axes, grid)}, read_one(axes, grid, "theirs"))


def test_a_run_of_a_process_that_ended_is_not_forgotten_in_the_next(start):
    """Both have the number 1, and the program frees it when it is told to."""
    worker = start(sys.executable, "-I", PROGRAMS / "engine.py")
    old, new = (run_of(worker, 0.1) for _ in range(2))
    assert old().ok
    worker.close()
    assert new().ok
    del old
    assert new().ok
    assert worker.ask("list")["runs"] == [1]


def test_the_time_of_a_call_has_the_conversion_of_its_states(start, monkeypatch):
    """The clock here goes on by 2 s at each look."""
    run = run_of(start(sys.executable, "-I", PROGRAMS / "engine.py"), 0.1)
    monkeypatch.setattr(engine_method, "perf_counter_ns", count(0, 2 * 10**9).__next__)
    assert run.own_loop.wall_time(1) < 1 < 2 <= run.wall_time(1)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_program_without_any_package_is_an_engine(command, start):
    """Compare RK4 in another process with the closed form. A wrong unit, frame or order of numbers would show here."""
    truth = cv.integrate(BRICK, 0.01, registry.method("exact"))
    errors = []
    for dt in (0.01, 0.005):
        run = run_of(start(*command), dt)
        trajectory = run()
        assert trajectory.ok
        assert trajectory.counters.evaluations == 4 * round(1 / dt)
        assert run.wall_time(2) > 0
        errors.append(float(angle_between(trajectory.R_WB[-1], truth.R_WB[-1])))
    assert errors[0] < 1e-6  # measured 1.4e-7
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.2)


@pytest.mark.parametrize("command", COMMANDS)
def test_errors_and_unsupported_scenes_are_reported(command, start):
    worker = start(*command)
    with pytest.raises(NotImplementedError, match="only free bodies"):
        run_of(worker, 0.01, cv.scenes.lagrange_top()).prepare()
    with pytest.raises(EngineCrashed, match="Error: "):
        worker.ask("run", run=7)
    assert run_of(worker, 0.01)().ok


def test_a_measured_time_is_that_of_the_program_alone(start):
    """The exchange of messages takes time as well."""
    code = (PROGRAMS / "engine.py").read_text().replace("time.perf_counter() - start", "0.0")
    assert run_of(start(sys.executable, "-I", "-c", code), 0.01).own_loop.wall_time(3) == 0


def test_numbers_that_are_not_finite_travel(start):
    trajectory = run_of(start(*COMMANDS[0].values[0]), 0.01, lose_samples=True)()
    assert trajectory.outcome.kind is OutcomeKind.DIVERGED
    assert len(trajectory) == 50


def test_a_run_without_references_is_forgotten(start):
    worker = start(*COMMANDS[0].values[0])
    runs = [run_of(worker, dt) for dt in (0.01, 0.02)]
    for run in runs:
        run.prepare()
    assert worker.ask("list")["runs"] == [1, 2]
    del run, runs[0]
    assert worker.ask("list")["runs"] == [2]


SILENT = "import time; time.sleep(600)"
WRONG = {
    "print('Welcome to my engine 2.1')": "an answer that cannot be read from .*python.*, which should speak version 1",
    'print(\'{"protocol": 2, "framing": "lines"}\')': "which should speak version 1 of the protocol",
    "print('[1, 2]')": "an answer that cannot be read",
    "raise SystemExit('no licence found')": "exit code 1: no licence found",
}


@pytest.mark.parametrize("code", WRONG)
def test_a_program_that_does_not_speak_the_protocol_is_named(code, start):
    with pytest.raises(EngineCrashed, match=WRONG[code]):
        start(sys.executable, "-c", code).ask("check")


def test_the_failure_of_a_program_is_that_of_its_trajectory_and_of_a_run_of_many_bodies(start):
    worker = start(sys.executable, "-c", "raise SystemExit('no licence found')")
    trajectory = run_of(worker, 0.01)()
    assert (trajectory.outcome.kind, len(trajectory)) == (OutcomeKind.CRASHED, 0)
    assert "no licence found" in trajectory.outcome.reason
    axes, grid = [principal_axes(BRICK)], grid_for(BRICK, 0.01)
    with pytest.raises(EngineCrashed, match="no licence found"):
        WorkerRun(worker, {"adapter": "", "settings": {}, **describe_many(axes, grid)}, read_many(axes, grid))()


def test_a_program_that_cannot_be_started_is_named(start):
    with pytest.raises(EngineCrashed, match="no_such_program cannot be started: No such file"):
        start("no_such_program").ask("check")


def test_a_silent_program_is_ended(start):
    with pytest.raises(EngineTimeout):
        start(sys.executable, "-c", SILENT).greet(0.5)


ADAPTER = """
from .waiting import sleep
calls = []
def prepare(given):
    def run():
        calls.append("run")
        sleep(given.seconds)
        return {"calls": list(calls)}
    run.dispose = lambda: calls.append("dispose")
    return run
def count():
    return {"calls": calls}
"""


def test_runs_have_unmeasured_calls_and_are_disposed_of(tmp_path):
    (tmp_path / "adapter.py").write_text(ADAPTER)
    (tmp_path / "waiting.py").write_text("from time import sleep\n")  # adapters may import files of their folder
    adapter, worker = str(tmp_path / "adapter.py"), python_worker()
    try:
        run = worker.ask("prepare", adapter=adapter, settings={"seconds": 0.005})["run"]
        worker.ask("time", run=run, calls=3)
        calls = worker.ask("call", adapter=adapter, function="count")["calls"]
        assert 3 < len(calls) <= 3 + 4  # until 0.02 s have passed
        worker.ask("time", run=run, calls=3)
        assert len(worker.ask("call", adapter=adapter, function="count")["calls"]) == len(calls) + 3
        worker.forget(worker.starts, run)
        assert worker.ask("call", adapter=adapter, function="count")["calls"][-1] == "dispose"
    finally:
        worker.close()


MESSAGE = {"a": np.arange(6.0).reshape(2, 3), "b": [1, 2.5, None, "ä", math.inf, {"c": -math.inf}], "d": np.empty((0, 3))}


def test_messages_survive_both_framings():
    data = program.pack({**MESSAGE, "e": np.float64(1) / 3, "f": np.array(math.nan)})
    place = 0

    def read(count):
        nonlocal place
        place += count
        return data[place - count : place]

    received = program.unpack(read)
    assert np.array_equal(received["a"], MESSAGE["a"])
    assert received["d"].shape == (0, 3)
    assert (received["b"], received["e"], math.isnan(received["f"])) == (MESSAGE["b"], 1 / 3, True)
    line = program.to_json(MESSAGE)
    assert line.count(b"\n") == 1
    assert program.from_json(line) == {**MESSAGE, "a": MESSAGE["a"].tolist(), "d": []}


def test_json_has_no_nan_and_no_infinity():
    """Python's own writer sends NaN and Infinity, which are not JSON."""
    text = program.to_json({"a": [math.nan], "b": np.array([math.inf])}).decode()
    assert json.loads(text, parse_constant=pytest.fail) == {"a": ["nan"], "b": ["inf"]}


def test_the_page_lists_all_numbers_of_a_request():
    page = (Path(program.__file__).parents[1] / "PROTOCOL.md").read_text(encoding="utf-8")
    table = page[page.index("## Numbers of a run") : page.index("## Process")]
    sent = describe(principal_axes(BRICK), grid_for(BRICK, 0.01))
    assert {*sent, "rows"} <= set(re.findall(r"`(\w+)`", table))
