"""The section of engines, on made-up measurements with known tables and pictures."""

import math
from functools import cache

import pytest

from conservative import BadInput, MissingEngine, registry
from conservative.benchmarks.measures import measurement
from conservative.benchmarks.measures.measure import Measure
from conservative.benchmarks.speed_ratio import cheapest, costs
from conservative.outcome import Outcome, OutcomeKind
from conservative.reports.document.model import Grade
from conservative.reports.rows.names import OF_ENGINES, of_classes
from conservative.reports.run.checkpoint import differences, terms
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import Plan, plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.sections.engines import (
    STUDIES,
    WORSE,
    engine_rows,
    every_setting,
    figure,
    picture_points,
    side_by_side,
)
from conservative.reports.sections.measured import Measured

from .made_up import SCENE, STEPS, at_step, named, over_steps
from .rows import point, row

NO_ORDER = Outcome(OutcomeKind.NO_ORDER, WORSE)
CRASHED = Outcome(OutcomeKind.CRASHED, "signal 11 (SIGSEGV)")
REFUSED = Outcome(OutcomeKind.UNSUPPORTED, "its adapter has free bodies")
GOOD, POOR, WRONG, SINGLE = "a==1/RK4", "a==1/Euler", "b==2/RK4", "c==3/default"


def measured_with(*groups, engines=None):
    """Rows of a report on the scene, whose engines are named."""
    rows = [row for group in groups for row in group]
    plan = Plan((registry.scene(SCENE),), (registry.method("reduced"),), (), named(rows) if engines is None else engines)
    return Measured(plan, Measurements(measurement.frame(rows), measurement.samples_frame([])), provenance([]))


@cache
def measured():
    return measured_with(
        at_step("a==1", "Euler", 3.0, as_installed=True, energy=0.22, direction="gained", turns=3, expected=1),
        over_steps("a==1", "Euler", (3.0, 3.0, 2.0, 1.0), 1.0),
        at_step("a==1", "RK4", 1e-6),
        over_steps("a==1", "RK4", (1e-1, 1e-2, 1e-3, 1e-4), 4.0),
        at_step("b==2", "RK4", 1e-3),
        over_steps("b==2", "RK4", (1e-1, 3e-2, 1e-2, 3e-3), 2.0),
        at_step("c==3", "default", 0.2, as_installed=True, bits=32),
        over_steps("c==3", "default", (0.9, 0.2, 0.4, 0.8), math.nan, outcome=NO_ORDER),
        at_step("d==4", "x", math.nan, outcome=CRASHED),
        at_step("e==5", "x", math.nan, outcome=REFUSED),
        at_step("e==5", "y", math.nan, outcome=REFUSED),
    )


@pytest.fixture(scope="module")
def rows():
    return {row.label: row for row in engine_rows(measured(), SCENE)}


@pytest.fixture(scope="module")
def settings(rows):
    table = every_setting(list(rows.values()), "0.01", SCENE)
    return {row[0]: dict(zip(table.header, row, strict=True)) for row in table.rows}


def test_accurate_rows_come_first_and_those_without_an_error_last(rows):
    assert list(rows) == [GOOD, WRONG, SINGLE, POOR, "d==4/x", "e==5/x", "e==5/y"]


def test_one_row_of_each_engine_is_its_best(rows):
    assert {label for label, row in rows.items() if row.best} == {GOOD, WRONG, SINGLE}
    assert {label for label, row in rows.items() if row.as_installed} == {POOR, SINGLE}


def test_values_are_those_measured(rows):
    row = rows[GOOD]
    assert (row.error, row.cells["order (expected)"].value, row.cells["bits"].value) == (1e-6, 4.0, 64)
    assert row.cells["longest step, s"].value == STEPS[0]
    assert row.second_time == pytest.approx(1e-6 / 0.025)  # the error of that very step
    assert math.isnan(rows[WRONG].second_time)  # no run gets there
    assert math.isnan(rows[POOR].cells["longest step, s"].value)


def test_an_order_that_is_lower_than_expected_is_marked(settings):
    assert str(settings[GOOD]["order (expected)"]) == "4.00 ± 0.01 (4)"
    assert settings[WRONG]["order (expected)"].text == "✗ 2.00 ± 0.01 (4)"
    assert settings[WRONG]["order (expected)"].grade is Grade.BAD


def test_an_engine_that_gets_worse_has_no_order(settings):
    assert str(settings[SINGLE]["order (expected)"]) == f"– none (4): {WORSE}"
    assert str(settings[SINGLE]["bits"]) == "32"


def test_turns_over_and_the_direction_of_energy_are_shown(settings):
    assert (str(settings[GOOD]["turns over"]), str(settings[POOR]["turns over"])) == ("✓ 2 of 2", "✗ 3 of 2")
    assert (str(settings[GOOD]["energy drift"]), str(settings[POOR]["energy drift"])) == ("✓ 1.0e-12", "✗ 0.22 gained")


def test_a_crash_is_a_marked_row_and_unsupported_settings_share_one(settings):
    assert str(settings["d==4/x"]["run"]) == "✗ crashed: signal 11 (SIGSEGV)"
    assert settings["d==4/x"]["run"].grade is Grade.BAD
    assert str(settings["e==5, 2 settings"]["run"]) == "– unsupported: its adapter has free bodies"
    assert list(settings)[-1] == "e==5, 2 settings"


def test_an_engine_as_installed_is_compared_with_its_best(rows):
    table = side_by_side(list(rows.values()), SCENE)
    assert [[str(cell) for cell in row[:3]] for row in table.rows] == [
        ["a==1", "as installed: Euler", "3"],
        ["a==1", "at its best: RK4", "1.0e-6"],
        ["b==2", "at its best: RK4", "1.0e-3"],
        ["c==3", "both: default", "0.2"],
        ["d==4", "x", "✗ crashed: signal 11 (SIGSEGV)"],
        ["e==5", "x", "– unsupported: its adapter has free bodies"],
    ]
    assert len(table.header) <= 6


def test_the_picture_has_two_lines_of_an_engine_and_one_entry_in_its_legend(rows):
    drawn = picture_points(list(rows.values()), measured().points)
    assert drawn["error"].max() == 1.0  # beyond, it is another motion
    lines = {tuple(line) for line in drawn[["name", "kind"]].itertuples(index=False)}
    assert lines == {("a==1", "at its best"), ("a==1", "as installed"), ("b==2", "at its best"), ("c==3", "at its best")}
    assert [entry.name for entry in figure(drawn, SCENE).legend] == ["a==1", "b==2", "c==3"]


def test_engines_that_are_named_are_methods_of_the_studies_of_scenes():
    without = plan_report([SCENE], ["reduced"], quick=True)
    planned = plan_report([SCENE], ["reduced", "pinocchio:RK4"], quick=True, engines=["pinocchio"])
    assert planned.names == without.names
    assert (without.verified, planned.verified) == (False, False)  # scenes are named
    for study in planned.studies:
        others = set(planned.engines) if study.name in (*STUDIES, "motion") else set()
        assert len(study.methods) == len(set(study.methods))
        assert set(study.methods) == {*planned.methods, *others}
    assert registry.method("pinocchio:Euler") not in planned.methods


def test_rows_of_the_section_of_engines_are_not_in_the_tables_of_scenes():
    both = measured_with(at_step("a==1", "RK4", 1e-6), [row("paper", "reduced", Measure.ATTITUDE_MAX, 1e-2, 0.01, scene=SCENE)])
    assert set(both.engine_rows["method"]) == {"a@1:RK4"}
    assert set(both.scene_rows["method"]) == {"reduced"}
    assert set(both.together["method"]) == {"reduced", "a@1:RK4"}


@pytest.mark.parametrize(("names", "error"), [(["exudin"], BadInput), (["mujoco==0.0.1"], MissingEngine)])
def test_an_engine_that_cannot_be_had_is_an_error_before_any_work(names, error):
    with pytest.raises(error):
        plan_report([SCENE], ["reduced"], quick=True, engines=names)


def test_unfinished_work_with_other_engines_is_not_gone_on_with():
    first, second = (plan_report([SCENE], ["reduced"], quick=True, engines=[name]) for name in ("pinocchio", "scipy"))
    source = provenance([])
    assert not list(differences(terms(first, source), terms(first, source)))
    assert any(text.startswith("engines: pinocchio") for text in differences(terms(first, source), terms(second, source)))


def test_the_verdict_counts_engines_that_are_named():
    ours = [
        each
        for dt, error in ((0.1, 1e-4), (0.01, 1e-8))
        for each in point("reduced", "ours", error, 1e-5 / dt, dt, scene=SCENE)
    ]
    points = measured_with(ours, over_steps("a==1", "RK4", (1e-5, 1e-7, 1e-9, 1e-11), 4.0)).points
    assert set(points["name"]) == {"reduced", "a 1 RK4"}
    assert cheapest(of_classes(costs(points, [1e-6]), *OF_ENGINES)).name == "a 1 RK4"
