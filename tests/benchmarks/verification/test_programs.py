"""Programs: right ones are right whatever their design, planted mistakes have their key, and the protocol is tested."""

import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

from conservative.benchmarks.verification import programs, protocol
from conservative.benchmarks.verification.finding import Verdict
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.verify import verify
from conservative.errors import BadInput, IntegrationFailed
from conservative.outcome import Outcome, OutcomeKind
from conservative.references.environments.programs import program_class, read_program
from conservative.references.worker import client
from conservative.references.worker.client import close_workers

from ...environments import PATIENCE
from ...sampling import sampled
from . import right_programs, wrong_programs

PLANTED = Path(__file__).parents[2] / "references" / "programs" / "planted.py"
RIGHT, WRONG = right_programs.right_programs(), wrong_programs.wrong_programs()
NEVER_SENT = ("no products of inertia", "axes of the torque")
"""Mistakes that a program cannot have: it gets principal axes, and no torque."""


FEW = (
    "golden_0", "golden_9", "products", "world_tensor", "half_turn", "golden_1", "golden_4", "heavy", "heavy_fast",
    "orbit", "orbit_flat", "rotor", "torque_in_body",
)  # fmt: skip
"""Motions of each kind: free bodies and tops, of which three or more show a mistake, satellites, a rotor and a torque."""
EVERY_MOTION = "RK4, matrix, world momentum", "wrong side", "test_two_mistakes_are_named_together"
"""A right program and two wrong ones, which run all motions by default, too. Among a few, a search takes longer than these."""


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    for name in ("CONFIG", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    monkeypatch.setattr(protocol, "PACE", 0.05)
    yield
    close_workers()


@pytest.fixture(autouse=True)
def few_motions(monkeypatch, request):
    """Programs run a few motions, and all of them in slow tests and in those of `EVERY_MOTION`."""
    few = [motion for motion in load() if motion.name in FEW]
    parameters = request.node.callspec.params.values() if hasattr(request.node, "callspec") else ()
    if not request.node.get_closest_marker("slow") and not any(x in EVERY_MOTION for x in (request.node.name, *parameters)):
        monkeypatch.setattr(programs, "load", lambda: few)
        monkeypatch.setattr(programs, "GENERIC", 2)


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
    for finding in found.findings:
        for cause in finding.causes:
            named[cause.key] = named.get(cause.key, 0) + 1
    return named


OTHER_DESIGNS = (
    "RK4, matrix, world momentum",
    "midpoint, quaternion, world momentum, single",
)
"""Designs that speak the protocol by default; `test_motions.py` compares all designs with the exact motions."""


@pytest.mark.parametrize("name", sampled(RIGHT, 2, keep=OTHER_DESIGNS))
def test_a_right_program_is_right(name):
    found = verified(command(right_programs.__file__, name), "protocol", "motions", "order", "repeatability")
    assert (found.verdict, keys(found)) == (Verdict.RIGHT, {}), found.reason
    free = sum(not {"torque", "damping"} & set(motion.features) for motion in programs.load())
    assert free == (42 if programs.load is load else 12)
    assert sum(finding.check == "motions" and finding.verdict == "right" for finding in found.findings) == free
    (order,) = (finding.error for finding in found.findings if finding.check == "order")
    if not RIGHT[name].single:  # whose errors of order 4 are rounding
        assert abs(order - RIGHT[name].order) < 0.05  # measured: 0.01 at most


IN_PROGRAMS = ("wrong side", "turning of the field")
"""Mistakes that are planted in programs by default; `test_mistakes.py` plants mistakes without a program in between."""


@pytest.mark.parametrize("name", sampled([name for name in WRONG if name not in NEVER_SENT], 2, keep=IN_PROGRAMS))
def test_a_planted_mistake_is_named(name):
    found = verified(command(wrong_programs.__file__, name), "motions", "order")
    assert found.verdict is Verdict.WRONG
    named, failing = keys(found), sum(finding.check == "motions" and finding.verdict == "wrong" for finding in found.findings)
    if WRONG[name].key == "explicit Euler":
        assert (failing, [finding.verdict for finding in found.findings if finding.check == "order"]) == (0, ["wrong"])
    else:
        assert max(named, key=named.get) == WRONG[name].key
        assert named[WRONG[name].key] >= 0.7 * failing


PLANTED_KEYS = {
    "x, y, z, w": "order xyzw",
    "reads x, y, z, w": "start in order xyzw",
    "w in world": "world rates",
    "reads w0 in world": "start in world rates",
    "w in deg": "rates in degrees",
    "R transposed": "transposed",
    "half a step late": "half a step late",
    "rates late": "rates half a step late",
    "inertia inverted": "inverted inertia",
    "no gyroscopic torque": "no gyroscopic term",
    "dt in ms": "time in ms",
    "gravity up": "sign of the field",
    "gravity along y": "start in a world with y up + world y up",
    "world y-up": "world y up",
    "wrong turn": "world turned the wrong way",
    "all y-up": "axes y up",
    "no gravity": "without the field",
    "inertia about com": "moments about the centre of mass",
}


OF_ORDER_1 = ("half a step late", "rates late", "dt in ms", "gravity along y")
"""Mistakes that are compared with the error of a method of order 1, too."""


CONVENTIONS = [*(("rk4", mistake) for mistake in PLANTED_KEYS), *(("euler", mistake) for mistake in OF_ORDER_1)]
ONLY_HERE = ("reads w0 in world", "wrong turn", "dt in ms")


@pytest.mark.parametrize(("order", "mistake"), sampled(CONVENTIONS, 3, keep=[("rk4", mistake) for mistake in ONLY_HERE]))
def test_a_mistake_of_conventions_is_named(order, mistake):
    named = keys(verified(command(PLANTED, order, mistake), "motions"))
    if (order, mistake) == ("euler", "rates late"):  # an error of order 1, which two motions show
        assert named == {}
    else:
        assert max(named, key=named.get) == PLANTED_KEYS[mistake], named


@pytest.mark.parametrize("mistake", sampled(["world y-up", "all y-up"], 1))
def test_a_mistake_in_matrices_is_named(mistake):
    assert PLANTED_KEYS[mistake] in keys(verified(command(PLANTED, "rk4", mistake, "matrices"), "motions"))


REFUSED = {
    "few samples": ("protocol", "it returned attitudes (10, 4) and rates (11, 3), not (11,) samples"),
    "texts": ("protocol", "expected an array of numbers"),
    "no rates": ("protocol", "its answer has no `w_W`"),
    "no number": ("protocol", "its answer has no `run`"),
    "debugged": ("protocol", "It starts with 'one step done': stdout is for answers only"),
    "random": ("repeatability", "a second run has other samples"),
    "goes on": ("repeatability", "a second run has other samples"),
    "time in ms": ("times", "`seconds` is in s, and only of the calls"),
    "time nine times": ("times", "`seconds` is in s, and only of the calls"),
    "less time": ("times", "`seconds` is the wall time of all calls together"),
    "one call": ("times", "`time` has to make `calls` runs"),
    "nan": ("motions", "the run ended early"),
}
"""Mistakes of the protocol: the check that finds each, and a part of its sentence."""


@pytest.mark.parametrize("mistake", REFUSED)
def test_a_mistake_of_the_protocol_is_found(mistake, monkeypatch):
    if mistake == "one call":  # only a machine on which a call takes longer than `PACE` hides it
        monkeypatch.setattr(protocol, "PACE", PATIENCE)
    check, words = REFUSED[mistake]
    found = verified(command(PLANTED, "rk4", mistake), *dict.fromkeys(("protocol", check)))
    wrong = [finding for finding in found.findings if finding.verdict is Verdict.WRONG]
    assert {each.check for each in wrong} == {check}
    assert words in wrong[0].detail


def test_a_lower_order_than_declared_is_wrong():
    """Measured: 1.00, of a program that declares order 2."""
    (found,) = verified(command(wrong_programs.__file__, "explicit Euler"), "order").findings
    assert (found.verdict, round(found.error, 1), found.allowed) == (Verdict.WRONG, 1.0, 2.0)


def test_a_higher_order_than_declared_is_right_and_said():
    """Measured: 4.00, of a program that declares nothing, which is order 1."""
    (found,) = verified(command(PLANTED, "rk4", "no order"), "order").findings
    assert (found.verdict, round(found.error, 1), found.allowed) == (Verdict.RIGHT, 4.0, 1.0)
    assert "1 was declared" in found.detail


def test_a_warm_up_of_every_measurement_is_reported():
    """Measured: 20.2 ms more than the call, of which 20 ms are the warm-up."""
    (found,) = verified(command(PLANTED, "rk4", "warm-up each time"), "times").findings
    assert found.verdict is Verdict.RIGHT
    assert found.detail.endswith("contains: call the run without measuring it only at the first `time` of a run")


def test_a_program_without_free_bodies_is_not_called_wrong():
    found = verified(command(PLANTED, "rk4", "only tops"), "protocol", "motions")
    assert found.verdict is Verdict.RIGHT
    assert {finding.case for finding in found.findings if finding.check == "motions" and finding.verdict == "right"} >= {
        "heavy"
    }


def test_a_program_that_does_not_answer_is_ended(monkeypatch):
    text = command(PLANTED, "rk4", "silent")
    monkeypatch.setattr(programs, "PATIENCE", 0.5)
    *_, wrong = verified(text, "protocol").findings
    assert (wrong.verdict, wrong.detail) == (Verdict.WRONG, f"timeout (after 0.5 s): {protocol.ANSWERS}")


def test_a_crash_in_any_motion_is_a_finding():
    def crash(scene, grid):
        failed = IntegrationFailed("crashed")
        failed.outcome = Outcome(OutcomeKind.CRASHED)
        raise failed

    assert {programs.run_motion(crash, motion, np.ones(2)).ended for motion in load()} == {"the run ended early: crashed"}


@pytest.mark.parametrize("limit", ["LARGEST_ANSWER", "PATIENCE"])
def test_an_answer_without_an_end_is_ended_by_its_size_and_by_time(limit, monkeypatch):
    module, value, problem = {
        "LARGEST_ANSWER": (client, 1 << 24, "an answer of more than 0.0156 GiB"),
        "PATIENCE": (programs, 0.5, "timeout (after 0.5 s)"),
    }[limit]
    text = command(PLANTED, "rk4", "endless")
    monkeypatch.setattr(module, limit, value)
    assert verified(text, "protocol").findings[-1].detail == f"{problem}: {protocol.ANSWERS}"


def test_two_mistakes_are_named_together():
    named = keys(verified(command(PLANTED, "euler", "x, y, z, w", "w in deg"), "motions"))
    assert max(named, key=named.get) == "order xyzw + rates in degrees"


@pytest.mark.parametrize(
    ("subjects", "options"), [(None, {}), ([3], {}), ("taylor", {"start": "scene"}), ("taylor", {"start": "end"})]
)
def test_arguments_of_python_are_checked(subjects, options):
    with pytest.raises(BadInput):
        verify(subjects, **options)


def test_one_check_is_a_text_or_a_list(monkeypatch):
    monkeypatch.setattr(programs, "load", lambda: load()[:2])
    one, two = (verify("mujoco:RK4", only=only)[0] for only in ("repeatability", ["repeatability"]))
    assert one.sentence == two.sentence
    assert {finding.check for finding in one.findings} == {"repeatability"}
