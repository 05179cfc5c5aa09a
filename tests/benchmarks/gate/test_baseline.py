"""A baseline: its file, what is accepted into it, and the limits that follow."""

import hashlib
import json
import math
from dataclasses import replace

import pytest

from conservative.benchmarks.gate import baseline, results
from conservative.benchmarks.gate.baseline import Allowed, limit
from conservative.benchmarks.gate.results import Results, Status
from conservative.errors import BadInput

from .gate_rows import KEPT, OTHER, ROW, RUN, changed


@pytest.mark.parametrize(
    ("measure", "value", "spread", "expected"),
    [
        ("energy drift max", 1.0, 0.1, 1.5),
        ("energy drift max", -2.0, 0.0, -2.0 + 2e-6),
        ("energy drift max", 0.0, 0.0, 8 * 2.0**-52),
        ("iterations", 30.0, 0.0, 30.0),
        ("steps", 30.0, 2.0, 40.0),
        ("observed order", 2.0, 1.0, 1.95),
    ],
)
def test_the_limit_of_a_value(measure, value, spread, expected):
    assert limit(measure, value, spread) == expected


def test_a_first_baseline():
    row = KEPT.rows[ROW.id]
    assert (row.scene, row.method, row.engine, row.definition) == ("brick", "reduced", "", "hash")
    assert row.measures["energy drift max"] == Allowed(1e-3, 1e-5, 1, 1e-3 + 5e-5)
    assert row.measures["iterations"] == Allowed(30.0, 0.0, 1, 30.0)
    (entry,) = KEPT.history
    expected = {"reason": "first", "commit": "abc", "runs": 1, "machines": ["here"], "added": [ROW.id]}
    assert {**entry, **expected, "removed": [], "changed": []} == entry


def test_values_of_several_runs_are_their_median_and_range():
    runs = [changed(values={"energy drift max": value}) for value in (1e-3, 4e-3, 2e-3)]
    made = baseline.update_baseline(None, runs, "three")
    assert made.history[0]["runs"] == 3
    assert made.rows[ROW.id].measures["energy drift max"] == Allowed(2e-3, 3e-3, 3, pytest.approx(2e-3 + 15e-3))


def test_the_largest_spread_within_and_between_runs_counts():
    runs = [changed(spreads={"energy drift max": spread}) for spread in (0.1, 0.3, 0.2)]
    found = baseline.update_baseline(None, runs, "why").rows[ROW.id].measures["energy drift max"]
    assert (found.spread, found.limit) == (0.3, pytest.approx(1e-3 + baseline.SPREADS * 0.3, rel=1e-15))


def test_the_history_has_every_change():
    both = changed(values={"energy drift max": 5e-3})
    second = baseline.update_baseline(KEPT, [replace(both, rows={**both.rows, OTHER.id: OTHER})], " again ")
    entry = second.history[1]
    assert (entry["reason"], entry["added"], entry["removed"], entry["changed"]) == ("again", [OTHER.id], [], [ROW.id])
    third = baseline.update_baseline(second, [Results("here", {OTHER.id: OTHER})], "less")
    assert (third.history[2]["removed"], third.history[2]["changed"]) == ([ROW.id], [])


def test_runs_that_disagree_are_refused():
    for other in (changed(definition="new"), changed(engine="new"), Results("here", {OTHER.id: OTHER})):
        with pytest.raises(BadInput, match="disagree"):
            baseline.update_baseline(None, [RUN, other], "why")


@pytest.mark.parametrize(
    "changes",
    [
        {"status": Status.FAILED},
        {"status": Status.ERROR},
        {"values": {"rate error max": float("nan")}},
        {"values": {"iterations": float("inf")}},
        {"values": {results.ENERGY_DRIFT: 1.01}},
    ],
)
def test_a_failure_cannot_be_accepted(changes):
    with pytest.raises(BadInput):
        baseline.update_baseline(KEPT, [changed(**changes)], "no")
    assert not baseline.update_baseline(None, [changed(status=Status.SKIPPED)], "why").rows


def test_a_baseline_comes_back_from_its_file_with_its_hash(tmp_path):
    path = tmp_path / "new" / "baseline.json"
    baseline.write(KEPT, path)
    assert baseline.read(path) == KEPT
    content = json.loads(path.read_text())
    hashed = {name: value for name, value in content.items() if name != "sha256"}
    assert content["sha256"] == hashlib.sha256(json.dumps(hashed, sort_keys=True).encode()).hexdigest()


DAMAGED = {
    "truncated": lambda text: text[: len(text) // 2],
    "edited by hand": lambda text: text.replace('"limit": ', '"limit": 1', 1),
    "another format": lambda text: text.replace('"format": 2', '"format": 3'),
    "another format: ": lambda text: "[]",
    "an earlier version": lambda text: text.replace('"format": 2', '"format": 1'),
}


@pytest.mark.parametrize("words", DAMAGED)
def test_a_damaged_baseline_is_refused(tmp_path, words):
    path = tmp_path / "baseline.json"
    baseline.write(KEPT, path)
    path.write_text(DAMAGED[words](path.read_text()))
    with pytest.raises(baseline.NoBaseline, match=words):
        baseline.read(path)
    with pytest.raises(baseline.NoBaseline, match="no baseline"):
        baseline.read(tmp_path / "nothing")


def test_a_baseline_with_times_is_read_without_them_where_it_is_about_to_be_replaced(tmp_path):
    path = tmp_path / "baseline.json"
    baseline.write(KEPT, path)
    content = json.loads(path.read_text())
    content.pop("sha256")
    content["format"] = 1
    content["rows"][ROW.id]["time_ratios"] = {"a machine": {"value": 2.0, "spread": 0.1, "runs": 5, "limit": 2.2}}
    content["sha256"] = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    path.write_text(json.dumps(content))
    with pytest.raises(baseline.NoBaseline, match="with times"):
        baseline.read(path)
    assert baseline.read(path, also_with_times=True) == KEPT


def test_results_come_back_from_their_file(tmp_path):
    path = tmp_path / "new" / "results.json"
    found = changed(values={"energy drift max": math.nan})
    results.write(found, path)
    assert math.isnan(results.read(path).rows[ROW.id].values["energy drift max"])
    results.write(RUN, path)
    assert results.read(path) == RUN
    for text in ("[]", "{}", "{", '{"rows": [1], "machine": "", "commit": ""}'):
        path.write_text(text)
        with pytest.raises(BadInput, match="results"):
            results.read(path)
    with pytest.raises(BadInput, match="No such file"):
        results.read(tmp_path / "nothing.json")
