"""The gate on made-up rows: limits, verdicts, history and files, each number against a formula of its own."""

import hashlib
import json
import math
from dataclasses import replace

import pytest
from scipy.stats import t

from conservative.benchmarks.gate import baseline, compare, results
from conservative.benchmarks.gate.baseline import Allowed, limit, time_limit
from conservative.benchmarks.gate.results import Results, Row, Status
from conservative.errors import BadInput

ROW = Row(
    "file.py::test[a]",
    "brick",
    "reduced",
    Status.PASSED,
    "",
    "hash",
    {"energy drift max": 1e-3, "observed order": 2.0, "iterations": 30.0},
    {"energy drift max": 1e-5, "observed order": 0.001},
    2.0,
    1e-6,
)
RUN = Results("here", {ROW.id: ROW}, "abc")
KEPT = baseline.update_baseline(None, [RUN], "first")
OTHER = Row("file.py::test[b]", "top", "gauss", Status.PASSED, "heyoka==7", "other", {"rate error max": 1.0}, {}, None)


def changed(row=ROW, **changes):
    return Results("here", {row.id: replace(row, **changes)}, "abc")


def with_values(**values):
    return changed(values={**ROW.values, **{name.replace("_", " "): value for name, value in values.items()}})


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


def test_the_limit_of_a_time_is_a_quantile_of_students():
    ratios = [2.0 * math.exp(x) for x in (-0.02, -0.01, 0.0, 0.012, 0.03)]
    found = time_limit(ratios, 3)
    spread = 1.4826 * 0.012
    margin = t.ppf(1 - 0.01 / 3, 4) * spread * math.sqrt(1.2)
    assert margin > 0.10
    assert (found.value, found.spread, found.runs) == pytest.approx((2.0, 2.0 * spread, 5))
    assert found.limit == pytest.approx(2.2)
    calm = time_limit([2.0 * math.exp(0.8 * x) for x in (-0.02, -0.01, 0.0, 0.012, 0.03)], 3)
    assert 0.05 < margin * 0.8 < 0.10
    assert calm.limit == pytest.approx(2.0 * (1 + margin * 0.8))
    assert time_limit([2.0] * 5, 3).limit == pytest.approx(2.1)
    assert time_limit([2.0] * 4, 3).limit == pytest.approx(2.2)


def test_a_first_baseline():
    row = KEPT.rows[ROW.id]
    assert (row.scene, row.method, row.engine, row.definition) == ("brick", "reduced", "", "hash")
    assert row.measures["energy drift max"] == Allowed(1e-3, 1e-5, 1, 1e-3 + 5e-5)
    assert row.measures["iterations"] == Allowed(30.0, 0.0, 1, 30.0)
    assert row.time_ratios == {"here": Allowed(2.0, 0.0, 1, 2.0 * (1 + baseline.WIDEST))}
    (entry,) = KEPT.history
    expected = {"reason": "first", "commit": "abc", "runs": 1, "machines": ["here"], "added": [ROW.id]}
    assert {**entry, **expected, "removed": [], "changed": []} == entry
    assert entry["date"].endswith("+00:00")


def test_values_of_several_runs_are_their_median_and_range():
    runs = [replace(with_values(energy_drift_max=value), commit=str(value)) for value in (1e-3, 4e-3, 2e-3)]
    made = baseline.update_baseline(None, runs, "three")
    row = made.rows[ROW.id]
    assert (made.history[0]["commit"], made.history[0]["runs"]) == ("0.001", 3)
    assert row.measures["energy drift max"] == Allowed(2e-3, 3e-3, 3, pytest.approx(2e-3 + 15e-3))
    assert row.time_ratios["here"].runs == 3


def test_rows_without_times_take_no_part_in_false_alarms():
    ratios = [2.0 + 0.01 * k for k in range(baseline.REPEATS + 1)]
    others = {name: replace(ROW, id=name, time_ratio=None) for name in ("a", "b", "c")}
    runs = [replace(RUN, rows={**others, ROW.id: replace(ROW, time_ratio=ratio)}) for ratio in ratios]
    assert baseline.update_baseline(None, runs, "one timed").rows[ROW.id].time_ratios["here"] == baseline.time_limit(ratios, 1)


def test_history_says_what_changed_and_times_of_other_machines_stay():
    there = replace(with_values(energy_drift_max=5e-3), machine="there")
    both = replace(there, rows={**there.rows, OTHER.id: OTHER})
    second = baseline.update_baseline(KEPT, [both], " again ")
    assert set(second.rows[ROW.id].time_ratios) == {"here", "there"}
    assert second.rows[OTHER.id].time_ratios == {}
    entry = second.history[1]
    assert (entry["reason"], entry["added"], entry["removed"], entry["changed"]) == ("again", [OTHER.id], [], [ROW.id])
    third = baseline.update_baseline(second, [Results("here", {OTHER.id: OTHER})], "less")
    assert (third.history[2]["removed"], third.history[2]["changed"]) == ([ROW.id], [])
    redefined = baseline.update_baseline(second, [changed(definition="new")], "other code")
    assert set(redefined.rows[ROW.id].time_ratios) == {"here"}
    untimed = baseline.update_baseline(KEPT, [changed(time_ratio=None)], "no time")
    assert untimed.rows[ROW.id].time_ratios == {}


def test_runs_that_disagree_are_refused():
    for other in (changed(definition="new"), changed(engine="new"), Results("here", {OTHER.id: OTHER})):
        with pytest.raises(BadInput, match="disagree"):
            baseline.update_baseline(None, [RUN, other], "why")
    with pytest.raises(BadInput, match="failed: " + "file"):
        baseline.update_baseline(None, [changed(status=Status.ERROR)], "why")
    assert not baseline.update_baseline(None, [changed(status=Status.SKIPPED)], "why").rows


def test_a_baseline_comes_back_from_its_file_with_its_hash(tmp_path):
    path = tmp_path / "new" / "baseline.json"
    baseline.write(KEPT, path)
    assert baseline.read(path) == KEPT
    content = json.loads(path.read_text())
    hashed = {name: value for name, value in content.items() if name != "sha256"}
    assert content["sha256"] == hashlib.sha256(json.dumps(hashed, sort_keys=True).encode()).hexdigest()
    assert content["format"] == 1
    for damage, words in (({"format": 2}, "another format"), ({"history": []}, "edited by hand")):
        path.write_text(json.dumps({**content, **damage}))
        with pytest.raises(baseline.NoBaseline, match=words):
            baseline.read(path)
    path.write_text("[]")
    with pytest.raises(baseline.NoBaseline, match="another format"):
        baseline.read(path)


def test_results_come_back_from_their_file(tmp_path):
    path = tmp_path / "new" / "results.json"
    results.write(RUN, path)
    assert results.read(path) == RUN
    path.write_text(json.dumps({"conservative": results.as_json(RUN)}))
    assert results.read(path) == RUN
    for text in ("[]", "{}", "{", '{"rows": [1], "machine": "", "commit": ""}'):
        path.write_text(text)
        with pytest.raises(BadInput, match="results"):
            results.read(path)
    with pytest.raises(BadInput, match="No such file"):
        results.read(tmp_path / "nothing.json")


def test_the_same_results_pass_and_values_at_their_limit():
    verdict = compare.judge(KEPT, RUN)
    assert verdict == compare.Verdict((), (), 1)
    assert str(verdict) == "gate: passed, 1 rows, 0 violations"
    assert compare.judge(KEPT, with_values(energy_drift_max=1e-3 + 5e-5, observed_order=1.95)).passed
    assert compare.judge(KEPT, changed(time_ratio=2.0 * (1 + baseline.WIDEST))).passed


def test_what_each_violation_says():
    worse = with_values(energy_drift_max=2e-3, observed_order=1.9)
    found = compare.judge(KEPT, worse).violations
    assert [(each.measure, each.was, each.now) for each in found] == [
        ("energy drift max", "0.001", "0.002"),
        ("observed order", "2", "1.9"),
    ]
    assert found[0].allowed == "at most 0.00105 (spread 1e-05 in 1 runs)"
    assert found[1].allowed == "at least 1.95 (spread 0.001 in 1 runs)"
    (slow,) = compare.judge(KEPT, changed(time_ratio=3.0)).violations
    assert (slow.measure, slow.was, slow.now) == ("time ratio", "2", "3")
    assert slow.allowed.startswith("at most 2.2")
    (gone,) = compare.judge(KEPT, changed(time_ratio=None)).violations
    assert gone.now == "missing"
    text = str(compare.judge(KEPT, changed(time_ratio=3.0)))
    assert text.startswith("gate: FAILED, 1 rows, 1 violations\ntime ratio, brick, reduced: was 2, is 3, allowed at most 2.2")


def test_rows_that_cannot_be_compared():
    nothing = replace(RUN, rows={})
    renamed = replace(RUN, rows={"new": replace(ROW, id="new")})
    for found, expected in (
        (nothing, ("row", "passed", "missing", "passed")),
        (renamed, ("row", "passed", "renamed new", "passed")),
        (
            replace(RUN, rows={"new": replace(ROW, id="new"), "z": replace(ROW, id="z")}),
            ("row", "passed", "renamed new", "passed"),
        ),
        (replace(RUN, rows={"new": replace(ROW, id="new", method="other")}), ("row", "passed", "missing", "passed")),
        (changed(status=Status.ERROR), ("row", "passed", "error", "passed")),
        (changed(definition="new"), ("definition", "hash", "new", "hash")),
        (changed(engine="mujoco==9"), ("engine version", "", "mujoco==9", "")),
    ):
        (each,) = compare.judge(KEPT, found).violations
        assert (each.measure, each.was, each.now, each.allowed) == expected
        assert (each.scene, each.method) == ("brick", "reduced")
    assert compare.judge(KEPT, renamed).notes == ("unbaselined: new",)
    failed = replace(RUN, rows={**RUN.rows, "new": replace(ROW, id="new", status=Status.FAILED)})
    assert compare.judge(KEPT, failed) == compare.Verdict((), (), 1)


def test_a_foreign_machine():
    elsewhere = replace(RUN, machine="elsewhere")
    (each,) = compare.judge(KEPT, elsewhere, "required").violations
    assert (each.measure, each.was, each.now) == ("foreign machine", "here", "elsewhere")
    known = compare.judge(KEPT, elsewhere, "known")
    assert known.passed
    advice = "on any machine: conservative gate --against REF"
    assert known.notes == (f"unbaselined machine: no time is gated, as the baseline has none of elsewhere; {advice}",)
    untimed = baseline.update_baseline(None, [changed(time_ratio=None)], "no times")
    assert compare.judge(untimed, elsewhere) == compare.Verdict((), (), 1)
    assert not compare.judge(baseline.Baseline({}, []), RUN).passed


def test_a_gain_as_large_as_a_failure_is_noted():
    better = compare.judge(KEPT, with_values(energy_drift_max=1e-3 - 6e-5, observed_order=2.06))
    assert better.passed
    assert better.notes == (
        "better: energy drift max, brick, reduced: was 0.001, is 0.00094",
        "better: observed order, brick, reduced: was 2, is 2.06",
    )
    same = compare.judge(KEPT, with_values(energy_drift_max=1e-3 - 4e-5, observed_order=2.04))
    assert not same.notes
    assert not compare.judge(KEPT, changed(definition="new", values={"energy drift max": 0.0})).notes
    two = baseline.update_baseline(None, [replace(RUN, rows={OTHER.id: OTHER, **RUN.rows})], "two")
    assert len(compare.judge(two, with_values(energy_drift_max=1e-3 - 6e-5)).notes) == 1  # the other row is missing
