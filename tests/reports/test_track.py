"""Changes between versions in tables, JSON, Markdown, JUnit and the page, and the verdict on the last version."""

import json
import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from conservative.benchmarks.measures.convergence_order import Order
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports.cli.main import main
from conservative.reports.cli.options import HEAD
from conservative.reports.document import text as text_of
from conservative.reports.document.model import Items, Section, walk
from conservative.reports.sections.track import NO_END, NOTHING_CHANGED, build

from ..benchmarks.versions.made_up_engine import BAD, FAILED, GOOD, TIMES, history, near


def sentences(document):
    """The changes that a document lists."""
    (changed,) = [block for block in walk(document.blocks) if isinstance(block, Section) and block.title == "Changes"]
    return [item.text for block in changed.blocks if isinstance(block, Items) for item in block.items]


SLOW = tuple(2 * time for time in TIMES)


def test_a_gain_is_one_sentence_with_both_versions_and_figures():
    assert sentences(build(history(BAD, GOOD))) == [
        "midpoint on brick, 1.0 → 2.0: order of the attitude 1 → 2; order of the rates 1 → 2; energy drift -17 % → 2e-13; "
        "attitude error 2.9 → 3.0e-3 rad",
    ]


# -------------------------------------------------------------------------------------------------------------- the verdict


def test_a_lost_order_fails_a_build_and_a_gain_does_not():
    lost = build(history(GOOD, BAD), gated=True)
    assert lost.failures == sentences(lost) != []
    assert lost.blocks[0].text == "2.0 against 1.0: FAILED"
    assert not build(history(BAD, GOOD), gated=True).failures
    assert not build(history(GOOD, GOOD), gated=True).failures
    assert not build(history(GOOD, BAD)).failures  # a history is no build to gate


def test_only_losses_of_the_last_version_count():
    assert not build(history(GOOD, BAD, BAD), gated=True).failures


def test_errors_and_times_alone_do_not_fail_a_build():
    slower = build(history(GOOD, replace(GOOD, error=near(1e-1)), times=(TIMES, SLOW)), gated=True)
    assert len(sentences(slower)) == 1
    assert not slower.failures


def test_a_build_that_never_reaches_an_end_is_not_passed_even_if_the_release_does_not():
    answer = build(history(FAILED, FAILED), gated=True)
    assert list(answer.failures) == [f"2.0: {NO_END}"]
    assert not build(history(FAILED, GOOD), gated=True).failures
    assert 'failures="1"' in text_of(answer, "junit")


# ---------------------------------------------------------------------------------------------------------------- the files


def test_junit_has_a_case_for_each_setting_and_a_failure_for_a_loss():
    suite = ElementTree.fromstring(text_of(build(history(GOOD, BAD), gated=True), "junit")).find("testsuite")
    assert (suite.get("tests"), suite.get("failures")) == ("1", "1")
    (case,) = suite.findall("testcase")
    assert (case.get("classname"), case.get("name")) == ("brick", "midpoint: 1.0 to 2.0")
    assert "order of the attitude 2 → 1; order of the rates 2 → 1" in case.find("failure").get("message")
    passed = ElementTree.fromstring(text_of(build(history(GOOD, GOOD), gated=True), "junit"))
    assert passed.find("testsuite").get("failures") == "0"
    assert passed.find(".//system-out").text == NOTHING_CHANGED


def test_junit_accepts_any_message_of_an_engine():
    failed = replace(GOOD, outcome=Outcome(OutcomeKind.CRASHED, "\x00<&>\x1b[31m"))
    text = text_of(build(history(GOOD, failed), gated=True), "junit")
    assert "?<&>?[31m" in ElementTree.fromstring(text).find(".//failure").get("message")


def test_markdown_has_tables_changes_and_versions():
    text = text_of(build(history(BAD, GOOD, FAILED, times=(TIMES, SLOW)), gated=True), "markdown")
    assert text.startswith("# Versions of made: 1.0, 2.0, 3.0\n\n**3.0 against 2.0: FAILED**\n")
    assert "| midpoint | 2.0 | 2 | 2 | ✓ 2e-13 | ✗ 9e-3 | 3.0e-3 | ✓ done | 2 | 2 |" in text
    assert "| midpoint | 3.0 | – | – | – | – | – | ✗ diverged | – | – |" in text
    assert "- midpoint on brick in 3.0: diverged after t = 0.5 s (why)" in text
    assert "| 1.0 | Python 3.11.7 | made==1.0 |" in text
    assert "| processor | fast |" in text_of(build(history(GOOD, GOOD), made={"processor": "fast"}), "markdown")
    assert NOTHING_CHANGED in text_of(build(history(GOOD, GOOD)), "markdown")


def test_json_has_every_figure_and_change():
    found = json.loads(text_of(build(history(GOOD, BAD, times=(TIMES, TIMES)), gated=True), "json"))
    assert (found["engine"], found["passed"], len(found["failures"])) == ("made", False, 1)
    assert found["versions"][1] == {"version": "2.0", "runtime": "Python 3.11.7", "packages": ["made==2.0"]}
    row = found["rows"][1]
    assert row["drifts"]["energy"]["value"] == -0.17
    assert row["attitude_order"] == {"slope": 0.99, "stderr": 0.01, "reason": ""}
    assert row["step_times_s"] == list(TIMES)
    (change,) = found["changes"]
    assert (change["from"], change["to"], change["lost"]) == ("1.0", "2.0", True)
    assert {"aspect": "drift", "quantity": "energy", "allowed": "within a factor of 3", "lost": True} in change["changes"]


def test_missing_measurements_are_null_in_json():
    row = json.loads(text_of(build(history(GOOD, FAILED)), "json"))["rows"][1]
    assert row["attitude_error_rad"]["value"] is None
    assert row["time_ratio"] is None


def test_the_page_needs_no_network_and_has_the_changes():
    failed = replace(GOOD, outcome=Outcome(OutcomeKind.CRASHED, "<script>alert(1)</script>"))
    answer = build(history(BAD, GOOD, failed), gated=True)
    page = text_of(answer, "html")
    assert "order of the attitude 1 → 2" in page
    assert "3.0 against 2.0: FAILED" in page
    assert "<script>alert" not in page
    assert not re.search(r'(?:src|href)="(?!data:)', page.replace('href="#main"', ""))


def test_a_file_of_somebody_else_is_not_replaced_and_its_own_are_recognized(tmp_path):
    answer = build(history(*[GOOD, BAD] * 9), gated=True, made={"command": "conservative track made"})
    kinds = {"track.html": "html", "track.md": "markdown", "track.json": "json"}
    texts = {name: text_of(answer, kind) for name, kind in kinds.items()}
    for option, name, text in (
        *(("--out", name, text) for name, text in texts.items()),
        ("--junit", "notes", text_of(answer, "junit")),
        ("--markdown", "notes", text_of(answer, "markdown")),
    ):
        mine = tmp_path / name
        mine.write_text("mine")
        arguments = ["track", "mujoco", "no such version", option, str(tmp_path if option == "--out" else mine)]
        done = CliRunner().invoke(main, arguments)
        assert (done.exit_code, "--force" in done.stderr, mine.read_text()) == (2, True, "mine")
        command = main.commands["track"]
        kind = next(param.type for param in command.params if option in param.opts)
        assert kind.marks[name if option == "--out" else ""] in text[:HEAD]
        mine.unlink()


@pytest.mark.parametrize(
    ("was", "now", "words"),
    [
        ({"drifts": {"energy": near(0.22)}}, {"drifts": {"energy": near(-0.17)}}, "energy drift 22 % → -17 %"),
        ({"rates_order": Order(4.0, 0.1)}, {"rates_order": Order(2.5, 0.1)}, "order of the rates 4 → 2.5"),
        ({"outcome": Outcome(OutcomeKind.UNSUPPORTED, "none")}, {}, "outcome unsupported → ok"),
        ({}, {"outcome": Outcome(OutcomeKind.UNSUPPORTED, "none")}, "outcome ok → unsupported"),
        ({}, {"outcome": Outcome(OutcomeKind.CRASHED, "signal 11 (SIGSEGV)")}, "outcome ok → crashed (signal 11 (SIGSEGV))"),
        (
            {},
            {"attitude_order": Order(reason="no descent"), "error": near(1.0)},
            "order of the attitude 2 → none (no descent)",
        ),
    ],
)
def test_a_change_is_one_line(was, now, words):
    (sentence,) = sentences(build(history(replace(GOOD, **was), replace(GOOD, **now))))
    assert words in sentence
