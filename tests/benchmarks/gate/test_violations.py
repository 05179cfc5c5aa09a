"""Each way in which a run can be worse than its baseline, planted, and the violation that must name it."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.gate import baseline, compare, results
from conservative.benchmarks.gate.results import Results, Status
from conservative.benchmarks.suite import points
from conservative.registry import method, scene

from .gate_rows import (
    ENGINE,
    FOURTH,
    KEPT,
    METHODS,
    OTHER,
    ROW,
    RUN,
    SECOND,
    accepted,
    changed,
    failures,
    measured,
    run,
    untouched,
)


@dataclass(frozen=True)
class NoGyroscopicTerm(cv.Method):
    """A negative control: the body keeps its rates."""

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


def test_one_more_newton_iteration():
    more = measured(SECOND, method("reduced:tol=1e-40")).values
    assert ("iterations", SECOND) in failures(accepted(), run(**{SECOND: more}))  # measured 299 instead of 204 in 100 steps
    single = {"iterations": untouched()[SECOND].values["iterations"] + 1}
    assert failures(accepted(), run(**{SECOND: single})) == {("iterations", SECOND)}


def test_energy_drift_10_times_larger():
    for name, row in untouched().items():
        worse = {"energy drift max": 10 * row.values["energy drift max"]}
        assert failures(accepted(), run(**{name: worse})) == {("energy drift max", name)}


def test_a_negative_control_in_place_of_the_method():
    found = failures(accepted(), run(**{SECOND: measured(SECOND, NoGyroscopicTerm()).values}))
    assert {("attitude error max", SECOND), ("rate error max", SECOND), ("momentum drift max", SECOND)} <= found


def test_every_measure_of_a_row_is_gated():
    for name, value in untouched()[SECOND].values.items():
        worse = {name: value - 1 if name == baseline.ORDER else value + 1}
        assert failures(accepted(), run(**{SECOND: worse})) == {(name, SECOND)}
        assert failures(accepted(), run(**{SECOND: {name: math.nan}})) == {(name, SECOND)}


def test_order_3_8_instead_of_4():
    assert failures(accepted(), run(**{FOURTH: {"observed order": 3.8}})) == {("observed order", FOURTH)}


def test_the_definition_changes_with_the_motion_and_the_engine_with_its_version():
    longer = points.Point(scene("brick_flip:t_end=2"), method(SECOND)).definition
    assert longer != untouched()[SECOND].definition
    assert untouched()[ENGINE].engine.startswith("mujoco==")


# ----------------------------------------------------------------------------------------------------- rows with chosen values


def test_the_same_results_pass_and_values_at_their_limit():
    assert compare.judge(KEPT, RUN) == compare.Verdict((), (), 1)
    assert str(compare.judge(KEPT, RUN)) == "gate: passed, 1 rows, 0 violations"
    assert compare.judge(KEPT, changed(values={"energy drift max": 1e-3 + 5e-5, "observed order": 1.95})).passed


def test_a_violation_has_the_value_before_and_now_and_the_limit():
    verdict = compare.judge(KEPT, changed(values={"energy drift max": 2e-3, "observed order": 1.9}))
    assert [tuple(vars(each).values()) for each in verdict.violations] == [
        ("energy drift max", "brick", "reduced", "0.001", "0.002", "at most 0.00105 (spread 1e-05 in 1 runs)"),
        ("observed order", "brick", "reduced", "2", "1.9", "at least 1.95 (spread 0.001 in 1 runs)"),
    ]
    assert "| observed order | brick | reduced | 2 | 1.9 |" in verdict.markdown_text()
    assert "--update" in str(verdict)


TWO_NEW = {"new": replace(ROW, id="new"), "z": replace(ROW, id="z")}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (replace(RUN, rows={}), ("row", "passed", "missing", "passed")),
        (replace(RUN, rows={"new": replace(ROW, id="new", method="other")}), ("row", "passed", "missing", "passed")),
        (replace(RUN, rows=TWO_NEW), ("row", "passed", "renamed new", "passed")),
        *(
            (changed(status=Status(each)), ("row", "passed", each, "passed"))
            for each in ("skipped", "failed", "error", "xfailed")
        ),
        (changed(definition="new"), ("definition", "hash", "new", "hash")),
        (changed(engine="mujoco==9"), ("engine version", "", "mujoco==9", "")),
    ],
)
def test_rows_that_cannot_be_compared(found, expected):
    (each,) = compare.judge(KEPT, found).violations
    assert (each.measure, each.was, each.now, each.allowed) == expected
    assert (each.scene, each.method) == ("brick", "reduced")


def test_a_measure_that_is_gone():
    values = {name: value for name, value in ROW.values.items() if name != "energy drift max"}
    gone = Results("here", {ROW.id: replace(ROW, values=values)})
    assert failures(KEPT, gone) == {("energy drift max", "reduced")}


def test_a_row_that_is_new_is_a_note_if_it_passed():
    both = replace(RUN, rows={**RUN.rows, "new": replace(ROW, id="new", method="new")})
    assert compare.judge(KEPT, both).notes == ("unbaselined: new",)
    failed = replace(RUN, rows={**RUN.rows, "new": replace(ROW, id="new", status=Status.FAILED)})
    assert compare.judge(KEPT, failed) == compare.Verdict((), (), 1)


def test_a_baseline_without_rows_is_a_violation():
    assert failures(baseline.Baseline({}, []), RUN) == {("rows", "all")}


@pytest.mark.parametrize(("drift", "failed"), [(0.36, False), (1.0, False), (1.01, True), (2.7e11, True), (math.nan, True)])
def test_a_run_that_ran_away_is_a_failure_whatever_the_baseline_is(drift, failed):
    values = {results.ENERGY_DRIFT: drift}
    row = replace(OTHER, values=values)
    unknown = compare.judge(KEPT, replace(RUN, rows={**RUN.rows, row.id: row})).violations  # a row without a baseline
    assert [each.measure for each in unknown] == [results.ENERGY_DRIFT] * failed
    as_before = baseline.BaselineRow(
        "top", "gauss", row.engine, "other", {results.ENERGY_DRIFT: baseline.Allowed(drift, 0, 1, 3e11)}
    )
    known = compare.judge(baseline.Baseline({row.id: as_before}, []), Results("here", {row.id: row}))
    assert known.passed != failed


def test_a_gain_as_large_as_a_failure_is_noted():
    better = compare.judge(KEPT, changed(values={"energy drift max": 1e-3 - 6e-5, "observed order": 2.06}))
    assert better.passed
    assert [note.partition(",")[0] for note in better.notes] == ["better: energy drift max", "better: observed order"]
    same = compare.judge(KEPT, changed(values={"energy drift max": 1e-3 - 4e-5, "observed order": 2.04}))
    assert not same.notes
    assert not compare.judge(KEPT, changed(definition="new", values={"energy drift max": 0.0})).notes
