"""Known errors in the tests of references/motions: recorded, compared with, refused, in the same words in every language."""

import os
import re
import subprocess
from itertools import product

import pytest

from ...environments import PATIENCE
from .motions_engines.methods import METHODS
from .motions_engines.run import LANGUAGES, Engine, missing, start, write

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
    "damped, then less": (RK2, "damping 0.05", RK2, "damping 0.01", 0),
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


@pytest.mark.parametrize(("language", "story"), list(stories()))
def test_the_same_words_in_every_language(language, story, tmp_path):
    """The lines of C are tested below. Other languages write the same files and lines, except in single precision."""
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
    """Mono rounds three digits that end in 5 away from zero: leave out the last of two."""
    return (found[0], [re.sub(r"(\d\.)\d(?=e)", r"\1", line) for line in found[1]]) if language == "C#" else found


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
    assert all(re.fullmatch(r"[\d.]{4,6}|\d\.\d\de[+-]\d\d", number) for row in rows for number in row[2:4])


def test_known_errors_are_green(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    code, lines = again("C", tmp_path, RK2, "damping 0.05")
    assert (code, lines) == (0, ["known errors of known.txt: 12 (damping 0.05: 12), new failures: 0"])


def test_a_worse_error_is_new(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    code, lines = again("C", tmp_path, RK2, "damping 0.1")
    assert code == 1
    assert lines[0] == "brick_flip: attitude error 2.0e-02 rad, was 9.9e-03; damping 0.1, was damping 0.05"
    assert re.fullmatch(r"known errors of known.txt: 2 \(damping 0\.05: 2\), new failures: 10", lines[-2])
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
    assert lines[-2] == "known errors of known.txt: 0, new failures: 0"
    assert re.fullmatch(r"free rotation at your step: attitude error \S+ to \S+ rad, order 0\.0 to 2\.0", lines[-1])


def test_nothing_is_said_if_nothing_changes(tmp_path):
    record("C", tmp_path, RK2)
    assert again("C", tmp_path, RK2) == (0, ["known errors of known.txt: 0, new failures: 0"])


def test_skipped_motions_are_new(tmp_path):
    record("C", tmp_path, RK2, "damping 0.05")
    code, lines = again("C", tmp_path, FEW, "damping 0.05")
    assert code == 1
    assert [line for line in lines if line.endswith("record again")] == [
        f"{name}: was tested, is skipped now: record again" for name in ("golden_4", "torque_and_rotor", "damped", "orbit_flat")
    ]
    assert lines[-1] == "known errors of known.txt: 8 (damping 0.05: 8), new failures: 4"


def test_other_settings_are_refused(tmp_path):
    record("C", tmp_path, RK2)
    assert again("C", tmp_path, Engine(RK2.method, 1)) == (
        2, ["known.txt: recorded with order 2, 0.01 rad, double; now order 1, 0.01 rad, double: record again"]
    )  # fmt: skip


@pytest.mark.parametrize("language", EVERY)
def test_how_to_ask(language, tmp_path):
    """By an argument, by an environment variable, or by a file known.txt; an empty variable is not set."""
    known = record(language, tmp_path, RK2, "damping 0.05")
    green = (0, ["known errors of known.txt: 12 (damping 0.05: 12), new failures: 0"])
    assert again(language, tmp_path, RK2, "damping 0.05", ROTATION_KNOWN="known.txt") == green
    assert again(language, tmp_path, RK2, "damping 0.05", ROTATION_KNOWN="") == green
    (tmp_path / "known.txt").rename(tmp_path / "kept.txt")
    code, lines = again(language, tmp_path, RK2, "damping 0.05", ROTATION_RECORD="new.txt")
    assert (code, lines[-1]) == (
        0,
        "new.txt: 12 motions recorded, 12 known errors. The next run needs --known new.txt (or ROTATION_KNOWN)",
    )
    assert (tmp_path / "new.txt").read_text().splitlines() == known
    code, lines = again(language, tmp_path, RK2, "damping 0.05", ROTATION_KNOWN="")
    assert (code, lines[-1].startswith("Known and accepted? --record")) == (1, True)


@pytest.mark.parametrize("language", [each for each in EVERY if each.values[0] in ("JavaScript", "Python")])
def test_a_file_beside_the_test(language, tmp_path):
    """It is found from another folder, where a file known.txt would be used first, and the output names it."""
    (tmp_path / "sub").mkdir()
    write(language, tmp_path / "sub", RK2)
    program, name = LANGUAGES[language][3]

    def lines(*arguments):
        own = {"env": os.environ | {"MISTAKE": "damping 0.05"}, "cwd": tmp_path, "timeout": PATIENCE}
        done = subprocess.run([program, f"sub/{name}", *arguments], text=True, capture_output=True, check=True, **own)
        return done.stdout.splitlines()

    assert lines("--record", "sub/known.txt")[-1] == "sub/known.txt: 12 motions recorded, 12 known errors"
    (line,) = lines()
    assert re.fullmatch(r"known errors of .*sub/known\.txt: 12 \(damping 0\.05: 12\), new failures: 0", line)
    lines("--record", "known.txt")
    assert lines() == ["known errors of known.txt: 12 (damping 0.05: 12), new failures: 0"]


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
    output = start(language, tmp_path, wild).stdout
    assert "brick_flip: energy error not finite, tolerance 1.9e-06; no known mistake" in output.splitlines()
    assert "e+06" not in output
    rows = [line.split(",") for line in record(language, tmp_path, wild)[2:]]
    assert {row[3] for row in rows} == {"1.00e+06"}
    assert again(language, tmp_path, wild)[0] == 0


@pytest.mark.parametrize("language", EVERY)
def test_better_with_another_mistake_is_no_failure(language, tmp_path):
    """An engine that is damped less resembles the next mistake of a list, and known errors are counted by it."""
    record(language, tmp_path, RK2, "damping 0.05")
    code, lines = again(language, tmp_path, RK2, "damping 0.02")
    assert code == 0
    assert "better: brick_flip, 9.9e-03 to 4.0e-03 rad, now damping 0.02: record again to tighten" in lines, lines
    assert re.fullmatch(r"known errors of known\.txt: 12 \(damping 0\.02: 9, damping 0\.05: 3\), new failures: 0", lines[-2])


@pytest.mark.parametrize("language", EVERY)
@pytest.mark.parametrize("factor", [0.996, 1.004])
def test_one_per_cent_is_no_change(language, factor, tmp_path):
    lines = record(language, tmp_path, RK2, "damping 0.05")
    rows = [line.split(",") for line in lines[3:]]
    for row in rows:
        row[2:4] = [f"{factor * float(number):.6g}" for number in row[2:4]]
    (tmp_path / "known.txt").write_text("\n".join([*lines[:3], *map(",".join, rows)]) + "\n")
    green = (0, ["known errors of known.txt: 12 (damping 0.05: 12), new failures: 0"])
    assert again(language, tmp_path, RK2, "damping 0.05") == green


@pytest.mark.parametrize("language", EVERY)
def test_new_failures_are_summed_up(language, tmp_path):
    """The sentence does not praise a smaller error beside new failures."""
    record(language, tmp_path, RK2, "damping 0.1")
    code, lines = again(language, tmp_path, RK2, "wrong side")
    assert code == 1
    assert '"wrong side" explains 10 of 10 new failures' in lines, lines
    record(language, tmp_path, RK2, "damping 0.1")
    code, lines = again(language, tmp_path, RK2, "no gyroscopic term")
    assert code == 1
    assert lines[-1] == "free rotation at your step: first bad motion: golden_4 (no gyroscopic term)"


UNKNOWN = Engine(RK2.method, 2, has="rotor, dampign")


@pytest.mark.parametrize("language", EVERY)
def test_unknown_features_are_refused(language, tmp_path):
    allowed = "rotor, torque, damping, fixed point, orbit"
    assert again(language, tmp_path, UNKNOWN) == (2, [f"HAS: got dampign; allowed: {allowed}"])


C_LIKE = (
    "static void simulate(const Motion *m, double h, int steps, int samples, double state[][7]) {{"
    "(void)m, (void)h, (void)steps; {} }}"
)
NOTHING = {
    "C": C_LIKE.format("(void)samples, (void)state;"),
    "C++": C_LIKE.format("(void)samples, (void)state;"),
    "Rust": "fn simulate(_: &Motion, _: f64, _: usize, _: usize) -> Vec<State> { vec![] }",
    "JavaScript": "function simulate() {}",
    "Python": "def simulate(m, h, steps, samples):\n    pass",
    "C#": "static double[][] Simulate(Motion m, double h, int steps, int samples) { return null; }",
}
QUATERNIONS = {
    "C": C_LIKE.format("for (int i = 0; i < 4 * samples; i++) state[i / 4][i % 4] = 1;"),
    "C++": C_LIKE.format("for (int i = 0; i < 4 * samples; i++) state[i / 4][i % 4] = 1;"),
    "JavaScript": "const simulate = (m, h, steps, samples) => Array(samples).fill([[1, 0, 0, 0]]);",
    "Python": "def simulate(m, h, steps, samples):\n    return samples * [([1, 0, 0, 0],)]",
    "C#": "static double[][] Simulate(Motion m, double h, int steps, int samples) "
    "{ return Enumerable.Repeat(new double[4], samples).ToArray(); }",
}
"""Functions that return nothing, and states without rates, which Rust does not compile."""


@pytest.mark.parametrize("language", EVERY)
def test_states_that_are_not_returned_are_refused(language, tmp_path):
    expected = (2, ["brick_flip: simulate returned 0 states, expected 5"])
    assert again(language, tmp_path, Engine((), 2, code=NOTHING[language])) == expected
    if language in QUATERNIONS:
        expected = (2, ["brick_flip: simulate returned another state, expected a quaternion (4) and rates (3)"])
        assert again(language, tmp_path, Engine((), 2, code=QUATERNIONS[language])) == expected
