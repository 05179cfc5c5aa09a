"""`conservative engines check`: a right program passes whatever its order, and planted mistakes are named."""

import shlex
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from conservative.benchmarks.verification import protocol as conformance
from conservative.benchmarks.verification.protocol import check
from conservative.references.environments.programs import program_class, read_program
from conservative.references.worker import client
from conservative.references.worker.client import close_workers
from conservative.reports.cli.main import main

from ...environments import PATIENCE

PLANTED = Path(__file__).parents[2] / "references" / "programs" / "planted.py"


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    monkeypatch.setattr(conformance, "PACE", 0.05)
    yield
    close_workers()


def results(*arguments):
    program = read_program(shlex.join([sys.executable, "-I", str(PLANTED), *arguments]), "planted")
    program_class(program)  # starts it, which may take longer than a limit that a test sets
    return list(check(program))


def failures(*arguments):
    return [text for passed, text in results(*arguments) if not passed]


@pytest.mark.parametrize("method", ["rk4", "euler"])
def test_a_right_program_passes(method):
    """Measured errors at dt = 0.0025: 4e-13 and 6e-13 of RK4, 7e-4 and 1e-3 of the method of order 1; orders 4.00 and 1.00."""
    assert [(passed, text.partition(":")[0]) for passed, text in results(method)] == [
        (True, name) for name in ("hello", "free body", "order", "heavy body", "time")
    ]


NAMED = {
    "x, y, z, w": "free body: `q` is x, y, z, w: the scalar comes first",
    "reads x, y, z, w": "free body: It reads `q0` as x, y, z, w",
    "w in world": "free body: `w` has rates in W, or `w_W` has rates in F",
    "reads w0 in world": "free body: It reads `w0` in world axes",
    "w in deg": "free body: Rates are in deg/s: answer in rad/s",
    "R transposed": "free body: The attitudes are transposed, or the quaternions conjugated: v_W = R v_F",
    "half a step late": "free body: Samples are half a step late",
    "rates late": "free body: Rates are half a step late",
    "inertia inverted": "free body: Its inertia is inverted",
    "no gyroscopic torque": "free body: It has no gyroscopic torque",
    "dt in ms": "free body: It reads `dt` in ms: it is in s",
    "gravity up": "heavy body: Gravity points up",
    "gravity along y": "heavy body: Gravity is along minus the second axis of W: the third axis of W is up",
    "world y-up": "free body: The second axis of its world is up",
    "wrong turn": "free body: Its world is W turned the wrong way",
    "all y-up": "free body: Vectors are x, z, -y, with the second axis up",
    "no gravity": "heavy body: It ignores gravity",
    "inertia about com": "heavy body: Its inertia is about the centre of mass",
    "time in ms": "`seconds` is in s, and only of the calls",
    "time nine times": "`seconds` is in s, and only of the calls",
    "less time": "`seconds` is the wall time of all calls together",
    "one call": "`time` has to make `calls` runs",
    "random": "free body: a second run has other samples: start from `q0` and `w0`",
    "goes on": "free body: a second run has other samples: start from `q0` and `w0`",
    "few samples": "free body: it returned attitudes (4, 4) and rates (5, 3), not (5,) samples",
    "texts": "expected an array of numbers",
    "no rates": "free body: its answer has no `w_W`",
    "no number": "free body: its answer has no `run`",
    "debugged": "It starts with 'one step done': stdout is for answers only",
    "nan": "free body: error inf at dt = 0.01 s, inf at 0.0025 s: it does not fall with dt, and no known mistake explains it",
    "only tops": "free body: unsupported (only tops)",
}


@pytest.mark.parametrize("mistake", NAMED)
def test_a_mistake_is_named(mistake, monkeypatch):
    """In a method of order 1, whose error is close to that of a delay."""
    if mistake == "one call":  # only a machine on which a call takes longer than `PACE` hides it
        monkeypatch.setattr(conformance, "PACE", PATIENCE)
    (found,) = failures("euler", mistake)
    assert NAMED[mistake] in found


def test_another_order_than_declared_is_named():
    """Measured: 4.00."""
    assert failures("rk4", "no order") == ['order: 4.00, not 1: "engine": {"order": 4} belongs in the answer to `hello`']


def test_a_warm_up_of_every_measurement_is_named():
    """Measured: 20.2 ms more than the call, of which 20 ms are the warm-up."""
    passed, text = results("rk4", "warm-up each time")[-1]
    assert passed
    assert text.endswith("contains: call the run without measuring it only at the first `time` of a run")


@pytest.mark.parametrize("mistake", ["world y-up", "all y-up"])
def test_a_mistake_in_matrices_is_named(mistake):
    assert [NAMED[mistake] in text for text in failures("rk4", mistake, "matrices")] == [True]


def test_a_program_that_does_not_answer_is_ended(monkeypatch):
    monkeypatch.setattr(conformance, "PATIENCE", 2.0)
    *right, wrong = results("rk4", "silent")
    assert (right, wrong[0]) == ([(True, "hello: planted, version 1")], False)
    assert wrong[1].startswith("free body: timeout (after 2 s): answer each request once, in one line that ends with a newline")
    words = shlex.join([sys.executable, "-I", "-c", "import time; time.sleep(60)"])
    assert [text.partition(": answer")[0] for _, text in check(read_program(words))] == ["hello: timeout (after 2 s)"]


@pytest.mark.parametrize("limit", ["LARGEST_ANSWER", "PATIENCE"])
def test_an_answer_without_an_end_is_ended_by_its_size_and_by_time(limit, monkeypatch):
    module, value, problem = {
        "LARGEST_ANSWER": (client, 1 << 24, "an answer of more than 0.0156 GiB"),
        "PATIENCE": (conformance, 0.5, "timeout (after 0.5 s)"),
    }[limit]
    monkeypatch.setattr(module, limit, value)
    assert failures("rk4", "endless") == [f"free body: {problem}: {conformance.ANSWERS}"]


def test_a_delay_of_an_accurate_method_is_named():
    assert [NAMED["half a step late"] in text for text in failures("rk4", "half a step late")] == [True]


def test_two_mistakes_are_named():
    found = failures("euler", "reads x, y, z, w", "x, y, z, w", "w in deg")
    assert [text.partition(":")[2][:12] for text in found] == [" It reads `q", " `q` is x, y", " Rates are i"]


def test_the_command_ends_with_exit_code_1_if_something_has_to_change():
    words = shlex.join([sys.executable, "-I", str(PLANTED), "rk4"])
    done = CliRunner().invoke(main, ["engines", "check", f"{words} 'gravity up'"])
    assert (done.exit_code, "right  free body: error" in done.output) == (1, True)
    assert "WRONG  heavy body: Gravity points up: it is along minus the third axis of W" in done.output
    assert CliRunner().invoke(main, ["engines", "check", words]).exit_code == 0
