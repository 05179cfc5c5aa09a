"""Known errors in the tests of references/motions: recorded, compared with, refused, in the same words in every language."""

import re
from itertools import product

import pytest

from .motions_engines.methods import METHODS
from .motions_engines.run import LANGUAGES, Engine, missing, start

RK2 = Engine(METHODS["explicit midpoint"][1], 2)
EULER = Engine(METHODS["explicit Euler"][1], 2)
FEW = Engine(RK2.method, 2, has="")
FLOAT = Engine(METHODS["RK4"][1], 4, rounds=True)
pytestmark = [pytest.mark.skipif(bool(missing("C")), reason="needs gcc")]
EVERY = [  # Python and C# need a second for each run
    pytest.param(
        language,
        marks=[
            *[pytest.mark.slow] * (language in ("C++", "Python", "C#")),
            pytest.mark.skipif(bool(missing(language)), reason=str(missing(language))),
        ],
    )
    for language in LANGUAGES
]


def record(language, folder, engine, mistake=""):
    """Record known errors in known.txt of a folder, and return its lines."""
    done = start(language, folder, engine, mistake, "--record", "known.txt")
    assert done.returncode == 0, done.stdout
    return (folder / "known.txt").read_text().splitlines()


def again(language, folder, engine, mistake="", *arguments, **environment):
    """Return the exit code and the lines of a run with known.txt of a folder, if nothing else is asked for."""
    asked = arguments or environment or ("--known", "known.txt")
    done = start(language, folder, engine, mistake, *(() if environment else asked), **environment)
    assert not done.stderr
    return done.returncode, done.stdout.splitlines()


STORIES = {
    "damped, then the same": (RK2, "damping 0.05", RK2, "damping 0.05", 0),
    "damped, then more": (RK2, "damping 0.05", RK2, "damping 0.1", 1),
    "damped, then less": (RK2, "damping 0.05", RK2, "damping 0.01", 1),
    "damped, then another mistake": (RK2, "damping 0.05", RK2, "no gyroscopic term", 1),
    "without the gyroscopic term, then the same": (RK2, "no gyroscopic term", RK2, "no gyroscopic term", 0),
    "without the gyroscopic term, then right": (RK2, "no gyroscopic term", RK2, "", 0),
    "right, then right": (RK2, "", RK2, "", 0),
    "right, then the wrong side": (RK2, "", RK2, "wrong side", 1),
    "of lower order, then the same": (EULER, "", EULER, "", 0),
    "of order two, then of order one": (RK2, "", EULER, "", 1),
    "of order one, then of order two": (EULER, "", RK2, "", 0),
    "single precision, declared double, then the same": (FLOAT, "", FLOAT, "", 0),
    "with features, then without": (RK2, "damping 0.05", FEW, "damping 0.05", 1),
    "without features, then with": (FEW, "damping 0.05", RK2, "damping 0.05", 1),
    "of order 2, declared 1 now": (RK2, "", Engine(RK2.method, 1), "", 2),
    "double, single now": (RK2, "", Engine(RK2.method, 2, single=True), "", 2),
}
"""Engines with a mistake that are recorded, engines that are run with these known errors, and the exit code."""


def stories():
    """C runs all stories; the other languages run all with --all, and some by default."""
    for language, story in product(LANGUAGES, STORIES):
        usual = language == "C" or (language in ("Rust", "JavaScript") and "other mistake" in story)
        marks = [] if usual else [pytest.mark.slow]
        skip = pytest.mark.skipif(bool(missing(language)), reason=str(missing(language)))
        yield pytest.param(language, story, marks=[*marks, skip], id=f"{language}-{story}")


@pytest.mark.parametrize(("language", "story"), stories())
def test_the_same_words_in_every_language(language, story, tmp_path):
    """The lines of C are tested below. Other languages write the same files and lines, but for the rounding of single precision."""
    engine, mistake, later, other, code = STORIES[story]
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    known = record(language, tmp_path / "one", engine, mistake)
    found = again(language, tmp_path / "one", later, other)
    assert found[0] == code
    if language != "C" and not engine.rounds and not missing("C"):
        assert record("C", tmp_path / "two", engine, mistake) == known
        assert alike(language, again("C", tmp_path / "two", later, other)) == alike(language, found)


def alike(language, found):
    """Mono rounds recorded numbers that end in 5 away from zero: leave out their last digit."""
    return (
        (found[0], [re.sub(r"(was|better: \w+,) (\d\.)\d", r"\1 \2", line) for line in found[1]]) if language == "C#" else found
    )


def test_a_record(tmp_path):
    lines = record("C", tmp_path, RK2, "damping 0.05")
    assert lines[0].startswith("# Known errors on exact motions.")
    assert lines[1] == "settings,2,0.01,double"
    assert re.fullmatch(r"order,\d\.\d\d", lines[2])
    assert len(lines) == 15
    rows = [line.split(",") for line in lines[3:]]
    assert {row[0] for row in rows} == {"motions"}
    assert rows[8] == ["motions", "half_turn_slow", "0.144", "0.632", "damping 0.05"]
    assert {row[4] for row in rows} == {"damping 0.05"}
    assert all(re.fullmatch(r"[\d.]{4,5}|\d\.\d\de[+-]\d\d", number) for row in rows for number in row[2:4])


def test_known_errors_are_green(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    code, lines = again("C", tmp_path, RK2, "damping 0.05")
    assert (code, lines) == (0, ["known errors: 12 (damping 0.05: 12), new failures: 0"])


def test_a_worse_error_is_new(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    code, lines = again("C", tmp_path, RK2, "damping 0.1")
    assert code == 1
    assert lines[0] == "brick_flip: attitude error 2.0e-02 rad, was 9.9e-03; damping 0.1, was damping 0.05"
    assert re.fullmatch(r"known errors: 2 \(damping 0\.05: 2\), new failures: 10", lines[-2])
    assert (
        lines[-1] == "free rotation at your step: attitude error 0.14 to 0.22 rad; first bad motion: brick_flip (damping 0.1)"
    )


def test_another_mistake_is_new(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    _, lines = again("C", tmp_path, RK2, "no gyroscopic term")
    assert "separatrix_turned: attitude error 6.5e-04 rad, was 2.0e-04; no gyroscopic term, was damping 0.05" in lines


def test_improvement_is_no_failure(tmp_path):
    record("C", tmp_path, RK2, "no gyroscopic term")
    code, lines = again("C", tmp_path, RK2)
    assert code == 0
    better = [
        line for line in lines if re.fullmatch(r"better: \w+, \S+ to \S+( rad| \(rates\)): record again to tighten", line)
    ]
    assert len(better) == 12
    assert lines[-2] == "known errors: 0, new failures: 0"
    assert re.fullmatch(r"free rotation at your step: attitude error \S+ to \S+ rad, order 0\.0 to 2\.0", lines[-1])


def test_nothing_is_said_if_nothing_changes(tmp_path):
    record("C", tmp_path, RK2)
    assert again("C", tmp_path, RK2) == (0, ["known errors: 0, new failures: 0"])


def test_skipped_motions_are_new(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    code, lines = again("C", tmp_path, FEW, "damping 0.05")
    assert code == 1
    assert [line for line in lines if line.endswith("record again")] == [
        f"{name}: was tested, is skipped now: record again" for name in ("golden_4", "torque_and_rotor", "damped", "orbit_flat")
    ]
    assert lines[-1] == "known errors: 8 (damping 0.05: 8), new failures: 4"


def test_other_settings_are_refused(tmp_path):
    record("C", tmp_path, RK2)
    assert again("C", tmp_path, Engine(RK2.method, 1)) == (
        2, ["known.txt: recorded with order 2, 0.01 rad, double; now order 1, 0.01 rad, double: record again"]
    )  # fmt: skip


@pytest.mark.parametrize("language", EVERY)
def test_how_to_ask(language, tmp_path):
    """By an argument, by an environment variable, or by a file known.txt; an empty variable is not set."""
    known = record(language, tmp_path, RK2, "damping 0.05")
    green = (0, ["known errors: 12 (damping 0.05: 12), new failures: 0"])
    assert again(language, tmp_path, RK2, "damping 0.05", ROTATION_KNOWN="known.txt") == green
    if language not in ("JavaScript", "Python"):  # beside the test, which is in another folder here
        assert again(language, tmp_path, RK2, "damping 0.05", ROTATION_KNOWN="") == green
    (tmp_path / "known.txt").rename(tmp_path / "kept.txt")
    code, lines = again(language, tmp_path, RK2, "damping 0.05", ROTATION_RECORD="new.txt")
    assert (code, lines[-1]) == (0, "new.txt: 12 motions recorded, 12 known errors")
    assert (tmp_path / "new.txt").read_text().splitlines() == known
    code, lines = again(language, tmp_path, RK2, "damping 0.05", ROTATION_KNOWN="")
    assert (code, lines[-1].startswith("Known and accepted? --record")) == (1, True)


@pytest.mark.parametrize("language", EVERY)
def test_files_and_arguments_that_are_refused(language, tmp_path):
    (tmp_path / "notes.txt").write_text("mine\n")
    (tmp_path / "empty.txt").write_text("")
    (tmp_path / "verify.txt").write_text("# Known errors on exact motions.\nsubject,mujoco\nsettings,2,0.01,double\n")
    (tmp_path / "broken.txt").write_text("# Known errors on exact motions.\nsettings,2,0.01,double\nmotions,slow,x,1,\n")
    for arguments, words in (
        (("--known", "nothing.txt"), "cannot be read. Write it with --record nothing.txt"),
        (("--known", "notes.txt"), "line 1 is not of this test: mine"),
        (("--known", "empty.txt"), "not a file of known errors"),
        (("--known", "verify.txt"), "line 2 is not of this test: subject,mujoco"),
        (("--known", "broken.txt"), "line 3 is not of this test: motions,slow,x,1,"),
        (("--record", "notes.txt"), "not a file of known errors, and not replaced"),
        (("--record", "empty.txt"), "not a file of known errors, and not replaced"),
        (("--record", "nothing/known.txt"), "cannot be written"),
        (("--record",), "expected the name of a file"),
        (("--record", "a.txt", "--known", "b.txt"), "record and known are both given"),
        (("--recrod", "a.txt"), "--recrod: expected --record FILE, --known FILE"),
        (("notes.txt",), "a file without a motion"),
    ):
        code, lines = again(language, tmp_path, RK2, "", *arguments)
        assert (code, words in lines[-1]) == (2, True), (arguments, lines[-1:])
    assert (tmp_path / "notes.txt").read_text() == "mine\n"
    assert not (tmp_path / "a.txt").exists()
    code, lines = again(language, tmp_path, Engine(RK2.method, 2, angle=0.03), "", "--record", "known.txt")
    assert (code, lines) == (2, ["brick_flip has no tolerance for order 2 and |w| h = 0.03 rad"])


@pytest.mark.parametrize("language", EVERY)
def test_errors_that_are_not_finite(language, tmp_path):
    """An engine that diverges is recorded, and known."""
    wild = Engine((1, 0, 1e300), 1)
    rows = [line.split(",") for line in record(language, tmp_path, wild)[2:]]
    assert {row[3] for row in rows} == {"1.00e+06"}
    assert again(language, tmp_path, wild)[0] == 0
