"""Comparisons of two versions as table, JSON, Markdown, JUnit and page, and the options of the command."""

import json
import math
import re
import sys
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from click import Option
from click.testing import CliRunner

from conservative.benchmarks.versions import project, version
from conservative.benchmarks.versions.project import Standing, decide
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports.cli.main import main
from conservative.reports.document import text as text_of
from conservative.reports.sections.comparison import EXPLANATION, build, table
from conservative.reports.terminal import progress

from ..benchmarks.versions.made_up import BASE, HEAD, comparison, row, timed
from ..environments import ROOT

SAME, SLOW, FAST = (1.0, 0.98, 1.02), (1.1, 1.08, 1.12), (0.8, 0.79, 0.81)


GOOD, ON_TIME = row(), timed(SAME)


def answer(was=GOOD, now=GOOD, time=ON_TIME):
    return comparison((was, now, time))


def shown(compared):
    return table(compared, decide(compared).violations).rows


def document(*compared, **others):
    return build(answer(*compared, **others), {"command": "conservative gate --against was"})


SLOWER = document(time=timed(SLOW, SLOW))
FAILED = row(Outcome(OutcomeKind.DIVERGED))
STANDINGS = {
    Standing.SAME: answer(),
    Standing.SLOWER: answer(time=timed(SLOW, SLOW)),
    Standing.FASTER: answer(time=timed(FAST)),
    Standing.WORSE: answer(now=row(steps=601.0)),
    Standing.NOTHING: answer(was=FAILED, now=FAILED, time=None),
}


@pytest.mark.parametrize("standing", STANDINGS)
def test_each_row_has_a_standing(standing):
    (cells,) = shown(STANDINGS[standing])
    assert str(cells[2]).endswith(standing)


def test_the_table_has_both_versions():
    (cells,) = shown(answer(now=row(attitude_error_max=2e-3), time=timed(SLOW, SAME)))
    assert [str(cell) for cell in cells] == [
        "brick_flip",
        "reduced",
        "✗ worse",
        "1.000",
        "0.980 to 1.020",
        "1 → 1.1",
        "1.00e-3 → 2.00e-3",
        "2.00e-16",
        "2",
    ]
    (cells,) = shown(STANDINGS[Standing.NOTHING])
    assert [str(cell) for cell in cells[3:]] == ["–"] * 6


def test_failed_rows_come_first_then_the_largest_changes_of_time():
    times = {"lame": timed((1.01, 0.99, 1.02)), "gauss": timed(FAST), "reduced": timed(SLOW, (1.11, 1.09, 1.13))}
    rows = shown(comparison(*((row(method=name), row(method=name), time) for name, time in times.items())))
    assert [cells[1] for cells in rows] == ["reduced", "gauss", "lame"]
    assert [cells[3].value for cells in rows] == [1.11, 0.8, 1.01]  # the page sorts by it


def test_json_has_measurements_and_null_for_missing_ones():
    content = json.loads(text_of(document(time=timed((math.nan,) * 3, reason="crashed")), "json"))
    assert not content["passed"]
    (record,) = content["rows"]
    assert record["time"]["first"] == {"value": None, "low": None, "high": None, "processes": 7}
    assert record["is"]["values"]["steps"] == 600
    assert content["versions"]["was"] == {"name": "was", "commit": "", "title": "was", "packages": ["numpy==2.0"]}


def test_markdown_and_junit_have_the_violations():
    text = text_of(SLOWER, "markdown")
    assert text.startswith("**gate: FAILED")
    assert "| brick_flip | reduced | ✗ slower | 1.100 | 1.080 to 1.120 |" in text
    assert EXPLANATION in text
    suite = ElementTree.fromstring(text_of(SLOWER, "junit")).find("testsuite")
    assert (suite.get("tests"), suite.get("failures")) == ("1", "1")
    assert ElementTree.fromstring(text_of(document(), "junit")).find("testsuite").get("failures") == "0"


def test_the_page_has_rows_ratios_and_filters():
    page = text_of(SLOWER, "html")
    assert 'aria-label="1.100, 1.080 to 1.120"' in page
    assert '<input type="search"' in page
    assert 'id="vega"' not in page  # it has no charts
    assert "conservative gate --against was" in page
    assert not re.search(r'(?:src|href)="(?!data:|#)', page)  # it opens without a network
    assert 'role="img"' not in text_of(build(STANDINGS[Standing.NOTHING]), "html")


# ---------------------------------------------------------------------------------------------------------------- the command


@pytest.fixture
def gate(monkeypatch):
    """Return exit code and output of the command; its versions are not installed, and their comparison is `measured`."""

    def run(*arguments, measured=answer(time=timed(SLOW, SLOW))):  # noqa: B008
        def compare(base, head, **asked):
            asked.pop("tell"), asked.pop("explain")
            run.asked = {"base": base, "head": head, **asked}
            return measured

        monkeypatch.setattr(version, "install_version", lambda name, project, source, requirements: (name, requirements))
        monkeypatch.setattr(project, "compare_projects", compare)
        done = CliRunner().invoke(main, ["gate", *map(str, arguments)])
        return done.exit_code, done.output

    return run


def test_a_violation_exits_with_1_and_leaves_the_files(gate, tmp_path):
    files = {name: tmp_path / f"gate.{name}" for name in ("html", "markdown", "junit")}
    options = [text for name, path in files.items() for text in (f"--{name}", path)]
    code, text = gate(
        "--against", "main", "--project", "v2", "--scenes", "brick_flip", "--processes", "3", "--with", "numpy", *options
    )
    assert gate.asked == {"base": ("main", ("numpy",)), "head": ("v2", ("numpy",)), "scenes": ["brick_flip"], "processes": 3}
    assert code == 1
    summary, violation = (line for line in text.splitlines() if "violation" in line or "1.100" in line)
    assert "1 violation" in summary
    for content in (violation, *(path.read_text() for path in files.values())):
        assert all(part in content for part in ("brick_flip", "reduced", "1.100"))  # the row, and how much longer it takes
    assert ElementTree.parse(files["junit"]).find("testsuite").get("failures") == "1"
    assert gate("--against", "main", "--accept-slower", "reduced=1.2x: more digits")[0] == 0
    code, text = gate("--against", "main", measured=answer())
    assert code == 0
    assert text.splitlines()[2:] == ["gate: passed, 1 row, 1 timed, 0 violations"]


@pytest.mark.parametrize("options", [("--update", "why"), ("--baseline", "kept.json"), ("results.json",)])
def test_options_of_a_baseline_do_not_go_with_two_versions(gate, options):
    code, text = gate("--against", "main", *options)
    assert code == 2
    assert "cannot be used with --against" in text


ALONE = {"--against", "--baseline", "--update", "--force", "--csv", "--json", "--markdown", "--html", "--junit"}
"""Options of the gate that go with a baseline, and formats of output."""
VALUES = {"--processes": "3", "--find-links": "."}
OF_TWO = [option.opts[0] for option in main.commands["gate"].params if isinstance(option, Option) and not option.hidden]


@pytest.mark.parametrize("option", [option for option in OF_TWO if option not in ALONE] + ["--html", "--junit"])
def test_options_of_two_versions_need_two(gate, option):
    flag = next(param for param in main.commands["gate"].params if option in param.opts).is_flag
    code, text = gate(option, *([] if flag else [VALUES.get(option, "name")]))
    assert code == 2
    assert "needs --against" in text


def test_junit_has_violations_that_belong_to_no_row():
    nothing = answer(was=None)  # no row of the earlier version has passed: everything would
    assert [violation.row.measure for violation in decide(nothing).violations] == ["rows"]
    suite = ElementTree.fromstring(text_of(build(nothing), "junit")).find("testsuite")
    assert suite.get("failures") == "1"
    assert "rows" in suite.find(".//failure").get("message")


def test_without_jinja2_only_the_page_is_refused_and_before_any_work(gate, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)  # neither found nor imported
    monkeypatch.delitem(sys.modules, "conservative.reports.document.html", raising=False)
    markdown = tmp_path / "gate.md"
    assert gate("--against", "main", "--markdown", markdown)[0] == 1
    assert gate("--against", "main", "--markdown", markdown, measured=answer())[0] == 0
    code, text = gate("--against", "main", "--html", tmp_path / "page.html", measured=None)
    assert (code, "conservative-rotation[report]" in text) == (2, True)
    assert not (tmp_path / "page.html").exists()


def test_progress_on_a_terminal_without_rich_is_a_line_after_a_while(monkeypatch, capsys):
    monkeypatch.setattr(progress, "has_terminal", lambda: True)
    monkeypatch.setitem(sys.modules, "rich", None)
    monkeypatch.delitem(sys.modules, "conservative.reports.terminal.bars", raising=False)
    for silence, said in ((60.0, ""), (0.0, "half\n")):
        monkeypatch.setattr(progress, "SILENCE", silence)
        with progress.progress() as step:
            step(0.5, "half")
        out, err = capsys.readouterr()
        assert (out, err.rpartition(": ")[2]) == ("", said)


@pytest.mark.parametrize("package", ["uv", "heyoka"])
def test_a_missing_extra_exits_with_2_before_any_work(gate, monkeypatch, package):
    monkeypatch.setattr("conservative.errors.find_spec", lambda name: None if name == package else name)
    code, text = gate("--against", "main", measured=None)
    assert (code, package in text) == (2, True)


@pytest.mark.parametrize("option", ["--html", "--markdown", "--junit"])
def test_a_file_of_somebody_else_is_not_replaced(gate, tmp_path, option):
    notes = tmp_path / "notes"
    notes.write_text("mine")
    code, _ = gate("--against", "main", option, notes, measured=None)
    assert (code, notes.read_text()) == (2, "mine")
    for more in (["--force"], []):  # then its own result of before
        assert gate("--against", "main", option, notes, *more)[0] == 1
    assert notes.read_text() != "mine"


def test_the_action_and_the_workflow_use_options_that_there_are():
    known = {option for name in ("gate", "track") for parameter in main.commands[name].params for option in parameter.opts}
    for path in (".github/actions/gate/action.yml", "tests/example_package/pull_request.yml"):
        text = re.sub(r"(?m)^.*\b(git|pip|gh|echo|bash|more)\b.*$", "", (ROOT / path).read_text())
        used = set(re.findall(r"(?<= )--[a-z-]+", text))
        assert used
        assert used <= known, used - known


def test_a_row_of_another_motion_and_an_accepted_price_have_their_standing():
    lost = replace(row(attitude_error_max=3.1), mistake="no torque", cause="no torque")
    slow = ((row(), row(), timed((1.1, 1.08, 1.12), (1.1, 1.08, 1.12))),)
    moved = comparison((row(), lost, None))
    assert [str(cells[2]) for cells in table(moved, decide(moved).violations).rows] == [f"✗ {Standing.MOTION}"]
    assert [str(cells[2]) for cells in table(comparison(*slow), ()).rows] == [Standing.PAID]


# ---------------------------------------------------------------------------------------------------------------- the comment

COMMITS = {
    "base": replace(BASE, commit="a" * 40, pushed="aaaaaaaaa First @team <b>`x`"),
    "head": replace(HEAD, commit="b" * 40, pushed="bbbbbbbbb Turn faster"),
}
OURS = {"command": "conservative gate", "commit": "c" * 40}


def comment(*lines):
    return text_of(build(comparison(*lines, **COMMITS), OURS), "markdown")


def unfolded(text):
    return re.sub(r"(?s)<details>.*</details>", "", text)


def test_a_comment_has_the_sentence_then_what_changed_and_everything_else_folded():
    worse, same = row(attitude_error_max=2e-3), row(method="gauss")
    text = comment((row(), worse, ON_TIME), (same, same, ON_TIME))
    assert text.splitlines()[0] == (
        "free rotation at your step (reduced): attitude error 0.001 to 0.002 rad; "
        "first bad motion: brick_flip (no known mistake)"
    )
    shown = unfolded(text)
    assert "1 of 2 rows changed" in shown
    assert "| brick_flip | reduced | ✗ worse |" in shown
    assert "gauss" not in shown
    assert "| brick_flip | gauss | same |" in text
    assert text.count("<details>") == text.count("</details>") == 3


def test_a_comment_names_the_commits_of_the_user():
    shown = unfolded(comment((row(), row(steps=601.0), ON_TIME)))
    assert "`bbbbbbbbb Turn faster` against `aaaaaaaaa First @team <b>x`" in shown  # as code: no mention, no tag
    assert not re.search("c{9}|a{10}|b{10}", shown)
    assert "commit of conservative-rotation" in comment((row(), row(steps=601.0), ON_TIME))


@pytest.mark.parametrize("time", [None, ON_TIME])
def test_a_comment_without_a_change_is_one_line(time):
    text = comment((GOOD, GOOD, time))
    assert text.count("\n") == 1  # by which the action knows it
    assert "nothing changed in 1 row: `bbbbbbbbb Turn faster` against" in text


NEWS = {
    "slower": ((GOOD, GOOD, timed(SLOW, SLOW)), False),
    "faster": ((GOOD, GOOD, timed(FAST)), False),
    "fewer steps": ((row(), row(steps=599.0), ON_TIME), False),
    "better": ((row(), row(attitude_error_max=1e-4), ON_TIME), True),
    "new": ((None, GOOD, None), False),
    "mended": ((FAILED, GOOD, None), False),
    "failed": ((GOOD, FAILED, None), True),
    "gone": ((GOOD, None, None), False),
}


@pytest.mark.parametrize("name", NEWS)
def test_what_changed_is_in_the_comment_and_only_accuracy_in_the_sentence(name):
    line, accuracy = NEWS[name]
    other = row(method="gauss")
    text = comment(line, (other, other, ON_TIME))
    assert "| brick_flip | reduced |" in unfolded(text)
    assert text.startswith("free rotation at your step") == accuracy


def test_a_violation_of_no_row_is_in_the_comment():
    assert "rows" in unfolded(comment((None, GOOD, None)))


def test_the_command_replaces_its_own_comment(gate, tmp_path):
    path = tmp_path / "gate.md"
    for measured in (answer(now=row(attitude_error_max=2.0)), answer(), answer(time=timed(SLOW, SLOW))):
        gate("--against", "main", "--markdown", path, measured=measured)
        assert "**gate: " in path.read_text()
    assert path.read_text().startswith("**gate: FAILED")
