"""What two versions differ in, from rows with chosen values: what fails, what is said beside that, and what passes."""

import math
from dataclasses import replace

import pytest

from conservative.benchmarks.comparison.compare import TIME, Place, judge, judge_values, measure_rows
from conservative.benchmarks.comparison.side import Setting
from conservative.benchmarks.gate.results import Status
from conservative.benchmarks.suite import points
from conservative.benchmarks.suite.points import GatedValue
from conservative.errors import BadInput
from conservative.references.worker.client import EngineCrashed
from conservative.registry import method, scene

from .made_up import BASE, HEAD, PLACE, TIMED, VALUES, found, timed, version

SAME = (1.0, 0.98, 1.02)
SLOW = (1.1, 1.08, 1.12)


def compare(was, now, time=None):
    rows = [{TIMED.id: each} if each else {} for each in (was, now)]
    return judge(BASE, HEAD, *rows, {TIMED.id: time} if time else {})


def violations(*arguments):
    result = compare(*arguments)
    assert result.passed == (not result.violations)
    return {each.measure for each in result.violations}


def test_the_same_passes_and_says_nothing():
    result = compare(found(), found(), timed(SAME))
    assert result.passed
    assert result.notes == ()


WORSE = {
    "attitude error max": 1.01e-3,
    "rate error max": 1.01e-3,
    "energy drift max": 1e-14,
    "steps": 601.0,
    "observed order": 1.9,
}


@pytest.mark.parametrize("name", WORSE)
def test_a_value_that_is_worse_fails(name):
    # By `judge_values`, as the rows of a version are made, so that no measure gets lost there either.
    was, now = (
        judge_values(found().row, {key: GatedValue(value, 0.0) for key, value in values.items()})
        for values in (VALUES, VALUES | {name: WORSE[name]})
    )
    assert violations(was, now) == {name}
    assert violations(now, was) == set()


def test_no_measure_of_a_real_row_is_ignored():
    values = points.measure(points.Point(scene("lagrange_top:t_end=0.5"), method("reduced")))
    assert {"rate error max", "vertical momentum drift max", "iterations", "observed order"} <= values.keys()
    was = judge_values(found().row, values)
    for name, each in values.items():
        worse = GatedValue(each.value + (-0.5 if name == "observed order" else 0.5), each.spread)
        assert violations(was, judge_values(found().row, values | {name: worse})) == {name}


def test_last_digits_fail_nothing():
    assert violations(found(), found(attitude_error_max=1e-3 * (1 + 1e-8), energy_drift_max=9e-16)) == set()


def test_a_time_fails_where_it_is_slower_twice():
    (each,) = compare(found(), found(), timed(SLOW, SLOW)).violations
    assert (each.measure, each.scene, each.method) == (TIME, "brick_flip", "reduced")
    assert each.now == "1.100 times as long (1.080 to 1.120)"
    assert compare(found(), found(), timed(SLOW, SAME)).notes == (
        "brick_flip, reduced: looked slower (1.100), and was not when measured again (1.000)",
    )


def test_a_time_that_cannot_be_measured_fails():
    (each,) = compare(found(), found(), timed((math.nan,) * 3, reason="crashed (signal 11)")).violations
    assert each.now == "crashed (signal 11)"


def test_a_row_that_fails_now_or_is_gone_fails():
    failed = found("diverged at 1 s", status=Status.FAILED)
    assert violations(found(), failed) == {"row"}
    assert violations(found(), None) == {"row"}
    assert compare(found(), failed).notes == ("brick_flip, reduced: is without values: diverged at 1 s",)


def test_what_is_new_or_failed_before_has_nothing_to_be_compared_with():
    failed = found("diverged at 1 s", status=Status.FAILED)
    old = replace(found(), row=replace(found().row, id="a", method="gauss"))
    new = judge(BASE, HEAD, {"a": old}, {"a": old, TIMED.id: found()}, {})
    assert new.passed
    assert new.notes == ("brick_flip, reduced: was not there",)
    mended = judge(BASE, HEAD, {"a": old, TIMED.id: failed}, {"a": old, TIMED.id: found()}, {})
    assert mended.passed
    assert mended.notes == ("brick_flip, reduced: was without values: diverged at 1 s",)


def test_without_a_row_that_passed_there_is_no_verdict():
    assert violations(found("diverged", status=Status.FAILED), found()) == {"rows"}
    assert violations(None, found()) == {"rows"}


def test_what_differs_between_environments_is_said():
    other = version("is", "numpy==2.1", "numba==0.68", python="3.12.1")
    result = judge(BASE, other, {TIMED.id: found()}, {TIMED.id: found()}, {})
    assert result.notes == (
        "another Python: was 3.11.7, is 3.12.1",
        "another numba: was not there, is numba==0.68",
        "another numpy: was numpy==2.0, is numpy==2.1",
    )


RUNAWAY = "energy drift max is 2.7e+11, more than 1: the run failed"


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("energy drift max", 2.7e11, RUNAWAY),
        ("energy drift max", math.inf, "energy drift max is inf, more than 1: the run failed; energy drift max is inf"),
        ("rate error max", math.nan, "rate error max is nan"),
    ],
)
def test_a_run_that_ran_away_failed_whatever_it_says(name, value, reason):
    row = judge_values(found().row, {name: GatedValue(value, 0.0)})
    assert (row.row.status, row.reason) == (Status.FAILED, reason)
    assert judge_values(found().row, {"energy drift max": GatedValue(0.36, 0.0)}).reason == ""


class Answers:
    """A side that answers tasks from a table, or does not survive them."""

    def __init__(self, **answers):
        self.answers = answers

    def ask(self, task, **values):
        if task not in self.answers:
            raise EngineCrashed("ImportError: no such thing")
        return self.answers[task]


SETTING = Setting("reduced", "made==1/reduced", 2, "")


def test_a_scene_that_a_version_does_not_have_is_an_error_of_its_rows():
    (each,) = measure_rows(Answers(), PLACE, [SETTING])
    assert each.row.status is Status.ERROR
    assert "no such thing" in each.reason


def definition(scene):
    """The scene as a version answers it."""
    return {
        "inertia": scene.body.inertia,
        "R_WB0": scene.R_WB0,
        "w_WB_B0": scene.w_WB_B0,
        "ends": [scene.t_end, scene.dt],
        "energies": [],
        "invariants": [invariant.name for invariant in scene.invariants],
    }


def test_a_scene_of_another_motion_is_not_compared():
    place = Place.of("brick_flip")
    heavier = definition(place.scene) | {"inertia": place.scene.body.inertia * 2}
    (each,) = measure_rows(Answers(describe_scene=heavier), place, [SETTING])
    assert each.reason == "another motion"
    assert violations(found(), each) == {"definition"}


def test_a_scene_that_a_version_cannot_do_is_skipped():
    place = Place.of("brick_flip")
    answers = Answers(
        describe_scene=definition(place.scene), describe_pair={"unsupported": "for tops only", "longest_step": 1.0}
    )
    (each,) = measure_rows(answers, place, [SETTING])
    assert (each.row.status, each.reason) == (Status.SKIPPED, "for tops only")


def test_a_field_that_turns_is_told_from_another_one():
    orbits = [Place.of(name).definition for name in ("stable_satellite", "unstable_satellite")]
    assert orbits[0] != orbits[1]


def test_an_unknown_scene_is_refused():
    with pytest.raises(BadInput, match="scene: got 'nowhere'"):
        Place.of("nowhere")
