"""`conservative gate` as a command: what it prints of verdicts and updates."""

import json

import pytest
from click.testing import CliRunner

from conservative.benchmarks.gate import results
from conservative.benchmarks.gate.results import Row
from conservative.reports.cli.main import main


def conservative(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def gated(tmp_path, monkeypatch):
    """A folder with a baseline of one row, and results in which an error became larger."""
    monkeypatch.chdir(tmp_path)
    before, after = (Row("id", "brick_flip", "reduced", "passed", values={"attitude error max": v}) for v in (1e-3, 2e-3))
    for name, row in (("before.json", before), ("after.json", after)):
        results.write(results.Results("a machine", {"id": row}, "a commit"), tmp_path / name)
    return conservative("gate", "before.json", "--baseline", "kept.json", "--update", "First", "--json")


def test_gate_as_json_has_the_violations(gated):
    done = conservative("gate", "after.json", "--baseline", "kept.json", "--json")
    assert done.exit_code == 1
    (verdict,) = json.loads(done.stdout)["verdicts"]
    assert not verdict["passed"]
    (violation,) = verdict["violations"]
    assert (violation["measure"], violation["scene"], violation["method"]) == ("attitude error max", "brick_flip", "reduced")
    assert (violation["was"], violation["now"]) == ("0.001", "0.002")
    passed = conservative("gate", "before.json", "--baseline", "kept.json", "--json")
    assert passed.exit_code == 0
    assert json.loads(passed.stdout)["passed"]


def test_update_as_json_has_the_entry_of_the_history(gated):
    told = json.loads(gated.stdout)
    assert gated.exit_code == 0
    assert (told["baseline"], told["rows"]) == ("kept.json", 1)
    assert (told["entry"]["reason"], told["entry"]["added"]) == ("First", ["id"])
