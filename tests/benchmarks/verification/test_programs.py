"""Programs: right ones are right whatever their design, planted mistakes have their key, and the protocol is tested."""

import shlex
import sys
from pathlib import Path

import pytest

from conservative.benchmarks.verification import programs, protocol
from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.verify import verify
from conservative.references.environments.programs import program_class, read_program
from conservative.references.worker import client
from conservative.references.worker.client import close_workers

from ...environments import PATIENCE
from . import right_programs, wrong_programs

PLANTED = Path(__file__).parents[2] / "references" / "programs" / "planted.py"
RIGHT, WRONG = right_programs.right_programs(), wrong_programs.wrong_programs()
NEVER_SENT = ("no products of inertia", "axes of the torque")
"""Mistakes that a program cannot have: it gets principal axes, and no torque."""


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    monkeypatch.setattr(protocol, "PACE", 0.05)
    yield
    close_workers()


def command(file, *arguments):
    text = shlex.join([sys.executable, str(file), *arguments])
    program_class(read_program(text, "program"))  # starts it, which may take longer than a limit that a test sets
    return text


def verified(text, *checks):
    (found,) = verify([text], only=checks)
    return found


def keys(found):
    """Return the keys of the mistakes, and how many motions each explains."""
    named = {}
    for each in found.findings:
        for cause in each.causes:
            named[cause.key] = named.get(cause.key, 0) + 1
    return named


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_program_is_right(name):
    found = verified(command(right_programs.__file__, name), "protocol", "motions", "order", "repeatability")
    assert (found.verdict, keys(found)) == (Verdict.RIGHT, {}), found.reason
    assert sum(each.check == "motions" and each.verdict == "right" for each in found.findings) == 42
    (order,) = (each.error for each in found.findings if each.check == "order")
    assert abs(order - RIGHT[name].order) < 0.05  # measured: 0.01 at most


@pytest.mark.parametrize("name", [name for name in WRONG if name not in NEVER_SENT])
def test_a_planted_mistake_is_named(name):
    found = verified(command(wrong_programs.__file__, name), "motions", "order")
    assert found.verdict is Verdict.WRONG
    named, failing = keys(found), sum(each.check == "motions" and each.verdict == "wrong" for each in found.findings)
    if WRONG[name].key == "explicit Euler":
        assert (failing, [each.verdict for each in found.findings if each.check == "order"]) == (0, ["wrong"])
    else:
        assert max(named, key=named.get) == WRONG[name].key
        assert named[WRONG[name].key] >= 0.7 * failing
