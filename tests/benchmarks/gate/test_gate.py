"""The baseline, its file and limits; every kind of violation; and the command."""

import hashlib
import json
import math
from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.gate import baseline, compare, results
from conservative.benchmarks.gate.baseline import Allowed, limit
from conservative.benchmarks.gate.results import Results, Row
from conservative.benchmarks.suite import points
from conservative.errors import BadInput
from conservative.methods import reduced
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.registry import method, scene
from conservative.reports.cli.main import main

ROW = Row(
    "file.py::test[a]",
    "brick",
    "reduced",
    OK,
    "",
    "hash",
    {"energy drift max": 1e-3, "observed order": 2.0, "iterations": 30.0},
    {"energy drift max": 1e-5, "observed order": 0.001},
)
FAILED, SKIPPED = Outcome(OutcomeKind.FAILED), Outcome(OutcomeKind.SKIPPED)
RUN = Results("here", {ROW.id: ROW}, "abc")
KEPT = baseline.update_baseline(None, [RUN], "first")
OTHER = Row("file.py::test[b]", "top", "gauss", OK, "heyoka==7", "other", {"rate error max": 1.0})


def changed(row=ROW, **changes):
    """Return the run with its row changed; a change of `values` is merged into its values."""
    if "values" in changes:
        changes["values"] = {**row.values, **changes["values"]}
    return Results("here", {row.id: replace(row, **changes)}, "abc")


BRICK = scene("brick_flip:t_end=1")
METHODS = SECOND, FOURTH, ENGINE = "reduced", "reduced:order=4", "mujoco:Euler"


def measured(name, instead=None):
    """Return the row of a method on the brick; `instead` is a method that is measured under its name."""
    point = points.Point(BRICK, method(name))
    values, spreads = points.measure(replace(point, method=instead or point.method))
    labels = point.labels
    return Row(point.id, BRICK.name, name, OK, labels["engine"], labels["definition"], values, spreads)


@cache
def untouched():
    return {name: measured(name) for name in METHODS}


@cache
def accepted():
    """Return the baseline that accepts the untouched run."""
    return baseline.update_baseline(None, [run()], "the first one")


def run(**changes):
    """Return the untouched run; `name={...}` merges values into the values of a method."""
    rows = [replace(row, values={**row.values, **changes.get(name, {})}) for name, row in untouched().items()]
    return Results("here", {row.id: row for row in rows})


def failures(kept, latest):
    """Return the violations as (measure, method)."""
    verdict = compare.decide(kept, latest)
    assert verdict.passed == (not verdict.violations)
    return {(change.row.measure, change.row.method) for change in verdict.violations}


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
    latest = baseline.update_baseline(None, runs, "why").rows[ROW.id].measures["energy drift max"]
    assert (latest.spread, latest.limit) == (0.3, pytest.approx(1e-3 + baseline.SPREADS * 0.3, rel=1e-15))


def test_the_history_has_every_change():
    both = changed(values={"energy drift max": 5e-3})
    second = baseline.update_baseline(KEPT, [replace(both, rows={**both.rows, OTHER.id: OTHER})], " again ")
    entry = second.history[1]
    assert (entry["reason"], entry["added"], entry["removed"], entry["changed"]) == ("again", [OTHER.id], [], [ROW.id])
    third = baseline.update_baseline(second, [Results("here", {OTHER.id: OTHER})], "less")
    assert (third.history[2]["removed"], third.history[2]["changed"]) == ([ROW.id], [])


def test_rows_that_a_run_left_out_stay():
    """An update after a run with `-k` removed 75 of 77 rows."""
    chosen = Results("here", {OTHER.id: OTHER}, left_out=(ROW.id,))
    accepted = baseline.update_baseline(KEPT, [chosen], "one more")
    assert set(accepted.rows) == {ROW.id, OTHER.id}
    assert accepted.history[-1]["removed"] == []
    skipped = Results("here", {ROW.id: replace(ROW, outcome=SKIPPED)}, left_out=(OTHER.id,))
    assert set(baseline.update_baseline(accepted, [skipped], "not that one").rows) == {OTHER.id}
    assert set(baseline.update_baseline(accepted, [Results("here", {OTHER.id: OTHER})], "it is gone").rows) == {OTHER.id}


def test_rows_that_a_run_left_out_are_counted_and_no_violations():
    both = baseline.update_baseline(KEPT, [Results("here", {ROW.id: ROW, OTHER.id: OTHER})], "both")
    verdict = compare.decide(both, Results("here", {OTHER.id: OTHER}, left_out=(ROW.id,)))
    assert (verdict.passed, verdict.rows) == (True, 1)
    assert verdict.notes == ("not compared: 1 rows of the baseline, which were not selected",)
    assert not compare.decide(both, Results("here", {OTHER.id: OTHER})).passed
    assert not compare.decide(both, Results("here", {}, left_out=(ROW.id,))).passed  # the other one is missing
    with pytest.raises(baseline.NothingToCompare, match="none of the 2 rows"):
        compare.decide(both, Results("here", {}, left_out=(ROW.id, OTHER.id)))


def test_runs_that_disagree_are_refused():
    for other in (changed(definition="new"), changed(engine="new"), Results("here", {OTHER.id: OTHER})):
        with pytest.raises(BadInput, match="disagree"):
            baseline.update_baseline(None, [RUN, other], "why")


@pytest.mark.parametrize(
    "changes",
    [
        {"outcome": FAILED},
        {"values": {"rate error max": float("nan")}},
        {"values": {"iterations": float("inf")}},
        {"values": {results.ENERGY_DRIFT: 1.01}},
        {"spreads": {results.ENERGY_DRIFT: float("nan")}},
        {"spreads": {results.ENERGY_DRIFT: -1.0}},  # the limit would be on the other side of the value
    ],
)
def test_a_failure_cannot_be_accepted(changes):
    with pytest.raises(BadInput):
        baseline.update_baseline(KEPT, [changed(**changes)], "no")
    assert not baseline.update_baseline(None, [changed(outcome=SKIPPED)], "why").rows


def test_a_baseline_survives_its_file_and_its_hash_is_right(tmp_path):
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


def test_a_baseline_with_times_is_read_only_to_be_replaced(tmp_path):
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


def test_accuracy_and_time_go_to_bencher(tmp_path):
    results.write(changed(seconds=2e-6), tmp_path / results.FILE)
    found = json.loads((tmp_path / results.HISTORY).read_text())[ROW.id]
    assert found["latency"] == {"value": pytest.approx(2000)}  # ns
    assert found["energy drift max"] == {"value": 1e-3, "lower_value": 0.00099, "upper_value": 0.00101}
    assert results.to_bencher(changed(outcome=FAILED)) == {}


def test_results_come_back_from_their_file(tmp_path):
    path = tmp_path / "new" / "results.json"
    latest = changed(values={"energy drift max": math.nan})
    results.write(latest, path)
    assert math.isnan(results.read(path).rows[ROW.id].values["energy drift max"])
    results.write(RUN, path)
    assert results.read(path) == RUN
    for text in ("[]", "{}", "{", '{"rows": [1], "machine": "", "commit": ""}'):
        path.write_text(text)
        with pytest.raises(BadInput, match="results"):
            results.read(path)
    with pytest.raises(BadInput, match="No such file"):
        results.read(tmp_path / "nothing.json")


@dataclass(frozen=True)
class NoGyroscopicTerm(cv.Method):
    """A negative control: the rates of the body are constant."""

    family: ClassVar[str] = "control"
    role: ClassVar[cv.Role] = cv.Role.OURS

    @property
    def order(self):
        return 2

    def prepare(self, scene, grid):
        w = np.array(scene.w_WB_B0)
        turns = np.array([rotation_about(w, np.linalg.norm(w) * t) for t in grid.t])
        return lambda: cv.Trajectory(scene, grid.t, scene.R_WB0 @ turns, np.tile(w, (len(turns), 1)), self.label)


# ---------------------------------------------------------------------------------------------------------- measured rows


def test_an_untouched_run_passes():
    again = {row.id: row for row in map(measured, METHODS)}
    assert failures(accepted(), Results("elsewhere", again)) == set()


def test_one_more_newton_iteration(monkeypatch):
    reduced.find_coefficients.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(reduced, "TOLERANCE", 1e-30)
        more = measured(SECOND).values
    reduced.find_coefficients.cache_clear()
    assert ("iterations", SECOND) in failures(accepted(), run(**{SECOND: more}))  # measured 299 instead of 204 in 100 steps


def test_a_negative_control_in_place_of_the_method():
    latest = failures(accepted(), run(**{SECOND: measured(SECOND, NoGyroscopicTerm()).values}))
    assert {("attitude error max", SECOND), ("rate error max", SECOND), ("momentum drift max", SECOND)} <= latest


def test_every_measure_of_a_row_is_gated():
    for method_name, row in untouched().items():
        for name, value in row.values.items():
            # An order that falls by 0.2, a drift of ten times as much, one more iteration.
            worse = value - 0.2 if name == baseline.ORDER else 10 * value if "drift" in name else value + 1
            assert failures(accepted(), run(**{method_name: {name: worse}})) == {(name, method_name)}
            assert failures(accepted(), run(**{method_name: {name: math.nan}})) == {(name, method_name)}


def test_an_order_is_not_fitted_to_errors_of_round_off():
    order = points.fit_order(points.Point(scene("lagrange_top"), method("projected")))[baseline.ORDER]
    assert order == pytest.approx(8, abs=0.1)  # measured 7.94; with errors of 1e-14 as well 7.88, 7.84 and 7.78 by compiler


def test_the_definition_changes_with_the_motion_and_the_engine_with_its_version():
    longer = points.Point(scene("brick_flip:t_end=2"), method(SECOND)).definition
    assert longer != untouched()[SECOND].definition
    assert untouched()[ENGINE].engine.startswith("mujoco==")


# ----------------------------------------------------------------------------------------------------- rows with chosen values


def test_the_same_results_pass_and_values_at_their_limit():
    assert compare.decide(KEPT, RUN) == compare.Decision((), (), 1)
    assert str(compare.decide(KEPT, RUN)) == "gate: passed, 1 rows, 0 violations"
    assert compare.decide(KEPT, changed(values={"energy drift max": 1e-3 + 5e-5, "observed order": 1.95})).passed


def test_a_violation_has_the_value_before_and_now_and_the_limit():
    verdict = compare.decide(KEPT, changed(values={"energy drift max": 2e-3, "observed order": 1.9}))
    assert [tuple(change.texts.values()) for change in verdict.violations] == [
        ("energy drift max", "brick", "reduced", "0.001", "0.002", "at most 0.00105 (spread 1e-05 in 1 run)"),
        ("observed order", "brick", "reduced", "2", "1.9", "at least 1.95 (spread 0.001 in 1 run)"),
    ]
    assert "| observed order | brick | reduced | 2 | 1.9 |" in verdict.markdown_text()
    assert "--update" in str(verdict)


def test_a_limit_that_is_no_number_is_reached_by_no_value():
    (kept,) = KEPT.rows.values()
    measures = {name: replace(allowed, limit=float("nan")) for name, allowed in kept.measures.items()}
    without = replace(KEPT, rows={ROW.id: replace(kept, measures=measures)})
    assert failures(without, RUN) == {(name, "reduced") for name in measures}


TWO_NEW = {"new": replace(ROW, id="new"), "z": replace(ROW, id="z")}


@pytest.mark.parametrize(
    ("latest", "expected"),
    [
        (replace(RUN, rows={}), ("row", OK, "missing", "ok")),
        (replace(RUN, rows={"new": replace(ROW, id="new", method="other")}), ("row", OK, "missing", "ok")),
        (replace(RUN, rows=TWO_NEW), ("row", OK, "renamed new", "ok")),
        *((changed(outcome=outcome), ("row", OK, outcome, "ok")) for outcome in (SKIPPED, FAILED)),
        (changed(definition="new"), ("definition", "hash", "new", "hash")),
        (changed(engine="mujoco==9"), ("engine version", "", "mujoco==9", "")),
    ],
)
def test_rows_that_cannot_be_compared(latest, expected):
    (each,) = compare.decide(KEPT, latest).violations
    assert (each.row.measure, each.was, each.now, each.allowed) == expected
    assert (each.row.scene, each.row.method) == ("brick", "reduced")


def test_a_measure_that_is_gone():
    values = {name: value for name, value in ROW.values.items() if name != "energy drift max"}
    gone = Results("here", {ROW.id: replace(ROW, values=values)})
    assert failures(KEPT, gone) == {("energy drift max", "reduced")}


def test_a_row_that_is_new_is_a_note_if_it_passed():
    both = replace(RUN, rows={**RUN.rows, "new": replace(ROW, id="new", method="new")})
    assert compare.decide(KEPT, both).notes == ("unbaselined: new",)
    failed = replace(RUN, rows={**RUN.rows, "new": replace(ROW, id="new", outcome=FAILED)})
    assert compare.decide(KEPT, failed) == compare.Decision((), (), 1)


def test_a_baseline_without_rows_is_a_violation():
    assert failures(baseline.Baseline({}, []), RUN) == {("rows", "all")}


@pytest.mark.parametrize(("drift", "failed"), [(0.36, False), (1.0, False), (1.01, True), (2.7e11, True), (math.nan, True)])
def test_a_runaway_is_a_failure_with_any_baseline(drift, failed):
    values = {results.ENERGY_DRIFT: drift}
    row = replace(OTHER, values=values)
    unknown = compare.decide(KEPT, replace(RUN, rows={**RUN.rows, row.id: row})).violations  # a row without a baseline
    assert [each.row.measure for each in unknown] == [results.ENERGY_DRIFT] * failed
    as_before = baseline.BaselineRow(
        "top", "gauss", row.engine, "other", {results.ENERGY_DRIFT: baseline.Allowed(drift, 0, 1, 3e11)}
    )
    known = compare.decide(baseline.Baseline({row.id: as_before}, []), Results("here", {row.id: row}))
    assert known.passed != failed


def test_a_gain_as_large_as_a_failure_is_noted():
    better = compare.decide(KEPT, changed(values={"energy drift max": 1e-3 - 6e-5, "observed order": 2.06}))
    assert better.passed
    assert [note.partition(",")[0] for note in better.notes] == ["better: energy drift max", "better: observed order"]
    same = compare.decide(KEPT, changed(values={"energy drift max": 1e-3 - 4e-5, "observed order": 2.04}))
    assert not same.notes
    assert not compare.decide(KEPT, changed(definition="new", values={"energy drift max": 0.0})).notes


@pytest.fixture
def gate(tmp_path, monkeypatch):
    """Return exit code and output of the command in a folder with results, worse ones, and a baseline."""
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
