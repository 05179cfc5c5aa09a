"""The attack by kills: a small share of it, and what it must not overlook."""

import json
import signal

import pytest

from conservative.benchmarks.verification import kills
from conservative.benchmarks.verification.processes import Ended

ROW = dict.fromkeys(kills.SAME, "x")
DONE = Ended(0, "", "", 1.0, False)


def test_a_killed_report_is_resumed_to_the_same_rows():
    found = list(kills.kills(1, seed=5))
    assert sum(each.number is not None for each in found) == 1
    assert [str(each) for each in found if each.complaints] == []


@pytest.fixture
def whole(tmp_path):
    """A folder with a report of one error and one time."""
    write(tmp_path, {**ROW, "unit": "rad", "value": "1"}, {**ROW, "unit": "s", "value": "2"})
    return tmp_path


def write(folder, *rows):
    report = folder / "report"
    report.mkdir(exist_ok=True)
    lines = [",".join(values) for values in [rows[0], *(row.values() for row in rows)]]
    (report / "measurements.csv").write_text("\n".join(lines) + "\n")
    (report / "measurements.json").write_text(json.dumps({"files": ["measurements.csv", "measurements.json"]}))


def wrong(folder, expected, ended=DONE):
    return list(kills._wrong_whole(ended, folder, expected))


def test_times_may_differ_and_nothing_else(whole):
    expected = kills.rows(whole)
    write(whole, {**ROW, "unit": "rad", "value": "1"}, {**ROW, "unit": "s", "value": "9"})
    assert wrong(whole, expected) == []
    write(whole, {**ROW, "unit": "rad", "value": "9"}, {**ROW, "unit": "s", "value": "2"})
    assert wrong(whole, expected) == ["other rows"]
    write(whole, {**ROW, "unit": "rad", "value": "1"})
    assert wrong(whole, expected) == ["other rows"]


@pytest.mark.parametrize("name", ["report.partial.json", ".report-0123456789ab", ".report-0123456789ab-old"])
def test_what_is_left_beside_is_seen(name, whole):
    (whole / name).touch()
    assert wrong(whole, kills.rows(whole)) == [f"left {name}"]


def test_what_is_left_in_the_folder_is_seen(whole):
    (whole / "report" / ".page-0123456789ab").touch()
    assert wrong(whole, kills.rows(whole)) == ["other files in the folder than it lists"]


def test_a_report_that_fails_is_seen(whole):
    assert wrong(whole, kills.rows(whole), Ended(2, "", "why", 1.0, False)) == ["exit code 2: 'why'"]


@pytest.mark.parametrize(
    ("number", "ended", "expected"),
    [
        (signal.SIGTERM, Ended(143, "", "Interrupted\n", 0.1, False), ["left .report-0123456789ab"]),
        (signal.SIGKILL, Ended(-9, "", "", 0.1, False), []),
        (signal.SIGKILL, Ended(-9, "", "", 0.1, True), ["processes went on"]),
    ],
)
def test_what_a_kill_leaves_is_seen(number, ended, expected, whole):
    (whole / ".report-0123456789ab").mkdir()
    assert list(kills._wrong_killed(ended, number, whole)) == expected
