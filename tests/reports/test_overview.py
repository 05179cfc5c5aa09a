import math

import pytest

from conservative.benchmarks.measures.measure import Measure
from conservative.errors import Diverged
from conservative.reports.tables import hard_cases, overview
from conservative.reports.tables.cells import Cell, Grade, grade_drift

from .made_up import row, table
from .rows import frame


def test_methods_are_ranked_by_what_they_keep():
    """Ours and the engines' are among each other: who drifts least comes first, who fails last."""
    found = [
        row("long_runs", "b", "energy drift max", math.nan, outcome=Diverged(0.36, "why").outcome),
        row("long_runs", "mujoco", "energy drift max", 1e-2, role="engine"),
        row("long_runs", "reduced", "energy drift max", 1e-15),
    ]
    _, body = overview.conservation(frame(found), "brick_flip")
    assert [line[0] for line in body] == ["reduced", "mujoco", "b"]


def test_a_step_that_a_method_does_not_have_is_no_failure_on_the_scene():
    found = [
        row("convergence", "a", "attitude error max", math.nan, outcome="unsupported"),
        row("long_runs", "a", "energy drift max", 1e-15),
    ]
    assert overview.scenes_in_trouble(frame(found)).empty
    assert len(overview.scenes_in_trouble(frame(found[:1]))) == 1


@pytest.mark.parametrize(
    ("value", "text", "grade"),
    [
        (3e-15, "✓ 3.0e-15", "good"),
        (2e-6, "≈ 2.0e-6", "fair"),
        (0.3, "✗ 0.3", "bad"),
        (math.inf, "✗ inf", "bad"),
        (math.nan, "–", "none"),
    ],
)
def test_drift_is_graded_by_symbol_and_colour(value, text, grade):
    assert grade_drift(value) == Cell(text, Grade(grade))


def test_hard_cases_are_a_matrix():
    found = [
        row("hard_cases", "reduced", "energy drift max", 1e-15, scene="needle"),
        row("hard_cases", "reduced", "energy drift max", math.nan, scene="falling_top", outcome="not converged"),
        row("hard_cases", "mujoco", "energy drift max", 0.1, scene="needle", role="engine"),
    ]
    header, body = hard_cases.hard_cases(frame(found)).as_table
    assert header == ["method", "needle", "falling_top"]
    assert body == [
        ["reduced", "motion –, invariants ✓ 1.0e-15 energy", "✗ not converged"],
        ["mujoco", "motion –, invariants ✗ 0.1 energy", "– not run"],
    ]
    assert hard_cases.hard_cases(table()) is None


def judged(*values):
    found = [row("hard_cases", "reduced", measure, value) for measure, value in values]
    judgement = hard_cases.judge(frame(found))
    return judgement.motion.grade, judgement.invariants.grade


def test_a_hard_case_is_judged_by_its_motion_and_by_its_worst_invariant():
    """Neither speaks for the other: what keeps everything can be wrong by 0.2 rad, and what is right can drift."""
    wrong = judged(("attitude error max", 0.2), ("energy drift max", 1e-15), ("momentum drift max", 0))
    assert wrong == (Grade.BAD, Grade.GOOD)
    assert judged(("attitude error max", 1.4e-6), ("energy drift max", 1e-8)) == (Grade.GOOD, Grade.FAIR)
    assert judged(("attitude error max", 0.05), ("energy drift max", 1e-15), ("momentum drift max", 1e-2))[1] is Grade.BAD


def test_methods_stand_in_the_order_in_which_they_did_well():
    found = [row("hard_cases", name, "attitude error max", error, scene="needle") for name, error in (("a", 1.0), ("b", 1e-9))]
    assert hard_cases.hard_cases(frame(found)).methods == ("b", "a")


def test_longest_steps_are_a_matrix():
    largest, first = Measure.LONGEST_STEP, Measure.FAILING_STEP
    found = [
        row("stability", "a", largest, 1.0, scene="needle"),
        row("stability", "a", first, 3.2, scene="needle", outcome="not converged"),
        row("stability", "b", largest, 10.0, scene="needle"),
        row("stability", "c", largest, math.nan, scene="needle", outcome="unsupported"),
    ]
    _, body = hard_cases.stability(frame(found))
    assert [str(line[1]) for line in body] == ["≈ 1 rad, then not converged", "✓ 10 rad and more", "– unsupported"]
    assert overview.scenes_in_trouble(frame(found)).empty
