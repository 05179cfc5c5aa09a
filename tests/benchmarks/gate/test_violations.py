"""Each way in which a run can be worse than its baseline, planted, and the failure that must name it."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import conservative as cv
from conservative.attitude import rotation_about
from conservative.benchmarks.gate import baseline, compare
from conservative.benchmarks.gate.results import Results, Status
from conservative.benchmarks.suite import points
from conservative.registry import method, scene

from .gate_rows import ENGINE, FOURTH, MACHINE, METHODS, SECOND, STEP, TURN, failures, row_of, with_row


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


def test_an_untouched_run_passes(kept, untouched):
    again = [row_of(name) for name in METHODS]
    assert again[0].time_ratio == pytest.approx(STEP / TURN, rel=1e-12)
    assert failures(kept, Results(MACHINE, {row.id: row for row in again}))[0] == set()


def test_one_more_newton_iteration(kept, untouched):
    row = row_of(SECOND, method("reduced:tol=1e-40"))
    found, text = failures(kept, with_row(untouched, SECOND, values=row.values))
    assert ("iterations", SECOND) in found  # measured 299 instead of 204 in 100 steps
    (single,) = (each.values["iterations"] + 1 for each in untouched.rows.values() if each.method == SECOND)
    assert failures(kept, with_row(untouched, SECOND, values={"iterations": single}))[0] == {("iterations", SECOND)}
    assert "--update" in text


def test_order_3_8_instead_of_4(kept, untouched):
    found, text = failures(kept, with_row(untouched, FOURTH, values={"observed order": 3.8}))
    assert found == {("observed order", FOURTH)}
    assert "is 3.8, allowed at least 3.9" in text


def test_energy_drift_10_times_larger(kept, untouched):
    for name in METHODS:
        (drift,) = (row.values["energy drift max"] for row in untouched.rows.values() if row.method == name)
        found, _ = failures(kept, with_row(untouched, name, values={"energy drift max": 10 * drift}))
        assert found == {("energy drift max", name)}


def test_a_negative_control_in_place_of_the_method(kept, untouched):
    row = row_of(SECOND, NoGyroscopicTerm())
    found, _ = failures(kept, with_row(untouched, SECOND, values=row.values))
    assert {("attitude error max", SECOND), ("rate error max", SECOND), ("momentum drift max", SECOND)} <= found


@pytest.mark.parametrize("measure", ["attitude error max", "energy drift max", "iterations", "observed order"])
def test_nan(kept, untouched, measure):
    assert failures(kept, with_row(untouched, SECOND, values={measure: float("nan")}))[0] == {(measure, SECOND)}


def test_a_time_that_is_nan_or_missing(kept, untouched):
    for ratio in (float("nan"), None):
        assert failures(kept, with_row(untouched, SECOND, time_ratio=ratio))[0] == {("time ratio", SECOND)}


def test_a_measure_that_is_gone(kept, untouched):
    (row,) = (row for row in untouched.rows.values() if row.method == SECOND)
    values = {name: value for name, value in row.values.items() if name != "energy drift max"}
    found = replace(untouched, rows={**untouched.rows, row.id: replace(row, values=values)})
    assert failures(kept, found)[0] == {("energy drift max", SECOND)}


def test_a_row_removed_or_renamed(kept, untouched):
    (id,) = (id for id, row in untouched.rows.items() if row.method == FOURTH)
    rows = {other: row for other, row in untouched.rows.items() if other != id}
    found, text = failures(kept, replace(untouched, rows=rows))
    assert found == {("row", FOURTH)}
    assert "was passed, is missing" in text
    renamed = replace(untouched, rows={**rows, "other": replace(untouched.rows[id], id="other")})
    found, text = failures(kept, renamed)
    assert found == {("row", FOURTH)}
    assert "is renamed other" in text
    assert "note: unbaselined: other" in text


@pytest.mark.parametrize("status", ["skipped", "failed", "error", "xfailed"])
def test_a_row_that_did_not_pass(kept, untouched, status):
    found, text = failures(kept, with_row(untouched, SECOND, status=Status(status)))
    assert found == {("row", SECOND)}
    assert f"was passed, is {status}" in text


def test_an_engine_of_another_version(kept, untouched):
    found, text = failures(kept, with_row(untouched, ENGINE, engine="mujoco==3.9.9/Euler"))
    assert found == {("engine version", ENGINE)}
    assert "is mujoco==3.9.9/Euler" in text


def test_another_definition(kept, untouched):
    longer = points.Point(scene("brick_flip:t_end=2"), method(SECOND)).definition
    assert failures(kept, with_row(untouched, SECOND, definition=longer))[0] == {("definition", SECOND)}


def test_a_baseline_of_a_foreign_machine(kept, untouched):
    elsewhere = replace(untouched, machine="another")
    found, text = failures(kept, elsewhere)
    assert found == {("foreign machine", "all")}
    assert "was this one, is another" in text
    found, text = failures(kept, elsewhere, "known")
    assert found == set()
    assert compare.judge(kept, elsewhere).passed  # which is the default
    assert "note: unbaselined machine" in text
    worse = replace(with_row(untouched, SECOND, values={"rate error max": 1.0}), machine="another")
    assert failures(kept, worse, "known")[0] == {("rate error max", SECOND)}  # all but time is gated everywhere
    both = baseline.update_baseline(kept, [elsewhere], "a second machine")
    assert failures(both, elsewhere)[0] == failures(both, untouched)[0] == set()


def test_a_baseline_without_rows(untouched):
    assert failures(baseline.Baseline({}, []), untouched)[0] == {("rows", "all")}
