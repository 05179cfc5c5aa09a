"""What dashboards and summaries get, word for word."""

import json
import math

import pytest

from conservative.benchmarks.gate import dashboards, pytest_gate
from conservative.benchmarks.gate.compare import Verdict, Violation
from conservative.benchmarks.gate.results import Results, Row, Status
from conservative.errors import NotWritten

VALUES = {"attitude error max": 1.0, "observed order": 2.0, "energy drift max": math.nan, "mine": 3.0}
ROW = Row("id", "brick", "reduced", Status.PASSED, "", "hash", VALUES, {"attitude error max": 0.25}, 4.0, 5.0)
NAMELESS = Row("a test", "", "mine", Status.PASSED, "engine==1", "hash", {"A b/(C)": math.inf}, {}, None, 6.0)
FAILED = Row("failed", "brick", "other", Status.FAILED, values={"mine": 1.0})
FOUND = Results("here", {row.id: row for row in (ROW, NAMELESS, FAILED)}, "abc")


def test_smaller_is_better():
    assert dashboards.smaller_is_better(FOUND) == [
        {"name": "brick / reduced / attitude error max", "unit": "rad", "value": 1.0, "extra": "abc"},
        {"name": "brick / reduced / mine", "unit": "1", "value": 3.0, "extra": "abc"},
        {"name": "brick / reduced / time ratio", "unit": "steps of the yardstick", "value": 4.0, "extra": "abc"},
        {"name": "brick / reduced / time", "unit": "s", "value": 5.0, "extra": "abc"},
        {"name": "a test / time", "unit": "s", "value": 6.0, "extra": "engine==1"},
    ]


def test_benchers_format_has_the_ends_of_what_has_a_spread():
    assert dashboards.bmf(FOUND) == {
        "brick / reduced": {
            "attitude-error-max": {"value": 1.0, "lower_value": 0.75, "upper_value": 1.25},
            "observed-order": {"value": 2.0},
            "mine": {"value": 3.0},
            "time-ratio": {"value": 4.0},
            "time": {"value": 5.0},
        },
        "a test": {"time": {"value": 6.0}},
    }


def test_a_name_of_a_measure_becomes_a_slug():
    assert list(dashboards.bmf(Results("", {"a": Row("a", "", "", Status.PASSED, values={"(A) b/C 9": 1.0})}))["a"]) == [
        "a-b-c-9"
    ]


def test_both_formats_are_written(tmp_path):
    dashboards.write(FOUND, tmp_path)
    read = {path.name: json.loads(path.read_text()) for path in tmp_path.iterdir()}
    assert read == {
        "custom_smaller_is_better.json": dashboards.smaller_is_better(FOUND),
        "bencher.json": dashboards.bmf(FOUND),
    }


def test_what_json_does_not_know_is_an_error(tmp_path):
    row = Row("id", "", "", Status.PASSED, values={"mine": 1.0}, spreads={"mine": math.nan})
    with pytest.raises(ValueError, match="JSON"):
        dashboards.write(Results("here", {"id": row}), tmp_path)


def test_the_summary_is_a_table_of_violations_and_a_list_of_notes():
    verdict = Verdict((Violation("measure", "scene", "method", "1", "2", "at most 1"),), ("a note", "another"), 7)
    assert dashboards.markdown(verdict) == (
        "## Gate: FAILED\n\n7 rows, 1 violations.\n\n\n"
        "| measure | scene | method | was | is | allowed |\n| --- | --- | --- | --- | --- | --- |\n"
        "| measure | scene | method | 1 | 2 | at most 1 |\n\n- a note\n- another\n"
    )
    assert dashboards.markdown(Verdict((), (), 3)) == "## Gate: passed\n\n3 rows, 0 violations.\n\n"


def test_what_cannot_be_added_to_is_named(tmp_path):
    pytest_gate._append(tmp_path / "summary", "one\n")
    pytest_gate._append(tmp_path / "summary", "two\n")
    assert (tmp_path / "summary").read_text() == "one\ntwo\n"
    with pytest.raises(NotWritten, match="GITHUB_STEP_SUMMARY"):
        pytest_gate._append(tmp_path, "three\n")
