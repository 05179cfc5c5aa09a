"""`conservative verify`: what it shows of findings, exit codes, options, and the names of earlier commands."""

import csv
import io
import json
import sys
from dataclasses import replace
from xml.etree import ElementTree

import click
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.benchmarks.verification.finding import Cause, Finding, MotionFinding, Verdict, Verification
from conservative.benchmarks.verification.verify import expand
from conservative.reports.cli.main import main
from conservative.reports.cli.options import OLD_NAMES

from ..pages import ROOT

RIGHT, WRONG, UNDECIDED, NOT_TESTED = Verdict
GYROSCOPIC = Cause(("no gyroscopic term",), "The gyroscopic term is missing", 1e-9, 0.3, {"share": 1.0})
WORLD = Cause(("world rates",), "Rates are in world axes", 2e-9, 0.3, remedy="answer in body axes")
REASON = "the gyroscopic term is missing (explains 2 of 3 failing motions)"


def motion(case, error, causes, verdict=WRONG, subject="b"):
    both = {"errors": (error, error / 2), "tolerances": (0.1, 0.1)}
    return MotionFinding(subject, "motions", case, verdict, error, 0.1, causes=causes, **both)


MADE = {
    "a": Verification("a", "engine", [motion("fast", 0.01, (), RIGHT, "a")], "1 of 1 motions"),
    "b": Verification(
        "b",
        "program",
        [
            motion("fast", 0.3, (GYROSCOPIC,)),
            motion("slow", 0.2, (GYROSCOPIC,)),
            motion("tiny", 0.2, (GYROSCOPIC, WORLD)),
            Finding("b", "motions", "spring", NOT_TESTED, detail="it has no springs"),
            Finding("b", "times", "", UNDECIDED, detail="the clock is coarse"),
        ],
        REASON,
    ),
    "c": Verification("c", "method", [Finding("c", "order", "", UNDECIDED, detail="too few steps")], "too few steps"),
    "d": Verification("d", "method", [Finding("d", "order", "", NOT_TESTED, detail="it has no step")]),
}


def invoke(*words):
    return CliRunner(env={"COLUMNS": "200"}).invoke(main, [*map(str, words)])


@pytest.fixture
def verify(monkeypatch):
    """Return the command with subjects `a` to `d`, which have the findings above."""
    module = sys.modules[cv.verification.verify.__module__]
    monkeypatch.setattr(module, "expand", lambda texts: [module.Subject(text, module.Kind.PROGRAM) for text in texts])
    monkeypatch.setattr(module, "verify", lambda subjects, **_: [MADE[subject] for subject in subjects])
    return lambda *words: invoke("verify", *words)


@pytest.mark.parametrize(
    ("subjects", "code", "first"),
    [
        ("a", 0, "a is right: 1 of 1 motions."),
        ("b", 1, f"b is wrong: {REASON}."),
        ("c", 3, "c is undecided: too few steps."),
        ("d", 3, "d is not tested."),
        ("aa", 0, "All 2 subjects are right."),
        ("acb", 1, "Of 3 subjects, 1 is right, 1 is wrong and 1 is undecided."),
        ("ad", 3, "Of 2 subjects, 1 is right and 1 is not tested."),
    ],
)
def test_the_verdict_is_the_first_line_and_the_exit_code(subjects, code, first, verify):
    done = verify(*subjects)
    assert (done.exit_code, done.stdout.splitlines()[0]) == (code, first)
    sentences = [f"{MADE[subject].sentence}." for subject in subjects]
    assert all(sentence in done.stdout for sentence in sentences)
    assert json.loads(verify(*subjects, "--json").stdout)["verdict"] == ("wrong" if code == 1 else MADE[subjects[-1]].verdict)


def test_a_mistake_is_shown_once_with_the_cases_that_it_explains(verify):
    lines = verify("b").stdout.splitlines()
    assert "  motions: fast, slow: The gyroscopic term is missing (leaves 1.0e-9 of 0.3 rad)" in lines
    (equally_good,) = (line for line in lines if "2 mistakes explain it equally well" in line)
    assert equally_good.startswith("  motions: tiny: ")
    assert "Rates are in world axes (leaves 2.0e-9 of 0.3 rad): answer in body axes" in equally_good
    assert "  times: the clock is coarse" in lines
    counts = [line.split() for line in lines if line.split()[:1] == ["motions"]]
    assert counts == [["motions", "0", "3", "0", "1"]]


def test_all_formats_have_the_same_findings(verify, tmp_path):
    done = verify("a", "b", "--json", "--junit", tmp_path / "v.xml", "--csv", tmp_path / "v.csv", "--out", tmp_path / "out")
    assert done.exit_code == 1
    subjects = json.loads(done.stdout)["subjects"]
    expected = [(each.subject, each.check, each.case, str(each.verdict)) for name in "ab" for each in MADE[name].findings]
    found = [finding for subject in subjects for finding in subject["findings"]]
    assert [(each["subject"], each["check"], each["case"], each["verdict"]) for each in found] == expected
    assert subjects[1]["findings"][0]["causes"][0]["numbers"] == {"share": 1.0}
    rows = list(csv.reader(io.StringIO((tmp_path / "v.csv").read_text())))
    assert [tuple(row[:4]) for row in rows[1:]] == expected
    assert rows[3][8] == "no gyroscopic term"
    suite = ElementTree.parse(tmp_path / "v.xml").getroot()[0]
    assert {name: suite.get(name) for name in ("tests", "failures", "skipped")} == {
        "tests": "6",
        "failures": "3",
        "skipped": "2",
    }
    reasons = [each.get("message") for each in suite.iter("skipped")]
    assert reasons == ["not tested: it has no springs", "undecided: the clock is coarse"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["verify.csv", "verify.json", "verify.md"]
    text = (tmp_path / "out" / "verify.md").read_text()
    assert all(f"| {case} |" in text for _, _, case, _ in expected if case)


@pytest.fixture
def recorded(monkeypatch, tmp_path):
    """Return the command with subjects `a` to `d`, which compares them with the file `known.txt`, written before a change."""
    module = sys.modules[cv.verification.verify.__module__]
    made = dict(MADE)
    monkeypatch.setattr(module, "expand", lambda texts: [module.Subject(text, module.Kind.PROGRAM) for text in texts])
    monkeypatch.setattr(module, "_verify_all", lambda subjects, *_: [made[subject.text] for subject in subjects])

    def command(*words, **changed):
        made.update(changed)
        return invoke("verify", *words)

    return command


def changed(*values):
    """Return `b` with another finding on a motion."""
    new = motion(*values)
    return replace(MADE["b"], findings=[new if each.case == new.case else each for each in MADE["b"].findings])


def test_the_first_run_with_known_errors_passes_and_so_does_a_later_one(recorded, tmp_path):
    file = tmp_path / "known.txt"
    assert [recorded(*"abd").exit_code, recorded(*"abd", "--record", file).exit_code] == [1, 0]
    text = file.read_text(encoding="utf-8")
    done = recorded(*"abd", "--known", file)
    assert done.stderr == ""
    assert (done.exit_code, file.read_text(encoding="utf-8")) == (0, text)
    assert "b is wrong as recorded, with 3 known errors" in done.stdout
    assert recorded(*"abd", "--record", file).exit_code == 0  # replaces its own file


@pytest.mark.parametrize("how", ["option", "variable"])
def test_a_new_failure_is_shown_in_all_formats(how, recorded, tmp_path, monkeypatch):
    file, xml, table = tmp_path / "known.txt", tmp_path / "v.xml", tmp_path / "v.csv"
    assert recorded("b", "--record", file).exit_code == 0
    words = ("--known", file) if how == "option" else ()
    if how == "variable":
        monkeypatch.setenv("ROTATION_KNOWN", str(file))
    worse = changed("slow", 0.9, (WORLD,))
    done = recorded("b", *words, "--junit", xml, "--csv", table, "--markdown", tmp_path / "v.md", b=worse)
    assert done.exit_code == 1
    change = "attitude error 9.0e-01 rad, was 2.0e-01; rates error 4.5e-01, was 1.0e-01; world rates, was no gyroscopic term"
    assert done.stdout.splitlines()[0].startswith("b is wrong, with 1 new failure and 2 known errors: ")
    assert f"  new: motions: slow: {change}" in done.stdout.splitlines()
    assert change in (tmp_path / "v.md").read_text(encoding="utf-8")
    suite = ElementTree.parse(xml).getroot()[0]
    assert (suite.get("failures"), suite.get("skipped")) == ("1", "4")
    assert [each.get("message").startswith(change) for each in suite.iter("failure")] == [True]
    assert sum(each.get("message").startswith("known: ") for each in suite.iter("skipped")) == 3
    rows = {row["case"]: row for row in csv.DictReader(io.StringIO(table.read_text(encoding="utf-8")))}
    assert {case: row["standing"] for case, row in rows.items()} == {
        "fast": "known", "slow": "new", "tiny": "known", "spring": "", "": "known",
    }  # fmt: skip
    assert rows["slow"]["change"] == change
    (subject,) = json.loads(recorded("b", *words, "--json").stdout)["subjects"]
    assert [each["standing"] for each in subject["findings"]] == ["known", "new", "known", None, "known"]
    assert (subject["compared"], subject["exit_code"]) == (True, 1)


def test_the_sentence_for_a_pull_request_is_the_last_line(recorded, tmp_path):
    file, worse = tmp_path / "known.txt", changed("tiny", 0.9, (GYROSCOPIC, WORLD))
    recorded("b", "--record", file)
    done = recorded("b", "--known", file, b=worse)
    errors = "attitude error 0.3 to 0.9 rad"
    sentence = f"free rotation at your step: {errors}; first bad motion: tiny (no gyroscopic term or world rates)"
    assert done.stdout.splitlines()[-1] == sentence
    (subject,) = json.loads(recorded("b", "--known", file, "--json").stdout)["subjects"]
    assert subject["change"] == sentence
    assert "free rotation" not in recorded("b", "--known", file, b=MADE["b"]).stdout


def test_what_is_better_is_shown_and_passes(recorded, tmp_path):
    file = tmp_path / "known.txt"
    recorded("b", "--record", file)
    done = recorded("b", "--known", file, "--junit", tmp_path / "v.xml", b=changed("slow", 0.01, (), RIGHT))
    assert done.exit_code == 0
    assert "  better: motions: slow: 2.0e-01 to 1.0e-02 rad: record again to tighten" in done.stdout.splitlines()
    assert ElementTree.parse(tmp_path / "v.xml").getroot()[0].get("failures") == "0"


def test_a_file_of_others_is_not_recorded_into(recorded, tmp_path):
    file = tmp_path / "notes.txt"
    file.write_text("my notes\n", encoding="utf-8")
    for more in ((), ("--force",)):
        assert recorded("b", "--record", file, *more).exit_code == 2
        assert file.read_text(encoding="utf-8") == "my notes\n"
    assert recorded("b", "--record", file, "--known", file).exit_code == 2
    assert recorded("b", "--known", file).exit_code == 2


UNUSED = {
    "--picture": "picture.svg", "--body": "brick_flip", "--columns": "time=1", "--quaternion": "wxyz", "--euler": "zyx",
    "--rates": "body", "--units": "deg", "--start": "row", "--from": "1", "--until": "1", "--error": "1e-3",
    "--search": ".", "--engines": "mujoco",
}  # fmt: skip


@pytest.mark.parametrize("option", UNUSED)
def test_an_option_that_no_subject_uses_is_an_error_with_its_name(option):
    done = invoke("verify", "reduced", option, UNUSED[option])
    assert (done.exit_code, done.stdout) == (2, "")
    assert f"{option[2:]}: got {option}, which none of the subjects uses (method)" in done.stderr


@pytest.mark.parametrize("option", ["--pairs", "--scripts"])
def test_an_option_of_programs_is_refused_for_a_file(option, tmp_path):
    (tmp_path / "run.csv").write_text("t,w_x,w_y,w_z\n")
    done = invoke("verify", tmp_path / "run.csv", "--body", "brick_flip", option, "x")
    assert (done.exit_code, done.stdout) == (2, "")
    assert f"{option[2:]}: got {option}, which" in done.stderr


def test_a_subject_is_needed_or_engines_for_the_model_files_of_the_package():
    assert "SUBJECT" in invoke("verify").stderr
    assert invoke("verify").exit_code == 2


WHERE = {
    "judge": {
        "run": "subjects", "body": "body", "columns": "columns", "quaternion": "quaternion", "euler": "euler", "rates": "rates",
        "units": "units", "start": "start", "error": "error", "as_json": "as_json", "out": "out", "picture": "picture",
        "force": "force",
    },
    "twins": {
        "engines": "subjects", "pairs": "pairs", "as_json": "as_json", "junit": "junit", "markdown": "markdown",
        "scripts": "scripts", "force": "force",
    },
    "importers": {
        "files": "subjects", "engines": "engines", "search": "search", "as_json": "as_json", "junit": "junit",
        "markdown": "markdown", "force": "force",
    },
    "engines check": {"command": "subjects", "as_json": "as_json"},
    "study motions": {
        "methods": "subjects", "engines": "subjects", "as_json": "as_json", "csv": "csv", "markdown": "markdown", "out": "out",
        "force": "force", "quick": "", "skip_missing": "", "time_limit": "", "scheduler": "", "latex": "",
    },
}  # fmt: skip
"""Options of the commands of 0.3, and the options of `verify` that take their place; "" if the changelog has the reason."""
WHERE["study twins"] = WHERE["study motions"]


def test_no_option_of_an_earlier_command_is_lost_without_a_reason():
    options = {param.name for param in main.commands["verify"].params}
    assert set(WHERE) == {name for name, new in OLD_NAMES.items() if new.startswith("verify")}
    assert {place for places in WHERE.values() for place in places.values()} - {""} <= options
    removed = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").partition("### Removed")[2].partition("\n## ")[0]
    lost = {name for places in WHERE.values() for name, place in places.items() if not place}
    assert [name for name in lost if f"`--{name.replace('_', '-')}`" not in removed] == []


@pytest.mark.parametrize(
    ("words", "new"),
    [
        (["judge", "my run.csv", "--body", "b.toml"], "verify 'my run.csv' --body b.toml"),
        (["twins", "mujoco", "--pairs", "q and -q"], "verify mujoco --pairs 'q and -q'"),
        (["importers", "a.urdf"], "verify a.urdf"),
        (["engines", "check", "python e.py"], "verify 'python e.py'"),
        (["study", "motions", "--engines", "mujoco,drake"], "verify --only motions mujoco drake"),
        (["study", "twins", "-m", "mujoco:RK4"], "verify --only pairs mujoco:RK4"),
        (["track", "mujoco", "--twins", "--last", "2"], "track --verify pairs mujoco --last 2"),
    ],
)
def test_an_old_name_answers_with_the_command_that_replaces_it(words, new):
    done = invoke(*words)
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.endswith(f"Run: conservative {new}\n")
    command, rest = new.split()[0], new.split()[1:]
    assert isinstance(main.commands[command], click.Command)
    assert all(
        each in {opt for option in main.commands[command].params for opt in option.opts} for each in rest if "--" in each[:2]
    )


def test_a_folder_stands_for_its_recordings_and_not_for_other_archives(tmp_path):
    for name in ("b.csv", "a.json", "c.csv.gz", "backup.tar.gz", "notes.md", "d.urdf", "LOG.CSV"):
        (tmp_path / name).touch()
    found = [subject.path.name for subject in expand([str(tmp_path)])]
    assert found == ["LOG.CSV", "a.json", "b.csv", "c.csv.gz", "d.urdf"]
