"""`conservative gate` on files of results: exit codes, text and JSON."""

import json

import pytest
from click.testing import CliRunner

from conservative.benchmarks.gate import baseline, results
from conservative.reports.cli.main import main

from .gate_rows import KEPT, RUN, changed


@pytest.fixture
def gate(tmp_path, monkeypatch):
    """Return exit code and output of the command in a folder with results, worse ones, and the baseline of the former."""
    monkeypatch.chdir(tmp_path)
    results.write(RUN, tmp_path / "before.json")
    results.write(changed(values={"energy drift max": 2e-3}), tmp_path / "after.json")
    baseline.write(KEPT, tmp_path / "kept.json")

    def run(*arguments):
        done = CliRunner().invoke(main, ["gate", "--baseline", "kept.json", *arguments])
        return done.exit_code, done.output

    return run


def test_a_violation_exits_with_1_and_is_named(gate):
    assert gate("before.json")[0] == 0
    code, text = gate("after.json")
    assert code == 1
    assert "energy drift max, brick, reduced: was 0.001, is 0.002" in text
    code, text = gate("after.json", "--json")
    (verdict,) = json.loads(text)["verdicts"]
    assert (code, verdict["passed"], verdict["violations"][0]["measure"]) == (1, False, "energy drift max")
    assert json.loads(gate("before.json", "--json")[1])["passed"]


def test_results_are_accepted_with_a_reason(gate, tmp_path):
    assert gate("after.json", "--update", " ")[0] == 2
    code, text = gate("after.json", "--update", "wanted so", "--json")
    assert code == 0
    assert (json.loads(text)["rows"], json.loads(text)["entry"]["reason"]) == (1, "wanted so")
    assert gate("after.json")[0] == 0
    assert [entry["reason"] for entry in baseline.read(tmp_path / "kept.json").history] == ["first", "wanted so"]


def test_without_a_baseline_the_exit_code_is_2(gate, tmp_path):
    (tmp_path / "kept.json").write_text("{}")
    assert gate("before.json")[0] == 2
    (tmp_path / "kept.json").unlink()
    code, text = gate("before.json")
    assert (code, "no baseline" in text) == (2, True)
