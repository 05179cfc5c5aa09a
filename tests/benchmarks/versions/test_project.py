"""Violations and notes of two versions, from rows with chosen values."""

import math
from dataclasses import replace

import pytest

from conservative.benchmarks.suite import points
from conservative.benchmarks.suite.motion import motion_of
from conservative.benchmarks.versions import project
from conservative.benchmarks.versions.prices import Price, read_prices
from conservative.benchmarks.versions.project import MOTION, TIME, ProjectSide, decide, decide_values, faster
from conservative.benchmarks.versions.times import Ratio
from conservative.errors import BadInput
from conservative.outcome import OK, Outcome, OutcomeKind
from conservative.references.worker.client import EngineCrashed
from conservative.registry import method, scene

from .made_up import HEAD, comparison, row, timed, version

SAME = (1.0, 0.98, 1.02)
SLOW = (1.1, 1.08, 1.12)
DIVERGED = Outcome(OutcomeKind.DIVERGED, time=1.0)


def compare(was, now, time=None):
    return decide(comparison((was, now, time)) if was or now else comparison())


def violations(*arguments):
    result = compare(*arguments)
    assert result.passed == (not result.violations)
    return {change.row.measure for change in result.violations}


def test_equal_rows_pass_without_notes():
    result = compare(row(), row(), timed(SAME))
    assert result.passed
    assert result.notes == ()


def test_no_measure_of_a_real_row_is_ignored():
    values, spreads = points.measure(points.Point(scene("lagrange_top:t_end=0.1"), method("reduced")))
    assert {"rate error max", "vertical momentum drift max", "iterations", "observed order"} <= values.keys()
    was = decide_values(row(), values, spreads)
    for name, value in values.items():
        worse = value + (-0.5 if name == "observed order" else 0.5)
        now = decide_values(row(), values | {name: worse}, spreads)
        assert (violations(was, now), violations(now, was)) == ({name}, set())


def test_differences_in_the_last_digits_pass():
    assert violations(row(), row(attitude_error_max=1e-3 * (1 + 1e-8), energy_drift_max=9e-16)) == set()


def test_a_time_fails_if_it_is_slower_twice():
    (each,) = compare(row(), row(), timed(SLOW, SLOW)).violations
    assert each.row == ("brick_flip", "reduced", TIME, "")
    assert (each.now, str(each.now)) == (Ratio(*SLOW, 7), "1.100 times as long (1.080 to 1.120)")
    assert compare(row(), row(), timed(SLOW, SAME)).notes == (
        "brick_flip, reduced: looked slower (1.100), and was not when measured again (1.000)",
    )


def test_a_time_that_cannot_be_measured_fails():
    (each,) = compare(row(), row(), timed((math.nan,) * 3, reason="crashed (signal 11)")).violations
    assert each.now == "crashed (signal 11)"


def test_a_row_that_fails_now_or_is_gone_fails():
    failed = row(DIVERGED)
    assert violations(row(), failed) == {"row"}
    assert violations(row(), None) == {"row"}
    assert compare(row(), failed).notes == ("brick_flip, reduced: is without values: diverged after t = 1 s",)


def test_another_motion_is_one_violation_with_its_cause():
    lost = row(attitude_error_max=3.1, rate_error_max=5.0, energy_drift_max=0.5)
    (each,) = compare(row(), replace(lost, mistake="no torque", cause="no torque")).violations
    assert (each.row.measure, each.allowed) == (MOTION, "")
    assert "no torque" in each.finding
    assert violations(row(), lost) == {MOTION}  # without a cause
    assert violations(row(), replace(row(), mistake="late", cause="late")) == {MOTION}  # which the scene does not show
    failed = replace(row(DIVERGED), mistake="no torque", cause="no torque")
    assert violations(row(), failed) == {MOTION}
    assert violations(row(), row(attitude_error_max=0.5)) == {"attitude error max"}  # an error may have grown


def test_a_motion_that_is_lost_in_both_versions_is_never_faster():
    was, now = row(attitude_error_max=3.13877), row(attitude_error_max=3.14159, rate_error_max=9.0, observed_order=0.1)
    line = comparison((was, now, timed((0.1, 0.09, 0.11)))).lines[0]
    assert not faster(line)
    assert faster(replace(line, results=(row(), row())))
    assert violations(was, now) == set()  # half a turn says nothing
    assert violations(was, replace(now, values={**now.values, "energy drift max": 0.1})) == {"energy drift max"}
    assert violations(was, now, timed(SLOW, SLOW)) == {TIME}
    known = replace(was, mistake="no torque", cause="no torque")
    assert violations(was, replace(now, mistake="no torque", cause="no torque")) == {MOTION}
    assert violations(known, replace(now, mistake="no torque", cause="no torque")) == set()
    assert any("no torque" in note for note in compare(known, replace(now, mistake="no torque", cause="no torque")).notes)


def test_a_longer_time_can_have_a_price(tmp_path):
    file = tmp_path / "conservative.toml"
    file.write_text('[engines]\na = "x"\n[accept-slower]\nreduced = "1.2x: more digits"\n')
    prices = read_prices(["other = 6x", "reduced=1.09x"], file)
    assert prices == {"reduced": Price(1.09, ""), "other": Price(6.0, "")}
    prices = read_prices([], file)
    slow = comparison((row(), row(), timed(SLOW, SLOW)))
    assert "more digits" in decide(slow, prices).notes[0]
    assert decide(slow, prices).passed
    assert not decide(slow, {"reduced": Price(1.07, "")}).passed
    assert decide(comparison((row(), row(), timed(SAME))), prices).notes == (
        f"reduced: no row needs the longer time, {prices['reduced']}",
    )
    broken = comparison((row(), row(), timed((math.nan,) * 3, reason="crashed")))
    assert not decide(broken, prices).passed


@pytest.mark.parametrize("text", ["reduced", "reduced=6", "reduced=0.5x", "=6x", "reduced=6x reason"])
def test_a_price_that_is_none_is_refused(text, tmp_path):
    with pytest.raises(BadInput, match="accept-slower: got "):
        read_prices([text], tmp_path / "conservative.toml")
    (tmp_path / "conservative.toml").write_text('[accept-slower]\nreduced = "6x"\n')  # in a file it needs a reason
    with pytest.raises(BadInput, match="accept-slower: got "):
        read_prices([], tmp_path / "conservative.toml")


def test_a_scene_that_is_not_supported_is_one_note():
    skipped = row(Outcome(OutcomeKind.UNSUPPORTED, "only free bodies"))
    result = decide(comparison((row(method="gauss"), row(method="gauss"), None), (skipped, skipped, None)))
    assert result.passed
    assert result.notes == ("reduced: not supported (only free bodies): brick_flip",)


def test_a_slow_method_is_measured_with_fewer_points():
    point = points.Point(scene("brick_flip"), method("textbook"))
    runs = []
    slow = replace(point, method=replace(point.method))
    object.__setattr__(slow.method, "solve", lambda scene, grid: runs.append(grid) or point.method.solve(scene, grid))
    values, _ = points.measure(slow, few=True)
    assert sum(grid.n_steps for grid in runs) <= 5 * point.grid.n_steps
    assert values["observed order"] == pytest.approx(point.method.order, abs=0.5)  # measured 4.42, of four coarse steps


def test_rows_that_are_new_or_failed_before_pass_with_a_note():
    failed = row(DIVERGED)
    old = row(method="gauss")
    new = decide(comparison((old, old, None), (None, row(), None)))
    assert new.passed
    assert new.notes == ("brick_flip, reduced: was not there",)
    mended = decide(comparison((old, old, None), (failed, row(), None)))
    assert mended.passed
    assert mended.notes == ("brick_flip, reduced: was without values: diverged after t = 1 s",)


def test_without_a_row_that_passed_there_is_no_verdict():
    assert violations(row(DIVERGED), row()) == {"rows"}
    assert violations(None, row()) == {"rows"}


def test_differences_between_environments_are_notes():
    other = version("is", "numpy==2.1", "numba==0.68", runtime="Python 3.12.1")
    result = decide(comparison((row(), row(), None), head=other))
    assert result.notes == (
        "another numba: was not there, is numba==0.68",
        "another numpy: was numpy==2.0, is numpy==2.1",
        "another runtime: was Python 3.11.7, is Python 3.12.1",
    )


RUNAWAY = "not conserved (energy drift max is 2.7e+11, more than 1: the run failed)"


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("energy drift max", 2.7e11, RUNAWAY),
        ("energy drift max", math.inf, "invalid result (energy drift max is inf)"),
        ("rate error max", math.nan, "invalid result (rate error max is nan)"),
    ],
)
def test_a_runaway_fails_without_an_error(name, value, reason):
    decided = decide_values(row(), {name: value}, {name: 0.0})
    assert str(decided.outcome) == reason
    assert decide_values(row(), {"energy drift max": 0.36}, {"energy drift max": 0.0}).outcome == OK


class Answers(ProjectSide):
    """A side that answers from a table, or crashes."""

    settings = [{"name": "reduced", "label": "made==1/reduced", "order": 2, "engine": ""}]  # noqa: RUF012

    def __init__(self, **answers):
        self.version, self.answers = HEAD, answers

    def ask(self, function, **values):
        if function not in self.answers:
            raise EngineCrashed("ImportError: no such thing")
        return self.answers[function]


def test_a_scene_that_a_version_does_not_have_is_an_error_of_its_rows():
    ((_, each),) = Answers().measure("brick_flip")
    assert each.outcome.kind is OutcomeKind.MISSING
    assert "no such thing" in each.outcome.reason


def definition(scene):
    """Return the description of a scene by a version."""
    return {
        "parts": [[]],
        "inertia": scene.body.inertia,
        "R_WB0": scene.R_WB0,
        "w_WB_B0": scene.w_WB_B0,
        "ends": [scene.t_end, scene.dt],
        "energies": [],
        "invariants": [invariant.name for invariant in scene.invariants],
    }


def test_a_scene_of_another_motion_is_not_compared():
    brick = scene("brick_flip")
    heavier = definition(brick) | {"inertia": brick.body.inertia * 2}
    ((_, each),) = Answers(describe_scene=heavier).measure("brick_flip")
    assert each.outcome == project.ANOTHER_SCENE
    assert violations(row(), each) == {"definition"}
    ((_, each),) = Answers(describe_scene=definition(brick) | {"parts": [[0.0, 0.0, 1.0]]}).measure("brick_flip")  # a rotor
    assert each.outcome == project.ANOTHER_SCENE


def test_a_scene_that_a_version_does_not_support_is_skipped():
    pair = {"unsupported": "for tops only", "longest_step": 1.0}
    answers = Answers(describe_scene=definition(scene("brick_flip")), describe_pair=pair)
    ((_, each),) = answers.measure("brick_flip")
    assert each.outcome == Outcome(OutcomeKind.UNSUPPORTED, "for tops only")


def test_fields_that_turn_have_different_definitions():
    assert motion_of("stable_satellite").key != motion_of("unstable_satellite").key


def test_methods_that_no_version_has_are_named():
    """They were left out without a word if another method was there."""
    settings = {"reduced", "reduced:order=4", "mujoco:RK4"}
    assert project.find_unknown(["reduced", "mujoco:RK4"], settings) == []
    assert project.find_unknown(["reduced", "nothing", "mujoco@4.0.0:RK4"], settings) == ["nothing", "mujoco@4.0.0:RK4"]


def test_an_unknown_scene_is_refused_before_any_work(monkeypatch):
    monkeypatch.setattr(project, "ProjectSide", None)
    with pytest.raises(BadInput, match="scene: got 'nowhere'"):
        project.compare_projects(HEAD, HEAD, ["nowhere"])
